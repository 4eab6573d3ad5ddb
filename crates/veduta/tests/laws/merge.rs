//! Law 2: composite(A, B, …) = render(A ∪ B ∪ …), in any grouping and order.

use crate::support::rng::Rng;
use crate::support::scenes::Scene;
use crate::{clip, has_piercing, has_ties, largest_error, report, seeds};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use veduta::composite::merge;
use veduta::map::{FaceId, Faces, Fragment, Seen, Side};
use veduta::visibility::speculative;

/// Random scenes; a tenth of them are large.
const SCENES: u64 = if cfg!(debug_assertions) { 100 } else { 1_200 };

#[test]
fn merged_maps_show_what_all_faces_show() {
    let [piercing, ties, veils] = [0; 3].map(AtomicUsize::new);
    let failures: Vec<String> = seeds(SCENES)
        .par_iter()
        .filter_map(|&seed| {
            let scene = Scene::random(seed);
            let aspect = f64::from(scene.width) / f64::from(scene.height);
            let count = 2 + seed as usize % 7;
            let maps = maps_of(&scene, count);
            let merged = |maps: &[Seen]| merge(&scene.faces, maps, aspect);
            let all = clip(&scene, true, None).0;
            let at_once = merged(&maps);
            let reversed: Vec<Seen> = maps.iter().rev().cloned().collect();
            let (some, others) = maps.split_at(count / 2);
            let in_groups = merged(&[merged(others), merged(some)]);
            let in_turn = maps[1..].iter().fold(maps[0].clone(), |before, map| {
                merged(&[before, map.clone()])
            });
            let tally = |counter: &AtomicUsize, does: bool| {
                counter.fetch_add(usize::from(does), Ordering::Relaxed);
            };
            tally(
                &piercing,
                has_piercing(&at_once) && !maps.iter().any(has_piercing),
            );
            tally(&ties, has_ties(&scene.faces, &at_once));
            tally(&veils, !at_once.veils.is_empty());
            let results = [
                ("all", all),
                ("at once", at_once),
                ("reversed", merged(&reversed)),
                ("in groups", in_groups),
                ("in turn", in_turn),
            ];
            let error = largest_error(&scene, &results).err();
            error
                .or_else(|| wrong_side(&scene.faces, &results[1].1))
                .map(|error| format!("{scene} in {count} maps: {error}"))
        })
        .collect();
    let [piercing, ties, veils] = [piercing, ties, veils].map(AtomicUsize::into_inner);
    println!(
        "{piercing} scenes in which only faces of different maps pierce each other, {ties} with ties, \
         {veils} with veils"
    );
    report(&failures);
    if seeds(SCENES).len() > 1 {
        assert!(piercing > 0 && ties > 0 && veils > 0, "a kind is missing");
    }
}

/// What is seen of a scene's faces dealt to `count` maps: at random, in turn, or in blocks.
pub fn maps_of(scene: &Scene, count: usize) -> Vec<Seen> {
    let mut rng = Rng::new(scene.seed ^ 0x6d61_7073);
    let total = scene.faces.len();
    let map_of: Vec<usize> = (0..total)
        .map(|face| match scene.seed % 3 {
            0 => rng.integer(0, count as u32 - 1) as usize,
            1 => face % count,
            _ => face * count / total,
        })
        .collect();
    (0..count)
        .map(|map| {
            let dealt: Vec<FaceId> = scene
                .faces
                .ids()
                .filter(|face| map_of[face.index()] == map)
                .collect();
            let settings = speculative::Settings::default();
            let seen = speculative::find(&selected(&scene.faces, &dealt), &settings);
            let number = |face: FaceId| dealt[face.index()];
            Seen {
                opaque: seen.opaque.renumbered(number),
                veils: seen.veils.renumbered(number),
            }
        })
        .collect()
}

/// The rows `ids` of a table.
fn selected(faces: &Faces, ids: &[FaceId]) -> Faces {
    let mut selected = Faces::new();
    faces.planes().iter().for_each(|&plane| {
        selected.push_plane(plane);
    });
    for &face in ids {
        let (outline, plane) = (faces.outline(face), faces.plane(face));
        let id = selected.push(outline, plane, faces.object(face), faces.source(face));
        let id = id.expect("a face of a table has an area");
        if faces.is_veil(face) {
            selected.set_veil(id);
        }
    }
    selected
}

/// A vertex that lies off a line that its fragment names beside it, in image units.
fn wrong_side(faces: &Faces, seen: &Seen) -> Option<String> {
    const NEAR: f64 = 1e-9;
    for fragment in seen.opaque.iter().chain(seen.veils.iter()) {
        let Fragment::Cut {
            face,
            vertices,
            sides,
        } = fragment
        else {
            continue;
        };
        for (index, side) in sides.iter().enumerate() {
            for end in [vertices[index], vertices[(index + 1) % vertices.len()]] {
                let off = match side.kind {
                    Side::SCAN => continue,
                    Side::CROSSING => {
                        let difference = faces
                            .face_nearness(side.face)
                            .minus(faces.face_nearness(face));
                        let slope = difference.a.hypot(difference.b);
                        // A crossing at a grazing angle is as sure as its planes.
                        (difference.at(end).abs() - 1e-12) / slope.max(1e-3)
                    }
                    kind => {
                        let outline = faces.outline(side.face);
                        let from = outline[kind as usize];
                        let to = outline[(kind as usize + 1) % outline.len()];
                        let along = to - from;
                        along.perp_dot(end - from).abs() / along.length()
                    }
                };
                if off > NEAR {
                    return Some(format!("{side:?} of {face:?} is off by {off:e}"));
                }
            }
        }
    }
    None
}
