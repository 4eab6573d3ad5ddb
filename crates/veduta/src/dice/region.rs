use crate::dice::{Bands, Dicer, Parts, PixelGrid, Run, dice};
use std::ops::Range;
use veduta_map::{FaceId, VisibilityMap};

/// Some of the pixels of a grid: those that are made, where the others stay.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    width: u32,
    /// Of each pixel of the grid, in rows from the top, whether it is one of them.
    pixels: Vec<bool>,
}

impl Region {
    /// None of the pixels of `grid`.
    pub fn none(grid: &PixelGrid) -> Self {
        Self {
            width: grid.width,
            pixels: vec![false; grid.pixel_count()],
        }
    }

    /// The pixels of `grid` in a window, as far as it lies in the grid.
    pub fn window(grid: &PixelGrid, columns: Range<u32>, rows: Range<u32>) -> Self {
        let mut region = Self::none(grid);
        let width = grid.width as usize;
        let columns = columns.start.min(grid.width)..columns.end.min(grid.width);
        for row in rows.start..rows.end.min(grid.height) {
            let first = row as usize * width;
            if !columns.is_empty() {
                region.pixels[first + columns.start as usize..first + columns.end as usize]
                    .fill(true);
            }
        }
        region
    }

    /// The pixels of `grid` that show something of the faces that `wanted` accepts, however little.
    pub fn of_faces(
        map: &VisibilityMap,
        grid: &PixelGrid,
        wanted: impl Fn(FaceId) -> bool + Sync,
    ) -> Self {
        let mut region = Self::none(grid);
        let bands = Bands::of_fragments(map, *grid, |fragment| wanted(map.face_of(fragment)));
        let (mut dicer, mut parts) = (Dicer::default(), Parts::default());
        for band in 0..bands.len() {
            dice(map, &bands, band, |_| false, &mut dicer, &mut parts);
            let first = bands.rows(band).start as usize * grid.width as usize;
            for part in &parts.boundary {
                region.pixels[first + part.pixel as usize] = true;
            }
            for run in &parts.runs {
                let Range { start, end } = run.pixels();
                region.pixels[first + start..first + end].fill(true);
            }
        }
        region
    }

    /// The pixels that are in this region or in `other`, of the same grid.
    pub fn or(mut self, other: &Self) -> Self {
        assert_eq!(self.pixels.len(), other.pixels.len(), "regions of one grid");
        for (pixel, other) in self.pixels.iter_mut().zip(&other.pixels) {
            *pixel |= other;
        }
        self
    }

    /// The pixels that are in this region and in `other`, of the same grid.
    pub fn and(mut self, other: &Self) -> Self {
        assert_eq!(self.pixels.len(), other.pixels.len(), "regions of one grid");
        for (pixel, other) in self.pixels.iter_mut().zip(&other.pixels) {
            *pixel &= other;
        }
        self
    }

    /// Number of its pixels.
    pub fn count(&self) -> usize {
        self.pixels.iter().filter(|&&is_in| is_in).count()
    }

    /// Of the grid's pixels, in rows from the top, whether they are in it.
    pub fn pixels(&self) -> &[bool] {
        &self.pixels
    }

    /// The columns and rows around it; nothing, if it is empty.
    pub fn bounds(&self) -> Option<[Range<u32>; 2]> {
        let width = self.width as usize;
        let (mut columns, mut rows) = (u32::MAX..0, u32::MAX..0);
        for (row, pixels) in self.pixels.chunks_exact(width).enumerate() {
            let Some(first) = pixels.iter().position(|&is_in| is_in) else {
                continue;
            };
            let last = pixels.iter().rposition(|&is_in| is_in).unwrap_or(first);
            columns = columns.start.min(first as u32)..columns.end.max(last as u32 + 1);
            rows = rows.start.min(row as u32)..row as u32 + 1;
        }
        (!rows.is_empty()).then_some([columns, rows])
    }

    /// Leaves of the parts of a band those in the region. `first_row` is the band's first.
    pub fn clip(&self, parts: &mut Parts, first_row: u32) {
        let of_band = &self.pixels[first_row as usize * self.width as usize..];
        parts.boundary.retain(|part| of_band[part.pixel as usize]);
        let mut kept = Vec::with_capacity(parts.runs.len());
        for run in &parts.runs {
            let mut pixel = run.pixel;
            for stretch in of_band[run.pixels()].chunk_by(|a, b| a == b) {
                let length = stretch.len() as u32;
                if stretch[0] {
                    let fragment = run.fragment;
                    kept.push(Run {
                        pixel,
                        length,
                        fragment,
                    });
                }
                pixel += length;
            }
        }
        parts.runs = kept;
    }
}
