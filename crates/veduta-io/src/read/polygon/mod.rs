//! Polygons with any number of corners and holes -> convex faces, as few as can be had cheaply.
//!
//! A convex planar polygon stays one face. Others are made rings without holes ([`rings`]: corners
//! that touch a side become corners of it, holes are joined to the outline by bridges), cut into
//! triangles ([`ears`]), and the triangles joined to convex parts ([`convex_parts`]). Parts over which
//! something does not go evenly (they are bent, or their texture is) become triangles again.
//!
//! All this is done in the plane of the two coordinates in which the polygon is largest, by the
//! vector area of its outline (Newell's), relative to its first corner. That is an affine image of
//! the polygon's own plane, in which turns are what they are there, and it keeps coordinates as they
//! are: three corners that lie exactly on a line do so there, however large the coordinates.

mod convex_parts;
mod ears;
mod rings;

use veduta_geometry::{DVec2, DVec3, Vec2, cross};

/// A polygon as a file gives it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Polygon<'a> {
    /// Corners of the outline, then those of the holes. The outline tells the front; holes may go
    /// round either way.
    pub points: &'a [DVec3],
    /// Where the points of each ring end, ascending; the last is the number of points.
    pub ring_ends: &'a [usize],
    /// A row for each point, or none.
    pub texcoords: &'a [Vec2],
    /// How far corners may lie off a plane because their coordinates are rounded, in the unit of
    /// `points`.
    pub rounding: f64,
}

/// What became of a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cut {
    /// Its faces cover it once.
    Sound,
    /// It has no area, and no face.
    NoArea,
    /// It crosses itself, or is too intricate, so that its faces may overlap.
    Crossing,
}

/// Cuts the polygons of one file.
#[derive(Debug)]
pub(crate) struct PolygonCutter {
    effort: Effort,
    flat: Vec<DVec2>,
    outline: Vec<usize>,
}

/// Comparisons of a corner with others that one file may cost: some seconds. Cutting is quadratic
/// for honest polygons, but there are cubic ones.
const MOST_EFFORT: u64 = 1 << 32;

/// How deep a corner may lie inside the line of its neighbours and still count as straight, as a
/// share of the polygon's extent: rounding in double precision. More would give the engine faces
/// that are not convex; less would cut polygons at corners that lie on straight sides.
const DENT: f64 = 1e-12;

/// Deviation of a texture coordinate that counts as rounding: what is left of four printed decimals,
/// and less than half a pixel of a picture of 4096. More would shift textures visibly.
const TEXCOORD_ROUNDING: f32 = 1e-4;

#[derive(Debug)]
struct Effort {
    left: u64,
}

impl Effort {
    /// False when there is no more.
    fn spend(&mut self, steps: usize) -> bool {
        self.left = self.left.saturating_sub(steps as u64);
        self.left > 0
    }
}

/// How far corners may lie off their plane where a file does not say how its coordinates were
/// rounded: four units in the last place of single precision, or a printed decimal of six places,
/// but never more than a ten thousandth of the polygon's extent, which would be its shape.
pub(crate) fn usual_rounding(points: &[DVec3]) -> f64 {
    const SINGLE: f64 = 4.0 * 0.5 / (1 << 23) as f64;
    const PRINTED: f64 = 1e-6;
    const MOST: f64 = 1e-4;
    let Some(&first) = points.first() else {
        return 0.0;
    };
    let largest = |largest: f64, p: DVec3| largest.max(p.abs().max_element());
    let reach = points.iter().fold(0.0, |r, &p| largest(r, p));
    let extent = points.iter().fold(0.0, |r, &p| largest(r, p - first));
    (SINGLE * reach + PRINTED).min(MOST * extent)
}

impl PolygonCutter {
    pub fn new() -> Self {
        Self {
            effort: Effort { left: MOST_EFFORT },
            flat: Vec::new(),
            outline: Vec::new(),
        }
    }

