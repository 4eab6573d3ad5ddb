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

    /// The same for the fragments that `wanted` accepts.
    pub fn of_fragments(
        map: &VisibilityMap,
        grid: PixelGrid,
        wanted: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        let all = [0..grid.width, 0..grid.height];
        Self::sorted(map, grid, [BAND_ROWS, 0], all, wanted)
    }

    /// The same for the fragments that may touch a pixel in these columns and rows. Other bands than
    /// those of the rows have none.
    pub fn within(map: &VisibilityMap, grid: PixelGrid, bounds: [Range<u32>; 2]) -> Self {
        Self::sorted(map, grid, [BAND_ROWS, 0], bounds, |_| true)
    }

    /// The same with bands that begin every `step` rows, each with `overlap` rows of those that follow.
    ///
    /// # Panics
    /// If `step` is 0, or the grid has no row beyond the overlap.
    pub fn overlapping(map: &VisibilityMap, grid: PixelGrid, step: u32, overlap: u32) -> Self {
        let all = [0..grid.width, 0..grid.height];
        Self::sorted(map, grid, [step, overlap], all, |_| true)
    }

    fn sorted(
        map: &VisibilityMap,
        grid: PixelGrid,
        [step, overlap]: [u32; 2],
        bounds: [Range<u32>; 2],
        wanted: impl Fn(usize) -> bool + Sync,
    ) -> Self {
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
                let touched = wanted(fragment)
                    .then(|| rows_touched(map, fragment, &grid, &bounds))
                    .flatten();
                let Some([first, last]) = touched else {
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

/// The first and the last row in which the box around a fragment touches the columns and rows of
/// `bounds`, which are some of the grid's; none if it does not.
fn rows_touched(
    map: &VisibilityMap,
    fragment: usize,
    grid: &PixelGrid,
    [columns, rows]: &[Range<u32>; 2],
) -> Option<[u32; 2]> {
    let polygon = map.polygon(map.fragment(fragment));
    let mut min = polygon[0];
    let mut max = polygon[0];
    for &vertex in &polygon[1..] {
        min = min.min(vertex);
        max = max.max(vertex);
    }
    let min = grid.pixels_from_image(min);
    let max = grid.pixels_from_image(max);
    let [left, right] = [columns.start, columns.end].map(f64::from);
    let [top, bottom] = [rows.start, rows.end].map(f64::from);
    if min.x >= right || max.x <= left || min.y >= bottom || max.y <= top {
        return None;
    }
    let first = min.y.max(top) as u32;
    let last = max.y.min(bottom - 1.0) as u32;
    Some([first, last])
}
