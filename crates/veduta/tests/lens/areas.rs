//! What is covered, and by which patches.

use crate::rng::Rng;
use crate::{ASKEW, LENSES, ball_around, covered, eye, lens, patch_direction, projection, size_of};
use veduta::geometry::{DVec2, DVec3};
use veduta::reproject::patches::{Subdivision, TOLERANCE};

#[test]
fn what_is_all_around_fills_every_pixel_and_the_rim_as_far_as_it_goes() {
    let scene = ball_around(&mut Rng::new(1), 13, 19);
    for name in LENSES {
        let lens = lens(name);
        for (eye, looking, width) in [
            (eye(DVec3::Z, 0.0), [DVec3::Y, DVec3::Z], 30),
            (eye(DVec3::Z, 0.0), [DVec3::Z, -DVec3::Y], 23),
            (eye(DVec3::new(1.0, 2.0, -0.7), 0.8), ASKEW, 27),
        ] {
            let [width, height] = size_of(lens, width);
            let projection = projection(&eye, lens, looking, width, height);
            for (pixel, covered) in covered(&scene, &eye, &projection).into_iter().enumerate() {
                let [column, row] = [pixel as u32 % width, pixel as u32 / width];
                let share = projection.coverage(column, row);
                assert!(
                    (covered - share).abs() < 1e-9,
                    "{name}, pixel {column} {row}: {covered} and not {share}"
                );
            }
        }
    }
}

#[test]
fn patches_show_everything_where_it_is() {
    let mut rng = Rng::new(2);
    for name in LENSES {
        let lens = lens(name);
        let eye = eye(DVec3::Z, 0.0);
        let [width, height] = size_of(lens, 110);
        let projection = projection(&eye, lens, ASKEW, width, height);
        let subdivision = Subdivision::new(&projection);
        let mut patches = Vec::new();
        // In patches of a pixel and more, and in smaller ones.
        let mut worst = [0.0_f64; 2];
        for first in (0..height).step_by(16) {
            subdivision.cut(first..(first + 16).min(height), &mut patches);
            for patch in &patches {
                let [a, b, c] = *patch.corners();
                let (u, v) = (rng.unit(), rng.unit());
                let (u, v) = if u + v > 1.0 {
                    (1.0 - u, 1.0 - v)
                } else {
                    (u, v)
                };
                let point = a + (b - a) * u + (c - a) * v;
                // Within a pixel of a pole, which a whole row or rim may be, a hair's breadth is half around.
                let from_middle = projection.lens_from_image(point);
                let pixel = (projection.lens_from_image(DVec2::X)
                    - projection.lens_from_image(DVec2::ZERO))
                .x;
                let at_pole = match name {
                    "equirect" => from_middle.y.abs() > 0.5 - pixel,
                    "angular" => from_middle.length() > 1.0 - pixel,
                    _ => false,
                };
                let direction = patch_direction(patch.look(point)[0]);
                let Some(seen) = projection.image(direction).filter(|_| !at_pole) else {
                    continue;
                };
                let mut off = seen - point;
                if let Some(period) = projection.period() {
                    off.x -= period * (off.x / period).round();
                }
                let longest = (b - a).max_element().max((c - a).max_element());
                let worst = &mut worst[usize::from(longest.max((c - b).max_element()) < 1.0)];
                *worst = worst.max(off.length());
            }
        }
        // The largest error in a patch is about 4/3 of that in the middles of its sides.
        assert!(
            worst[0] < 1.5 * TOLERANCE,
            "{name}: off by {worst:?} pixels"
        );
        assert!(
            worst[1] < 8.0 * TOLERANCE,
            "{name}: off by {worst:?} pixels"
        );
        assert!(worst != [0.0; 2], "{name}: no patch was looked at");
    }
}
