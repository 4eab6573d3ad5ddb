//! Was the guess right? What was found seen must cover each cell in which a face was guessed to be
//! hidden, and be nearer there than anything that was guessed away.
//!
//! Then a hidden face is proved to be hidden: something found seen is in front of it everywhere.

use crate::clip::{Context, OPEN};
use std::sync::atomic::{AtomicI64, AtomicU32, Ordering};
use veduta_geometry::{Affine, Cells, DVec2, GridAreas, signed_area};

/// Units of coverage in a cell: sums of integers do not depend on their order, so tasks may add to
/// a cell as they come.
const COVERAGE_UNIT: f64 = (1_u64 << 48) as f64;

/// Share of a cell that may seem uncovered though it is covered: rounding. A gap that is smaller
/// cannot show a face by more than this share of a cell.
const COVERAGE_TOLERANCE: f64 = 2e-11;

/// What was found of the cells so far.
pub(super) struct Verification {
    coverage: Vec<AtomicI64>,
    /// Smallest nearness seen below the cell's threshold; in the order of [`ordered_bits`].
    lowest: Vec<AtomicU32>,
}

/// Bits of a number such that numbers and bits have the same order.
fn ordered_bits(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 0 {
        bits | 1 << 31
    } else {
        !bits
    }
}

fn from_ordered_bits(bits: u32) -> f32 {
    f32::from_bits(if bits >> 31 == 1 {
        bits & !(1 << 31)
    } else {
        !bits
    })
}

/// Buffers of one task.
#[derive(Default)]
pub(super) struct Scratch {
    areas: GridAreas,
    polygon: Vec<DVec2>,
    clipped: [Vec<DVec2>; 2],
}

impl Verification {
    pub fn new(cells: usize) -> Self {
        Self {
            coverage: (0..cells).map(|_| AtomicI64::new(0)).collect(),
            lowest: (0..cells).map(|_| AtomicU32::new(u32::MAX)).collect(),
        }
    }

    /// Forgets what was found of a cell.
    pub fn reset(&self, cell: usize) {
        self.coverage[cell].store(0, Ordering::Relaxed);
        self.lowest[cell].store(u32::MAX, Ordering::Relaxed);
    }

    /// Adds a polygon in which an opaque face with this plane is seen, in the cells for which
    /// `wanted` holds.
    pub fn add(
        &self,
        context: &Context,
        scratch: &mut Scratch,
        thresholds: &[f32],
        polygon: impl Iterator<Item = DVec2>,
        plane: &Affine,
        wanted: impl Fn(usize) -> bool,
    ) {
        let grid = context.grid;
        let (origin, scale) = (grid.origin(), grid.scale());
        let Scratch {
            areas,
            polygon: scaled,
            clipped,
        } = scratch;
        scaled.clear();
        scaled.extend(polygon.map(|point| (point - origin) * scale));
        let plane = grid.plane(plane);
        let (mut min, mut max, mut lowest) = (scaled[0], scaled[0], plane.at(scaled[0]));
        for &point in &scaled[1..] {
            min = min.min(point);
            max = max.max(point);
            lowest = lowest.min(plane.at(point));
        }

        // Many pieces lie in one cell, and have their area there and nowhere else.
        let (column, row) = (min.x as u32, min.y as u32);
        if max.x <= f64::from(column + 1) && max.y <= f64::from(row + 1) {
            let cell = grid.index(column.min(grid.columns - 1), row.min(grid.rows - 1));
            if wanted(cell) {
                self.cover(cell, signed_area(scaled));
                if lowest < f64::from(thresholds[cell]) {
                    self.see(cell, lowest);
                }
            }
            return;
        }

        areas.each_cell(scaled, grid.columns, 0..grid.rows, |cells| match cells {
            Cells::Boundary { column, row, area } => {
                let cell = grid.index(column, row);
                if wanted(cell) {
                    self.cover(cell, area);
                    let threshold = f64::from(thresholds[cell]);
                    if lowest < threshold && lower_bound(&plane, column, row) < threshold {
                        let nearness = lowest_in_cell(scaled, clipped, &plane, column, row);
                        if nearness < threshold {
                            self.see(cell, nearness);
                        }
                    }
                }
            }
            Cells::Inside { row, columns } => {
                for column in columns {
                    let cell = grid.index(column, row);
                    if wanted(cell) {
                        self.cover(cell, 1.0);
                        let nearness = lower_bound(&plane, column, row);
                        if nearness < f64::from(thresholds[cell]) {
                            self.see(cell, nearness);
                        }
                    }
                }
            }
        });
    }

