//! The laws of visibility, on random scenes: area (law 1), merge (law 2, in `merge`), scale (law 3, in
//! `zoom`) and same bytes (law 5).
//!
//! Every engine goes through the same scenes. A failing case prints its seed; set `VEDUTA_SEED` to
//! look at that scene alone.

mod merge;
mod operators;
#[path = "../support/mod.rs"]
mod support;
mod zoom;

use merge::maps_of;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use support::coverage::{self, exceeds, largest_difference};
use support::samples;
use support::scenes::{LARGE, Scene};
use veduta::geometry::{DVec2, DVec3};
use veduta::map::{Camera, FaceId, Faces, Fragment, Fragments, Projection, Side, VisibilityMap};
use veduta::visibility::speculative::{self, Report};
use veduta::visibility::{Seen, Strip, Strips, cross_scanline};

/// A way to find visibility.
struct Engine {
    name: &'static str,
    find: fn(&Scene) -> (Seen, Report),
    /// To save time it is tried on one in this many of the small scenes and of the large ones.
    one_in: [u64; 2],
}

/// The engines under test. They are compared with the first one, which cuts the frame into a strip
/// for each row of pixels, like the paper.
const ENGINES: [Engine; 6] = [
    Engine {
        name: "sweep, a strip a row",
        find: |scene| sweep(&scene.faces, scene.height),
        one_in: [1, 1],
    },
    Engine {
        name: "sweep, 7 strips",
        find: |scene| sweep(&scene.faces, 7),
        one_in: [1, 40],
    },
    Engine {
        name: "sweep, 53 strips",
        find: |scene| sweep(&scene.faces, 53),
        one_in: [4, 8],
    },
    Engine {
        name: "clip without a guess",
        find: |scene| clip(scene, false, None),
        one_in: [1, 1],
    },
    Engine {
        name: "speculative",
        find: |scene| clip(scene, true, None),
        one_in: [1, 1],
    },
    Engine {
        name: "speculative, coarse cells",
        find: |scene| clip(scene, true, Some(60)),
        one_in: [1, 8],
    },
];

fn clip(scene: &Scene, guess: bool, cells: Option<u32>) -> (Seen, Report) {
    let aspect = f64::from(scene.width) / f64::from(scene.height);
    let settings = speculative::Settings {
        guess,
        aspect,
        cells,
        ..speculative::Settings::default()
    };
    speculative::find_and_report(&scene.faces, &settings)
}

/// The engines to try on a scene.
fn engines_for(scene: &Scene) -> impl Iterator<Item = &'static Engine> {
    // Large scenes are every tenth, so that the last digit says nothing new.
    let number = scene.seed / 10;
    let size = usize::from(scene.faces.len() > LARGE);
    ENGINES
        .iter()
        .filter(move |engine| number.is_multiple_of(engine.one_in[size]))
}

fn sweep(faces: &Faces, strips: u32) -> (Seen, Report) {
    let seen = cross_scanline::find(
        faces,
        &cross_scanline::Settings {
            strips: strips.max(1),
        },
    );
    (seen, Report::default())
}

/// Law 1: coverage per face and pixel, in square pixels.
const TOLERANCE: f64 = 1e-9;

/// Random scenes; a tenth of them have more than 5,000 faces.
const SCENES: u64 = if cfg!(debug_assertions) { 300 } else { 10_000 };

/// The seeds of a test: `count` of them, or the one to look at.
fn seeds(count: u64) -> Vec<u64> {
    match std::env::var("VEDUTA_SEED") {
        Ok(seed) => vec![seed.parse().expect("VEDUTA_SEED is a number")],
        Err(_) => {
            let few = std::env::var("VEDUTA_SCENES").ok();
            (0..few.map_or(count, |few| few.parse().expect("VEDUTA_SCENES is a number"))).collect()
        }
    }
}

