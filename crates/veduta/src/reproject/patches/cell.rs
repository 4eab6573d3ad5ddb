//! A rectangle of a picture as two patches, and how far they are off.

use super::Patch;
use veduta_geometry::{DVec2, DVec3};

/// An arc of angle t whose directions are mixed linearly is right in its middle, and off by about 0.021 t^3 at its
/// quarters; the lens itself may add as much again. Larger makes more patches in small pictures, in others
/// nothing; smaller would let patches that look at a large part of the sphere pass for straight.
const THIRD_ORDER: f64 = 0.05;

/// What that does to the scale, at most: a cubic function that is 0 at the ends and in the middle, by its largest
/// value in between and the length from end to end.
const SCALE_OF_CUBIC: f64 = 10.4;

/// A side that spans less than this share of what the cell does sees a single direction: a pole.
const AT_POLE: f64 = 1e-9;

/// A rectangle with the directions of its corners, the middles of its sides, and its middle; rows from the top. Where
/// the lens's law ends, they are not numbers.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    pub min: DVec2,
    pub max: DVec2,
    directions: [[DVec3; 3]; 3],
}

/// Corners of a triangle of a cell: column and row from 0 to 2.
type Corners = [(usize, usize); 3];

/// The triangles into which a diagonal cuts a cell, falling (from the top left) or rising.
const fn triangles(falling: bool) -> [Corners; 2] {
    if falling {
        [[(0, 0), (2, 0), (2, 2)], [(2, 2), (0, 2), (0, 0)]]
    } else {
        [[(2, 0), (2, 2), (0, 2)], [(0, 2), (0, 0), (2, 0)]]
    }
}

impl Cell {
    pub fn new(min: DVec2, max: DVec2, direction: impl Fn(DVec2) -> DVec3) -> Self {
        let mut cell = Self {
            min,
            max,
            directions: [[DVec3::NAN; 3]; 3],
        };
        for row in 0..3 {
            for column in 0..3 {
                cell.directions[row][column] = direction(cell.point(column, row));
            }
        }
        cell
    }

    /// The two halves; the directions that the cell has are not asked for again.
    pub fn halves(&self, axis: usize, direction: impl Fn(DVec2) -> DVec3) -> [Self; 2] {
        let middle = 0.5 * (self.min[axis] + self.max[axis]);
        [0, 1].map(|half| {
            let mut part = *self;
            if half == 0 {
                part.max[axis] = middle;
            } else {
                part.min[axis] = middle;
            }
            for across in 0..3 {
                for along in 0..3 {
                    // Of the cell's own three, the half has two at its ends.
                    let known = (along != 1).then_some(half + along / 2);
                    let (i, j) = if axis == 0 {
                        (along, across)
                    } else {
                        (across, along)
                    };
                    part.directions[j][i] = match known {
                        Some(at) if axis == 0 => self.directions[j][at],
                        Some(at) => self.directions[at][i],
                        None => direction(part.point(i, j)),
                    };
                }
            }
            part
        })
    }

    /// A corner, or a middle: column and row from 0 to 2.
    fn point(&self, column: usize, row: usize) -> DVec2 {
        let along = |axis: usize, step: usize| match step {
            0 => self.min[axis],
            1 => 0.5 * (self.min[axis] + self.max[axis]),
            _ => self.max[axis],
        };
        DVec2::new(along(0, column), along(1, row))
    }

    /// The axis that leads away from a side that sees a single direction, if there is one.
    pub fn pole(&self) -> Option<usize> {
        let [top, middle, bottom] = self.directions;
        let far = (bottom[2] - top[0])
            .length_squared()
            .max((bottom[0] - top[2]).length_squared());
        let is_one = |[a, b]: [DVec3; 2]| (b - a).length_squared() <= AT_POLE * AT_POLE * far;
        if is_one([top[0], top[2]]) || is_one([bottom[0], bottom[2]]) {
            return (!is_one([middle[0], middle[2]])).then_some(1);
        }
        let at_side = is_one([top[0], bottom[0]]) || is_one([top[2], bottom[2]]);
        (at_side && !is_one([top[1], bottom[1]])).then_some(0)
    }

    /// How far from its place anything is seen where the cell is cut along a diagonal, in pixels, and how much the scale is
    /// off anywhere and in any direction, as a share of it.
    pub fn off(&self, falling: bool) -> [f64; 2] {
        let mut worst = [0.0_f64; 2];
        for corners in triangles(falling) {
            let (points, directions, middles) = self.triangle(corners);
            let errors = match Patch::through(points, directions, middles) {
                Some(patch) => errors(&patch, &directions, &middles),
                None => [f64::INFINITY; 2],
            };
            for (worst, error) in worst.iter_mut().zip(errors) {
                *worst = worst.max(error);
            }
        }
        worst
    }

