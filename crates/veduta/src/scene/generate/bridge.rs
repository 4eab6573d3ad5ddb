//! A suspension bridge whose hangers, rails and stays are thinner than a pixel
//! (Tanaka & Takahashi 1991, Fig. 7).

use super::Generated;
use super::patchwork::{Patchwork, Sides, daylight, mix, srgb};
use crate::scene::Scene;
use veduta_geometry::DVec3;
use veduta_map::{Camera, Projection};

// The bridge runs along X over water at z = 0, symmetric about the origin. Metres.
/// Of a tower's axis from the middle.
const TOWER_X: f64 = 250.0;
const TOWER_TOP: f64 = 178.0;
/// Where the cables enter the anchorages.
const ANCHOR_X: f64 = 470.0;
const ANCHOR_Z: f64 = 66.0;
/// Of the cables and legs from the bridge's axis.
const CABLE_Y: f64 = 14.0;
const DECK_Z: f64 = 62.0;
const DECK_HALF_WIDTH: f64 = 12.5;
/// Well inland, where the road has met the ground.
const DECK_END: f64 = 900.0;
const HANGER_DISTANCE: f64 = 10.0;
/// A tenth of a pixel in the picture of 512 rows.
const HANGER_WIDTH: f64 = 0.09;
const CABLE_WIDTH: f64 = 0.9;

/// The bridge between its banks.
pub(super) fn suspension_bridge(aspect: f64) -> Generated {
    let mut scene = Scene::default();
    water(&mut scene);
    for (name, side) in [("west bank", -1.0), ("east bank", 1.0)] {
        bank(&mut scene, name, side);
    }
    deck(&mut scene);
    for (name, side) in [("west tower", -1.0), ("east tower", 1.0)] {
        tower(&mut scene, name, side * TOWER_X);
    }
    cables(&mut scene);
    hangers(&mut scene);
    rails(&mut scene);
    let projection = Projection::Perspective {
        tan_half_height: 16.0_f64.to_radians().tan(),
        aspect,
    };
    Generated {
        scene,
        camera: Camera::looking(
            DVec3::new(-560.0, -640.0, 118.0),
            DVec3::new(-32.0, 0.0, 84.0),
            DVec3::Z,
            projection,
            1.0,
        )
        .expect("the direction of view is not the vertical"),
        size: [512, 512],
    }
}

/// Height of the main cables' axis above the water.
fn cable_height(x: f64) -> f64 {
    let sagging = |share: f64, from: f64, to: f64, sag: f64| {
        from + (to - from) * share - 4.0 * sag * share * (1.0 - share)
    };
    let x = x.abs();
    if x <= TOWER_X {
        let lowest = DECK_Z + 6.0;
        lowest + (TOWER_TOP - lowest) * (x / TOWER_X).powi(2)
    } else {
        let share = (x - TOWER_X) / (ANCHOR_X - TOWER_X);
        sagging(share, TOWER_TOP, ANCHOR_Z, 9.0)
    }
}

/// Strips of sea to the horizon, the nearer the finer and the darker.
fn water(scene: &mut Scene) {
    let mut faces = Patchwork::new();
    let (near, far, side) = (-560.0_f64, 14000.0_f64, 16000.0);
    let strips = 120;
    let edge = |strip: i32| near + (far - near) * (f64::from(strip) / f64::from(strips)).powi(3);
    for strip in 0..strips {
        let (y0, y1) = (edge(strip), edge(strip + 1));
        let share = strip as f32 / strips as f32;
        faces.quad(
            [
                DVec3::new(-side, y0, 0.0),
                DVec3::new(side, y0, 0.0),
                DVec3::new(side, y1, 0.0),
                DVec3::new(-side, y1, 0.0),
            ],
            mix(srgb(0x2f5a6e), srgb(0xa8c0c8), share),
        );
    }
    faces.place(scene, "water", Sides::Outer);
}

/// A hilly bank that dips into the water; `side` is -1 in the west and 1 in the east.
fn bank(scene: &mut Scene, name: &str, side: f64) {
    const CELL: f64 = 30.0;
    const COLUMNS: u32 = 50;
    const ROWS: u32 = 90;
    let height = |x: f64, y: f64| {
        let shore = 395.0 + 45.0 * (y / 170.0 + side).sin() + 20.0 * (y / 61.0).cos();
        let inland = side * x - shore;
        let hills =
            26.0 * (x / 130.0).sin() * (y / 150.0 + 1.0).cos() + 9.0 * (x / 47.0 + y / 39.0).sin();
        let slope = if inland < 0.0 { 0.6 } else { 0.28 };
        // Levelled where the road comes ashore.
        let road = (-(y / 60.0).powi(2)).exp();
        let rise = (slope * inland).min(150.0) + hills * (inland / 160.0).clamp(0.0, 1.0);
        rise + (rise.clamp(-30.0, DECK_Z - 1.0) - rise) * road
    };
    let point = |column: u32, row: u32| {
        let x = side * (330.0 + CELL * f64::from(column));
        let y = -420.0 + CELL * f64::from(row);
        DVec3::new(x, y, height(x, y))
    };
    let mut faces = Patchwork::new();
    for row in 0..ROWS {
        for column in 0..COLUMNS {
            let [a, b, c, d] =
                [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| point(column + i, row + j));
            // Seen from above, columns run westwards on the west bank.
            let pair = if side > 0.0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, c, b], [a, d, c]]
            };
            for corners in pair {
                let mean = (corners[0] + corners[1] + corners[2]) / 3.0;
                let sand = ((12.0 - mean.z) / 8.0).clamp(0.0, 1.0) as f32;
                let haze = ((mean.y - 300.0) / 2600.0).clamp(0.0, 0.7) as f32;
                let mottle = (mean.x * 0.9 + mean.y * 1.7).sin() as f32 * 0.5 + 0.5;
                let grass = mix(srgb(0x5b7a40), srgb(0x82904f), mottle);
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                let color = daylight(mix(grass, srgb(0xcdbb92), sand), normal);
                faces.triangle(corners, mix(color, srgb(0xb4c6d0), haze));
            }
        }
    }
    faces.place(scene, name, Sides::Outer);
}