#[test]
fn all_engines_see_the_same_areas() {
    let [large, piercing, ties, veils, mended] = [0; 5].map(AtomicUsize::new);
    let seeds = seeds(SCENES);
    let differences: Vec<Result<f64, String>> = seeds
        .par_iter()
        .map(|&seed| {
            let scene = Scene::random(seed);
            let mut is_mended = false;
            let results: Vec<(&str, Seen)> = engines_for(&scene)
                .map(|engine| {
                    let (seen, report) = (engine.find)(&scene);
                    is_mended |= report.rounds > 0;
                    (engine.name, seen)
                })
                .collect();
            let count = |counter: &AtomicUsize, does: bool| {
                counter.fetch_add(usize::from(does), Ordering::Relaxed);
            };
            count(&large, scene.faces.len() > LARGE);
            count(&piercing, has_piercing(&results[0].1));
            count(&ties, has_ties(&scene.faces, &results[0].1));
            count(&veils, !results[0].1.veils.is_empty());
            count(&mended, is_mended);
            largest_error(&scene, &results).map_err(|error| format!("{scene}: {error}"))
        })
        .collect();
    let largest = differences.iter().flatten().copied().fold(0.0, f64::max);
    let counts = [large, piercing, ties, veils, mended].map(AtomicUsize::into_inner);
    println!(
        "{} scenes: {} of more than {LARGE} faces, {} with faces that pierce each other, {} with \
         ties of coplanar faces, {} with veils, {} in which a wrong guess was mended; off by at \
         most {largest:e} square pixels",
        seeds.len(),
        counts[0],
        counts[1],
        counts[2],
        counts[3],
        counts[4]
    );
    let failures: Vec<String> = differences.into_iter().filter_map(Result::err).collect();
    report(&failures);
    if seeds.len() > 1 {
        assert!(counts.iter().all(|&count| count > 0), "a kind is missing");
    }
}

#[test]
fn strips_show_what_the_frame_shows_there() {
    let failures: Vec<String> = seeds(SCENES / 5)
        .par_iter()
        .filter_map(|&seed| {
            let scene = Scene::random(seed);
            let strips = strip_by_strip(&scene.faces, 2 + seed as u32 % 9);
            let results = [("frame", clip(&scene, true, None).0), ("strips", strips)];
            let error = largest_error(&scene, &results).err()?;
            Some(format!("{scene}: {error}"))
        })
        .collect();
    report(&failures);
}

/// Finds what is seen in each of `count` strips, and puts the strips together again. Sides are not
/// told: they would name lines of the strips' faces.
fn strip_by_strip(faces: &Faces, count: u32) -> Seen {
    let border = |k: u32| f64::from(k) / f64::from(count);
    let extents = (0..count).map(|k| [border(k), border(k + 1)]);
    let strips = Strips::new(faces, extents.collect());
    let mut pieces: [Vec<(FaceId, Vec<DVec2>)>; 2] = Default::default();
    for index in 0..strips.len() {
        let Strip { faces, parts_of } = strips.cut(index);
        let settings = speculative::Settings {
            strip: strips.extent(index),
            ..speculative::Settings::default()
        };
        let seen = speculative::find(&faces, &settings);
        for (pieces, fragments) in pieces.iter_mut().zip([seen.opaque, seen.veils]) {
            pieces.extend(fragments.iter().map(|fragment| {
                let polygon = match fragment {
                    Fragment::Whole(face) => faces.outline(face),
                    Fragment::Cut { vertices, .. } => vertices,
                };
                (parts_of[fragment.face().index()], polygon.to_vec())
            }));
        }
    }
    let [opaque, veils] = pieces.map(|mut pieces| {
        pieces.sort_by_key(|piece| piece.0);
        let mut fragments = Fragments::new();
        for (face, polygon) in pieces {
            fragments.push_cut(face, polygon.into_iter().map(|p| (p, Side::scan(face))));
        }
        fragments
    });
    Seen { opaque, veils }
}

fn report(failures: &[String]) {
    let some = failures.iter().take(10).cloned().collect::<Vec<_>>();
    assert!(
        failures.is_empty(),
        "{} scenes fail:\n{}",
        failures.len(),
        some.join("\n")
    );
}

/// The largest error of an area, in square pixels, as far as it shows: as a difference from the first
/// result, or in the sum of a pixel's areas. Above the tolerance it is an `Err` that says what is wrong.
fn largest_error(scene: &Scene, results: &[(&str, Seen)]) -> Result<f64, String> {
    let pixels = scene.width * scene.height;
    let mut first = None;
    let mut largest: f64 = 0.0;
    for (name, seen) in results {
        let fail = |what: String| Err(format!("{name}: {what}"));
        if let Err(broken) = map_of(&scene.faces, seen).check() {
            return fail(broken.to_string());
        }
        let [opaque, veils] = [&seen.opaque, &seen.veils]
            .map(|fragments| coverage::measure(&scene.faces, fragments, scene.width, scene.height));
        let (least, greatest) = coverage::sums(&opaque, pixels);
        if greatest > 1.0 + TOLERANCE {
            return fail(format!(
                "opaque areas of a pixel sum to 1 + {:e}",
                greatest - 1.0
            ));
        }
        largest = largest.max(greatest - 1.0);
        if scene.is_covered {
            if least < 1.0 - TOLERANCE {
                return fail(format!("{:e} of a pixel is uncovered", 1.0 - least));
            }
            largest = largest.max(1.0 - least);
        }
        let Some((first_opaque, first_veils)) = &first else {
            first = Some((opaque, veils));
            continue;
        };
        for (what, one, other) in [
            ("opaque", first_opaque, &opaque),
            ("veil", first_veils, &veils),
        ] {
            let difference = largest_difference(one, other);
            if exceeds(difference.size(), TOLERANCE) {
                return fail(format!("{what} {difference}"));
            }
            largest = largest.max(difference.size());
        }
    }
    Ok(largest)
}

