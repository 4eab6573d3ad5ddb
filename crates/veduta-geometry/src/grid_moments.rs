//! Exact moments of a convex polygon in the cells of a unit grid.
//!
//! A moment is the integral of `x^i y^j` over what is covered of a cell, measured from the cell's top
//! left corner. All with `i, j < N` are found: by them the integral of any product of a polynomial
//! of x and one of y over the polygon is a sum, which is how pixel filters weigh what lies in a cell.
//!
//! The polygon is walked as in [`grid_area`](crate::grid_area), whose sibling this is: the same cuts, so
//! that neighbours share a cell without gap or overlap. Only what is measured beside a piece of an edge
//! differs. By Green's theorem that is an integral along the piece,
//!
//! ```text
//!     a                 what lies between a-b and the cell's right side has the moments
//!      \####|
//!       \###|              ⌠ b_y      1 - x(y)^(i+1)
//!        \##|              │     y^j  -------------- dy
//!         b#|              ⌡ a_y          i + 1
//! ```
//!
//! and x(y) is linear: a polynomial of degree `2 N - 1` at most, which the Gauss-Legendre rule of N points
//! integrates exactly. So all N² moments cost N points on each piece.

use crate::grid_area::{Cells, Measure, RowBuffer, fan, walk};
use crate::{DVec2, cross};
use std::ops::{AddAssign, Mul, Range, Sub, SubAssign};

/// Moments of what is covered of a cell: `0[j][i]` is the integral of `x^i y^j` over it, in cells, from the
/// cell's top left corner. `0[0][0]` is the area.
///
/// `N` is 2 or 4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellMoments<const N: usize>(pub [[f64; N]; N]);

impl<const N: usize> Default for CellMoments<N> {
    /// Nothing is covered.
    fn default() -> Self {
        Self([[0.0; N]; N])
    }
}

impl<const N: usize> CellMoments<N> {
    /// Of the whole cell.
    pub fn whole() -> Self {
        Self::full_width(0.0, 1.0)
    }

    /// Of a convex polygon, positively wound, that lies in the cell whose top left corner is `corner`.
    pub fn of_polygon(polygon: &[DVec2], corner: DVec2) -> Self {
        if polygon.len() < 3 {
            return Self::default();
        }
        fan(polygon, corner)
    }

    /// Area in square cells.
    #[inline(always)]
    pub fn area(&self) -> f64 {
        self.0[0][0]
    }

    /// Centroid, from the cell's top left corner: each coordinate in `0.0..=1.0`.
    ///
    /// Its rounding error grows as 1e-16 over the area, so it is kept inside the cell.
    #[inline]
    pub fn centroid(&self) -> DVec2 {
        let first = DVec2::new(self.0[0][1], self.0[1][0]);
        (first / self.area()).clamp(DVec2::ZERO, DVec2::ONE)
    }

    /// The integral of `p(x) q(y)`, where `p[i]` and `q[j]` are the coefficients of `x^i` and `y^j`.
    pub fn integral(&self, p: &[f64; N], q: &[f64; N]) -> f64 {
        let of_row = |row: &[f64; N]| -> f64 { row.iter().zip(p).map(|(m, p)| m * p).sum() };
        self.0.iter().zip(q).map(|(row, q)| q * of_row(row)).sum()
    }
}

/// Finds the moments of convex polygons in the cells of a grid. Keeps its buffers between polygons.
#[derive(Clone, Debug, Default)]
pub struct GridMoments<const N: usize> {
    moments: RowBuffer<CellMoments<N>>,
    clamped: Vec<DVec2>,
}

impl<const N: usize> GridMoments<N> {
    /// No buffers yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// As [`GridAreas::each_cell`](crate::GridAreas::each_cell), with moments.
    pub fn each_cell(
        &mut self,
        polygon: &[DVec2],
        columns: u32,
        rows: Range<u32>,
        visit: impl FnMut(Cells<CellMoments<N>>),
    ) {
        let (moments, clamped) = (&mut self.moments, &mut self.clamped);
        walk(polygon, columns, rows, moments, clamped, visit);
    }
}

