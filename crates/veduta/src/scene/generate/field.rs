//! Height fields seen at a grazing angle: many small faces, about half of them turned away or out
//! of the picture, ridge behind ridge.

use super::Generated;
use super::patchwork::{Color, Sides, daylight, mix, normal_of_slopes, place, srgb};
use super::view::FrontView;
use crate::scene::{Mesh, Scene};
use veduta_geometry::DVec3;

/// Ground of `cells` x `cells` squares, two triangles each.
///
/// One mesh with shared vertices, because the largest of these has ten million faces.
pub(super) fn height_field(cells: u32, aspect: f64) -> Generated {
    let side = cells + 1;
    let mut mesh = Mesh::default();
    mesh.positions.reserve_exact((side * side) as usize);
    mesh.colors.reserve_exact((side * side) as usize);
    for row in 0..side {
        let y = 2.2 + 7.0 * f64::from(row) / f64::from(cells);
        for column in 0..side {
            let x = 9.0 * (f64::from(column) / f64::from(cells) - 0.5);
            let ground = Ground::at(x, y);
            mesh.positions.push(DVec3::new(x, y, ground.height));
            mesh.colors.push(ground.color());
        }
    }
    mesh.triangles.reserve_exact(2 * (cells * cells) as usize);
    for row in 0..cells {
        for column in 0..cells {
            let near = row * side + column;
            let far = near + side;
            mesh.triangles.push([near, near + 1, far + 1]);
            mesh.triangles.push([near, far + 1, far]);
        }
    }
    let mut scene = Scene::default();
    place(&mut scene, "ground", mesh, Sides::Outer);
    Generated {
        scene,
        camera: FrontView::perspective(aspect).camera,
        size: [1920, 1080],
    }
}

/// The ground at a place.
struct Ground {
    height: f64,
    slope_x: f64,
    slope_y: f64,
}

impl Ground {
    /// Seven octaves of waves on a slope that rises away from the eye.
    fn at(x: f64, y: f64) -> Self {
        let rise = 0.18;
        let mut ground = Self {
            height: -1.25 + rise * (y - 2.2),
            slope_x: 0.0,
            slope_y: rise,
        };
        let (mut amplitude, mut frequency) = (0.32, 2.3);
        for octave in 0..7 {
            let (sin_x, cos_x) = (x * frequency + 1.7 * f64::from(octave)).sin_cos();
            let frequency_y = 1.13 * frequency;
            let (sin_y, cos_y) = (y * frequency_y + 0.6 * f64::from(octave)).sin_cos();
            ground.height += amplitude * sin_x * cos_y;
            ground.slope_x += amplitude * frequency * cos_x * cos_y;
            ground.slope_y -= amplitude * frequency_y * sin_x * sin_y;
            amplitude *= 0.5;
            frequency *= 2.05;
        }
        ground
    }

    /// Meadow in the hollows, rock where it is steep, snow on the tops.
    fn color(&self) -> Color {
        let normal = normal_of_slopes(self.slope_x, self.slope_y);
        let share = |value: f64| value.clamp(0.0, 1.0) as f32;
        let meadow = mix(
            srgb(0x4f7038),
            srgb(0x9a9a58),
            share((self.height + 1.6) / 1.4),
        );
        let rock = mix(meadow, srgb(0x7d7368), share(3.0 - 5.0 * normal.z));
        let snow = mix(rock, srgb(0xf4f6fa), share(4.0 * (self.height - 0.1)));
        daylight(snow, normal)
    }
}
