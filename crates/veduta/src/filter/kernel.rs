use veduta_geometry::CellMoments;

/// One axis of a separable filter: a symmetric piecewise polynomial whose integral is 1.
///
/// Invariants: pieces are one pixel long and meet at pixel centres; at any place, the kernels of all pixels sum
/// to 1 (a *partition of unity*), and none jumps.
#[derive(Clone, Debug, PartialEq)]
pub struct Kernel {
    /// From the left end on: coefficients of the powers 0 to 3 of the distance from the piece's left side. As
    /// many as the kernel is wide, an even number.
    pieces: Vec<[f64; 4]>,
}

impl Kernel {
    /// The triangle, `1 - |x|`.
    pub fn triangle() -> Self {
        Self {
            pieces: vec![[0.0, 1.0, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0]],
        }
    }

    /// The cubics of Don Mitchell & Arun Netravali, "Reconstruction filters in computer graphics" (1988),
    /// equation (8): all symmetric cubics of radius 2 with a continuous slope and the invariants above.
    pub fn cubic(b: f64, c: f64) -> Self {
        let inner = [1.0 - b / 3.0, 0.0, -3.0 + 2.0 * b + c, 2.0 - 1.5 * b - c];
        let outer = [b / 6.0, -0.5 * b - c, 0.5 * b + 2.0 * c, -b / 6.0 - c];
        Self {
            pieces: vec![mirrored(outer), mirrored(inner), inner, outer],
        }
    }

    /// Nearly a Gaussian of standard deviation 1/2 pixel, truncated at 2 pixels and normalised: Mitsuba's
    /// `gaussian`, and that of PBRT and RenderMan (`exp(-2 x²)`) but for where they end.
    ///
    /// It is the cubic with B = 5/8 and C = 0, the best of those without lobes below 0. From the
    /// Gaussian it differs by at most 1.2 % of the peak, and its standard deviation is 0.508. Gaussians
    /// at pixel distance do not sum to 1: the sum of those of 1/2 pixel goes up and down by 1.4 %, so
    /// that a small light would twinkle when it moves. Any kernel that keeps the sum differs from them
    /// by 0.6 % of the peak at least.
    pub fn gaussian() -> Self {
        Self::cubic(5.0 / 8.0, 0.0)
    }

    /// How far it reaches from a pixel's centre, in pixels.
    pub fn radius(&self) -> u32 {
        self.pieces.len() as u32 / 2
    }

    /// The kernel at `x` pixels from the centre.
    pub fn at(&self, x: f64) -> f64 {
        let from_left = x + f64::from(self.radius());
        if from_left < 0.0 {
            return 0.0;
        }
        let piece = self.pieces.get(from_left as usize);
        piece.map_or(0.0, |piece| evaluate(piece, from_left.fract()))
    }

    /// The integral from `from` to `to`, in pixels from the centre; exactly 1 over all of the kernel.
    pub fn share(&self, from: f64, to: f64) -> f64 {
        let radius = f64::from(self.radius());
        if from <= -radius && to >= radius {
            return 1.0;
        }
        let pieces = self.pieces.iter().enumerate();
        let shares = pieces.map(|(index, &[a, b, c, d])| {
            let left = index as f64 - radius;
            let primitive = |t: f64| t * (a + t * (b / 2.0 + t * (c / 3.0 + t * (d / 4.0))));
            let [from, to] = [from, to].map(|x| (x - left).clamp(0.0, 1.0));
            primitive(to) - primitive(from)
        });
        shares.sum()
    }
}

fn evaluate([a, b, c, d]: &[f64; 4], t: f64) -> f64 {
    a + t * (b + t * (c + t * d))
}

