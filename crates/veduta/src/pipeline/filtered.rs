//! The same stages for filters that reach beyond the pixel: on the cells between the pixels' centres, with
//! moments.

use crate::accumulate::{KernelFilter, KernelSums};
use crate::dice::{self, BAND_ROWS, Bands, CellParts, Dicer, PixelGrid, VeilBuffers};
use crate::filter::Kernel;
use crate::shade::{Radiance, Surfaces};
use rayon::prelude::*;
use veduta_geometry::CellMoments;
use veduta_map::VisibilityMap;

/// Cells along the side of a pixel where light differs from point to point. It is evaluated once in
/// each part of a cell, so that larger cells would blur textures more than the filter does: cells of a
/// pixel as if the kernel's variance, in square pixels, were larger by 1/6, these by 1/24 (1/12 and
/// 1/48 of it by the look-up's own footprint). Where all faces have one colour, cells of a pixel are
/// exact.
const FINE_CELLS: u32 = 2;

/// What a thread keeps from band to band.
#[derive(Default)]
struct Buffers<const N: usize> {
    dicer: Dicer<CellParts<N>>,
    cells: CellParts<N>,
    veils: VeilBuffers<CellMoments<N>>,
    radiance: Radiance,
    sums: KernelSums,
}

/// Makes the pixels of `grid`. `N` is the width of the kernel in pixels.
pub fn paint<const N: usize>(
    surfaces: &Surfaces,
    kernel: &Kernel,
    map: &VisibilityMap,
    grid: &PixelGrid,
    pixels: &mut [[f32; 4]],
) {
    let cells_per_pixel = if surfaces.vary() { FINE_CELLS } else { 1 };
    let filter = KernelFilter::<N>::new(grid, kernel, cells_per_pixel);
    let overlap = filter.rows_of_cells(0);
    let bands = Bands::overlapping(map, *filter.cells(), BAND_ROWS * cells_per_pixel, overlap);
    let band_pixels = grid.width as usize * BAND_ROWS as usize;
    let pixels = pixels.par_chunks_mut(band_pixels).enumerate();
    pixels.for_each_init(Buffers::<N>::default, |buffers, (band, pixels)| {
        let Buffers {
            dicer,
            cells,
            veils,
            radiance,
            sums,
        } = buffers;
        let varies = |fragment| surfaces.varies(fragment);
        dice::dice(map, &bands, band, varies, dicer, cells);
        let first_row = bands.rows(band).start;
        surfaces.shade(&cells.parts, filter.cells(), first_row, radiance);
        if !map.veils.is_empty() {
            let opacities = &radiance.opacities;
            dice::attenuate(map, filter.cells(), first_row, opacities, veils, cells);
        }
        filter.sum(cells, radiance, band as u32 * BAND_ROWS, sums, pixels);
    });
}