    /// Gives the faces of a polygon to `emit`, as rows of its points, wound like its outline:
    /// triangles, or convex polygons that are planar and evenly textured.
    pub fn cut(&mut self, polygon: &Polygon<'_>, mut emit: impl FnMut(&[usize])) -> Cut {
        let points = polygon.points;
        let first_end = polygon.ring_ends.first().copied().unwrap_or(0);
        self.outline.clear();
        self.outline.extend(0..first_end);
        rings::clean(&mut self.outline, |a, b| points[a] == points[b]);
        if self.outline.len() < 3 || !self.flatten(points) {
            return Cut::NoArea;
        }
        let shape = Shape::new(&self.flat);
        if polygon.ring_ends.len() <= 1 && shape.is_convex(&self.outline) {
            emit_part(polygon, &self.flat, &self.outline, &mut emit);
            return Cut::Sound;
        }
        let rings = rings::sorted_out(polygon, shape, &self.outline);
        let mut cut = Cut::Crossing;
        let mut triangles = Vec::new();
        // What touches is brought to touch exactly, at first only within rounding of this
        // arithmetic; where the polygon then seems to cross itself, within that of its coordinates.
        for reach in [DENT * shape.extent, polygon.rounding] {
            let (regions, mut sound) = rings::regions(shape, &rings, reach, &mut self.effort);
            triangles.clear();
            for ring in &regions {
                sound &= ears::clip(shape, ring, &mut triangles, &mut self.effort);
            }
            if sound {
                cut = Cut::Sound;
                break;
            }
        }
        if cut == Cut::Sound && triangles.is_empty() {
            // All corners lie on a line, but for rounding.
            cut = Cut::NoArea;
        } else if cut == Cut::Sound {
            for part in convex_parts::join(shape, &triangles) {
                emit_part(polygon, &self.flat, &part, &mut emit);
            }
        } else {
            // Parts of what crosses itself need not be convex.
            for triangle in &triangles {
                emit(triangle);
            }
        }
        cut
    }

    /// Lays the points on the coordinate plane in which the outline's area is largest, so that it
    /// goes round counterclockwise. False if it has no area.
    fn flatten(&mut self, points: &[DVec3]) -> bool {
        let origin = points[self.outline[0]];
        // Twice the vector area; relative to a corner, so that far polygons lose nothing.
        let normal: DVec3 = self
            .outline
            .windows(2)
            .map(|edge| (points[edge[0]] - origin).cross(points[edge[1]] - origin))
            .sum();
        if !normal.is_finite() || normal == DVec3::ZERO {
            return false;
        }
        let size = normal.abs();
        let (u, v) = if size.z >= size.x && size.z >= size.y {
            (0, 1)
        } else if size.x >= size.y {
            (1, 2)
        } else {
            (2, 0)
        };
        let facing = normal[3 - u - v];
        let sign = if facing < 0.0 { -1.0 } else { 1.0 };
        self.flat.clear();
        self.flat.extend(points.iter().map(|&point| {
            let point = point - origin;
            DVec2::new(sign * point[u], point[v])
        }));
        true
    }
}

/// A polygon's points in the plane, and what is exact there.
#[derive(Clone, Copy)]
struct Shape<'a> {
    flat: &'a [DVec2],
    /// The largest coordinate.
    extent: f64,
}

impl<'a> Shape<'a> {
    fn new(flat: &'a [DVec2]) -> Self {
        let largest = |largest: f64, p: &DVec2| largest.max(p.abs().max_element());
        let extent = flat.iter().fold(0.0, largest);
        Self { flat, extent }
    }

