use super::{add, add_runs};
use crate::dice::{CellParts, Parts, PixelGrid};
use crate::filter::{CellKernel, Kernel};
use crate::shade::Radiance;

/// Filters that reach beyond the pixel: a pixel is the sum over the parts of cells around it of weight times
/// radiance.
///
/// What is diced and shaded are the cells between the pixels' centres ([`PixelGrid::between_centres`]),
/// on which a kernel is a polynomial. It is exact wherever radiance is constant over a part, as the box
/// filter is; elsewhere the error goes with the square of the cells' size.
///
/// What lies outside the frame is not known. So a pixel that the frame contains is the mean over what
/// its kernel reaches inside, and a plain scene stays plain up to the frame's border; of a pixel that
/// the frame contains in part, that mean counts as much as the part, as in the box filter. What lies
/// outside the grid but in the frame counts as everywhere: a pixel is the same whatever the window.
#[derive(Clone, Debug)]
pub struct KernelFilter<const N: usize> {
    kernel: CellKernel<N>,
    cells: PixelGrid,
    shares: FrameShares,
}

/// Buffers that [`KernelFilter::sum`] keeps from band to band.
#[derive(Clone, Debug, Default)]
pub struct KernelSums {
    /// Of each cell, the sum of what fills it.
    filled: Vec<[f64; 4]>,
    /// Of a row of cells: by pixel, what lies in the kernels along x.
    along_row: Vec<[f64; 4]>,
    /// By pixel, with those around the band whose kernels its cells lie in.
    sums: Vec<[f64; 4]>,
}

impl<const N: usize> KernelFilter<N> {
    /// Makes ready for the pixels of `grid`, with `cells_per_pixel` cells along a side of each.
    ///
    /// # Panics
    /// If the kernel is not `N` pixels wide, or of degree `N` or more, or if `cells_per_pixel` is 0.
    pub fn new(grid: &PixelGrid, kernel: &Kernel, cells_per_pixel: u32) -> Self {
        Self {
            kernel: CellKernel::new(kernel, cells_per_pixel),
            cells: grid.between_centres(kernel.radius(), cells_per_pixel),
            shares: FrameShares::new(grid, kernel),
        }
    }

    /// The cells to be diced.
    pub fn cells(&self) -> &PixelGrid {
        &self.cells
    }

    /// How many rows of cells `rows` rows of pixels take; the first begins at the row of the first pixels times
    /// the number of cells along a pixel's side.
    pub fn rows_of_cells(&self, rows: u32) -> u32 {
        (rows + N as u32 - 1) * self.kernel.cells_per_pixel()
    }

    /// Sums the parts of a band's cells into `pixels`, whole rows from `first_row` on, which are overwritten.
    ///
    /// Sums are f64, as in [`box_filter`](super::box_filter).
    pub fn sum(
        &self,
        diced: &CellParts<N>,
        radiance: &Radiance,
        first_row: u32,
        buffers: &mut KernelSums,
        pixels: &mut [[f32; 4]],
    ) {
        let columns = self.shares.columns.len();
        // A cell lies in the kernels of N pixels: N - 1 before the first one of a row, and as many behind the
        // last.
        let width = columns + 2 * (N - 1);
        let rows = pixels.len() / columns;
        let height = rows + 2 * (N - 1);
        buffers.sums.clear();
        buffers.sums.resize(width * height, [0.0; 4]);
        self.add_boundary(diced, radiance, width, &mut buffers.sums);
        self.add_filled(&diced.parts, radiance, rows as u32, width, buffers);

        let shares = self.shares.rows[first_row as usize..].iter();
        for ((row, pixels), of_row) in pixels.chunks_exact_mut(columns).enumerate().zip(shares) {
            let sums = &buffers.sums[(row + N - 1) * width + N - 1..];
            let of_columns = self.shares.columns.iter().zip(sums);
            for (pixel, (of_column, sum)) in pixels.iter_mut().zip(of_columns) {
                let share = of_column * of_row;
                *pixel = sum.map(|channel| (channel * share) as f32);
            }
        }
    }

    /// Adds parts of cells that are not filled to `sums`, `width` pixels in a row.
    fn add_boundary(
        &self,
        diced: &CellParts<N>,
        radiance: &Radiance,
        width: usize,
        sums: &mut [[f64; 4]],
    ) {
        let CellParts { parts, moments } = diced;
        let boundary = parts.boundary.iter().zip(moments).zip(&radiance.boundary);
        for ((part, moments), &[r, g, b]) in boundary {
            let (column, row) = (part.pixel % self.cells.width, part.pixel / self.cells.width);
            let weights = self.kernel.weights(column, row, moments);
            let value = [r, g, b, 1.0].map(f64::from);
            let first = self.pixel_of(row) * width + self.pixel_of(column);
            for (row, weights) in weights.iter().enumerate() {
                let sums = &mut sums[first + row * width..][..N];
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    add(sum, value.map(|channel| weight * channel));
                }
            }
        }
    }

    /// Adds what fills cells. All cells have the same weights, so that it is summed by cell, then
    /// filtered along x, then along y.
    fn add_filled(
        &self,
        parts: &Parts,
        radiance: &Radiance,
        rows: u32,
        width: usize,
        buffers: &mut KernelSums,
    ) {
        let KernelSums {
            filled,
            along_row,
            sums,
        } = buffers;
        let cells_in_row = self.cells.width as usize;
        filled.clear();
        filled.resize(self.rows_of_cells(rows) as usize * cells_in_row, [0.0; 4]);
        add_runs(parts, radiance, filled);
        for (row, of_row) in (0..).zip(filled.chunks_exact(cells_in_row)) {
            if of_row.iter().all(|[.., opacity]| *opacity == 0.0) {
                continue;
            }
            along_row.clear();
            along_row.resize(width, [0.0; 4]);
            for (column, value) in (0..).zip(of_row) {
                let weights = self.kernel.of_whole_cell(column);
                let sums = &mut along_row[self.pixel_of(column)..][..N];
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    add(sum, value.map(|channel| weight * channel));
                }
            }
            let weights = self.kernel.of_whole_cell(row);
            let rows = sums[self.pixel_of(row) * width..].chunks_exact_mut(width);
            for (sums, weight) in rows.zip(weights) {
                for (sum, value) in sums.iter_mut().zip(&*along_row) {
                    add(sum, value.map(|channel| weight * channel));
                }
            }
        }
    }

    /// The first pixel, with those around the band, whose kernel a cell lies in.
    #[inline]
    fn pixel_of(&self, cell: u32) -> usize {
        (cell / self.kernel.cells_per_pixel()) as usize
    }
}

/// What the sums of pixels are multiplied by where the frame ends, along each axis.
#[derive(Clone, Debug)]
struct FrameShares {
    columns: Vec<f64>,
    rows: Vec<f64>,
}

impl FrameShares {
    /// Of the pixels of `grid`. All are exactly 1 whose kernels lie in the frame.
    fn new(grid: &PixelGrid, kernel: &Kernel) -> Self {
        let along = |axis: usize, pixels: u32| -> Vec<f64> {
            let start = -grid.origin[axis];
            let end = start + grid.pixels_per_frame[axis];
            let pixels = (0..pixels).map(f64::from);
            let factor = |pixel: f64| {
                let inside = (end.min(pixel + 1.0) - start.max(pixel)).max(0.0);
                if inside == 0.0 {
                    return 0.0;
                }
                let centre = pixel + 0.5;
                inside / kernel.share(start - centre, end - centre)
            };
            pixels.map(factor).collect()
        };
        Self {
            columns: along(0, grid.width),
            rows: along(1, grid.height),
        }
    }
}
