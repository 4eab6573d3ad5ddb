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
//! 3. Where veils (faces that are not fully opaque) are seen, [`attenuate`] makes of each part's area what
//!    is left of it behind the veils before it, once their opacities are known.
//!
//! [`GuestDicer`] does that where pictures of other programs are seen too, whose samples have depths.
//!
//! Where a picture is made of patches, each a small perspective picture of its own (domes, panoramas),
//! [`PatchDicer`] does the same.
//!
//! For filters that reach beyond a pixel the same is done on cells around it, with all moments of parts instead
//! of areas ([`CellParts`], [`PixelGrid::between_centres`]).
//!
//! [`dice_spans`] does the same for what multiscan found. [`sum_by_face`] tells which faces a pixel
//! shows, for all that is not light. [`coverage`] gives the areas in f64, for measuring; [`Depths`] how
//! deep parts reach, for deep pictures. [`Region`] are the pixels that are made where only some are.

mod bands;
mod coverage;
mod depth;
mod fragment_index;
mod guests;
mod measure;
mod patched;
mod pixel_grid;
mod place;
mod region;
mod shares;
mod spans;
mod tidy;
mod veils;

pub use bands::{BAND_ROWS, Bands};
pub use coverage::{Coverage, coverage};
pub use depth::{DepthRange, Depths, depth_of_nearness};
pub use guests::{GuestBuffers, GuestDicer, GuestLight};
pub use measure::{CellParts, Diced, Measure};
pub use patched::{
    PatchDicer, PatchedBand, PatchedParts, PatchedView, attenuate_patched, patched_coverage,
};
pub use pixel_grid::PixelGrid;
pub use region::Region;
pub use shares::{Share, largest, sum_by_face};
pub use spans::{SpanDicer, dice_spans};
pub use veils::{VeilBuffers, attenuate};

use place::Placer;
use std::ops::Range;
use veduta_geometry::{Cells, Vec2};
use veduta_map::VisibilityMap;

/// What a fragment covers of a pixel that it does not fill, or fills just so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// The pixel, counted from the band's first one: row in the band * width + column.
    pub pixel: u32,
    /// The [fragment](VisibilityMap::fragment).
    pub fragment: u32,
    /// Area in square pixels; from [`attenuate`] on, the integral over it of what is seen of the
    /// fragment: the transmittance of the veils before it, times its own opacity.
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
    /// The [fragment](VisibilityMap::fragment), an opaque one.
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
    /// Pixels that are covered partly, and all pixels that veils touch. Those of veils come last.
    pub boundary: Vec<Part>,
    /// Pixels that are covered wholly, and that no veil touches.
    pub runs: Vec<Run>,
}

/// Buffers that [`dice`] keeps from band to band.
#[derive(Clone, Debug, Default)]
pub struct Dicer<D: Diced = Parts> {
    placer: Placer,
    finder: D::Finder,
    veils: D,
    /// Whether a veil touches a pixel of the band; empty if there is none.
    veiled: Vec<bool>,
}

