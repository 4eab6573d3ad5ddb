//! Polygons -> triangles, by clipping ears.
//!
//! A polygon with n corners always becomes n - 2 triangles, so that face counts are predictable.
//! Convex polygons become fans. Others are laid on the coordinate plane they face most and lose one
//! ear after another: a convex corner whose triangle no other corner enters (Meisters, "Polygons
//! have ears", 1975).

use veduta_geometry::{DVec2, DVec3, cross};

/// Cuts polygons into triangles.
#[derive(Debug)]
pub struct Triangulator {
    /// Corners still to be tested for lying in an ear, over all polygons.
    effort_left: u64,
    flat: Vec<DVec2>,
    next: Vec<usize>,
    previous: Vec<usize>,
}

/// Tests of a corner against an ear that one file may cost: some seconds. Ear clipping is quadratic
/// for honest polygons, but there are cubic ones.
const MOST_EFFORT: u64 = 1 << 32;

impl Triangulator {
    pub fn new() -> Self {
        Self {
            effort_left: MOST_EFFORT,
            flat: Vec::new(),
            next: Vec::new(),
            previous: Vec::new(),
        }
    }

    /// Gives the triangles of a polygon to `emit`, as indices into `corners`, with its winding.
    ///
    /// False where the polygon crosses itself or is too intricate, so that its triangles may
    /// overlap.
    pub fn triangulate(&mut self, corners: &[DVec3], mut emit: impl FnMut([usize; 3])) -> bool {
        let n = corners.len();
        self.flatten(corners);
        if self.is_convex() {
            for i in 2..n {
                emit([0, i - 1, i]);
            }
            return true;
        }
        self.next = (1..n).chain([0]).collect();
        self.previous = [n - 1].into_iter().chain(0..n - 1).collect();
        let mut simple = true;
        let mut corner = 0;
        let mut tried = 0;
        for left in (3..=n).rev() {
            // After a fruitless round the polygon crosses itself or has only flat corners left.
            while tried < left && self.effort_left > 0 && !self.is_ear(corner) {
                corner = self.next[corner];
                tried += 1;
            }
            let (before, after) = (self.previous[corner], self.next[corner]);
            if tried == left || self.effort_left == 0 {
                // Corners that turn nowhere can go, whatever the rest looks like.
                simple &= self.effort_left > 0 && self.turn(before, corner, after) == 0.0;
            }
            emit([before, corner, after]);
            self.next[before] = after;
            self.previous[after] = before;
            // The corner after the next one: cutting ears in turn makes fewer slivers.
            corner = self.next[after];
            tried = 0;
        }
        simple
    }

    /// Lays the polygon on the coordinate plane in which its area is largest, counterclockwise.
    fn flatten(&mut self, corners: &[DVec3]) {
        let origin = corners[0];
        // Twice the vector area; relative to a corner, so that far polygons lose nothing.
        let normal: DVec3 = corners
            .windows(2)
            .map(|edge| (edge[0] - origin).cross(edge[1] - origin))
            .sum();
        let size = normal.abs();
        self.flat.clear();
        if size.z >= size.x && size.z >= size.y {
            self.flat
                .extend(corners.iter().map(|p| DVec2::new(p.x, p.y)));
        } else if size.x >= size.y {
            self.flat
                .extend(corners.iter().map(|p| DVec2::new(p.y, p.z)));
        } else {
            self.flat
                .extend(corners.iter().map(|p| DVec2::new(p.z, p.x)));
        }
        let facing = if size.z >= size.x && size.z >= size.y {
            normal.z
        } else if size.x >= size.y {
            normal.x
        } else {
            normal.y
        };
        if facing < 0.0 {
            for point in &mut self.flat {
                point.x = -point.x;
            }
        }
    }

    /// Whether the polygon turns left at every corner, or nowhere.
    fn is_convex(&self) -> bool {
        let n = self.flat.len();
        (0..n).all(|i| self.turn(i, (i + 1) % n, (i + 2) % n) >= 0.0)
    }

