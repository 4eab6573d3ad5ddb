//! Coordinates of files: whole numbers of the last decimal, so that nothing drifts and equal points
//! stay equal.

use std::fmt::Write;
use veduta_geometry::DVec2;

/// A point in units of the last decimal.
pub type Point = [i64; 2];

/// Rounds coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Rounding {
    decimals: usize,
    units: f64,
}

impl Rounding {
    pub fn new(decimals: u8) -> Self {
        Self {
            decimals: decimals.into(),
            units: 10f64.powi(decimals.into()),
        }
    }

    /// A length in units of the last decimal, without what rounding adds to it.
    #[cfg(feature = "svg")]
    pub fn units(self, length: f64) -> f64 {
        (length * self.units * 1e3).round() / 1e3
    }

    fn point(self, point: DVec2) -> Point {
        (point * self.units)
            .to_array()
            .map(|value| value.round() as i64)
    }

    /// A closed polygon without repeated points and points on straight sides; `None` if it has no area
    /// any more.
    pub fn ring(self, points: &[DVec2]) -> Option<Vec<Point>> {
        let mut ring: Vec<Point> = Vec::with_capacity(points.len());
        for &point in points {
            push_corner(&mut ring, self.point(point));
        }
        // The same around the end.
        loop {
            let count = ring.len();
            if count < 3 {
                return None;
            }
            if is_no_corner(ring[count - 2], ring[count - 1], ring[0]) {
                ring.pop();
            } else if is_no_corner(ring[count - 1], ring[0], ring[1]) {
                ring.remove(0);
            } else {
                break;
            }
        }
        (twice_area(&ring) != 0).then_some(ring)
    }

    /// All polygons of a shape that have an area.
    pub fn rings(self, outlines: &[Vec<DVec2>]) -> Vec<Vec<Point>> {
        outlines
            .iter()
            .filter_map(|outline| self.ring(outline))
            .collect()
    }

    /// An open chain of points without repeated ones; `None` if one point is left.
    #[cfg(any(feature = "svg", feature = "pdf"))]
    fn chain(self, points: &[DVec2]) -> Option<Vec<Point>> {
        let mut chain: Vec<Point> = points.iter().map(|&point| self.point(point)).collect();
        chain.dedup();
        (chain.len() > 1).then_some(chain)
    }

    /// [`Self::ring`] or [`Self::chain`].
    #[cfg(any(feature = "svg", feature = "pdf"))]
    pub fn line(self, points: &[DVec2], closed: bool) -> Option<Vec<Point>> {
        if closed {
            self.ring(points)
        } else {
            self.chain(points)
        }
    }

    /// A stroke without repeated points, and whether it is closed; `None` if one point is left. A ring round next to
    /// nothing, such as a crack between two faces, becomes a line: it is drawn for what stands beside it.
    #[cfg(any(feature = "svg", feature = "pdf"))]
    pub fn stroke(self, points: &[DVec2], closed: bool) -> Option<(Vec<Point>, bool)> {
        let mut chain = self.chain(points)?;
        if closed && chain.first() == chain.last() {
            chain.pop();
        }
        let is_closed = closed && chain.len() > 2;
        Some((chain, is_closed))
    }

    /// Appends a coordinate in decimals, as short as it can be.
    pub fn push(self, text: &mut String, value: i64) {
        let start = text.len();
        if value < 0 {
            text.push('-');
        }
        let unit = 10u64.pow(self.decimals as u32);
        let (whole, part) = (value.unsigned_abs() / unit, value.unsigned_abs() % unit);
        let digits = text.len();
        if whole > 0 {
            // Writing to a string cannot fail.
            let _ = write!(text, "{whole}");
        }
        if part > 0 {
            let _ = write!(text, ".{part:0width$}", width = self.decimals);
            text.truncate(text.trim_end_matches('0').len());
        }
        if text.len() == digits {
            text.truncate(start);
            text.push('0');
        }
    }
}

fn push_corner(ring: &mut Vec<Point>, point: Point) {
    while let [.., before, last] = ring[..]
        && is_no_corner(before, last, point)
    {
        ring.pop();
    }
    if ring.last() != Some(&point) {
        ring.push(point);
    }
}

/// Whether `q` adds nothing between `p` and `r`: it repeats one of them, or lies on a line with both.
fn is_no_corner(p: Point, q: Point, r: Point) -> bool {
    let [ux, uy, vx, vy] = [q[0] - p[0], q[1] - p[1], r[0] - q[0], r[1] - q[1]].map(i128::from);
    ux * vy == uy * vx
}

/// Twice the signed area; positive for outlines.
pub fn twice_area(ring: &[Point]) -> i128 {
    let wrapped = ring.iter().zip(ring.iter().cycle().skip(1));
    wrapped
        .map(|(p, q)| {
            let [px, py, qx, qy] = [p[0], p[1], q[0], q[1]].map(i128::from);
            px * qy - py * qx
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pushed(decimals: u8, value: i64) -> String {
        let mut text = String::new();
        Rounding::new(decimals).push(&mut text, value);
        text
    }

    #[test]
    fn numbers_are_as_short_as_can_be() {
        for (value, text) in [
            (0, "0"),
            (1000, "1"),
            (1500, "1.5"),
            (-20, "-.02"),
            (1234, "1.234"),
            (-1_000_001, "-1000.001"),
            (100_000, "100"),
        ] {
            assert_eq!(pushed(3, value), text);
        }
        assert_eq!(pushed(0, -100), "-100");
        assert_eq!(pushed(9, i64::MIN), "-9223372036.854775808");
    }

    #[test]
    #[cfg(any(feature = "svg", feature = "pdf"))]
    fn a_ring_round_a_crack_is_drawn_as_a_line() {
        let stroke = |points: &[(f64, f64)], closed| {
            let points: Vec<DVec2> = points.iter().copied().map(DVec2::from).collect();
            Rounding::new(1).stroke(&points, closed)
        };
        let crack = [(0.0, 0.0), (5.0, 0.0), (0.01, 0.02)];
        assert_eq!(stroke(&crack, true), Some((vec![[0, 0], [50, 0]], false)));
        let branch = [(0.0, 0.0), (5.0, 0.0), (9.0, 0.0), (5.0, 0.01), (2.0, 3.0)];
        let (points, closed) = stroke(&branch, true).expect("a ring");
        assert!(closed && points.contains(&[90, 0]), "{points:?}");
        assert_eq!(stroke(&[(1.0, 1.0), (1.01, 1.0)], false), None);
    }

    #[test]
    fn rings_lose_what_rounding_makes_needless() {
        let ring = |points: &[(f64, f64)]| {
            let points: Vec<DVec2> = points.iter().copied().map(DVec2::from).collect();
            Rounding::new(1).ring(&points)
        };
        let square = [[0, 0], [10, 0], [10, 10], [0, 10]].to_vec();
        let rounded = ring(&[
            (0.5, 0.01),
            (1.0, 0.0),
            (1.04, 0.5),
            (1.0, 1.0),
            (0.0, 1.0),
            (0.01, 0.99),
            (0.0, 0.0),
        ]);
        let mut expected = square;
        expected.rotate_left(1);
        assert_eq!(rounded, Some(expected));
        assert_eq!(ring(&[(0.0, 0.0), (5.0, 0.01), (9.0, 0.02)]), None);
        assert_eq!(
            ring(&[(0.0, 0.0), (5.0, 0.0), (9.0, 0.0), (5.0, 0.0)]),
            None
        );
    }
}
