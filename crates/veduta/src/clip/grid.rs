//! The cells of the frame, and what is known of a face before its outline is looked at.

use rayon::prelude::*;
use std::ops::RangeInclusive;
use veduta_geometry::{Affine, DVec2};
use veduta_map::{FaceId, Faces};

/// Bounds of a face in the image plane and of its nearness, rounded outwards.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub x: [f32; 2],
    pub y: [f32; 2],
    pub nearness: [f32; 2],
}

/// Added to both sides of a bound that is rounded to f32: more than what rounding does to it, to the
/// top of the grid and to their difference in the frame. A larger one would only cost time.
const COORDINATE_MARGIN: f32 = 2.5e-7;
/// The same for nearness, relative to its size.
const NEARNESS_MARGIN: f64 = 2e-7;

impl Extent {
    /// The extent of a face.
    pub fn of(faces: &Faces, face: FaceId) -> Self {
        let plane = faces.face_nearness(face);
        let mut min = DVec2::INFINITY;
        let mut max = DVec2::NEG_INFINITY;
        let mut nearness = [f64::INFINITY, f64::NEG_INFINITY];
        for &vertex in faces.outline(face) {
            min = min.min(vertex);
            max = max.max(vertex);
            let value = plane.at(vertex);
            nearness = [nearness[0].min(value), nearness[1].max(value)];
        }
        let [low, high] = nearness;
        Self {
            x: [
                min.x as f32 - COORDINATE_MARGIN,
                max.x as f32 + COORDINATE_MARGIN,
            ],
            y: [
                min.y as f32 - COORDINATE_MARGIN,
                max.y as f32 + COORDINATE_MARGIN,
            ],
            nearness: [
                (low - low.abs() * NEARNESS_MARGIN) as f32,
                (high + high.abs() * NEARNESS_MARGIN) as f32,
            ],
        }
    }

    /// The extents of all faces, by [`FaceId`].
    pub fn of_all(faces: &Faces) -> Vec<Self> {
        (0..faces.len() as u32)
            .into_par_iter()
            .with_min_len(4096)
            .map(|index| Self::of(faces, FaceId(index)))
            .collect()
    }
}

/// A regular grid of cells over a strip of the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    pub columns: u32,
    pub rows: u32,
    /// The strip's top in the image plane.
    pub top: f64,
    /// The strip's height.
    pub height: f64,
}

/// Cells a face may touch: all of a box of cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub columns: [u32; 2],
    pub rows: [u32; 2],
}

impl Span {
    /// Whether every cell of the box may be taken as touched; looking closer would cost more than
    /// the cells it saved.
    fn is_small(&self) -> bool {
        self.columns[1] - self.columns[0] <= 1 && self.rows[1] - self.rows[0] <= 1
    }
}

/// Faces for each cell, by default.
const FACES_PER_CELL: f64 = 8.0;

impl Grid {
    /// A grid for `faces` faces in a strip of the frame, of cells that are about square; `cells` of them,
    /// about, if told.
    pub fn choose(faces: usize, aspect: f64, [top, bottom]: [f64; 2], cells: Option<u32>) -> Self {
        let cells = cells.map_or_else(
            || (faces as f64 / FACES_PER_CELL).clamp(1024.0, 1024.0 * 1024.0),
            |cells| f64::from(cells.max(1)),
        );
        let height = bottom - top;
        let columns = (cells * aspect / height).sqrt().round().clamp(1.0, 16384.0);
        let rows = (cells / columns).round().clamp(1.0, 16384.0);
        Self {
            columns: columns as u32,
            rows: rows as u32,
            top,
            height,
        }
    }