impl<const N: usize> Measure for CellMoments<N> {
    #[inline(always)]
    fn full_width(top: f64, bottom: f64) -> Self {
        let mut moments = Self::default();
        let (mut top_power, mut bottom_power) = (1.0, 1.0);
        for (j, row) in moments.0.iter_mut().enumerate() {
            top_power *= top;
            bottom_power *= bottom;
            let of_row = (bottom_power - top_power) / (j + 1) as f64;
            for (i, moment) in row.iter_mut().enumerate() {
                *moment = of_row / (i + 1) as f64;
            }
        }
        moments
    }

    #[inline(always)]
    fn right_of(upper: DVec2, lower: DVec2) -> Self {
        let mut moments = Self::default();
        let along = lower - upper;
        for [place, weight] in gauss_legendre::<N>() {
            let DVec2 { x, y } = upper + place * along;
            // weight dy times (1 - x^(i+1)) / (i+1)
            let mut beside = [0.0; N];
            let mut power = x;
            for (i, beside) in beside.iter_mut().enumerate() {
                *beside = weight * along.y * (1.0 - power) / (i + 1) as f64;
                power *= x;
            }
            let mut power = 1.0;
            for row in &mut moments.0 {
                for (moment, beside) in row.iter_mut().zip(beside) {
                    *moment += power * beside;
                }
                power *= y;
            }
        }
        moments
    }

    /// Along its three sides what lies right of them cancels, but for the triangle, counted negative.
    #[inline(always)]
    fn triangle(origin: DVec2, u: DVec2, v: DVec2) -> Self {
        let (a, b, c) = (origin, origin + u, origin + v);
        let mut moments = Self::right_of(a, b);
        moments += Self::right_of(b, c);
        moments += Self::right_of(c, a);
        moments = moments * -1.0;
        // Small triangles keep the digits of their area, of which the other way leaves 1e-16.
        moments.0[0][0] = 0.5 * cross(u, v);
        moments
    }

    #[inline(always)]
    fn area(&self) -> f64 {
        self.0[0][0]
    }
}

/// Points in `0..1` and weights, summing up to 1, of the Gauss-Legendre rule of N points, exact for
/// polynomials of degree `2 N - 1`.
#[inline(always)]
fn gauss_legendre<const N: usize>() -> [[f64; 2]; N] {
    const TWO: [[f64; 2]; 2] = [
        [0.211_324_865_405_187_1, 0.5],
        [0.788_675_134_594_812_9, 0.5],
    ];
    const FOUR: [[f64; 2]; 4] = [
        [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
        [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
        [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
        [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
    ];
    const { assert!(N == 2 || N == 4, "rules of 2 and of 4 points are known") };
    std::array::from_fn(|k| if N == 2 { TWO[k] } else { FOUR[k] })
}

impl<const N: usize> AddAssign for CellMoments<N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        for (row, other) in self.0.iter_mut().zip(other.0) {
            for (moment, other) in row.iter_mut().zip(other) {
                *moment += other;
            }
        }
    }
}

impl<const N: usize> SubAssign for CellMoments<N> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        for (row, other) in self.0.iter_mut().zip(other.0) {
            for (moment, other) in row.iter_mut().zip(other) {
                *moment -= other;
            }
        }
    }
}

impl<const N: usize> Sub for CellMoments<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        self -= other;
        self
    }
}