fn map_of(faces: &Faces, seen: &Seen) -> VisibilityMap {
    let projection = Projection::Parallel {
        height: 1.0,
        aspect: 1.0,
    };
    VisibilityMap {
        camera: Camera::looking(DVec3::ZERO, DVec3::Y, DVec3::Z, projection, 0.0)
            .expect("a level view"),
        faces: faces.clone(),
        opaque: seen.opaque.clone(),
        veils: seen.veils.clone(),
    }
}

fn sides(seen: &Seen) -> impl Iterator<Item = (Fragment<'_>, [DVec2; 2], Side)> {
    seen.opaque
        .iter()
        .chain(seen.veils.iter())
        .flat_map(|fragment| {
            let (vertices, sides) = match fragment {
                Fragment::Whole(_) => (&[][..], &[][..]),
                Fragment::Cut {
                    vertices, sides, ..
                } => (vertices, sides),
            };
            sides.iter().enumerate().map(move |(index, &side)| {
                let ends = [vertices[index], vertices[(index + 1) % vertices.len()]];
                (fragment, ends, side)
            })
        })
}

fn has_piercing(seen: &Seen) -> bool {
    sides(seen).any(|(_, _, side)| side.kind == Side::CROSSING)
}

/// Whether the edge of one face bounds another one of the same plane.
fn has_ties(faces: &Faces, seen: &Seen) -> bool {
    sides(seen).any(|(fragment, _, side)| {
        side.kind < Side::SCAN
            && side.face < fragment.face()
            && faces.face_nearness(side.face) == faces.face_nearness(fragment.face())
    })
}

#[test]
fn areas_are_those_that_samples_find() {
    let count = if cfg!(debug_assertions) { 8 } else { 96 };
    let failures: Vec<String> = seeds(count)
        .par_iter()
        .filter_map(|&seed| {
            let mut scene = Scene::small(seed);
            (scene.width, scene.height) = (8, 6);
            let shares = samples::sample(&scene.faces, scene.width, scene.height, seed);
            engines_for(&scene).find_map(|Engine { name, find, .. }| {
                let (seen, _) = find(&scene);
                let fragments = [(&seen.opaque, &shares.opaque), (&seen.veils, &shares.veils)];
                fragments.into_iter().find_map(|(fragments, shares)| {
                    let coverage =
                        coverage::measure(&scene.faces, fragments, scene.width, scene.height);
                    unlikely(&coverage, shares)
                        .map(|what| format!("{scene}, without its own size: {name}: {what}"))
                })
            })
        })
        .collect();
    report(&failures);
}

/// A part whose area the samples contradict.
fn unlikely(coverage: &[coverage::Part], shares: &[(u32, u32, f64)]) -> Option<String> {
    let share = |pixel: u32, face: u32| {
        shares
            .binary_search_by_key(&(pixel, face), |&(pixel, face, _)| (pixel, face))
            .map_or(0.0, |index| shares[index].2)
    };
    let is_measured = |pixel: u32, face: u32| {
        coverage
            .binary_search_by_key(&(pixel, face), |part| (part.pixel, part.face))
            .is_ok()
    };
    let wrong = coverage.iter().find_map(|part| {
        let share = share(part.pixel, part.face);
        let tolerance = samples::tolerance(part.perimeter, part.fragments);
        exceeds((part.area - share).abs(), tolerance)
            .then(|| format!("{part:?}, but {share} of the samples, +- {tolerance}"))
    });
    wrong.or_else(|| {
        shares
            .iter()
            .find(|&&(pixel, face, _)| !is_measured(pixel, face))
            .map(|missing| format!("no area for the samples (pixel, face, share) {missing:?}"))
    })
}

/// Whether there are regions so thin that "next to" and "on the line" say little about them.
fn has_hairs(scene: &Scene) -> bool {
    ["slivers", "near-vertical", "mixture", "grazing"].contains(&scene.kind)
}