    /// Positive where the path a, b, c turns left.
    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        cross(self.flat[b] - self.flat[a], self.flat[c] - self.flat[a])
    }

    /// Whether the triangle at `corner` can be cut off.
    fn is_ear(&mut self, corner: usize) -> bool {
        let (before, after) = (self.previous[corner], self.next[corner]);
        if self.turn(before, corner, after) <= 0.0 {
            return false;
        }
        let triangle = [before, corner, after];
        let mut other = self.next[after];
        while other != before {
            self.effort_left = self.effort_left.saturating_sub(1);
            let inside = self.turn(before, corner, other) >= 0.0
                && self.turn(corner, after, other) >= 0.0
                && self.turn(after, before, other) >= 0.0;
            // Where a bridge leads to a hole, corners lie on one another; those do not count.
            if inside && triangle.iter().all(|&t| self.flat[t] != self.flat[other]) {
                return false;
            }
            other = self.next[other];
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta_geometry::signed_area;

    /// Triangulates, and checks winding, number and area of the triangles.
    fn check(corners: &[DVec3]) -> Vec<[usize; 3]> {
        let mut triangles = Vec::new();
        let simple = Triangulator::new().triangulate(corners, |t| triangles.push(t));
        assert!(simple, "{corners:?}");
        assert_eq!(triangles.len(), corners.len() - 2);
        let vector_area = |polygon: &[DVec3]| -> DVec3 {
            let edges = polygon.windows(2);
            0.5 * edges
                .map(|e| (e[0] - polygon[0]).cross(e[1] - polygon[0]))
                .sum::<DVec3>()
        };
        let whole = vector_area(corners);
        let mut sum = 0.0;
        for triangle in &triangles {
            let area = vector_area(&triangle.map(|i| corners[i]));
            assert!(area.dot(whole) >= 0.0, "{triangle:?} is turned over");
            sum += area.length();
        }
        // Parts of the right sign that add up to the whole do not overlap.
        assert!(
            (sum - whole.length()).abs() <= 1e-12 * sum,
            "{sum} is not {whole}"
        );
        triangles
    }

    fn polygon(points: &[(f64, f64)]) -> Vec<DVec3> {
        points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect()
    }

    #[test]
    fn concave_polygons_keep_their_shape_on_every_plane() {
        let shapes: [&[(f64, f64)]; 5] = [
            // A dart: the fan from corner 0 would leave it.
            &[(0.0, 0.0), (2.0, 1.0), (0.0, 2.0), (1.0, 1.0)],
            &[(1.0, 1.0), (0.0, 0.0), (2.0, 1.0), (0.0, 2.0)],
            // An L and a comb.
            &[
                (0.0, 0.0),
                (2.0, 0.0),
                (2.0, 1.0),
                (1.0, 1.0),
                (1.0, 2.0),
                (0.0, 2.0),
            ],
            &[
                (0.0, 0.0),
                (5.0, 0.0),
                (5.0, 2.0),
                (4.0, 0.5),
                (3.0, 2.0),
                (2.0, 0.5),
                (1.0, 2.0),
            ],
            // A square with a square hole, reached by a bridge.
            &[
                (0.0, 0.0),
                (3.0, 0.0),
                (3.0, 3.0),
                (0.0, 3.0),
                (0.0, 0.0),
                (1.0, 1.0),
                (1.0, 2.0),
                (2.0, 2.0),
                (2.0, 1.0),
                (1.0, 1.0),
            ],
        ];
        for shape in shapes {
            let flat = polygon(shape);
            let mut reversed = flat.clone();
            reversed.reverse();
            for corners in [flat, reversed] {
                for shift in 0..3 {
                    let turned: Vec<_> = corners
                        .iter()
                        .map(|p| {
                            let p = [p.x, p.y, 0.3 * p.x - 0.2 * p.y];
                            DVec3::new(p[shift % 3], p[(shift + 1) % 3], p[(shift + 2) % 3])
                        })
                        .collect();
                    check(&turned);
                }
            }
        }
    }

    #[test]
    fn random_star_shapes_are_covered_once() {
        let mut state = 7u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for n in 4..200 {
            let star: Vec<_> = (0..n)
                .map(|i| {
                    let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
                    let radius = 0.1 + random();
                    (radius * angle.cos(), radius * angle.sin())
                })
                .collect();
            let corners = polygon(&star);
            let flat: Vec<_> = corners.iter().map(|p| p.truncate()).collect();
            assert!(signed_area(&flat) > 0.0);
            check(&corners);
        }
    }

    #[test]
    fn degenerate_polygons_still_give_two_triangles_less_than_corners() {
        let point = vec![DVec3::ONE; 6];
        let line = polygon(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (1.0, 0.0)]);
        let bow = polygon(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]);
        let bow_of_five = polygon(&[(0.0, 0.0), (3.0, 3.0), (3.0, 0.0), (0.0, 2.0), (-1.0, 1.0)]);
        for corners in [point, line, bow, bow_of_five] {
            let mut count = 0;
            Triangulator::new().triangulate(&corners, |_| count += 1);
            assert_eq!(count, corners.len() - 2);
        }
    }
}
