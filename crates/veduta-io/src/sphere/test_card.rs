//! A cube to try conventions on: each side tells its name, its number, what is upwards, and its neighbours.

use super::letters::{Stroke, distance, strokes};
use crate::tone::linear_from_srgb;
use rayon::prelude::*;
use veduta::accumulate::Picture;
use veduta::geometry::DVec2;
use veduta::reproject::cube::Side;

/// Squares along an edge.
const SQUARES: f64 = 8.0;

/// The two shades of a side, in sRGB: warm before and to the right, cold behind and to the left.
fn shades(side: Side) -> [[u8; 3]; 2] {
    match side {
        Side::Front => [[196, 66, 52], [172, 52, 40]],
        Side::Right => [[214, 140, 40], [190, 120, 28]],
        Side::Back => [[40, 120, 150], [30, 100, 128]],
        Side::Left => [[84, 86, 160], [70, 70, 138]],
        Side::Up => [[120, 160, 200], [100, 140, 182]],
        Side::Down => [[84, 120, 62], [68, 100, 48]],
    }
}

/// A side of the test card, `size` pixels wide and high, as it lies by itself ([`Side`]).
///
/// It is chequered 8 by 8. An arrow points upwards; below it stand the side's name and its number in the
/// order of OpenGL (0 right, 1 left, 2 up, 3 down, 4 front, 5 back). At each edge stands the name of
/// the neighbour there, and along it a white line, which is 1/64 of the side wide.
///
/// # Panics
/// If the size is 0.
pub fn test_card(side: Side, size: u32) -> Picture {
    assert!(size > 0, "a side has pixels");
    let pixel = 1.0 / f64::from(size);
    let light = |[r, g, b]: [u8; 3]| [r, g, b].map(|v| linear_from_srgb(f32::from(v) / 255.0));
    let shades = shades(side).map(light);
    let white = light([245, 245, 240]);
    let (thick, thin) = drawing(side);
    let pixels = (0..size).into_par_iter().flat_map_iter(|row| {
        let (thick, thin) = (&thick, &thin);
        (0..size).map(move |column| {
            let at = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5) * pixel;
            let is_odd = chequer(at, pixel);
            let mut color = mix(shades[0], shades[1], is_odd);
            // At least a pixel wide, so that sides fit together whatever their shades.
            let border = at.min(DVec2::ONE - at).min_element() - pixel.max(1.0 / 64.0);
            let lines = [
                border,
                distance(thick, at) - 0.012,
                distance(thin, at) - 0.004,
            ];
            for line in lines {
                color = mix(color, white, (0.5 - line / pixel).clamp(0.0, 1.0));
            }
            let [r, g, b] = color;
            [r, g, b, 1.0]
        })
    });
    Picture {
        width: size,
        height: size,
        pixels: pixels.collect(),
    }
}

/// The number of a side in the order of OpenGL.
fn number(side: Side) -> &'static str {
    match side {
        Side::Right => "0",
        Side::Left => "1",
        Side::Up => "2",
        Side::Down => "3",
        Side::Front => "4",
        Side::Back => "5",
    }
}

/// What is drawn on a side, in thick strokes and in thin ones; the side is 1 wide and high.
fn drawing(side: Side) -> (Vec<Stroke>, Vec<Stroke>) {
    let at = DVec2::new;
    let mut thick = vec![
        [at(0.5, 0.42), at(0.5, 0.16)],
        [at(0.5, 0.16), at(0.42, 0.25)],
        [at(0.5, 0.16), at(0.58, 0.25)],
    ];
    thick.extend(strokes(&side.name().to_uppercase(), at(0.5, 0.55), 0.13));
    thick.extend(strokes(number(side), at(0.5, 0.76), 0.13));
    let mut thin = Vec::new();
    let [forward, right, up] = side.axes();
    for (towards, place) in [
        (right, at(0.87, 0.42)),
        (right.map(|v| -v), at(0.13, 0.42)),
        (up, at(0.5, 0.07)),
        (up.map(|v| -v), at(0.5, 0.93)),
    ] {
        debug_assert_ne!(towards, forward);
        let neighbour = Side::ALL.into_iter().find(|side| side.axes()[0] == towards);
        let name = neighbour.map_or("", Side::name).to_uppercase();
        thin.extend(strokes(&name, place, 0.035));
    }
    (thick, thin)
}

/// Share of odd squares in the pixel around a point.
fn chequer(at: DVec2, pixel: f64) -> f64 {
    // Along one axis 1 in even squares and -1 in odd ones, with the pixel's mean at the borders.
    let wave = |t: f64| {
        let place = t * SQUARES;
        let from_border = (place - place.round()) / (SQUARES * pixel);
        let sign = if place.round() as i64 % 2 == 0 {
            1.0
        } else {
            -1.0
        };
        sign * (2.0 * from_border).clamp(-1.0, 1.0)
    };
    0.5 - 0.5 * wave(at.x) * wave(at.y)
}

fn mix(a: [f32; 3], b: [f32; 3], share: f64) -> [f32; 3] {
    let share = share as f32;
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_differ_and_have_a_top() {
        let cards = Side::ALL.map(|side| test_card(side, 64));
        for (k, card) in cards.iter().enumerate() {
            assert!(cards[..k].iter().all(|other| other != card));
            let above: f32 = card.pixels[..64 * 32].iter().map(|pixel| pixel[0]).sum();
            let below: f32 = card.pixels[64 * 32..].iter().map(|pixel| pixel[0]).sum();
            assert_ne!(above, below);
        }
        assert_eq!(test_card(Side::Up, 1).pixels.len(), 1);
    }
}
