//! Mending a wrong guess, cell by cell.

use super::cells::{CellLists, listed_between};
use super::clip::{Clipper, Context};
use super::verify::{Scratch, Verification};
use super::{Clipped, FACES_PER_TASK, Report, Seen, clip_all};
use rayon::prelude::*;
use veduta_map::{FaceId, Fragment, Fragments};

/// Admits what a wrong guess hid, until every cell is proved.
pub(super) fn mend(
    context: &Context,
    first_lists: CellLists,
    first_candidates: &[FaceId],
    thresholds: &mut [f32],
    verification: Verification,
    seen: &mut Seen,
    report: &mut Report,
) {
    let cells = context.grid.cells();
    let mut layers = vec![first_lists];
    let mut is_candidate = Vec::new();
    let mut failed_before = vec![false; cells];
    loop {
        let before = thresholds.to_vec();
        let guessed = |cell: usize| layers[0].guessed(cell);
        let wrong =
            verification.lower_wrong_thresholds(thresholds, &mut failed_before, 0..cells, guessed);
        if wrong.is_empty() {
            return;
        }
        report.rounds += 1;
        report.mended_cells += wrong.len();
        if is_candidate.is_empty() {
            is_candidate = vec![false; context.faces.len()];
            for face in first_candidates {
                is_candidate[face.index()] = true;
            }
        }

        // What the lower thresholds let in, and only that.
        let (reached, admitted) = listed_between(context, Some(&before), thresholds);
        let fresh: Vec<FaceId> = reached
            .into_iter()
            .filter(|face| !is_candidate[face.index()])
            .collect();
        for face in &fresh {
            is_candidate[face.index()] = true;
        }
        report.candidates += fresh.len();

        let mut is_wrong = vec![false; cells];
        for &cell in &wrong {
            is_wrong[cell] = true;
        }
        let (kept, changed) = take_away(context, seen, &admitted, &is_wrong);
        layers.push(admitted);
        let all_layers: Vec<&CellLists> = layers.iter().collect();
        let added = clip_all(context, &fresh, &all_layers, |_, _, _| {});
        report.pierced += kept.pierced + added.pierced;
        report.tied += kept.tied + added.tied;
        seen.opaque = merged(&kept.seen.opaque, &added.seen.opaque);
        seen.veils = merged(&kept.seen.veils, &added.seen.veils);

        // Prove anew the cells that were wrong and those of every face that changed.
        for &face in changed.iter().chain(&fresh) {
            let outline = context.faces.outline(face);
            context
                .grid
                .each_row(outline, &context.extents[face.index()], |row, columns| {
                    for column in columns {
                        is_wrong[context.grid.index(column, row)] = true;
                    }
                    true
                });
        }
        prove_anew(context, &verification, thresholds, &seen.opaque, |cell| {
            is_wrong[cell] && layers[0].guessed(cell)
        });
    }
}

/// Takes the newly admitted faces from what was seen in the wrong cells. Returns what is left, and
/// the faces that lost something.
fn take_away(
    context: &Context,
    seen: &Seen,
    admitted: &CellLists,
    is_wrong: &[bool],
) -> (Clipped, Vec<FaceId>) {
    let mut all = Clipped::default();
    let mut changed = Vec::new();
    for (veils, fragments) in [(false, &seen.opaque), (true, &seen.veils)] {
        let groups = runs_of_one_face(fragments);
        let parts: Vec<(Clipped, Vec<FaceId>)> = groups
            .par_chunks(FACES_PER_TASK)
            .map_init(
                || Clipper::new(*context),
                |clipper, groups| {
                    let mut part = (Clipped::default(), Vec::new());
                    for group in groups {
                        let face = fragments.face(group.start);
                        if !touches(context, face, is_wrong) {
                            let kept = if veils {
                                &mut part.0.seen.veils
                            } else {
                                &mut part.0.seen.opaque
                            };
                            for index in group.clone() {
                                copy(kept, fragments.get(index));
                            }
                            continue;
                        }
                        clipper.resume(face, group.clone().map(|index| fragments.get(index)));
                        let before = clipper.pieces.losses();
                        clipper.subtract_listed(face, &[admitted], |cell| is_wrong[cell]);
                        if clipper.pieces.losses() != before {
                            part.1.push(face);
                        }
                        part.0.push(context.faces, face, clipper);
                    }
                    part
                },
            )
            .collect();
        for (part, faces) in &parts {
            all.append(part);
            changed.extend_from_slice(faces);
        }
    }
    (all, changed)
}

/// Index ranges of the fragments of each face.
fn runs_of_one_face(fragments: &Fragments) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for index in 0..fragments.len() {
        match runs.last_mut() {
            Some(run) if fragments.face(run.start) == fragments.face(index) => run.end += 1,
            _ => runs.push(index..index + 1),
        }
    }
    runs
}

fn touches(context: &Context, face: FaceId, is_wrong: &[bool]) -> bool {
    let mut touched = false;
    let extent = &context.extents[face.index()];
    context
        .grid
        .each_row(context.faces.outline(face), extent, |row, columns| {
            touched = columns
                .into_iter()
                .any(|column| is_wrong[context.grid.index(column, row)]);
            !touched
        });
    touched
}

fn copy(fragments: &mut Fragments, fragment: Fragment) {
    match fragment {
        Fragment::Whole(face) => fragments.push_whole(face),
        Fragment::Cut {
            face,
            vertices,
            sides,
        } => {
            fragments.push_cut(face, vertices.iter().copied().zip(sides.iter().copied()));
        }
    }
}

/// Two sets of fragments, of different faces, in one order.
fn merged(a: &Fragments, b: &Fragments) -> Fragments {
    if b.is_empty() {
        return a.clone();
    }
    let mut merged = Fragments::new();
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        if j == b.len() || (i < a.len() && a.face(i) < b.face(j)) {
            copy(&mut merged, a.get(i));
            i += 1;
        } else {
            copy(&mut merged, b.get(j));
            j += 1;
        }
    }
    merged
}

fn prove_anew(
    context: &Context,
    verification: &Verification,
    thresholds: &[f32],
    opaque: &Fragments,
    wanted: impl Fn(usize) -> bool + Sync,
) {
    let dirty: Vec<bool> = (0..context.grid.cells()).map(&wanted).collect();
    for (cell, _) in dirty.iter().enumerate().filter(|(_, dirty)| **dirty) {
        verification.reset(cell);
    }
    (0..opaque.len())
        .into_par_iter()
        .with_min_len(FACES_PER_TASK)
        .for_each_init(Scratch::default, |scratch, index| {
            let fragment = opaque.get(index);
            let face = fragment.face();
            if !touches(context, face, &dirty) {
                return;
            }
            let polygon = match fragment {
                Fragment::Whole(face) => context.faces.outline(face),
                Fragment::Cut { vertices, .. } => vertices,
            };
            let plane = context.faces.face_nearness(face);
            verification.add(
                context,
                scratch,
                thresholds,
                polygon.iter().copied(),
                plane,
                |cell| dirty[cell],
            );
        });
}