    /// Positive where the path a, b, c turns left, zero where the three lie on a line; the sign is
    /// exact (Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
    /// predicates", 1997).
    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        let coord = |index: usize| robust::Coord {
            x: self.flat[index].x,
            y: self.flat[index].y,
        };
        robust::orient2d(coord(a), coord(b), coord(c))
    }

    /// Whether the path a, b, c turns left or goes straight on, but for rounding.
    fn is_convex_corner(&self, a: usize, b: usize, c: usize) -> bool {
        let (p, q, r) = (self.flat[a], self.flat[b], self.flat[c]);
        let (before, after, across) = (q - p, r - q, r - p);
        let dent = DENT * self.extent * (across.x.abs() + across.y.abs());
        let turn = cross(before, after);
        turn > dent || (turn >= -dent && before.dot(after) > 0.0)
    }

    /// Whether a ring turns left at every corner, or nowhere, and goes round once.
    fn is_convex(&self, ring: &[usize]) -> bool {
        let n = ring.len();
        let corner = |k: usize| ring[k % n];
        let turns_left = |k: usize| self.is_convex_corner(corner(k), corner(k + 1), corner(k + 2));
        if !(0..n).all(turns_left) {
            return false;
        }
        if n < 5 {
            return true;
        }
        // A star of five points turns left everywhere, but goes to and fro twice.
        let reversals = |along: fn(DVec2) -> f64| {
            let steps = || {
                (0..n)
                    .map(|k| along(self.flat[corner(k + 1)] - self.flat[corner(k)]))
                    .filter(|&step| step != 0.0)
            };
            let after = steps().skip(1).chain(steps().take(1));
            steps().zip(after).filter(|(a, b)| a * b < 0.0).count()
        };
        reversals(|step| step.x) <= 2 && reversals(|step| step.y) <= 2
    }
}

/// Emits a convex part: as one face where it is planar and evenly textured, else as triangles.
fn emit_part(
    polygon: &Polygon<'_>,
    flat: &[DVec2],
    part: &[usize],
    emit: &mut impl FnMut(&[usize]),
) {
    if part.len() == 3 {
        emit(part);
        return;
    }
    // What goes over a face is told by the first triangle of its fan, which `Mesh::push_polygon`
    // begins where that is largest.
    let n = part.len();
    let corner = |k: usize| part[k % n];
    let area = |k: usize| {
        let [p, q, r] = [k, k + 1, k + 2].map(|k| polygon.points[corner(k)]);
        (q - p).cross(r - p).length_squared()
    };
    // Of equals the first, as there.
    let largest = (0..n).rev().max_by(|&j, &k| area(j).total_cmp(&area(k)));
    let start = largest.unwrap_or(0);
    let first = [start, start + 1, start + 2].map(corner);
    if is_even(polygon, flat, first, part) {
        emit(part);
    } else {
        for k in 2..n {
            emit(&[part[0], part[k - 1], part[k]]);
        }
    }
}

/// Whether all of a part goes on from one of its triangles within rounding.
fn is_even(polygon: &Polygon<'_>, flat: &[DVec2], triangle: [usize; 3], part: &[usize]) -> bool {
    let [p, q, r] = triangle.map(|corner| polygon.points[corner]);
    let normal = (q - p).cross(r - p).normalize_or_zero();
    let is_planar =
        |&corner: &usize| normal.dot(polygon.points[corner] - p).abs() <= polygon.rounding;
    if normal == DVec3::ZERO || !part.iter().all(is_planar) {
        return false;
    }
    if polygon.texcoords.is_empty() {
        return true;
    }
    let [u, v, w] = triangle.map(|corner| polygon.texcoords[corner]);
    let [a, b, c] = triangle.map(|corner| flat[corner]);
    let (ab, ac) = (b - a, c - a);
    let whole = cross(ab, ac);
    part.iter().all(|&corner| {
        let ap = flat[corner] - a;
        let (beta, gamma) = (cross(ap, ac) / whole, cross(ab, ap) / whole);
        let told = u + (v - u) * beta as f32 + (w - u) * gamma as f32;
        // Also false for what is not finite.
        (told - polygon.texcoords[corner]).abs().max_element() <= TEXCOORD_ROUNDING
    })
}

#[cfg(test)]
mod tests;
