//! A small town: as many polygons as Tanaka & Takahashi 1991, Fig. 8.

use super::Generated;
use super::patchwork::{Patchwork, Sides, rectangle, srgb};
use crate::scene::Scene;
use veduta_geometry::DVec3;
use veduta_map::{Camera, Projection};

/// Houses and towers about a square: 151 triangles.
pub(super) fn town(aspect: f64) -> Generated {
    let mut scene = Scene::default();
    ground(&mut scene);
    houses(&mut scene);
    stepped_tower(&mut scene);
    hexagonal_tower(&mut scene);
    spired_tower(&mut scene);
    wedge(&mut scene);
    let projection = Projection::Perspective {
        tan_half_height: 17.5_f64.to_radians().tan(),
        aspect,
    };
    Generated {
        scene,
        camera: Camera::looking(
            DVec3::new(-118.0, -140.0, 98.0),
            DVec3::new(-1.0, 2.0, 11.0),
            DVec3::Z,
            projection,
            1.0,
        )
        .expect("the direction of view is not the vertical"),
        size: [512, 512],
    }
}

/// Ground, street and square, a kerb's height above one another: 6 triangles.
fn ground(scene: &mut Scene) {
    let mut faces = Patchwork::new();
    let grounds = [
        (rectangle(-62.0, -62.0, 62.0, 62.0), 0.0, 0x9aa585),
        (rectangle(-62.0, -7.0, 62.0, 4.0), 0.1, 0x6a6a70),
        (rectangle(-13.0, 7.0, 13.0, 33.0), 0.2, 0xd8cbb0),
    ];
    for (outline, height, tint) in grounds {
        faces.roof(&outline, height, srgb(tint));
    }
    faces.place(scene, "ground", Sides::Outer);
}

/// Eight plain houses: 80 triangles.
fn houses(scene: &mut Scene) {
    const HOUSES: [([f64; 4], f64, u32); 8] = [
        ([-55.0, -50.0, -33.0, -14.0], 17.0, 0xd8a27a),
        ([-26.0, -46.0, -8.0, -15.0], 11.0, 0xe3cfa2),
        ([0.0, -52.0, 24.0, -32.0], 21.0, 0xc98a72),
        ([2.0, -26.0, 21.0, -13.0], 9.0, 0xded8c8),
        ([30.0, -48.0, 54.0, -16.0], 14.0, 0xe0b98a),
        ([-56.0, 10.0, -36.0, 30.0], 23.0, 0xcfc2b4),
        ([20.0, 11.0, 34.0, 33.0], 16.0, 0xd69f8a),
        ([41.0, 10.0, 56.0, 32.0], 12.0, 0xe8dcb4),
    ];
    for (index, ([x0, y0, x1, y1], height, tint)) in HOUSES.into_iter().enumerate() {
        let mut faces = Patchwork::new();
        let (min, max) = (DVec3::new(x0, y0, 0.0), DVec3::new(x1, y1, height));
        faces.house(min, max, srgb(tint), srgb(0xa9603f));
        faces.place(scene, &format!("house {index}"), Sides::Outer);
    }
}

/// Three boxes on top of each other: 30 triangles.
fn stepped_tower(scene: &mut Scene) {
    let mut faces = Patchwork::new();
    for (half, bottom, top) in [(10.0, 0.0, 26.0), (7.5, 26.0, 44.0), (4.5, 44.0, 57.0)] {
        let min = DVec3::new(-22.0 - half, 48.0 - half, bottom);
        let max = DVec3::new(-22.0 + half, 48.0 + half, top);
        faces.house(min, max, srgb(0xb9c4cf), srgb(0x8f9aa6));
    }
    faces.place(scene, "stepped tower", Sides::Outer);
}

/// Six walls and a flat roof: 16 triangles.
fn hexagonal_tower(scene: &mut Scene) {
    let base: [[f64; 2]; 6] = std::array::from_fn(|corner| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_3 * (corner as f64 + 0.2)).sin_cos();
        [8.0 + 9.0 * cos, 48.0 + 9.0 * sin]
    });
    let mut faces = Patchwork::new();
    faces.walls(&base, 0.0, 41.0, srgb(0x8fb0b8));
    faces.roof(&base, 41.0, srgb(0x6f8f98));
    faces.place(scene, "hexagonal tower", Sides::Outer);
}

/// Four walls under a steep pyramid: 12 triangles.
fn spired_tower(scene: &mut Scene) {
    let base = rectangle(36.0, 42.0, 50.0, 56.0);
    let (eaves, tip) = (27.0, DVec3::new(43.0, 49.0, 50.0));
    let mut faces = Patchwork::new();
    faces.walls(&base, 0.0, eaves, srgb(0xe6dccb));
    for (k, &[x, y]) in base.iter().enumerate() {
        let [next_x, next_y] = base[(k + 1) % 4];
        let side = [
            DVec3::new(x, y, eaves),
            DVec3::new(next_x, next_y, eaves),
            tip,
        ];
        faces.lit_triangle(side, srgb(0x4f6f62));
    }
    faces.place(scene, "spired tower", Sides::Outer);
}

/// A house on a triangular lot: 7 triangles.
fn wedge(scene: &mut Scene) {
    let base = [[-57.0, 37.0], [-37.0, 37.0], [-57.0, 58.0]];
    let mut faces = Patchwork::new();
    faces.walls(&base, 0.0, 19.0, srgb(0xd9b0a0));
    faces.roof(&base, 19.0, srgb(0x8a5a48));
    faces.place(scene, "wedge", Sides::Outer);
}
