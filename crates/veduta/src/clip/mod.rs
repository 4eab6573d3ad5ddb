//! The exact clip of convex faces by nearer ones, which finding visibility and compositing share.
//!
//! 1. [`Grid`]: cells of the frame, and [`Extent`], what is known of a face before its outline is
//!    looked at.
//! 2. [`CellLists`]: which faces may hide others in which cells.
//! 3. [`Clipper`]: a face less the nearer parts of the listed faces that overlap it; its [`Pieces`]
//!    are what is left.
//! 4. [`Found`]: what was found, put in order of faces.

mod cells;
mod clipper;
mod found;
mod grid;
mod pieces;
mod sides;

pub(crate) use cells::{CellLists, OPEN, listed_between, listed_of_maps};
pub(crate) use clipper::{Clipper, Context};
pub(crate) use found::{Entry, Found, Pile};
pub(crate) use grid::{CellSet, Extent, Grid};
pub(crate) use pieces::Corner;

use crate::buckets::Buckets;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use veduta_map::FaceId;

/// Faces that a task clips at a time.
pub(crate) const FACES_PER_TASK: usize = 256;

/// Faces clipped since the process began.
pub(crate) static CLIPPED: AtomicU64 = AtomicU64::new(0);

/// Lets `clip` clip each of `faces` and store what is left of it, side by side. It is given a clipper and
/// what else a task keeps.
pub(crate) fn clip_each<T: Default + Send>(
    context: &Context,
    faces: &[FaceId],
    clip: impl Fn(&mut Clipper, &mut T, FaceId, &mut Pile) + Sync,
) -> Vec<Pile> {
    CLIPPED.fetch_add(faces.len() as u64, Relaxed);
    // A clipper is as large as the scene has faces, so tasks hand theirs on rather than make new ones.
    let idle: Mutex<Vec<(Clipper, T)>> = Mutex::new(Vec::new());
    let lock = || idle.lock().expect("no task fails while it holds the lock");
    let tasks = faces.par_chunks(FACES_PER_TASK).map(|faces| {
        let tools = lock().pop();
        let (mut clipper, mut kept) =
            tools.unwrap_or_else(|| (Clipper::new(*context), T::default()));
        let mut pile = Pile::default();
        for &face in faces {
            clip(&mut clipper, &mut kept, face, &mut pile);
        }
        lock().push((clipper, kept));
        pile
    });
    tasks.collect()
}

/// The faces in the order of the cells they begin in: what is compared lies together.
pub(crate) fn by_place(context: &Context, faces: &[FaceId]) -> Vec<FaceId> {
    let cell_of = |face: FaceId| {
        let span = context.grid.span(&context.extents[face.index()]);
        context.grid.index(span.columns[0], span.rows[0]) as u32
    };
    let cells: Vec<Range<u32>> = faces
        .iter()
        .map(|&face| cell_of(face)..cell_of(face) + 1)
        .collect();
    let sorted = Buckets::new(context.grid.cells(), &cells);
    let in_order = (0..sorted.len()).flat_map(|cell| sorted.of(cell));
    in_order.map(|&index| faces[index as usize]).collect()
}