/// The polynomial of `1 - t`.
fn mirrored([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [a + b + c + d, -b - 2.0 * c - 3.0 * d, c + 3.0 * d, -d]
}

/// A kernel made ready for the cells of a grid, one or several to a pixel, whose borders go through the
/// pixels' centres.
///
/// Along each axis a cell lies in the kernels of `N` pixels, twice the radius: the nearest before and
/// after it, here in ascending order. Their pieces have as many coefficients, so `N` is 2 for the
/// triangle and 4 for cubics.
#[derive(Clone, Debug, PartialEq)]
pub struct CellKernel<const N: usize> {
    /// Of each place of a cell between two pixel centres, by pixel: the piece's coefficients, for integrals
    /// over cells that are to be in pixels.
    pieces: Vec<[[f64; N]; N]>,
    /// The pieces' integrals over the cell.
    whole: Vec<[f64; N]>,
}

impl<const N: usize> CellKernel<N> {
    /// Cuts a kernel into `cells_per_pixel` cells a pixel.
    ///
    /// # Panics
    /// If the kernel is not `N` pixels wide, or of degree `N` or more, or if `cells_per_pixel` is 0.
    pub fn new(kernel: &Kernel, cells_per_pixel: u32) -> Self {
        assert!(cells_per_pixel > 0, "a pixel has cells");
        assert_eq!(kernel.pieces.len(), N, "the kernel's width");
        let size = 1.0 / f64::from(cells_per_pixel);
        let of_cell = |piece: &[f64; 4], left: f64| -> [f64; N] {
            assert!(piece[N..].iter().all(|&c| c == 0.0), "the kernel's degree");
            // Taylor's coefficients at the cell's left side.
            let [_, b, c, d] = *piece;
            let taylor = [
                evaluate(piece, left),
                b + left * (2.0 * c + left * 3.0 * d),
                c + left * 3.0 * d,
                d,
            ];
            std::array::from_fn(|power| taylor[power] * size.powi(power as i32 + 1))
        };
        let places = (0..cells_per_pixel).map(|place| f64::from(place) * size);
        // The first pixel is the farthest before the cell, which lies in the last piece of its kernel.
        let pieces: Vec<[[f64; N]; N]> = places
            .map(|left| std::array::from_fn(|pixel| of_cell(&kernel.pieces[N - 1 - pixel], left)))
            .collect();
        let integral = |piece: [f64; N]| -> f64 {
            let terms = piece.iter().enumerate();
            terms.map(|(power, c)| c / (power + 1) as f64).sum()
        };
        let whole = pieces.iter().map(|of_pixels| of_pixels.map(integral));
        Self {
            whole: whole.collect(),
            pieces,
        }
    }

    /// Cells along a side of a pixel.
    pub fn cells_per_pixel(&self) -> u32 {
        self.pieces.len() as u32
    }

    /// The weights of a whole cell along an axis, in pixels: `cell` counts from one that begins at a pixel's
    /// centre.
    #[inline]
    pub fn of_whole_cell(&self, cell: u32) -> [f64; N] {
        self.whole[(cell % self.cells_per_pixel()) as usize]
    }

    /// The weights of what has `moments` in a cell, in square pixels: `[row][column]` of the pixels.
    ///
    /// `column` and `row` count from a cell that begins at a pixel's centre.
    #[inline]
    pub fn weights(&self, column: u32, row: u32, moments: &CellMoments<N>) -> [[f64; N]; N] {
        let (of_columns, of_rows) = (self.of_cell(column), self.of_cell(row));
        let dot = |a: &[f64; N], b: &[f64; N]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        // By pixel column, then by power of y.
        let along_x = of_columns.map(|p| moments.0.map(|of_power| dot(&p, &of_power)));
        of_rows.map(|q| along_x.map(|of_column| dot(&q, &of_column)))
    }

    #[inline]
    fn of_cell(&self, cell: u32) -> &[[f64; N]; N] {
        &self.pieces[(cell % self.cells_per_pixel()) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::Filter;
    use veduta_geometry::DVec2;

    fn kernels() -> Vec<(Filter, Kernel)> {
        let wide = [
            Filter::Triangle,
            Filter::Gaussian,
            Filter::Mitchell,
            Filter::CatmullRom,
            Filter::BSpline,
        ];
        let with_kernel = |filter: Filter| (filter, filter.kernel().expect("a wide filter"));
        wide.map(with_kernel).to_vec()
    }

    #[test]
    fn kernels_of_all_pixels_sum_to_one_at_any_place() {
        for (filter, kernel) in kernels() {
            for step in 0..=100 {
                let x = f64::from(step) / 100.0;
                let sum: f64 = (-4..=4).map(|pixel| kernel.at(x - f64::from(pixel))).sum();
                assert!((sum - 1.0).abs() < 1e-15, "{filter:?} at {x}: {sum}");
            }
        }
    }

    #[test]
    fn kernels_are_symmetric_and_end_where_they_say() {
        for (filter, kernel) in kernels() {
            let radius = f64::from(kernel.radius());
            assert_eq!(kernel.at(-radius - 1e-9), 0.0);
            assert_eq!(kernel.at(radius), 0.0);
            for step in 0..300 {
                let x = f64::from(step) / 100.0;
                let (left, right) = (kernel.at(-x), kernel.at(x));
                assert!((left - right).abs() < 1e-15, "{filter:?} at {x}");
                // No jump: the slope is nowhere beyond 1.3.
                let before = kernel.at(x - 1e-6);
                assert!((right - before).abs() < 2e-6, "{filter:?} at {x}");
            }
        }
    }

    #[test]
    fn cubics_are_those_of_the_paper() {
        // Mitchell & Netravali's equation (8), in powers of |x|.
        let paper = |x: f64, b: f64, c: f64| {
            let x = x.abs();
            let sum = if x < 1.0 {
                (12.0 - 9.0 * b - 6.0 * c) * x.powi(3)
                    + (-18.0 + 12.0 * b + 6.0 * c) * x.powi(2)
                    + (6.0 - 2.0 * b)
            } else {
                (-b - 6.0 * c) * x.powi(3)
                    + (6.0 * b + 30.0 * c) * x.powi(2)
                    + (-12.0 * b - 48.0 * c) * x
                    + (8.0 * b + 24.0 * c)
            };
            sum / 6.0
        };
        for (b, c) in [(1.0 / 3.0, 1.0 / 3.0), (0.0, 0.5), (1.0, 0.0), (0.6, -0.1)] {
            let kernel = Kernel::cubic(b, c);
            for step in -199..200 {
                let x = f64::from(step) / 100.0;
                assert!(
                    (kernel.at(x) - paper(x, b, c)).abs() < 1e-14,
                    "{b}, {c} at {x}"
                );
            }
        }
    }

    #[test]
    fn the_gaussian_is_as_near_to_the_true_one_as_is_told() {
        let kernel = Kernel::gaussian();
        let bell = |x: f64| (-2.0 * x * x).exp();
        let steps = || (-20_000..20_000).map(|step| (f64::from(step) + 0.5) / 10_000.0);
        let area: f64 = steps().map(bell).sum::<f64>() / 10_000.0;
        let peak = bell(0.0) / area;
        let farthest = steps()
            .map(|x| (kernel.at(x) - bell(x) / area).abs() / peak)
            .fold(0.0, f64::max);
        let variance = steps().map(|x| x * x * kernel.at(x)).sum::<f64>() / 10_000.0;
        assert!(farthest > 0.011 && farthest < 0.012, "{farthest}");
        assert!(
            (variance.sqrt() - 0.508).abs() < 0.0005,
            "{}",
            variance.sqrt()
        );
        assert!(steps().all(|x| kernel.at(x) >= 0.0));
    }

    #[test]
    fn shares_are_integrals() {
        for (filter, kernel) in kernels() {
            for (from, to) in [
                (-3.0, 3.0),
                (-0.5, 0.5),
                (0.5, 7.0),
                (-1.25, -0.3),
                (2.0, 3.0),
            ] {
                let width = (to - from) / 100_000.0;
                let places = (0..100_000).map(|k| from + (f64::from(k) + 0.5) * width);
                let expected: f64 = places.map(|x| kernel.at(x) * width).sum();
                let share = kernel.share(from, to);
                assert!(
                    (share - expected).abs() < 1e-8,
                    "{filter:?}, {from} to {to}"
                );
            }
        }
    }

    /// The weights of a polygon in a cell, by the pixel's place in the order of [`CellKernel::weights`].
    fn weigh<const N: usize>(kernel: &Kernel, cells: u32, cell: [u32; 2], polygon: &[DVec2]) {
        let cell_kernel = CellKernel::<N>::new(kernel, cells);
        let moments = CellMoments::of_polygon(polygon, DVec2::ZERO);
        let found = cell_kernel.weights(cell[0], cell[1], &moments);
        let (size, side) = (1.0 / f64::from(cells), 400);
        let mut expected = [[0.0; N]; N];
        for k in 0..side * side {
            let local = DVec2::new((k % side) as f64 + 0.5, (k / side) as f64 + 0.5) / side as f64;
            let inside = (0..polygon.len()).all(|k| {
                let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
                veduta_geometry::cross(b - a, local - a) >= 0.0
            });
            if inside {
                // From the pixel centre before the cell.
                let place = DVec2::new(f64::from(cell[0] % cells), f64::from(cell[1] % cells));
                let at = (place + local) * size;
                let area = (size / side as f64).powi(2);
                for (row, of_row) in expected.iter_mut().enumerate() {
                    for (column, weight) in of_row.iter_mut().enumerate() {
                        let centre = |pixel: usize| pixel as f64 - (N / 2 - 1) as f64;
                        *weight +=
                            area * kernel.at(at.x - centre(column)) * kernel.at(at.y - centre(row));
                    }
                }
            }
        }
        for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
            let wrong = (found - expected).abs();
            assert!(wrong < 2e-3 * size * size, "{found} and not {expected}");
        }
        let sum: f64 = found.as_flattened().iter().sum();
        let area = moments.area() * size * size;
        assert!((sum - area).abs() < 1e-15, "weights sum to the area");
    }

    #[test]
    fn weights_are_the_kernels_integrals_over_a_polygon() {
        let polygon = [(0.1, 0.05), (0.9, 0.3), (0.7, 1.0), (0.0, 0.6)].map(DVec2::from);
        for cell in [[0, 0], [3, 5]] {
            for cells in [1, 2, 3] {
                for (filter, kernel) in kernels() {
                    match filter {
                        Filter::Triangle => weigh::<2>(&kernel, cells, cell, &polygon),
                        _ => weigh::<4>(&kernel, cells, cell, &polygon),
                    }
                }
            }
        }
    }

    #[test]
    fn a_whole_cell_weighs_what_its_moments_say() {
        for (_, kernel) in kernels().into_iter().skip(1) {
            let kernel = CellKernel::<4>::new(&kernel, 2);
            let found = kernel.weights(4, 7, &CellMoments::whole());
            let (columns, rows) = (kernel.of_whole_cell(4), kernel.of_whole_cell(7));
            for (found, row) in found.iter().zip(rows) {
                for (found, column) in found.iter().zip(columns) {
                    assert!((found - row * column).abs() < 1e-16);
                }
            }
        }
    }
}
