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
    fragments: Buckets,
}

impl Bands {
    /// Sorts the fragments of `map` into the bands of `grid`.
    pub fn new(map: &VisibilityMap, grid: PixelGrid) -> Self {
        Self::of_fragments(map, grid, |_| true)
    }

    /// The same for the fragments that `wanted` accepts.
    pub fn of_fragments(
        map: &VisibilityMap,
        grid: PixelGrid,
        wanted: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        Self::sorted(map, grid, [0..grid.width, 0..grid.height], wanted)
    }

    /// The same for the fragments that may touch a pixel in these columns and rows. Other bands than
    /// those of the rows have none.
    pub fn within(map: &VisibilityMap, grid: PixelGrid, bounds: [Range<u32>; 2]) -> Self {
        Self::sorted(map, grid, bounds, |_| true)
    }

    fn sorted(
        map: &VisibilityMap,
        grid: PixelGrid,
        bounds: [Range<u32>; 2],
        wanted: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        assert!(
            grid.pixels_per_frame.cmpgt(DVec2::ZERO).all(),
            "a grid's scale is positive"
        );
        let count = grid.height.div_ceil(BAND_ROWS) as usize;
        let touched: Vec<Range<u32>> = (0..map.fragment_count())
            .into_par_iter()
            .with_min_len(1024)
            .map(|fragment| {
                if wanted(fragment) {
                    bands_touched(map, fragment, &grid, &bounds)
                } else {
                    0..0
                }
            })
            .collect();
        Self {
            grid,
            fragments: Buckets::new(count, &touched),
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
        let first = band as u32 * BAND_ROWS;
        first..(first + BAND_ROWS).min(self.grid.height)
    }

    /// Fragments that touch band `band`, ascending: opaque ones, then those of veils.
    pub fn fragments(&self, band: usize) -> &[u32] {
        self.fragments.of(band)
    }
}

/// The bands in which the box around a fragment touches the columns and rows of `bounds`, which are
/// some of the grid's.
fn bands_touched(
    map: &VisibilityMap,
    fragment: usize,
    grid: &PixelGrid,
    [columns, rows]: &[Range<u32>; 2],
) -> Range<u32> {
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
        return 0..0;
    }
    let first = min.y.max(top) as u32;
    let last = max.y.min(bottom - 1.0) as u32;
    first / BAND_ROWS..last / BAND_ROWS + 1
}
