//! Which faces may be seen, and in which cells they may hide others.

use super::clipper::Context;
use super::grid::{CellSet, Extent};
use rayon::prelude::*;
use veduta_map::FaceId;
use wide::f32x8;

/// The threshold of a cell in which nothing is guessed to be hidden.
pub(crate) const OPEN: f32 = f32::NEG_INFINITY;

/// How many faces are compared at once.
pub(crate) const LANES: usize = 8;

/// The faces that are not guessed to be hidden in a cell, for every cell.
///
/// Columns in cell order, so that a cell's extents are read as a stream; the bounds that `overlaps`
/// compares are stored, and no more. Veils hide nothing: they are listed only on demand.
pub(crate) struct CellLists {
    start: Vec<u32>,
    face: Vec<u32>,
    left: Vec<f32>,
    right: Vec<f32>,
    top: Vec<f32>,
    bottom: Vec<f32>,
    nearest: Vec<f32>,
    /// The map that the face is of, a number that is exact in single precision; empty where all are of one.
    map: Vec<f32>,
    /// Whether a face was guessed to be hidden in the cell.
    guessed: Vec<bool>,
}

/// Faces a task looks at at a time.
const FACES_PER_TASK: usize = 8192;

/// A nearness this much below a threshold, relative to its size, still counts as reaching it, so
/// that rounding never hides a face that `verify` would have found seen.
const THRESHOLD_MARGIN: f64 = 1e-6;

/// Whether a face that is at most `nearness` near in a cell may be seen there.
#[inline]
fn reaches(nearness: f64, threshold: f32) -> bool {
    let threshold = f64::from(threshold);
    nearness >= threshold - threshold.abs() * THRESHOLD_MARGIN || threshold == f64::from(OPEN)
}

/// The faces that may be seen somewhere, ascending, and where.
///
/// With the thresholds before they were lowered, and the cells in which they were: only what those
/// left out and `thresholds` let in.
pub(crate) fn listed_between(
    context: &Context,
    before: Option<(&[f32], &CellSet)>,
    thresholds: &[f32],
) -> (Vec<FaceId>, CellLists) {
    let count = context.faces.len();
    let chunks: Vec<Chunk> = (0..count.div_ceil(FACES_PER_TASK))
        .into_par_iter()
        .map(|chunk| {
            let start = chunk * FACES_PER_TASK;
            let end = (start + FACES_PER_TASK).min(count);
            Chunk::list(context, before, thresholds, start..end)
        })
        .collect();
    let cells = context.grid.cells();
    let mut guessed = vec![false; cells];
    for &cell in chunks.iter().flat_map(|chunk| &chunk.guessed) {
        guessed[cell as usize] = true;
    }
    let lists = CellLists::gather(cells, &chunks, context.extents, guessed);
    let faces = chunks
        .iter()
        .flat_map(|chunk| &chunk.faces)
        .copied()
        .collect();
    (faces, lists)
}

/// The faces that `wanted` accepts, in the cells that they touch and `meets` tells of; `map` is the map
/// that each is of.
pub(crate) fn listed_of_maps(
    context: &Context,
    wanted: impl Fn(FaceId) -> bool + Sync,
    meets: &[bool],
    map: impl Fn(FaceId) -> u32 + Sync,
) -> CellLists {
    let Context {
        faces,
        extents,
        grid,
    } = *context;
    let count = faces.len();
    let chunks: Vec<Chunk> = (0..count.div_ceil(FACES_PER_TASK))
        .into_par_iter()
        .map(|chunk| {
            let range = chunk * FACES_PER_TASK..((chunk + 1) * FACES_PER_TASK).min(count);
            let mut chunk = Chunk::default();
            for (face, extent) in range.clone().zip(&extents[range]) {
                let face = FaceId::from_index(face);
                if !wanted(face) {
                    continue;
                }
                grid.each_row(faces.outline(face), extent, |row, columns| {
                    let cells = columns.map(|column| grid.index(column, row));
                    let cells = cells.filter(|&cell| meets[cell]);
                    chunk.listed.extend(cells.map(|cell| (cell as u32, face.0)));
                    true
                });
            }
            chunk
        })
        .collect();
    let cells = grid.cells();
    let mut lists = CellLists::gather(cells, &chunks, extents, vec![false; cells]);
    lists.map = lists.column(|face| map(FaceId(face)) as f32);
    lists
}

/// What one task lists.
#[derive(Default)]
struct Chunk {
    faces: Vec<FaceId>,
    /// `(cell, face)`, by face.
    listed: Vec<(u32, u32)>,
    /// Cells in which a face was guessed to be hidden.
    guessed: Vec<u32>,
}

