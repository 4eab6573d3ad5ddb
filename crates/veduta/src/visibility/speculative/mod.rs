//! The main engine: guess with a z-buffer, clip exactly, verify, mend.
//!
//! 1. `guess`: a coarse z-buffer tells, for each cell of the frame, how near the nearest surface
//!    about is. It only *guesses* what is hidden.
//! 2. `clip::cells`: faces that are not guessed to be hidden everywhere become candidates, and are
//!    listed in the cells in which they may be seen.
//! 3. `clip`: each candidate is clipped exactly by the nearer candidates that overlap it; where
//!    planes cross, by one more line. Most seen faces are seen whole and need no cut. The cost does
//!    not depend on any resolution.
//! 4. `verify`: the guess is proved from the result: in each cell where something was guessed to
//!    be hidden, what was found seen must leave no gap and be nearer.
//! 5. `mend`: where it was wrong, the faces that it hid are admitted and taken from what
//!    was found, there and nowhere else, until every cell is proved.
//!
//! Without the guess ([`Settings::guess`]) every face is a candidate everywhere and nothing needs to
//! be proved: the same exact clip, slower. Input: projected faces. Output: fragments, the same for
//! any number of threads.

mod guess;
mod mend;
mod verify;

use super::Seen;
use crate::clip::{
    CellLists, Context, Extent, Found, Grid, OPEN, Pile, by_place, clip_each, listed_between,
};
use veduta_map::{FaceId, Faces};
use verify::{Scratch, Verification};

/// How the engine works; what it finds does not depend on it, but for the cuts inside a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Whether hidden faces are guessed with a z-buffer first.
    pub guess: bool,
    /// Width over height of the frame, so that cells are about square.
    pub aspect: f64,
    /// Top and bottom of the strip of the frame in which all faces lie: 0 and 1 for all of it.
    pub strip: [f64; 2],
    /// Number of cells, about; by default one for each few faces.
    pub cells: Option<u32>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            guess: true,
            aspect: 1.5,
            strip: [0.0, 1.0],
            cells: None,
        }
    }
}

/// What the engine did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Faces that were not guessed to be hidden everywhere.
    pub candidates: usize,
    /// Rounds of mending.
    pub rounds: usize,
    /// Cells in which the guess was wrong, counted in each round.
    pub mended_cells: usize,
    /// Candidates cut by a crossing of planes.
    pub pierced: usize,
    /// Candidates of which a face in the same plane hid something.
    pub tied: usize,
}

/// Finds where each face is seen.
pub fn find(faces: &Faces, settings: &Settings) -> Seen {
    find_and_report(faces, settings).0
}

/// [`find`], and what it took.
pub fn find_and_report(faces: &Faces, settings: &Settings) -> (Seen, Report) {
    let extents = Extent::of_all(faces);
    let grid = Grid::choose(faces.len(), settings.aspect, settings.strip, settings.cells);
    let context = Context {
        faces,
        extents: &extents,
        grid: &grid,
    };

    let mut thresholds = if settings.guess {
        guess::thresholds(faces, &extents, &grid, samples_for(&grid))
    } else {
        vec![OPEN; grid.cells()]
    };
    let (candidates, lists) = listed_between(&context, None, &thresholds);

    let verification = Verification::new(grid.cells());
    let mut report = Report {
        candidates: candidates.len(),
        ..Report::default()
    };
    let mut found = Found::default();
    let in_order = by_place(&context, &candidates);
    let proof = Proof {
        verification: &verification,
        thresholds: &thresholds,
        lists: &lists,
    };
    clip_all(
        &context,
        &in_order,
        &[&lists],
        Some(proof),
        &mut found,
        &mut report,
    );
    if settings.guess {
        let verification = &verification;
        mend::mend(
            &context,
            lists,
            candidates,
            &mut thresholds,
            verification,
            &mut found,
            &mut report,
        );
    }
    (found.into_seen(faces), report)
}

/// Samples of the guess along each side of a cell.
const SAMPLES: u32 = 4;

/// Samples of the guess in all, above which cells have fewer of them: the guess would cost more than
/// it saves.
const MOST_SAMPLES: usize = 4 * 1024 * 1024;

fn samples_for(grid: &Grid) -> u32 {
    (1..SAMPLES).rev().fold(SAMPLES, |samples, fewer| {
        let too_many = grid.cells() * (samples * samples) as usize > MOST_SAMPLES;
        if too_many { fewer } else { samples }
    })
}

impl Report {
    fn count(&mut self, pile: &Pile) {
        self.pierced += pile.pierced;
        self.tied += pile.tied;
    }
}

/// Where what is clipped is measured, to prove the guess.
#[derive(Clone, Copy)]
struct Proof<'a> {
    verification: &'a Verification,
    thresholds: &'a [f32],
    lists: &'a CellLists,
}

/// Clips `candidates` by the faces of `lists`, adds what is left to `found`, and measures it for the
/// proof.
fn clip_all(
    context: &Context,
    candidates: &[FaceId],
    lists: &[&CellLists],
    proof: Option<Proof>,
    found: &mut Found,
    report: &mut Report,
) {
    let piles = clip_each(
        context,
        candidates,
        |clipper, scratch: &mut Scratch, face, pile| {
            clipper.clip(face, lists);
            clipper.store(face, pile);
            if let Some(proof) = proof
                && !context.faces.is_veil(face)
            {
                let plane = context.faces.face_nearness(face);
                for piece in clipper.pieces.iter() {
                    let points = piece.iter().map(|corner| corner.point);
                    let guessed = |cell| proof.lists.guessed(cell);
                    let Proof {
                        verification,
                        thresholds,
                        ..
                    } = proof;
                    verification.add(context, scratch, thresholds, points, plane, guessed);
                }
            }
        },
    );
    for pile in piles {
        report.count(&pile);
        found.add(pile);
    }
}
