//! Dicing: visibility map + pixel grid -> pixel parts.
//!
//! A part is what one fragment covers of one pixel: an exact area, and where it lies. Nothing here
//! knows colours. The map has no resolution; [`PixelGrid`] lays the pixels on its image plane, and any
//! other grid on the same map (larger, unequally scaled, a window of it) dices without visibility
//! being found again.
//!
//! Steps:
//!
//! 1. [`Bands`] cuts the grid into bands of [`BAND_ROWS`] rows, whatever the number of threads, and
//!    sorts the fragments into them. Bands own their pixels and can be worked on in any order.
//! 2. [`dice`] walks the fragments of a band in order, so that the parts of a pixel always come in
//!    the order of fragments and sums over them are the same in every run.
//!
//! [`dice_spans`] does the same for what multiscan found. [`sum_by_face`] tells which faces a pixel
//! shows, for all that is not light. [`coverage`] gives the areas in f64, for measuring; [`Depths`] how
//! deep parts reach, for deep pictures. [`Region`] are the pixels that are made where only some are.

mod bands;
mod coverage;
mod depth;
mod pixel_grid;
mod place;
mod region;
mod shares;
mod spans;

pub use bands::{BAND_ROWS, Bands};
pub use coverage::{Coverage, coverage};
pub use depth::{DepthRange, Depths, depth_of_nearness};
pub use pixel_grid::PixelGrid;
pub use region::Region;
pub use shares::{Share, largest, sum_by_face};
pub use spans::{SpanDicer, dice_spans};

use place::Placer;
use std::ops::Range;
use veduta_geometry::{Cells, GridAreas, Vec2};
use veduta_map::VisibilityMap;

/// What a fragment covers of a pixel that it does not fill, or fills just so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// The pixel, counted from the band's first one: row in the band * width + column.
    pub pixel: u32,
    /// Index of the fragment in [`VisibilityMap::opaque`].
    pub fragment: u32,
    /// Area in square pixels.
    pub area: f32,
    /// Centroid of the area in pixels from the pixel's top left corner, if it was asked for;
    /// otherwise the pixel's centre.
    pub centroid: Vec2,
}

/// Pixels of a row that a fragment fills.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The first pixel, counted from the band's first one.
    pub pixel: u32,
    /// Number of pixels, at least 1.
    pub length: u32,
    /// Index of the fragment in [`VisibilityMap::opaque`].
    pub fragment: u32,
}

impl Run {
    /// The run's pixels, counted from the band's first one.
    pub fn pixels(&self) -> Range<usize> {
        self.pixel as usize..(self.pixel + self.length) as usize
    }
}

/// The parts of a band, in order of fragments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// Pixels that are covered partly.
    pub boundary: Vec<Part>,
    /// Pixels that are covered wholly.
    pub runs: Vec<Run>,
}

/// Buffers that [`dice`] keeps from band to band.
#[derive(Clone, Debug, Default)]
pub struct Dicer {
    placer: Placer,
    grid_areas: GridAreas,
}

/// Dices the opaque fragments of band `band`; `parts` is overwritten.
///
/// `varies` says of a fragment whether its radiance varies over it. Only then centroids are found,
/// which take about half as long again as areas.
pub fn dice(
    map: &VisibilityMap,
    bands: &Bands,
    band: usize,
    varies: impl Fn(u32) -> bool,
    dicer: &mut Dicer,
    parts: &mut Parts,
) {
    parts.boundary.clear();
    parts.runs.clear();
    let grid = bands.grid();
    let rows = bands.rows(band);
    let index_of = |column: u32, row: u32| (row - rows.start) * grid.width + column;
    for &fragment in bands.fragments(band) {
        let polygon = dicer.placer.place(map, grid, fragment);
        let areas = &mut dicer.grid_areas;
        let runs = &mut parts.runs;
        let mut push_run = |row: u32, columns: Range<u32>| {
            runs.push(Run {
                pixel: index_of(columns.start, row),
                length: columns.end - columns.start,
                fragment,
            });
        };
        if varies(fragment) {
            areas.each_cell_with_moments(polygon, grid.width, rows.clone(), |cells| match cells {
                Cells::Boundary { column, row, area } => parts.boundary.push(Part {
                    pixel: index_of(column, row),
                    fragment,
                    area: area.area as f32,
                    centroid: area.centroid().as_vec2(),
                }),
                Cells::Inside { row, columns } => push_run(row, columns),
            });
        } else {
            areas.each_cell(polygon, grid.width, rows.clone(), |cells| match cells {
                Cells::Boundary { column, row, area } => parts.boundary.push(Part {
                    pixel: index_of(column, row),
                    fragment,
                    area: area as f32,
                    centroid: Vec2::splat(0.5),
                }),
                Cells::Inside { row, columns } => push_run(row, columns),
            });
        }
    }
}

#[cfg(test)]
mod tests;
