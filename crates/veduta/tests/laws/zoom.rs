//! Law 3: dice(zoom(map)) = dice(render at that size).

use crate::map_of;
use crate::support::coverage;
use crate::support::rng::Rng;
use crate::support::scenes::Scene;
use rayon::prelude::*;
use veduta::dice::{Coverage, PixelGrid, coverage as coverage_on};
use veduta::geometry::DVec2;
use veduta::visibility::{cross_scanline, speculative};

#[test]
fn a_zoomed_map_shows_what_a_picture_of_that_size_would() {
    let scenes: u64 = if cfg!(debug_assertions) { 60 } else { 1_500 };
    let failures: Vec<String> = (0..scenes)
        .into_par_iter()
        .filter_map(|seed| {
            let scene = Scene::random(seed);
            let mut rng = Rng::new(seed ^ 0x7a6f_6f6d);
            let scale = DVec2::new(rng.magnitude(0.1, 64.0), rng.magnitude(0.1, 64.0));
            let frame = DVec2::new(f64::from(scene.width), f64::from(scene.height)) * scale;
            // A window of at most 40 pixels a side, which may hang over the border of the frame.
            let size = [rng.integer(1, 40), rng.integer(1, 40)];
            let origin = (frame * DVec2::new(rng.within(-0.1, 1.0), rng.within(-0.1, 1.0))).floor();
            let grid = PixelGrid {
                width: size[0],
                height: size[1],
                pixels_per_frame: frame,
                origin,
            };
            // Found for one size, and for the strips of another: the map has none.
            let settings = speculative::Settings {
                aspect: f64::from(scene.width) / f64::from(scene.height),
                ..speculative::Settings::default()
            };
            let stored = map_of(&scene.faces, &speculative::find(&scene.faces, &settings));
            let strips = cross_scanline::Settings {
                strips: (frame.y as u32).clamp(1, 64),
            };
            let fresh = map_of(&scene.faces, &cross_scanline::find(&scene.faces, &strips));
            let (zoomed, fresh) = (coverage_on(&stored, &grid), coverage_on(&fresh, &grid));
            let difference = largest_difference(&zoomed, &fresh);
            (difference > 1e-9)
                .then(|| format!("{scene}, scaled by {scale}: off by {difference:e}"))
        })
        .collect();
    assert!(
        failures.is_empty(),
        "{} fail: {:?}",
        failures.len(),
        failures.first()
    );
}

fn largest_difference(one: &[Coverage], other: &[Coverage]) -> f64 {
    let part = |row: &Coverage| coverage::Part {
        pixel: row.pixel as u32,
        face: row.face.0,
        area: row.area,
        perimeter: 0.0,
        fragments: 1,
    };
    let [one, other] = [one, other].map(|rows| rows.iter().map(part).collect::<Vec<_>>());
    coverage::largest_difference(&one, &other).size()
}