fn deck(scene: &mut Scene) {
    let steel = srgb(0x8f3f30);
    let mut faces = Patchwork::new();
    let half = DECK_HALF_WIDTH;
    faces.block(
        DVec3::new(-DECK_END, -half, DECK_Z - 3.2),
        DVec3::new(DECK_END, half, DECK_Z - 0.4),
        steel,
    );
    // The roadway lies on it.
    faces.block(
        DVec3::new(-DECK_END, -half + 1.0, DECK_Z - 0.4),
        DVec3::new(DECK_END, half - 1.0, DECK_Z),
        srgb(0x77777c),
    );
    faces.place(scene, "deck", Sides::Outer);

    let mut anchors = Patchwork::new();
    for side in [-1.0, 1.0] {
        let ends = [side * (ANCHOR_X - 6.0), side * (ANCHOR_X + 34.0)];
        for y in [-CABLE_Y - 5.0, CABLE_Y - 1.2] {
            anchors.block(
                DVec3::new(ends[0].min(ends[1]), y, -20.0),
                DVec3::new(ends[0].max(ends[1]), y + 6.2, ANCHOR_Z + 4.0),
                srgb(0xb9b2a4),
            );
        }
    }
    anchors.place(scene, "anchorages", Sides::Outer);
}

/// Two legs that grow thinner in steps, braced below and above the deck, on a pier.
fn tower(scene: &mut Scene, name: &str, x: f64) {
    let steel = srgb(0xc0503c);
    let mut faces = Patchwork::new();
    let mut upright = |y: f64, half: [f64; 2], bottom: f64, top: f64, color| {
        faces.block(
            DVec3::new(x - half[0], y - half[1], bottom),
            DVec3::new(x + half[0], y + half[1], top),
            color,
        );
    };
    upright(0.0, [11.0, 25.0], -20.0, 9.0, srgb(0xb9b2a4));
    for y in [-CABLE_Y - 2.0, CABLE_Y + 2.0] {
        let steps = [9.0, 56.0, 98.0, 140.0, TOWER_TOP + 3.0];
        for (step, ends) in steps.windows(2).enumerate() {
            let half = 4.2 - 0.6 * step as f64;
            upright(y, [half, 0.8 * half], ends[0], ends[1], steel);
        }
    }
    for (bottom, top) in [(50.0, 56.0), (94.0, 100.0), (134.0, 140.0), (170.0, 176.0)] {
        upright(0.0, [1.8, CABLE_Y + 1.0], bottom, top, steel);
    }
    faces.place(scene, name, Sides::Outer);
}

/// The two main cables, in straight pieces from hanger to hanger.
fn cables(scene: &mut Scene) {
    let mut faces = Patchwork::new();
    let pieces = (2.0 * ANCHOR_X / HANGER_DISTANCE) as i32;
    for y in [-CABLE_Y, CABLE_Y] {
        let at = |piece: i32| {
            let x = -ANCHOR_X + HANGER_DISTANCE * f64::from(piece);
            DVec3::new(x, y, cable_height(x))
        };
        for piece in 0..pieces {
            faces.rod(at(piece), at(piece + 1), CABLE_WIDTH, srgb(0xb86a50));
        }
    }
    faces.place(scene, "main cables", Sides::Outer);
}

fn hangers(scene: &mut Scene) {
    let mut faces = Patchwork::new();
    let count = (2.0 * ANCHOR_X / HANGER_DISTANCE) as i32;
    for y in [-CABLE_Y, CABLE_Y] {
        for hanger in 1..count {
            let x = -ANCHOR_X + HANGER_DISTANCE * f64::from(hanger);
            let top = cable_height(x);
            if top > DECK_Z + 2.0 && (x.abs() - TOWER_X).abs() > 1.0 {
                let (top, foot) = (DVec3::new(x, y, top), DVec3::new(x, y, DECK_Z - 2.0));
                faces.rod(foot, top, HANGER_WIDTH, srgb(0xd8cfc4));
            }
        }
    }
    faces.place(scene, "hangers", Sides::Outer);
}

/// Two rails along each edge of the deck.
fn rails(scene: &mut Scene) {
    let mut faces = Patchwork::new();
    for y in [-DECK_HALF_WIDTH, DECK_HALF_WIDTH] {
        for z in [DECK_Z + 0.7, DECK_Z + 1.3] {
            let ends = [-ANCHOR_X, ANCHOR_X].map(|x| DVec3::new(x, y, z));
            faces.rod(ends[0], ends[1], 0.07, srgb(0xe8e4dc));
        }
    }
    faces.place(scene, "rails", Sides::Outer);
}
