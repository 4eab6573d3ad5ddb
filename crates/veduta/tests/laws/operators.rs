//! The operators of compositing by area: what of a map lies inside and outside of another.

use crate::maps_of;
use crate::support::coverage::{self, Coverage, exceeds, largest_difference};
use crate::support::rng::Rng;
use crate::support::samples::SIDE;
use crate::support::scenes::Scene;
use crate::{TOLERANCE, report, seeds, unlikely};
use rayon::prelude::*;
use veduta::composite::{Keep, cover};
use veduta::geometry::DVec2;
use veduta::map::{FaceId, Faces, Fragment, Fragments, Seen};

/// Random scenes; a tenth of them are large.
const SCENES: u64 = if cfg!(debug_assertions) { 20 } else { 150 };

/// A map B as a cover: the faces that it shows.
struct Cover(Vec<bool>);

impl Cover {
    fn of(faces: &Faces, seen: &Seen) -> Self {
        let mut shown = vec![false; faces.len()];
        for fragment in seen.opaque.iter().chain(seen.veils.iter()) {
            shown[fragment.face().index()] = true;
        }
        Self(shown)
    }

    fn keep(&self, scene: &Scene, seen: &Seen, keep: Keep) -> Seen {
        let aspect = f64::from(scene.width) / f64::from(scene.height);
        let is_cover = |face: FaceId| self.0[face.index()];
        cover(&scene.faces, seen, is_cover, keep, aspect)
    }
}

fn measured(scene: &Scene, fragments: &Fragments) -> Coverage {
    coverage::measure(&scene.faces, fragments, scene.width, scene.height)
}

#[test]
fn what_is_in_and_what_is_out_of_a_map_are_all_of_it() {
    let failures: Vec<String> = seeds(SCENES)
        .par_iter()
        .filter_map(|&seed| {
            let scene = Scene::random(seed);
            let maps = maps_of(&scene, 2);
            let cover = Cover::of(&scene.faces, &maps[1]);
            let [inside, outside] =
                [Keep::Inside, Keep::Outside].map(|keep| cover.keep(&scene, &maps[0], keep));
            for (whole, parts) in [
                (&maps[0].opaque, [&inside.opaque, &outside.opaque]),
                (&maps[0].veils, [&inside.veils, &outside.veils]),
            ] {
                let both = measured(&scene, &parts[0].with(parts[1]));
                let difference = largest_difference(&measured(&scene, whole), &both);
                if exceeds(difference.size(), TOLERANCE) {
                    return Some(format!("{scene}: {difference}"));
                }
            }
            None
        })
        .collect();
    report(&failures);
}

#[test]
fn atop_covers_what_the_map_below_covers() {
    let failures: Vec<String> = seeds(SCENES)
        .par_iter()
        .filter_map(|&seed| {
            let scene = Scene::random(seed);
            let maps = maps_of(&scene, 2);
            if maps.iter().any(|map| !map.veils.is_empty()) {
                return None;
            }
            let [above, below] = [0, 1].map(|map| Cover::of(&scene.faces, &maps[map]));
            let front = below.keep(&scene, &maps[0], Keep::Inside);
            let rest = above.keep(&scene, &maps[1], Keep::Outside);
            let [atop, expected] = [&front.opaque.with(&rest.opaque), &maps[1].opaque]
                .map(|fragments| of_pixels(&measured(&scene, fragments)));
            let difference = largest_difference(&expected, &atop);
            exceeds(difference.size(), TOLERANCE).then(|| format!("{scene}: {difference}"))
        })
        .collect();
    report(&failures);
}

/// The areas of all faces of a pixel together.
fn of_pixels(coverage: &Coverage) -> Coverage {
    let mut sums = coverage.clone();
    sums.iter_mut().for_each(|part| part.face = 0);
    sums.dedup_by(|next, first| {
        let is_same = next.pixel == first.pixel;
        if is_same {
            first.area += next.area;
        }
        is_same
    });
    sums
}

#[test]
fn what_is_in_and_out_of_a_map_is_what_samples_find() {
    let count = if cfg!(debug_assertions) { 2 } else { 8 };
    let failures: Vec<String> = seeds(count)
        .par_iter()
        .filter_map(|&seed| {
            let mut scene = Scene::small(seed);
            (scene.width, scene.height) = (8, 6);
            let maps = maps_of(&scene, 2);
            let cover = Cover::of(&scene.faces, &maps[1]);
            let found = [Keep::Inside, Keep::Outside].map(|keep| {
                let seen = cover.keep(&scene, &maps[0], keep);
                measured(&scene, &seen.opaque)
            });
            let shares = sampled(&scene, &maps[0], &maps[1]);
            found.iter().zip(shares).find_map(|(found, shares)| {
                unlikely(found, &shares).map(|what| format!("{scene}: {what}"))
            })
        })
        .collect();
    report(&failures);
}

/// The shares of samples at which a face of the first map is seen: where the second one shows something,
/// and where not.
fn sampled(scene: &Scene, map: &Seen, cover: &Seen) -> [Vec<(u32, u32, f64)>; 2] {
    let faces = &scene.faces;
    let mut rng = Rng::new(scene.seed);
    let size = DVec2::new(f64::from(scene.width), f64::from(scene.height));
    let mut shares = [Vec::new(), Vec::new()];
    for pixel in 0..scene.width * scene.height {
        let corner = DVec2::new(
            f64::from(pixel % scene.width),
            f64::from(pixel / scene.width),
        );
        let near = |fragments: &Fragments| near(faces, fragments, corner / size, 1.0 / size);
        let own = near(&map.opaque);
        let others = [near(&cover.opaque), near(&cover.veils)].concat();
        let mut seen = [Vec::new(), Vec::new()];
        for square in 0..SIDE * SIDE {
            let square = DVec2::new(f64::from(square % SIDE), f64::from(square / SIDE));
            let jitter = DVec2::new(rng.unit(), rng.unit());
            let point = (corner + (square + jitter) / f64::from(SIDE)) / size;
            let shows = |(_, polygon): &&(u32, Vec<DVec2>)| contains(polygon, point);
            if let Some((face, _)) = own.iter().find(shows) {
                let outside = usize::from(!others.iter().any(|other| shows(&other)));
                seen[outside].push(*face);
            }
        }
        for (mut seen, shares) in seen.into_iter().zip(&mut shares) {
            seen.sort_unstable();
            for run in seen.chunk_by(|a, b| a == b) {
                shares.push((pixel, run[0], run.len() as f64 / f64::from(SIDE * SIDE)));
            }
        }
    }
    shares
}

/// The fragments whose boxes touch a box, with their faces.
fn near(faces: &Faces, fragments: &Fragments, min: DVec2, size: DVec2) -> Vec<(u32, Vec<DVec2>)> {
    let polygons = fragments.iter().map(|fragment| {
        let polygon = match fragment {
            Fragment::Whole(face) => faces.outline(face),
            Fragment::Cut { vertices, .. } => vertices,
        };
        (fragment.face().0, polygon.to_vec())
    });
    polygons
        .filter(|(_, polygon)| {
            let low = polygon.iter().fold(DVec2::MAX, |low, &p| low.min(p));
            let high = polygon.iter().fold(DVec2::MIN, |high, &p| high.max(p));
            low.cmple(min + size).all() && high.cmpge(min).all()
        })
        .collect()
}

fn contains(polygon: &[DVec2], point: DVec2) -> bool {
    (0..polygon.len()).all(|index| {
        let (from, to) = (polygon[index], polygon[(index + 1) % polygon.len()]);
        (to - from).perp_dot(point - from) >= 0.0
    })
}