    /// Adds to the covered share of a cell.
    #[inline(always)]
    fn cover(&self, cell: usize, area: f64) {
        // Areas are positive: cutting off after adding a half rounds, and is cheaper than `round`.
        let units = (area * COVERAGE_UNIT + 0.5) as i64;
        self.coverage[cell].fetch_add(units, Ordering::Relaxed);
    }

    /// Notes a nearness below the cell's threshold.
    #[cold]
    fn see(&self, cell: usize, nearness: f64) {
        // Rounded down, so that a threshold lowered to it is reached.
        let bits = ordered_bits((nearness as f32).next_down());
        self.lowest[cell].fetch_min(bits, Ordering::Relaxed);
    }

    /// Lowers the threshold of each cell of `cells` in which the guess was not proved right, and
    /// returns those cells.
    ///
    /// A cell that fails again is opened: nothing is guessed there any more. So this ends.
    pub fn lower_wrong_thresholds(
        &self,
        thresholds: &mut [f32],
        failed_before: &mut [bool],
        guessed: impl Fn(usize) -> bool,
    ) -> Vec<usize> {
        let full = (COVERAGE_UNIT * (1.0 - COVERAGE_TOLERANCE)) as i64;
        let mut wrong = Vec::new();
        for cell in 0..thresholds.len() {
            if thresholds[cell] == OPEN || !guessed(cell) {
                continue;
            }
            let covered = self.coverage[cell].load(Ordering::Relaxed) >= full;
            let lowest = self.lowest[cell].load(Ordering::Relaxed);
            if covered && lowest == u32::MAX {
                continue;
            }
            thresholds[cell] = if covered && !failed_before[cell] {
                from_ordered_bits(lowest)
            } else {
                OPEN
            };
            failed_before[cell] = true;
            wrong.push(cell);
        }
        wrong
    }
}

/// Smallest value of `plane` (over the grid) in a cell.
fn lower_bound(plane: &Affine, column: u32, row: u32) -> f64 {
    plane.at(DVec2::new(
        f64::from(column + u32::from(plane.a < 0.0)),
        f64::from(row + u32::from(plane.b < 0.0)),
    ))
}

/// Smallest value of `plane` on the part of `polygon` in a cell.
fn lowest_in_cell(
    polygon: &[DVec2],
    buffers: &mut [Vec<DVec2>; 2],
    plane: &Affine,
    column: u32,
    row: u32,
) -> f64 {
    let (left, top) = (f64::from(column), f64::from(row));
    let sides = [
        Affine::new(1.0, 0.0, -left),
        Affine::new(-1.0, 0.0, left + 1.0),
        Affine::new(0.0, 1.0, -top),
        Affine::new(0.0, -1.0, top + 1.0),
    ];
    let [kept, next] = buffers;
    kept.clear();
    kept.extend_from_slice(polygon);
    for side in sides {
        next.clear();
        for (index, &p) in kept.iter().enumerate() {
            let q = kept[(index + 1) % kept.len()];
            let (dp, dq) = (side.at(p), side.at(q));
            if dp >= 0.0 {
                next.push(p);
            }
            if (dp > 0.0 && dq < 0.0) || (dp < 0.0 && dq > 0.0) {
                next.push(p + (q - p) * (dp / (dp - dq)));
            }
        }
        std::mem::swap(kept, next);
    }
    kept.iter()
        .map(|&point| plane.at(point))
        .fold(f64::INFINITY, f64::min)
}
