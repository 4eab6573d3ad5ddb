//! Flat test patterns, a metre a pixel at 512 rows: edges of every direction, wires thinner than a
//! pixel (Tanaka & Takahashi 1991, §5.1 and §5.2).

use super::Generated;
use super::patchwork::{Patchwork, Sides, hue, mix, srgb};
use super::view::FrontView;
use crate::scene::Scene;
use std::f64::consts::TAU;
use veduta_geometry::DVec3;

/// Rows of the picture for which lengths in this file are pixels.
const ROWS: f64 = 512.0;

/// Thin triangles about a centre, as many as the gaps between them are wide (Fig. 4).
pub(super) fn radial(aspect: f64) -> Generated {
    const WEDGES: u32 = 80;
    // Off the pixel corners, so that no two edges are symmetric on the pixel grid.
    let centre = DVec3::new(0.3, 0.0, -0.2);
    let radius = 0.48 * ROWS;
    let rim = |turns: f64| {
        let angle = TAU * turns;
        centre + radius * DVec3::new(angle.cos(), 0.0, angle.sin())
    };
    let mut pattern = Patchwork::new();
    for wedge in 0..WEDGES {
        let turns = (f64::from(wedge) + 0.25) / f64::from(WEDGES);
        let half = 0.25 / f64::from(WEDGES);
        let color = mix(hue(turns), [1.0; 3], 0.25);
        pattern.triangle([centre, rim(turns - half), rim(turns + half)], color);
    }
    finish("radial pattern", pattern, aspect)
}

/// Two sets of wires across each other, turned by `degrees` (Figs. 5 and 6).
pub(super) fn wire_mesh(degrees: f64, aspect: f64) -> Generated {
    /// Wires of each set.
    const WIRES: u32 = 25;
    const WIDTH: f64 = 0.05;
    /// Not a whole number of pixels, so that the wires lie in ten different ways to the pixel grid,
    /// and to any sub-scanlines.
    const DISTANCE: f64 = 20.1;
    /// By which a wire reaches past the outermost that crosses it.
    const OVERHANG: f64 = 10.0;

    let (sin, cos) = degrees.to_radians().sin_cos();
    // The horizontal wires lie in front, so that no two share a plane.
    let point = |along: f64, across: f64, horizontal: bool| {
        let (x, z, y) = if horizontal {
            (along, across, -1.0)
        } else {
            (across, along, 0.0)
        };
        DVec3::new(x * cos - z * sin, y, x * sin + z * cos)
    };
    let outermost = 0.5 * f64::from(WIRES - 1) * DISTANCE;
    let end = outermost + OVERHANG;
    let mut mesh = Patchwork::new();
    for horizontal in [true, false] {
        for wire in 0..WIRES {
            let across = f64::from(wire) * DISTANCE - outermost;
            let [low, high] = [across - 0.5 * WIDTH, across + 0.5 * WIDTH];
            let corners = [(-end, low), (end, low), (end, high), (-end, high)]
                .map(|(along, across)| point(along, across, horizontal));
            mesh.quad(corners, srgb(0xffffff));
        }
    }
    finish("wire mesh", mesh, aspect)
}

fn finish(name: &str, pattern: Patchwork, aspect: f64) -> Generated {
    let mut scene = Scene::default();
    pattern.place(&mut scene, name, Sides::Both);
    Generated {
        scene,
        camera: FrontView::parallel(ROWS, aspect).camera,
        size: [512, 512],
    }
}
