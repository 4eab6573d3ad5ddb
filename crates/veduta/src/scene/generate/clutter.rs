//! Random faces strewn over the picture: the hard cases for anything that culls or sorts.

use super::Generated;
use super::patchwork::{Patchwork, Sides, hue, mix, srgb};
use super::random::Random;
use super::view::FrontView;
use crate::scene::Scene;
use std::f64::consts::TAU;
use veduta_geometry::{DVec2, DVec3};

/// Large triangles that pierce one another everywhere.
pub(super) fn soup(triangles: u32, aspect: f64) -> Generated {
    let view = FrontView::perspective(aspect);
    let mut random = Random::new(0x5015);
    let reach = DVec2::new(1.0 / (9.0 * aspect), 1.0 / 9.0);
    let mut faces = Patchwork::new();
    for _ in 0..triangles {
        let centre = DVec2::new(random.unit(), random.unit());
        let corners = [(); 3].map(|()| {
            let image = centre + reach * around(&mut random);
            view.world_point(image, random.between(0.2, 0.8))
        });
        let color = hue(random.unit());
        faces.triangle(corners, color);
    }
    finish("soup", faces, view)
}

/// Straight wires 0.05 pixels thick at 1080 rows, in all directions and depths.
pub(super) fn wires(count: u32, aspect: f64) -> Generated {
    const HALF_WIDTH: f64 = 0.025 / 1080.0;
    let view = FrontView::perspective(aspect);
    let mut random = Random::new(0x3173);
    let mut faces = Patchwork::new();
    let isotropic = DVec2::new(1.0 / aspect, 1.0);
    for _ in 0..count {
        let start = DVec2::new(random.unit(), random.unit());
        let along = DVec2::from_angle(random.between(0.0, TAU));
        let end = start + random.between(0.0, 0.2) * along * isotropic;
        let side = HALF_WIDTH * along.perp() * isotropic;
        let nearness = [(); 2].map(|()| random.between(0.2, 0.8));
        let corners = [
            (start + side, nearness[0]),
            (start - side, nearness[0]),
            (end - side, nearness[1]),
            (end + side, nearness[1]),
        ]
        .map(|(image, nearness)| view.world_point(image, nearness));
        faces.quad(corners, mix(hue(random.unit()), [1.0; 3], 0.4));
    }
    finish("wires", faces, view)
}

/// Small leaves with gaps between them, so that nothing hides everything behind it.
pub(super) fn foliage(leaves: u32, aspect: f64) -> Generated {
    let view = FrontView::perspective(aspect);
    let mut random = Random::new(0x1eaf);
    let reach = DVec2::new(1.0 / (120.0 * aspect), 1.0 / 120.0);
    let greens = [srgb(0x2f5d1e), srgb(0x7fa83a), srgb(0xc9c65a)];
    let mut faces = Patchwork::new();
    for _ in 0..leaves {
        let centre = DVec2::new(random.between(0.1, 0.9), random.between(0.1, 0.9));
        let nearness = random.between(0.2, 0.8);
        let corners = [(); 3].map(|()| {
            let image = centre + reach * around(&mut random);
            view.world_point(image, nearness * random.between(0.99, 1.01))
        });
        let green = mix(greens[0], greens[1], random.unit() as f32);
        let color = mix(green, greens[2], 0.5 * random.unit().powi(3) as f32);
        // Leaves deep in the foliage are in its shadow.
        let light = (0.35 + 0.65 * (nearness - 0.2) / 0.6) as f32;
        faces.triangle(corners, color.map(|value| value * light));
    }
    finish("foliage", faces, view)
}

/// 16 crumpled sheets of small triangles, one behind the other, each across the whole picture.
pub(super) fn layers(rows: u32, aspect: f64) -> Generated {
    const SHEETS: u32 = 16;
    /// By which a sheet reaches out of the picture, so that no pixel sees past it.
    const OVERLAP: f64 = 0.01;
    let view = FrontView::perspective(aspect);
    let mut random = Random::new(0x1a7e);
    let columns = (f64::from(rows) * aspect).floor() as u32;
    let mut scene = Scene::default();
    for sheet in 0..SHEETS {
        let mut inside = |index: u32, count: u32| match index {
            0 => -OVERLAP,
            last if last == count => 1.0 + OVERLAP,
            _ => (f64::from(index) + random.between(-0.3, 0.3)) / f64::from(count),
        };
        let mut images = Vec::new();
        for row in 0..=rows {
            for column in 0..=columns {
                images.push(DVec2::new(inside(column, columns), inside(row, rows)));
            }
        }
        let points: Vec<DVec3> = images
            .into_iter()
            .map(|image| {
                let depth = 1.0 + 0.2 * f64::from(sheet) + random.between(0.0, 0.05);
                view.world_point(image, 1.0 / depth)
            })
            .collect();
        let base = hue(f64::from(sheet) / f64::from(SHEETS));
        let mut faces = Patchwork::new();
        for row in 0..rows {
            for column in 0..columns {
                let at = |i: u32, j: u32| points[((row + j) * (columns + 1) + column + i) as usize];
                for corners in [
                    [at(0, 0), at(1, 0), at(1, 1)],
                    [at(0, 0), at(1, 1), at(0, 1)],
                ] {
                    faces.triangle(corners, mix(base, [1.0; 3], 0.4 * random.unit() as f32));
                }
            }
        }
        faces.place(&mut scene, &format!("sheet {sheet}"), Sides::Both);
    }
    Generated {
        scene,
        camera: view.camera,
        size: [960, 540],
    }
}

/// A random point of the square from -1 to 1.
fn around(random: &mut Random) -> DVec2 {
    DVec2::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0))
}

fn finish(name: &str, faces: Patchwork, view: FrontView) -> Generated {
    let mut scene = Scene::default();
    faces.place(&mut scene, name, Sides::Both);
    Generated {
        scene,
        camera: view.camera,
        size: [1920, 1080],
    }
}
