use crate::buckets::Buckets;
use crate::dice::PixelGrid;
use rayon::prelude::*;
use std::ops::Range;
use veduta_geometry::DVec2;
use veduta_map::VisibilityMap;

/// Rows of pixels in a band. More would leave cores idle and caches full on large pictures; fewer
/// would visit fragments more often, once for each band that they touch.
pub const BAND_ROWS: u32 = 16;

/// Which fragments touch which band of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Bands {
    grid: PixelGrid,
    /// From the first row of a band to that of the next.
    step: u32,
    /// Rows that a band has in common with the next.
    overlap: u32,
    fragments: Buckets,
}

impl Bands {
    /// Sorts the fragments of `map` into the bands of `grid`.
    pub fn new(map: &VisibilityMap, grid: PixelGrid) -> Self {
        Self::overlapping(map, grid, BAND_ROWS, 0)
    }

    /// The same with bands that begin every `step` rows, each with `overlap` rows of those that follow.
    ///
    /// # Panics
    /// If `step` is 0, or the grid has no row beyond the overlap.
    pub fn overlapping(map: &VisibilityMap, grid: PixelGrid, step: u32, overlap: u32) -> Self {
        assert!(
            step > 0 && grid.height > overlap,
            "a band has rows of its own"
        );
        assert!(
            grid.pixels_per_frame.cmpgt(DVec2::ZERO).all(),
            "a grid's scale is positive"
        );
        let count = (grid.height - overlap).div_ceil(step);
        let touched: Vec<Range<u32>> = (0..map.fragment_count())
            .into_par_iter()
            .with_min_len(1024)
            .map(|fragment| {
                let Some([first, last]) = rows_touched(map, fragment, &grid) else {
                    return 0..0;
                };
                first.saturating_sub(overlap) / step..(last / step + 1).min(count)
            })
            .collect();
        Self {
            grid,
            step,
            overlap,
            fragments: Buckets::new(count as usize, &touched),
        }
    }

    /// The grid that is cut into bands.
    pub fn grid(&self) -> &PixelGrid {
        &self.grid
    }

    /// Number of bands.
    pub fn len(&self) -> usize {
        self.fragments.len()
    }

    /// Whether there are no bands. There is always one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Rows of the grid in band `band`.
    pub fn rows(&self, band: usize) -> Range<u32> {
        let first = band as u32 * self.step;
        first..(first + self.step + self.overlap).min(self.grid.height)
    }

    /// Fragments that touch band `band`, ascending: opaque ones, then those of veils.
    pub fn fragments(&self, band: usize) -> &[u32] {
        self.fragments.of(band)
    }
}

/// The first and the last row that the box around a fragment touches; none if it lies outside the grid.
fn rows_touched(map: &VisibilityMap, fragment: usize, grid: &PixelGrid) -> Option<[u32; 2]> {
    let polygon = map.polygon(map.fragment(fragment));
    let mut min = polygon[0];
    let mut max = polygon[0];
    for &vertex in &polygon[1..] {
        min = min.min(vertex);
        max = max.max(vertex);
    }
    let min = grid.pixels_from_image(min);
    let max = grid.pixels_from_image(max);
    let (width, height) = (f64::from(grid.width), f64::from(grid.height));
    if min.x >= width || max.x <= 0.0 || min.y >= height || max.y <= 0.0 {
        return None;
    }
    let first = min.y.max(0.0) as u32;
    let last = max.y.min(height - 1.0) as u32;
    Some([first, last])
}