impl<const N: usize> Mul<f64> for CellMoments<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(mut self, factor: f64) -> Self {
        self.0
            .as_flattened_mut()
            .iter_mut()
            .for_each(|moment| *moment *= factor);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CellArea, GridAreas};

    /// SplitMix64, with a fixed seed.
    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 * 2.0_f64.powi(-53)
        }

        /// A triangle or a quadrilateral in an ellipse around a point of the grid, positively wound.
        fn polygon(&mut self, size: f64) -> Vec<DVec2> {
            let centre = DVec2::new(self.unit(), self.unit()) * size;
            let long = size * self.unit().powi(2);
            let wide = long * [1.0, 0.3, 1e-3][(self.unit() * 3.0) as usize];
            let turn = DVec2::from_angle(self.unit() * 7.0);
            let corners = 3 + (self.unit() * 2.0) as usize;
            let mut angles: Vec<f64> = (0..corners)
                .map(|_| self.unit() * std::f64::consts::TAU)
                .collect();
            angles.sort_by(f64::total_cmp);
            let polygon: Vec<DVec2> = angles
                .iter()
                .map(|&angle| {
                    let (sin, cos) = angle.sin_cos();
                    let p = centre + turn.rotate(DVec2::new(long * cos, wide * sin));
                    p.clamp(DVec2::ZERO, DVec2::splat(size))
                })
                .collect();
            // What was pushed onto the grid's sides may no longer be convex.
            let convex = (0..corners).all(|k| {
                let [p, q, r] = [0, 1, 2].map(|step| polygon[(k + step) % corners]);
                cross(q - p, r - q) > 0.0
            });
            if convex { polygon } else { Vec::new() }
        }
    }

    fn grid_of<const N: usize>(polygon: &[DVec2], size: u32) -> Vec<CellMoments<N>> {
        let mut cells = vec![CellMoments::default(); (size * size) as usize];
        GridMoments::new().each_cell(polygon, size, 0..size, |visited| match visited {
            Cells::Boundary { column, row, area } => cells[(row * size + column) as usize] = area,
            Cells::Inside { row, columns } => {
                for column in columns {
                    cells[(row * size + column) as usize] = CellMoments::whole();
                }
            }
        });
        cells
    }

    fn farthest<const N: usize>(a: &CellMoments<N>, b: &CellMoments<N>) -> f64 {
        let pairs = a.0.as_flattened().iter().zip(b.0.as_flattened());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn half_a_cell_below_its_diagonal_has_the_moments_of_the_closed_form() {
        // y > x: the integral of x^i y^j is 1 / ((i + 1) (i + j + 2)).
        let triangle = [(5.0, 7.0), (6.0, 8.0), (5.0, 8.0)].map(DVec2::from);
        let moments = CellMoments::<4>::of_polygon(&triangle, DVec2::new(5.0, 7.0));
        for (j, row) in moments.0.iter().enumerate() {
            for (i, moment) in row.iter().enumerate() {
                let expected = 1.0 / ((i + 1) as f64 * (i + j + 2) as f64);
                assert!((moment - expected).abs() < 1e-15, "x^{i} y^{j}: {moment}");
            }
        }
        // The same as the left half of what a large triangle covers of the cell.
        let large = [(2.0, 4.0), (6.0, 8.0), (2.0, 8.0)].map(DVec2::from);
        let found = grid_of::<4>(&large, 9)[7 * 9 + 5];
        assert!(farthest(&found, &moments) < 1e-15);
    }

    /// The moments by many level lines, along each of which the integral is known.
    fn by_lines(polygon: &[DVec2], corner: DVec2) -> CellMoments<4> {
        const LINES: usize = 4000;
        let mut sum = CellMoments::<4>::default();
        for line in 0..LINES {
            let y = (line as f64 + 0.5) / LINES as f64;
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for k in 0..polygon.len() {
                let (a, b) = (
                    polygon[k] - corner,
                    polygon[(k + 1) % polygon.len()] - corner,
                );
                if (a.y <= y) != (b.y <= y) {
                    let x = a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
                    (left, right) = (left.min(x), right.max(x));
                }
            }
            let (left, right) = (left.clamp(0.0, 1.0), right.clamp(0.0, 1.0));
            if left >= right {
                continue;
            }
            for (j, row) in sum.0.iter_mut().enumerate() {
                for (i, moment) in row.iter_mut().enumerate() {
                    let power = i as i32 + 1;
                    let along = (right.powi(power) - left.powi(power)) / f64::from(power);
                    *moment += along * y.powi(j as i32) / LINES as f64;
                }
            }
        }
        sum
    }

    #[test]
    fn moments_are_those_of_many_level_lines() {
        let mut random = Random(11);
        let mut seen = 0;
        for case in 0..60 {
            let polygon = random.polygon(2.0);
            if polygon.is_empty() {
                continue;
            }
            seen += 1;
            for (index, found) in grid_of::<4>(&polygon, 2).iter().enumerate() {
                let corner = DVec2::new((index % 2) as f64, (index / 2) as f64);
                // A vertex between two lines costs a part of the strip around it; along edges that lie
                // almost level, a line ends anywhere.
                let wrong = farthest(found, &by_lines(&polygon, corner));
                assert!(wrong < 2e-5, "case {case}: {wrong}; {polygon:?}");
            }
        }
        assert!(seen > 20);
    }

    #[test]
    fn areas_and_first_moments_are_those_of_the_areas_found_beside() {
        let mut random = Random(12);
        for case in 0..4000 {
            let size = [1_u32, 2, 7][case % 3];
            let polygon = random.polygon(f64::from(size));
            let (all, bilinear) = (grid_of::<4>(&polygon, size), grid_of::<2>(&polygon, size));
            let mut areas = vec![CellArea::default(); all.len()];
            GridAreas::new().each_cell_with_moments(
                &polygon,
                size,
                0..size,
                |visited| match visited {
                    Cells::Boundary { column, row, area } => {
                        areas[(row * size + column) as usize] = area;
                    }
                    Cells::Inside { row, columns } => columns.for_each(|column| {
                        areas[(row * size + column) as usize] = CellArea {
                            area: 1.0,
                            moment: DVec2::splat(0.5),
                        };
                    }),
                },
            );
            for ((all, bilinear), area) in all.iter().zip(&bilinear).zip(&areas) {
                let expected = [[area.area, area.moment.x], [area.moment.y, all.0[1][1]]];
                let of_all = [0, 1].map(|j| [0, 1].map(|i| all.0[j][i]));
                for found in [bilinear, &CellMoments(of_all)] {
                    let wrong = farthest(found, &CellMoments(expected));
                    assert!(
                        wrong < 1e-14,
                        "case {case}: {found:?}, {area:?}; {polygon:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_parts_of_a_cell_have_the_moments_of_the_cell() {
        let mut random = Random(13);
        for case in 0..300 {
            let hub = DVec2::new(random.unit(), random.unit()) * 5.0;
            let mut rim: Vec<DVec2> = (0..12)
                .map(|_| {
                    let along = random.unit() * 5.0;
                    match (random.unit() * 4.0) as u32 {
                        0 => DVec2::new(along, 0.0),
                        1 => DVec2::new(5.0, along),
                        2 => DVec2::new(along, 5.0),
                        _ => DVec2::new(0.0, along),
                    }
                })
                .chain([(0.0, 0.0), (5.0, 0.0), (5.0, 5.0), (0.0, 5.0)].map(DVec2::from))
                .collect();
            rim.sort_by(|p, q| (*p - hub).to_angle().total_cmp(&(*q - hub).to_angle()));
            let mut sums = vec![CellMoments::<4>::default(); 25];
            for k in 0..rim.len() {
                let triangle = [hub, rim[k], rim[(k + 1) % rim.len()]];
                for (sum, moments) in sums.iter_mut().zip(grid_of(&triangle, 5)) {
                    *sum += moments;
                }
            }
            for (index, sum) in sums.iter().enumerate() {
                let wrong = farthest(sum, &CellMoments::whole());
                assert!(
                    wrong < 1e-13,
                    "case {case}, cell {index}: {wrong}; hub {hub}"
                );
            }
        }
    }

    #[test]
    fn an_integral_of_polynomials_is_the_sum_of_moments() {
        // Over the whole cell the integral of a product is the product of the integrals.
        let (p, q) = ([1.0, -2.0, 0.5, 4.0], [0.25, 3.0, -1.0, 2.0]);
        let over = |p: &[f64; 4]| -> f64 {
            let terms = p.iter().enumerate();
            terms.map(|(i, c)| c / (i + 1) as f64).sum()
        };
        let found = CellMoments::whole().integral(&p, &q);
        assert!((found - over(&p) * over(&q)).abs() < 1e-15);
    }
}
