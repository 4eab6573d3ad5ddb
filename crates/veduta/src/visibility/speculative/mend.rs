//! Mending a wrong guess, cell by cell.

use super::verify::{Scratch, Verification};
use super::{Report, clip_all};
use crate::clip::{
    CellLists, CellSet, Clipper, Context, Entry, FACES_PER_TASK, Found, Pile, listed_between,
};
use rayon::prelude::*;
use veduta_map::FaceId;

/// Admits what a wrong guess hid, until every cell is proved.
pub(super) fn mend(
    context: &Context,
    first_lists: CellLists,
    candidates: Vec<FaceId>,
    thresholds: &mut [f32],
    verification: &Verification,
    found: &mut Found,
    report: &mut Report,
) {
    let cells = context.grid.cells();
    let mut layers = vec![first_lists];
    let mut is_candidate = Vec::new();
    let mut failed_before = vec![false; cells];
    loop {
        let before = thresholds.to_vec();
        let wrong = verification.lower_wrong_thresholds(thresholds, &mut failed_before, |cell| {
            layers[0].guessed(cell)
        });
        if wrong.is_empty() {
            return;
        }
        report.rounds += 1;
        report.mended_cells += wrong.len();
        if is_candidate.is_empty() {
            is_candidate = vec![false; context.faces.len()];
            for face in &candidates {
                is_candidate[face.index()] = true;
            }
        }

        // What the lower thresholds let in, and only that.
        let mut dirty = vec![false; cells];
        for &cell in &wrong {
            dirty[cell] = true;
        }
        let lowered = CellSet::new(context.grid, dirty.clone());
        let (mut fresh, admitted) = listed_between(context, Some((&before, &lowered)), thresholds);
        fresh.retain(|face| !std::mem::replace(&mut is_candidate[face.index()], true));
        report.candidates += fresh.len();

        let changed = take_away(context, found, &admitted, &lowered, report);
        layers.push(admitted);
        let all_layers: Vec<&CellLists> = layers.iter().collect();
        clip_all(context, &fresh, &all_layers, None, found, report);

        // Prove anew the cells that were wrong and those of every face that changed.
        for &face in changed.iter().chain(&fresh) {
            let outline = context.faces.outline(face);
            let extent = &context.extents[face.index()];
            context.grid.each_row(outline, extent, |row, columns| {
                for column in columns {
                    dirty[context.grid.index(column, row)] = true;
                }
                true
            });
        }
        let dirty = CellSet::new(context.grid, dirty);
        prove_anew(context, verification, thresholds, found, &dirty);
    }
}

/// Takes the newly admitted faces from what was found in the wrong cells. Returns the faces that
/// lost something.
fn take_away(
    context: &Context,
    found: &mut Found,
    admitted: &CellLists,
    lowered: &CellSet,
    report: &mut Report,
) -> Vec<FaceId> {
    let (touched, untouched): (Vec<Entry>, Vec<Entry>) = found
        .entries
        .par_iter()
        .partition(|entry| touches(context, entry.face, lowered));
    let parts: Vec<(Pile, Vec<FaceId>)> = touched
        .par_chunks(FACES_PER_TASK)
        .map_init(
            || Clipper::new(*context),
            |clipper, entries| {
                let mut pile = Pile::default();
                let mut changed = Vec::new();
                for &entry in entries {
                    let fragments = found.fragments(entry).map(|all| all.iter().copied());
                    clipper.resume(entry.face, fragments);
                    let before = clipper.pieces.losses();
                    clipper.subtract_listed(entry.face, &[admitted], |cell| lowered.contains(cell));
                    if clipper.pieces.losses() != before {
                        changed.push(entry.face);
                    }
                    clipper.store(entry.face, &mut pile);
                }
                (pile, changed)
            },
        )
        .collect();
    found.entries = untouched;
    let mut changed = Vec::new();
    for (pile, faces) in parts {
        report.count(&pile);
        found.add(pile);
        changed.extend(faces);
    }
    changed
}

/// Whether a face may reach into one of the cells.
fn touches(context: &Context, face: FaceId, cells: &CellSet) -> bool {
    let extent = &context.extents[face.index()];
    if !cells.meets(&context.grid.span(extent)) {
        return false;
    }
    let mut touched = false;
    context
        .grid
        .each_row(context.faces.outline(face), extent, |row, columns| {
            touched = columns
                .into_iter()
                .any(|column| cells.contains(context.grid.index(column, row)));
            !touched
        });
    touched
}

/// Measures the dirty cells again.
fn prove_anew(
    context: &Context,
    verification: &Verification,
    thresholds: &[f32],
    found: &Found,
    dirty: &CellSet,
) {
    for cell in dirty.cells() {
        verification.reset(cell);
    }
    found
        .entries
        .par_iter()
        .with_min_len(FACES_PER_TASK)
        .for_each_init(Scratch::default, |scratch, &entry| {
            let face = entry.face;
            if context.faces.is_veil(face) || !touches(context, face, dirty) {
                return;
            }
            let plane = context.faces.face_nearness(face);
            for polygon in found.polygons(context.faces, entry) {
                verification.add(context, scratch, thresholds, polygon, plane, |cell| {
                    dirty.contains(cell)
                });
            }
        });
}