    /// The triangles of the cell, and their patches unless their directions lie on a line.
    pub fn patches(&self, falling: bool) -> [([DVec2; 3], Option<Patch>); 2] {
        triangles(falling).map(|corners| {
            let (points, directions, middles) = self.triangle(corners);
            (points, Patch::through(points, directions, middles))
        })
    }

    /// Corners of a triangle, and the directions there and in the middles of its sides.
    fn triangle(&self, corners: Corners) -> ([DVec2; 3], [DVec3; 3], [DVec3; 3]) {
        let mut middles = [DVec3::NAN; 3];
        for (k, middle) in middles.iter_mut().enumerate() {
            let ((i, j), (next_i, next_j)) = (corners[k], corners[(k + 1) % 3]);
            *middle = self.directions[(j + next_j) / 2][(i + next_i) / 2];
        }
        let points = corners.map(|(i, j)| self.point(i, j));
        let directions = corners.map(|(i, j)| self.directions[j][i]);
        (points, directions, middles)
    }

    /// How much longer than wide a small round thing is shown.
    pub fn stretch(&self) -> f64 {
        let size = self.max - self.min;
        let x = (self.directions[1][2] - self.directions[1][0]) / size.x;
        let y = (self.directions[2][1] - self.directions[0][1]) / size.y;
        // The ratio of the singular values of the two, as columns.
        let (xx, yy, xy) = (x.length_squared(), y.length_squared(), x.dot(y));
        let (mean, difference) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let root = difference.hypot(xy);
        let stretch = ((mean + root) / (mean - root)).sqrt();
        if stretch.is_finite() { stretch } else { 1.0 }
    }
}

/// How far a patch with these directions in its corners is off, and how much its scale is, if the lens sees `middles` in
/// the middles of its sides.
///
/// In the corners it is right. So with `e_k` its error in the middle of side `k` and barycentric coordinates `l`, it is off
/// by the quadratic function `Σ 4 e_k l_i l_j`, whose derivative is largest in a corner.
fn errors(patch: &Patch, directions: &[DVec3; 3], middles: &[DVec3; 3]) -> [f64; 2] {
    let corners = patch.corners();
    let next = |k: usize| (k + 1) % 3;
    let (mut off, mut longest) = (0.0_f64, 0.0_f64);
    let errors = [0, 1, 2].map(|k| {
        let weights = patch.weights(middles[k]);
        let error = patch.point(weights) - 0.5 * (corners[k] + corners[next(k)]);
        // How far it may be off between an end and the middle while it is right in the middle, which is what
        // symmetry does.
        let arc = (directions[next(k)] - directions[k]).length_squared();
        let beside = THIRD_ORDER * arc * (corners[next(k)] - corners[k]).length();
        longest = longest.max(arc);
        let here = error.length() + beside;
        off = off.max(if weights.element_sum() > 0.0 && here.is_finite() {
            here
        } else {
            f64::INFINITY
        });
        error
    });
    let twice = 2.0 * patch.area();
    // Of a corner's barycentric coordinate: across the opposite side.
    let slopes = [0, 1, 2].map(|k| {
        let opposite = corners[next(next(k))] - corners[next(k)];
        DVec2::new(-opposite.y, opposite.x) / twice
    });
    let mut most = 0.0_f64;
    for k in 0..3 {
        // The sides that end in the corner lead to the next one, and come from the one before.
        let (after, before) = (next(k), next(next(k)));
        let (e, f) = (4.0 * errors[k], 4.0 * errors[before]);
        let along_x = e * slopes[after].x + f * slopes[before].x;
        let along_y = e * slopes[after].y + f * slopes[before].y;
        most = most.max(along_x.length_squared() + along_y.length_squared());
    }
    let scale_off = most.sqrt() + SCALE_OF_CUBIC * THIRD_ORDER * longest;
    [
        off,
        if off.is_finite() {
            scale_off
        } else {
            f64::INFINITY
        },
    ]
}

/// How far from `point` a patch shows the direction that is seen there, in pixels.
pub(super) fn off_at(patch: &Patch, direction: DVec3, point: DVec2) -> f64 {
    let weights = patch.weights(direction);
    if weights.element_sum() <= 0.0 {
        return f64::INFINITY;
    }
    let off = (patch.point(weights) - point).length();
    if off.is_nan() { f64::INFINITY } else { off }
}
