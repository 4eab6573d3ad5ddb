//! Thin things.

use crate::panes::{Pane, scene_of};
use crate::{eye, lens, patch_direction, picture_of, projection, size_of};
use veduta::geometry::{DVec2, DVec3};

/// Area in square pixels that a polygon of closely set points covers of the columns from `first` to `end`.
fn area_in_columns(polygon: &[DVec2], first: f64, end: f64) -> f64 {
    let mut area = 0.0;
    for (k, &p) in polygon.iter().enumerate() {
        let q = polygon[(k + 1) % polygon.len()];
        let (low, high) = (p.x.clamp(first, end), q.x.clamp(first, end));
        if p.x != q.x {
            let at = |x: f64| p.y + (q.y - p.y) * ((x - p.x) / (q.x - p.x));
            area += 0.5 * (at(low) + at(high)) * (low - high);
        }
    }
    area.abs()
}

#[test]
fn a_wire_stays_a_wire() {
    let eye = eye(DVec3::Z, 0.0);
    // Lenses, what they look at, and the wire's ends.
    let high = [DVec3::new(-9.0, 3.0, 2.5), DVec3::new(9.0, 3.0, 2.2)];
    let level = [DVec3::Y, DVec3::Z];
    let upwards = [DVec3::Z, -DVec3::Y];
    for (name, looking, [from, to]) in [
        ("domemaster", upwards, high),
        ("fisheye:180", level, high),
        ("equisolid:200", level, high),
        ("omnimax:full", level, high),
        ("equirect", level, high),
        ("cylinder", level, high),
        ("mercator", level, high),
        ("stereographic:220", level, high),
        (
            "ball",
            level,
            [DVec3::new(5.0, -4.0, 3.0), DVec3::new(-5.0, -4.0, 2.0)],
        ),
    ] {
        let lens = lens(name);
        // So large that the scale of the lens does not change by more than a per cent or two from pixel to pixel.
        for width in if lens.is_round() {
            [200, 440]
        } else {
            [400, 600]
        } {
            let [width, height] = size_of(lens, width);
            let projection = projection(&eye, lens, looking, width, height);
            // Of a twentieth of a pixel, in the middle.
            let middle = 0.5 * (from + to);
            let at = |point: DVec3| {
                let seen = eye.eye_from_world.transform_vector3(point);
                let point = projection.image(patch_direction(seen));
                point.expect("in view")
            };
            let across = middle.cross(to - from).normalize();
            let step = (at(middle + 1e-4 * across) - at(middle)).length() / 1e-4;
            let half = 0.5 * across * (0.05 / step);
            let corners = [from - half, to - half, to + half, from + half];
            let pane = Pane {
                corners: corners.to_vec(),
                color: [1.0; 4],
            };
            let picture = picture_of(&scene_of(&[pane]), &eye, &projection);

            let along = |p: DVec3, q: DVec3| {
                (0..20_000).map(move |k| at(p + (q - p) * (f64::from(k) / 20_000.0)))
            };
            let [a, b, c, d] = corners;
            let outline: Vec<DVec2> = along(a, b)
                .chain(along(b, c))
                .chain(along(c, d))
                .chain(along(d, a))
                .collect();
            let (left, right) = outline
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, r), p| {
                    (l.min(p.x), r.max(p.x))
                });
            let (mut columns, mut worst) = (0, 0.0_f64);
            for column in left.ceil() as u32 + 1..right.floor() as u32 - 1 {
                let expected = area_in_columns(&outline, f64::from(column), f64::from(column + 1));
                let found: f64 = (0..height)
                    .map(|row| f64::from(picture.pixels[(row * width + column) as usize][3]))
                    .sum();
                worst = worst.max((found / expected - 1.0).abs());
                columns += 1;
            }
            println!("{name} {width}: off by {worst:.5} in a column");
            assert!(columns > width / 4, "{name}: the wire is {columns} long");
            assert!(worst < 0.01, "{name} {width}: off by {worst} in a column");
        }
    }
}