#[test]
fn sides_lie_on_the_lines_they_name() {
    let failures: Vec<String> = seeds(SCENES / 20)
        .par_iter()
        .filter_map(|&seed| {
            let scene = Scene::small(seed);
            if has_hairs(&scene) {
                return None;
            }
            engines_for(&scene).find_map(|Engine { name, find, .. }| {
                let (seen, _) = find(&scene);
                sides(&seen).find_map(|(fragment, ends, side)| {
                    let off = ends
                        .map(|end| distance_from_line(&scene.faces, &fragment, side, end))
                        .into_iter()
                        .fold(0.0, f64::max);
                    // Lines of different names may be as close as this.
                    exceeds(off, 2e-12).then(|| {
                        format!("{scene}: {name}: {side:?} of {fragment:?} is off by {off:e}")
                    })
                })
            })
        })
        .collect();
    report(&failures);
}

/// How far `point` is from the line that `side` names, in the image plane.
fn distance_from_line(faces: &Faces, fragment: &Fragment, side: Side, point: DVec2) -> f64 {
    match side.kind {
        Side::SCAN => 0.0,
        Side::CROSSING => {
            let own = faces.face_nearness(fragment.face());
            let difference = own.minus(faces.face_nearness(side.face));
            let scale = difference.a.hypot(difference.b);
            // What is left of the difference is as unsure as its terms.
            difference.at(point).abs() / scale
        }
        index => {
            let outline = faces.outline(side.face);
            let from = outline[index as usize];
            let to = outline[(index as usize + 1) % outline.len()];
            // A cut goes on along the line, beyond the edge that made it.
            ((to - from).perp_dot(point - from) / (to - from).length()).abs()
        }
    }
}

#[test]
fn both_sides_of_a_scanline_show_the_same_face() {
    /// Further than rounding, nearer than anything in the scenes that are looked at.
    const NEXT: f64 = 1e-9;
    let failures: Vec<String> = seeds(SCENES / 5)
        .par_iter()
        .filter_map(|&seed| {
            let scene = Scene::small(seed);
            if has_hairs(&scene) || scene.faces.ids().any(|face| scene.faces.is_veil(face)) {
                return None;
            }
            engines_for(&scene).find_map(|Engine { name, find, .. }| {
                let (seen, _) = find(&scene);
                sides(&seen).find_map(|(fragment, [from, to], side)| {
                    let is_long = from.distance(to) > 100.0 * NEXT;
                    if side.kind != Side::SCAN || !is_long {
                        return None;
                    }
                    // The fragment is on the other side: it is wound positively.
                    let outwards = -(to - from).perp().normalize() * NEXT;
                    // Not the middle, since vertices like to be there.
                    let next = from.lerp(to, 0.381_966) + outwards;
                    let seen_there = samples::nearest_at(&scene.faces, next);
                    (seen_there != Some(fragment.face())).then(|| {
                        format!("{scene}: {name}: {seen_there:?} next to {fragment:?} at {next}")
                    })
                })
            })
        })
        .collect();
    report(&failures);
}

#[test]
fn the_number_of_threads_makes_no_difference() {
    let pool = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool of threads")
    };
    let (one, three) = (pool(1), pool(3));
    for seed in seeds(SCENES / 100) {
        let scene = Scene::random(seed);
        for Engine { name, find, .. } in engines_for(&scene) {
            let (alone, _) = one.install(|| find(&scene));
            let (together, _) = three.install(|| find(&scene));
            assert!(alone == together, "{scene}: {name} depends on threads");
        }
    }
}

/// Prints what engines and measuring take for scenes of each kind, in milliseconds of one thread.
#[test]
#[ignore = "prints times, proves nothing"]
fn times() {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool of threads");
    for seed in seeds(120) {
        let scene = Scene::random(seed);
        let [mut times, mut fragments] = [String::new(), String::new()];
        for Engine { find, .. } in engines_for(&scene) {
            let start = Instant::now();
            let (seen, _) = pool.install(|| find(&scene));
            let found = Instant::now();
            coverage::measure(&scene.faces, &seen.opaque, scene.width, scene.height);
            let (find, measure) = (found - start, found.elapsed());
            times += &format!(
                " {:8.2} + {:6.2}",
                1e3 * find.as_secs_f64(),
                1e3 * measure.as_secs_f64()
            );
            fragments += &format!(" {}", seen.opaque.len());
        }
        println!("{times} ms, fragments{fragments}: {scene}");
    }
}
