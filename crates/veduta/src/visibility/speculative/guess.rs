//! The guess: how near the nearest surface is in each cell, seen through a coarse z-buffer.
//!
//! A face whose greatest nearness in a cell is below the cell's threshold is *guessed* to be hidden
//! there. The samples may miss a gap, so the guess may be wrong; `verify` finds out.

use crate::clip::{Extent, Grid, OPEN};
use rayon::prelude::*;
use veduta_geometry::{Affine, DVec2};
use veduta_map::{FaceId, Faces};

/// Share of the range of nearness around a cell that is taken off its threshold. Less would make
/// more wrong guesses, each costing a repair; more would hide fewer faces.
const SLACK: f32 = 0.25;

/// Thresholds of all cells, from `samples` by `samples` z-buffer samples a cell.
pub(super) fn thresholds(faces: &Faces, extents: &[Extent], grid: &Grid, samples: u32) -> Vec<f32> {
    // Each band of cell rows has its own z-buffer. A sample holds a maximum, so the bands change
    // nothing. Each looks at every face's extent, so one thread has one band; more have some each,
    // since what is to be drawn is often all in one half of the picture.
    let threads = rayon::current_num_threads();
    let bands = if threads == 1 { 1 } else { 4 * threads };
    let bands = bands.min(grid.rows as usize) as u32;
    let rows_of = |band: u32| band * grid.rows / bands..(band + 1) * grid.rows / bands;
    let parts: Vec<Vec<f32>> = (0..bands)
        .into_par_iter()
        .map(|band| {
            let rows = rows_of(band);
            let samples_grid = Grid {
                columns: grid.columns * samples,
                rows: grid.rows * samples,
                ..*grid
            };
            let first = (rows.start * samples).saturating_sub(1);
            let last = (rows.end * samples + 1).min(samples_grid.rows);
            let mut buffer = ZBuffer::new(samples_grid, first..last);
            for (index, extent) in extents.iter().enumerate() {
                let face = FaceId(index as u32);
                if buffer.reaches(extent) && !faces.is_veil(face) {
                    buffer.draw(faces.outline(face), faces.face_nearness(face));
                }
            }
            buffer.thresholds(rows, grid.columns, samples)
        })
        .collect();
    parts.concat()
}

/// Samples of some rows, each with the greatest nearness found there.
struct ZBuffer {
    width: usize,
    rows: std::ops::Range<usize>,
    /// Each cell has a sample in its middle.
    grid: Grid,
    scale: DVec2,
    samples: Vec<f32>,
}

impl ZBuffer {
    fn new(grid: Grid, rows: std::ops::Range<u32>) -> Self {
        Self {
            width: grid.columns as usize,
            rows: rows.start as usize..rows.end as usize,
            grid,
            scale: grid.scale(),
            samples: vec![OPEN; grid.columns as usize * (rows.end - rows.start) as usize],
        }
    }

    /// Whether a face of this extent can hold a sample of these rows.
    #[inline]
    fn reaches(&self, extent: &Extent) -> bool {
        let (top, scale) = (self.grid.top as f32, self.scale.y as f32);
        let first = ((extent.y[0] - top) * scale + 0.5) as usize;
        let last = ((extent.y[1] - top) * scale + 0.5) as usize;
        first < last && first < self.rows.end && last > self.rows.start
    }

    /// Draws a convex outline as a fan of triangles.
    fn draw(&mut self, outline: &[DVec2], plane: &Affine) {
        let plane = self.grid.plane(plane);
        let (origin, scale) = (self.grid.origin(), self.scale);
        let place = |point: DVec2| (point - origin) * scale;
        let first = place(outline[0]);
        for edge in outline[1..].windows(2) {
            self.draw_triangle([first, place(edge[0]), place(edge[1])], &plane);
        }
    }

    /// Draws a triangle given in samples.
    fn draw_triangle(&mut self, mut v: [DVec2; 3], plane: &Affine) {
        if v[1].y < v[0].y {
            v.swap(0, 1);
        }
        if v[2].y < v[1].y {
            v.swap(1, 2);
        }
        if v[1].y < v[0].y {
            v.swap(0, 1);
        }
        // Row r holds the samples at y = r + 1/2.
        let row_after = |y: f64| (y + 0.5) as usize;
        let first = row_after(v[0].y).max(self.rows.start);
        let last = row_after(v[2].y).min(self.rows.end);
        if first >= last {
            return;
        }
        let slope = |p: DVec2, q: DVec2| (q.x - p.x) / (q.y - p.y);
        let long = slope(v[0], v[2]);
        let short = [slope(v[0], v[1]), slope(v[1], v[2])];
        let step = plane.a as f32;
        for row in first..last {
            let y = row as f64 + 0.5;
            let x0 = v[0].x + (y - v[0].y) * long;
            let x1 = if y < v[1].y {
                v[0].x + (y - v[0].y) * short[0]
            } else {
                v[1].x + (y - v[1].y) * short[1]
            };
            let start = (x0.min(x1) + 0.5) as usize;
            let end = ((x0.max(x1) + 0.5) as usize).min(self.width);
            if start >= end {
                continue;
            }
            let mut nearness = plane.at(DVec2::new(start as f64 + 0.5, y)) as f32;
            let base = (row - self.rows.start) * self.width;
            for sample in &mut self.samples[base + start..base + end] {
                if nearness > *sample {
                    *sample = nearness;
                }
                nearness += step;
            }
        }
    }

    /// Thresholds of the cells in cell rows `rows`.
    ///
    /// A cell looks at its own samples and at those one further on each side.
    fn thresholds(&self, rows: std::ops::Range<u32>, columns: u32, samples: u32) -> Vec<f32> {
        let samples = samples as usize;
        let mut thresholds = Vec::with_capacity(rows.len() * columns as usize);
        let mut lowest = vec![0.0_f32; self.width];
        let mut highest = vec![0.0_f32; self.width];
        for row in rows {
            let first = (row as usize * samples)
                .saturating_sub(1)
                .max(self.rows.start);
            let last = ((row as usize + 1) * samples + 1).min(self.rows.end);
            lowest.fill(f32::INFINITY);
            highest.fill(OPEN);
            for line in first..last {
                let base = (line - self.rows.start) * self.width;
                let line = &self.samples[base..base + self.width];
                for ((low, high), &sample) in lowest.iter_mut().zip(&mut highest).zip(line) {
                    *low = low.min(sample);
                    *high = high.max(sample);
                }
            }
            for column in 0..columns as usize {
                let start = (column * samples).saturating_sub(1);
                let end = ((column + 1) * samples + 1).min(self.width);
                let low = lowest[start..end]
                    .iter()
                    .copied()
                    .fold(f32::INFINITY, f32::min);
                let high = highest[start..end].iter().copied().fold(OPEN, f32::max);
                thresholds.push(if low == OPEN {
                    OPEN
                } else {
                    low - SLACK * (high - low)
                });
            }
        }
        thresholds
    }
}
