//! The sides of the cube around the eye.

use crate::pictures::lit_ground;
use crate::rng::Rng;
use crate::{ball_around, eye, lens};
use std::f64::consts::FRAC_PI_2;
use veduta::geometry::DVec3;
use veduta::pipeline;
use veduta::reproject::cube::Layout;
use veduta::reproject::{Orientation, Projection};

#[test]
fn only_what_a_lens_looks_at_is_found() {
    let scene = lit_ground();
    let eye = eye(DVec3::Z, 0.0);
    let faces = |name: &str, elevation: f64| -> Vec<&str> {
        let orientation = Orientation::from_angles(0.0, elevation, 0.0);
        let projection = Projection::new(lens(name), orientation, 100, 78);
        let found = pipeline::find_surroundings(&scene, &eye, &projection, |_| {});
        found
            .sides
            .iter()
            .map(|seen| seen.part.side.name())
            .collect()
    };
    // The paper's four faces; the arc touches the bottom's border only.
    assert_eq!(faces("omnimax", 0.0), ["front", "right", "left", "up"]);
    let upper = ["front", "right", "back", "left", "up"];
    assert_eq!(faces("domemaster", FRAC_PI_2), upper);
    assert_eq!(faces("perspective:60", 0.0), ["front"]);
    assert_eq!(faces("equirect", 0.0).len(), 6);
}

#[test]
fn the_faces_of_a_cube_fit_together() {
    // A ball of many colours: across each side of the front, pixels go on where they end.
    let scene = ball_around(&mut Rng::new(6), 12, 16);
    let eye = eye(DVec3::Z, 0.3);
    let side = 64;
    let cross = pipeline::render_cube(&scene, &eye, &Layout::cross(), side, true, |_| {});
    assert_eq!((cross.width, cross.height), (4 * side, 3 * side));
    let at = |x: u32, y: u32| cross.pixels[(y * cross.width + x) as usize];
    let difference = |p: [u32; 2], q: [u32; 2]| {
        let (p, q) = (at(p[0], p[1]), at(q[0], q[1]));
        p.iter().zip(q).map(|(a, b)| (a - b).abs()).sum::<f32>()
    };
    let (first, last) = (side, 2 * side - 1);
    for [across, within] in [
        // Left, right, above and below of the front; each against pixels within it.
        (first..=last)
            .map(|y| [[first - 1, y], [first, y]])
            .collect(),
        (first..=last).map(|y| [[last, y], [last + 1, y]]).collect(),
        (first..=last)
            .map(|x| [[x, first - 1], [x, first]])
            .collect(),
        (first..=last)
            .map(|x| [[x, last], [x, last + 1]])
            .collect::<Vec<_>>(),
    ]
    .map(|pairs| {
        let middle = side + side / 2;
        let upright = pairs[0][0][1] == pairs[0][1][1];
        let within = pairs.iter().map(|pair| match upright {
            true => difference([middle, pair[0][1]], [middle + 1, pair[0][1]]),
            false => difference([pair[0][0], middle], [pair[0][0], middle + 1]),
        });
        let across = pairs.iter().map(|pair| difference(pair[0], pair[1]));
        [across.sum::<f32>(), within.sum::<f32>()]
    }) {
        assert!(across < 3.0 * within, "{across} and {within} within");
    }
    // The bottom left square of the cross is empty.
    assert_eq!(at(0, 2 * side), [0.0; 4]);
}