/// Dices the fragments of band `band`; `diced` is overwritten.
///
/// `varies` says of a fragment whether its radiance varies over it. Only then, and for veils,
/// centroids are found, which take about half as long again as areas.
pub fn dice<D: Diced>(
    map: &VisibilityMap,
    bands: &Bands,
    band: usize,
    varies: impl Fn(u32) -> bool,
    dicer: &mut Dicer<D>,
    diced: &mut D,
) {
    diced.clear();
    let grid = bands.grid();
    let rows = bands.rows(band);
    let index_of = |column: u32, row: u32| (row - rows.start) * grid.width + column;
    let fragments = bands.fragments(band);
    let first_veil = fragments.partition_point(|&k| (k as usize) < map.opaque.len());
    let (opaque, veils) = fragments.split_at(first_veil);
    // First, since they say where opaque fragments do not come in runs.
    dicer.dice_veils(map, bands, band, veils);
    for &fragment in opaque {
        let polygon = dicer.placer.place(map, grid, fragment);
        let veiled = &dicer.veiled;
        let visit = |cells: Cells<(D::Measure, Vec2)>| match cells {
            Cells::Boundary { column, row, area } => {
                let part = Part::new(index_of(column, row), fragment, &area);
                diced.push(part, area.0);
            }
            Cells::Inside { row, columns } => {
                let pixels = index_of(columns.start, row)..index_of(columns.end, row);
                if veiled.is_empty() {
                    push_run(&mut diced.parts_mut().runs, fragment, pixels);
                } else {
                    push_between_veils(diced, fragment, pixels, veiled);
                }
            }
        };
        let finder = &mut dicer.finder;
        D::each_cell(
            finder,
            polygon,
            grid.width,
            rows.clone(),
            varies(fragment),
            visit,
        );
    }
    diced.append(&mut dicer.veils);
}

/// Adds a run of pixels, if there are any.
fn push_run(runs: &mut Vec<Run>, fragment: u32, pixels: Range<u32>) {
    if !pixels.is_empty() {
        runs.push(Run {
            pixel: pixels.start,
            length: pixels.end - pixels.start,
            fragment,
        });
    }
}

/// Adds pixels that a fragment fills: those that a veil touches one by one, the others in runs. Not
/// inlined, since few bands have veils and all go through what calls it.
#[inline(never)]
fn push_between_veils<D: Diced>(diced: &mut D, fragment: u32, pixels: Range<u32>, veiled: &[bool]) {
    let mut start = pixels.start;
    for pixel in pixels.clone() {
        if veiled[pixel as usize] {
            push_run(&mut diced.parts_mut().runs, fragment, start..pixel);
            diced.push(Part::whole(pixel, fragment), D::Measure::whole());
            start = pixel + 1;
        }
    }
    push_run(&mut diced.parts_mut().runs, fragment, start..pixels.end);
}

impl Part {
    #[inline(always)]
    fn new<M: Measure>(pixel: u32, fragment: u32, (measure, centroid): &(M, Vec2)) -> Self {
        Self {
            pixel,
            fragment,
            area: measure.area() as f32,
            centroid: *centroid,
        }
    }

    /// All of a pixel.
    fn whole(pixel: u32, fragment: u32) -> Self {
        Self {
            pixel,
            fragment,
            area: 1.0,
            centroid: Vec2::splat(0.5),
        }
    }
}

impl<D: Diced> Dicer<D> {
    /// Dices the fragments of veils, and marks the pixels that they touch.
    fn dice_veils(&mut self, map: &VisibilityMap, bands: &Bands, band: usize, veils: &[u32]) {
        let Self {
            placer,
            finder,
            veils: diced,
            veiled,
        } = self;
        diced.clear();
        veiled.clear();
        if veils.is_empty() {
            return;
        }
        let grid = bands.grid();
        let rows = bands.rows(band);
        veiled.resize((rows.len() as u32 * grid.width) as usize, false);
        let index_of = |column: u32, row: u32| (row - rows.start) * grid.width + column;
        for &fragment in veils {
            let polygon = placer.place(map, grid, fragment);
            let rows = rows.clone();
            D::each_cell(
                finder,
                polygon,
                grid.width,
                rows,
                true,
                |cells| match cells {
                    Cells::Boundary { column, row, area } => {
                        let part = Part::new(index_of(column, row), fragment, &area);
                        diced.push(part, area.0);
                    }
                    Cells::Inside { row, columns } => columns.for_each(|column| {
                        let part = Part::whole(index_of(column, row), fragment);
                        diced.push(part, D::Measure::whole());
                    }),
                },
            );
        }
        for part in &diced.parts().boundary {
            veiled[part.pixel as usize] = true;
        }
    }
}

#[cfg(test)]
mod tests;