impl Chunk {
    fn list(
        context: &Context,
        before: Option<(&[f32], &CellSet)>,
        thresholds: &[f32],
        range: std::ops::Range<usize>,
    ) -> Self {
        let Context {
            faces,
            extents,
            grid,
        } = *context;
        let mut chunk = Self::default();
        for index in range {
            let face = FaceId(index as u32);
            let extent = &extents[index];
            if before.is_some_and(|(_, lowered)| !lowered.meets(&grid.span(extent))) {
                continue;
            }
            let nearest = f64::from(extent.nearness[1]);
            let plane = faces.face_nearness(face);
            let is_veil = faces.is_veil(face);
            let mut admitted = false;
            grid.each_row(faces.outline(face), extent, |row, columns| {
                for column in columns {
                    let cell = grid.index(column, row);
                    if before.is_some_and(|(_, lowered)| !lowered.contains(cell)) {
                        continue;
                    }
                    let reaches = |threshold: f32| {
                        reaches(nearest, threshold)
                            && reaches(grid.upper_bound(plane, column, row), threshold)
                    };
                    if !reaches(thresholds[cell]) {
                        if chunk.guessed.last() != Some(&(cell as u32)) {
                            chunk.guessed.push(cell as u32);
                        }
                    } else if !before.is_some_and(|(before, _)| reaches(before[cell])) {
                        admitted = true;
                        if !is_veil {
                            chunk.listed.push((cell as u32, index as u32));
                        }
                    }
                }
                true
            });
            if admitted {
                chunk.faces.push(face);
            }
        }
        chunk
    }
}

impl CellLists {
    fn gather(cells: usize, chunks: &[Chunk], extents: &[Extent], guessed: Vec<bool>) -> Self {
        // A counting sort by cell; within a cell faces stay in order.
        let mut start = vec![0_u32; cells + 1];
        for &(cell, _) in chunks.iter().flat_map(|chunk| &chunk.listed) {
            start[cell as usize + 1] += 1;
        }
        for cell in 0..cells {
            start[cell + 1] += start[cell];
        }
        let entries = start[cells] as usize;
        let mut face = vec![0_u32; entries];
        let mut next = start.clone();
        for &(cell, id) in chunks.iter().flat_map(|chunk| &chunk.listed) {
            let place = &mut next[cell as usize];
            face[*place as usize] = id;
            *place += 1;
        }
        let mut lists = Self {
            start,
            face,
            guessed,
            left: Vec::new(),
            right: Vec::new(),
            top: Vec::new(),
            bottom: Vec::new(),
            nearest: Vec::new(),
            map: Vec::new(),
        };
        let extent = |face: u32| &extents[face as usize];
        lists.left = lists.column(|face| extent(face).x[0]);
        lists.right = lists.column(|face| extent(face).x[1]);
        lists.top = lists.column(|face| extent(face).y[0]);
        lists.bottom = lists.column(|face| extent(face).y[1]);
        lists.nearest = lists.column(|face| extent(face).nearness[1]);
        lists
    }

    /// A column; padded, so that the last cell too can be read LANES at a time.
    fn column(&self, value: impl Fn(u32) -> f32 + Sync) -> Vec<f32> {
        let entries = self.face.len();
        let mut column: Vec<f32> = Vec::with_capacity(entries + LANES);
        self.face
            .par_iter()
            .with_min_len(16 * 1024)
            .map(|&face| value(face))
            .collect_into_vec(&mut column);
        column.resize(entries + LANES, 0.0);
        column
    }

    /// Whether a face was guessed to be hidden in the cell.
    pub fn guessed(&self, cell: usize) -> bool {
        self.guessed[cell]
    }

    /// Calls `visit` with the faces of a cell whose box overlaps that of `extent` and which are, at
    /// their nearest, nearer than it is at its farthest; not with those of the map `own`. `visit` returns
    /// whether to go on.
    #[inline]
    pub fn overlapping(
        &self,
        cell: usize,
        extent: &Extent,
        own: Option<u32>,
        mut visit: impl FnMut(FaceId) -> bool,
    ) -> bool {
        let load = |column: &[f32], at: usize| {
            let lanes: [f32; LANES] = column[at..at + LANES]
                .try_into()
                .expect("a slice of this length");
            f32x8::from(lanes)
        };
        let [left, right] = extent.x.map(f32x8::splat);
        let [top, bottom] = extent.y.map(f32x8::splat);
        let farthest = f32x8::splat(extent.nearness[0]);
        let (start, end) = (self.start[cell] as usize, self.start[cell + 1] as usize);
        for at in (start..end).step_by(LANES) {
            let mut overlaps = load(&self.left, at).simd_lt(right)
                & load(&self.right, at).simd_gt(left)
                & load(&self.top, at).simd_lt(bottom)
                & load(&self.bottom, at).simd_gt(top)
                & load(&self.nearest, at).simd_ge(farthest);
            if let Some(own) = own {
                overlaps &= load(&self.map, at).simd_ne(f32x8::splat(own as f32));
            }
            let in_cell = (1_u32 << (end - at).min(LANES)) - 1;
            let mut mask = overlaps.to_bitmask() & in_cell;
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                if !visit(FaceId(self.face[at + lane])) {
                    return false;
                }
            }
        }
        true
    }
}