    pub fn cells(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    #[inline]
    pub fn index(&self, column: u32, row: u32) -> usize {
        row as usize * self.columns as usize + column as usize
    }

    /// The grid's top left corner in the image plane.
    pub fn origin(&self) -> DVec2 {
        DVec2::new(0.0, self.top)
    }

    /// Scale from the image plane to cells.
    pub fn scale(&self) -> DVec2 {
        DVec2::new(f64::from(self.columns), f64::from(self.rows) / self.height)
    }

    /// A plane over the image plane as a function of places on the grid, where cells have unit size.
    pub fn plane(&self, plane: &Affine) -> Affine {
        let scale = self.scale();
        Affine::new(
            plane.a / scale.x,
            plane.b / scale.y,
            plane.c + plane.b * self.top,
        )
    }

    /// The box of cells that an extent touches.
    #[inline]
    pub fn span(&self, extent: &Extent) -> Span {
        let cell = |value: f32, cells: u32| ((value * cells as f32) as u32).min(cells - 1);
        let (top, height) = (self.top as f32, self.height as f32);
        Span {
            columns: extent.x.map(|x| cell(x, self.columns)),
            rows: extent.y.map(|y| cell((y - top) / height, self.rows)),
        }
    }

    /// Calls `visit` with each row and the columns in which the outline touches cells of that row.
    ///
    /// Conservative: a cell that is only touched by the rounding of the outline may be included,
    /// one that the outline enters is never left out. `visit` returns whether to go on.
    #[inline]
    pub fn each_row(
        &self,
        outline: &[DVec2],
        extent: &Extent,
        mut visit: impl FnMut(u32, RangeInclusive<u32>) -> bool,
    ) {
        let span = self.span(extent);
        let [first, last] = span.columns;
        for row in span.rows[0]..=span.rows[1] {
            let columns = if span.is_small() {
                first..=last
            } else {
                let (low, high) = self.reach_in_row(outline, row);
                if low > high {
                    continue;
                }
                let cell = |x: f64| ((x * f64::from(self.columns)) as u32).clamp(first, last);
                cell(low - ROW_MARGIN)..=cell(high + ROW_MARGIN)
            };
            if !visit(row, columns) {
                return;
            }
        }
    }

    /// Smallest and largest x of the outline within a row of cells.
    fn reach_in_row(&self, outline: &[DVec2], row: u32) -> (f64, f64) {
        let height = self.height / f64::from(self.rows);
        let top = self.top + f64::from(row) * height - ROW_MARGIN;
        let bottom = self.top + f64::from(row + 1) * height + ROW_MARGIN;
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut previous = outline[outline.len() - 1];
        for &next in outline {
            let (upper, lower) = if previous.y <= next.y {
                (previous, next)
            } else {
                (next, previous)
            };
            if upper.y <= bottom && lower.y >= top {
                let slope = (lower.x - upper.x) / (lower.y - upper.y);
                let at = |y: f64| {
                    if y <= upper.y {
                        upper.x
                    } else if y >= lower.y {
                        lower.x
                    } else {
                        upper.x + (y - upper.y) * slope
                    }
                };
                let (a, b) = (at(top), at(bottom));
                low = low.min(a).min(b);
                high = high.max(a).max(b);
            }
            previous = next;
        }
        (low, high)
    }

    /// Upper bound of `plane` over a cell.
    #[inline]
    pub fn upper_bound(&self, plane: &Affine, column: u32, row: u32) -> f64 {
        let corner = DVec2::new(
            f64::from(column + u32::from(plane.a > 0.0)),
            f64::from(row + u32::from(plane.b > 0.0)),
        );
        plane.at(corner / self.scale() + self.origin())
    }
}

/// Some cells of a grid, and an answer to "is any of them in this box" that costs four look-ups.
pub(crate) struct CellSet {
    columns: usize,
    marked: Vec<bool>,
    /// Number of marked cells above and left of each corner of cells.
    before: Vec<u32>,
}

impl CellSet {
    pub fn new(grid: &Grid, marked: Vec<bool>) -> Self {
        let columns = grid.columns as usize;
        let mut before = vec![0; (columns + 1) * (grid.rows as usize + 1)];
        for (row, cells) in marked.chunks(columns).enumerate() {
            let (above, here) = before[row * (columns + 1)..].split_at_mut(columns + 1);
            let mut in_row = 0;
            for (column, &marked) in cells.iter().enumerate() {
                in_row += u32::from(marked);
                here[column + 1] = above[column + 1] + in_row;
            }
        }
        Self {
            columns,
            marked,
            before,
        }
    }

    #[inline]
    pub fn contains(&self, cell: usize) -> bool {
        self.marked[cell]
    }

    /// All marked cells.
    pub fn cells(&self) -> impl Iterator<Item = usize> {
        let cells = self.marked.iter().enumerate();
        cells.filter_map(|(cell, &marked)| marked.then_some(cell))
    }

    /// Whether a cell of the box is marked.
    #[inline]
    pub fn meets(&self, span: &Span) -> bool {
        let at = |column: u32, row: u32| {
            self.before[row as usize * (self.columns + 1) + column as usize]
        };
        let [left, right] = [span.columns[0], span.columns[1] + 1];
        let [top, bottom] = [span.rows[0], span.rows[1] + 1];
        at(right, bottom) + at(left, top) != at(left, bottom) + at(right, top)
    }
}

/// How far beyond a row of cells an outline counts as touching it: rounding of image coordinates.
const ROW_MARGIN: f64 = 1e-12;
