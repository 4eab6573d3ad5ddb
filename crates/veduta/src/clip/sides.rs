//! The lines through a polygon's sides, up to four at a time in the lanes of a register.
//!
//! Nearly all polygons compared here are triangles, so one group of lanes holds all sides, and
//! "does a side separate these two" is one question instead of three.

use veduta_geometry::{Affine, DVec2};
use wide::f64x4;

/// Distance, in frame heights or widths, within which a point counts as lying on a line.
///
/// Points constructed on a line miss it by a few units of 2^-53. Without this band every such miss
/// would cut off a sliver; the area it can misplace is its width times a line's length in a pixel,
/// 2e-12 pixels at 2000 pixels across.
pub(crate) const ON_LINE: f64 = 1e-15;

/// Lanes of a group.
pub(crate) const LANES: usize = 4;

/// Some consecutive sides of a positively wound outline.
#[derive(Clone, Copy)]
pub(crate) struct Sides {
    start: [f64x4; 2],
    direction: [f64x4; 2],
    /// [`ON_LINE`] in units of [`Sides::inside`].
    pub tolerance: f64x4,
    /// How many lanes are sides of their own; the others repeat the group's first.
    pub count: usize,
}

impl Sides {
    /// The sides of a triangle.
    #[inline(always)]
    pub fn of_triangle([p, q, r]: [DVec2; 3]) -> Self {
        Self::from_lanes([p, q, r, p], [q, r, p, q], 3)
    }

    /// The sides of `outline` from the one that starts at vertex `first`, four at most.
    #[inline]
    pub fn group(outline: &[DVec2], first: usize) -> Self {
        if let &[p, q, r] = outline {
            return Self::of_triangle([p, q, r]);
        }
        let count = (outline.len() - first).min(LANES);
        let vertex = |index: usize| outline[index % outline.len()];
        let side = |lane: usize| first + if lane < count { lane } else { 0 };
        let start = std::array::from_fn(|lane| vertex(side(lane)));
        let end = std::array::from_fn(|lane| vertex(side(lane) + 1));
        Self::from_lanes(start, end, count)
    }

    #[inline(always)]
    fn from_lanes(start: [DVec2; LANES], end: [DVec2; LANES], count: usize) -> Self {
        let x = f64x4::from(start.map(|p| p.x));
        let y = f64x4::from(start.map(|p| p.y));
        let dx = f64x4::from(end.map(|p| p.x)) - x;
        let dy = f64x4::from(end.map(|p| p.y)) - y;
        let tolerance = (dx.abs() + dy.abs()) * f64x4::splat(ON_LINE);
        Self {
            start: [x, y],
            direction: [dx, dy],
            tolerance,
            count,
        }
    }

    /// Distance of a point from each line, times the side's length: positive inside, exactly zero
    /// at the side's start.
    #[inline(always)]
    pub fn inside(&self, point: DVec2) -> f64x4 {
        self.direction[0] * (f64x4::splat(point.y) - self.start[1])
            - self.direction[1] * (f64x4::splat(point.x) - self.start[0])
    }

    /// Whether all points lie outside or on one of the lines.
    #[inline(always)]
    pub fn separate(&self, points: &[DVec2]) -> bool {
        let farthest = if let &[p, q, r] = points {
            let [p, q, r] = [p, q, r].map(|point| self.inside(point));
            p.fast_max(q).fast_max(r)
        } else {
            let beyond_all = f64x4::splat(f64::NEG_INFINITY);
            points.iter().fold(beyond_all, |farthest, &point| {
                farthest.fast_max(self.inside(point))
            })
        };
        farthest.simd_le(self.tolerance).any()
    }

    /// A function at the points where the sides start.
    #[inline(always)]
    pub fn at_starts(&self, function: &Affine) -> f64x4 {
        f64x4::splat(function.a) * self.start[0]
            + f64x4::splat(function.b) * self.start[1]
            + f64x4::splat(function.c)
    }
}

/// Whether a side of `outline` after its first four separates it from `points`.
pub(crate) fn later_sides_separate(outline: &[DVec2], points: &[DVec2]) -> bool {
    (LANES..outline.len())
        .step_by(LANES)
        .any(|first| Sides::group(outline, first).separate(points))
}
