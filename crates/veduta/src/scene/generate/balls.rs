//! Balls: the scenes of Tanaka & Takahashi 1991, Figs. 9 and 10, and two that pierce each other.

use super::Generated;
use super::patchwork::{Color, Patchwork, Sides, mix, srgb};
use super::view::FrontView;
use crate::scene::Scene;
use veduta_geometry::DVec3;

/// Three balls on a floor: 10,450 triangles.
pub(super) fn three(aspect: f64) -> Generated {
    let centres = [(-1.1, 5.0, 0.1), (0.9, 4.6, -0.5), (0.3, 5.8, 0.9)];
    let mut scene = Scene::default();
    floor(&mut scene, 5, -1.65);
    for (index, (x, y, z)) in centres.into_iter().enumerate() {
        let tint = [0xd9503f, 0xe8b64c, 0x3f7fb5][index];
        ball(
            &mut scene,
            index,
            DVec3::new(x, y, z),
            1.1,
            [60, 30],
            srgb(tint),
        );
    }
    finish(scene, aspect)
}

/// Seven balls in a spiral above a floor: 16,150 triangles.
pub(super) fn seven(aspect: f64) -> Generated {
    const TINTS: [u32; 7] = [
        0xd9503f, 0xe8884c, 0xe8c95a, 0x7fae4f, 0x3f9fa5, 0x4a6fb5, 0x8a5fa8,
    ];
    let mut scene = Scene::default();
    floor(&mut scene, 11, -1.95);
    for (index, tint) in TINTS.into_iter().enumerate() {
        let step = index as f64;
        let angle = 0.9 * step;
        let out = step / 7.0 + 0.4;
        let centre = DVec3::new(
            1.35 * angle.cos() * out,
            4.2 + 0.3 * step,
            0.95 * angle.sin() * out,
        );
        ball(&mut scene, index, centre, 0.85, [48, 25], srgb(tint));
    }
    finish(scene, aspect)
}

/// Two balls, each halfway in the other: 6,724 triangles.
pub(super) fn piercing(aspect: f64) -> Generated {
    let mut scene = Scene::default();
    let left = DVec3::new(-0.45, 4.5, 0.05);
    let right = DVec3::new(0.5, 4.6, -0.1);
    ball(&mut scene, 0, left, 1.2, [42, 42], srgb(0xd9503f));
    ball(&mut scene, 1, right, 1.15, [41, 41], srgb(0x3f7fb5));
    finish(scene, aspect)
}

fn ball(
    scene: &mut Scene,
    index: usize,
    centre: DVec3,
    radius: f64,
    [meridians, bands]: [u32; 2],
    tint: Color,
) {
    let mut faces = Patchwork::new();
    // Slightly checkered, so that the faces can be told apart.
    faces.ball(centre, radius, meridians, bands, |meridian, band| {
        let light = (meridian + band) % 2 == 0;
        mix(tint, [1.0; 3], if light { 0.12 } else { 0.0 })
    });
    faces.place(scene, &format!("ball {index}"), Sides::Outer);
}

/// Planks that run away from the eye at height `z`, two triangles each.
fn floor(scene: &mut Scene, planks: u32, z: f64) {
    let (near, far, half_width) = (3.4, 7.6, 4.5);
    let edge = |index: u32| half_width * (2.0 * f64::from(index) / f64::from(planks) - 1.0);
    let mut faces = Patchwork::new();
    for plank in 0..planks {
        let (x0, x1) = (edge(plank), edge(plank + 1));
        let shade = [0.0, 0.5, 0.2, 0.8, 0.35][plank as usize % 5];
        faces.lit_quad(
            [
                DVec3::new(x0, near, z),
                DVec3::new(x1, near, z),
                DVec3::new(x1, far, z),
                DVec3::new(x0, far, z),
            ],
            mix(srgb(0x8a6f52), srgb(0xc9ae86), shade),
        );
    }
    faces.place(scene, "floor", Sides::Outer);
}

fn finish(scene: Scene, aspect: f64) -> Generated {
    Generated {
        scene,
        camera: FrontView::perspective(aspect).camera,
        size: [512, 512],
    }
}
