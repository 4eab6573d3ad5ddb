use crate::{Camera, FaceId, Faces, Fragment, Fragments};
use veduta_geometry::{Cells, DVec2, GridAreas, signed_area};

/// Which face is seen where: the result of finding visibility, and the input of all that follows.
///
/// `opaque` partitions what is covered of the frame; the rest is background. `veils` are fragments
/// of faces that are not fully opaque: cut by opaque faces only, they may overlap one another.
#[derive(Clone, Debug, PartialEq)]
pub struct VisibilityMap {
    /// The camera it was seen through.
    pub camera: Camera,
    /// The seen faces. (Others may be in the table too.)
    pub faces: Faces,
    /// Regions in which opaque faces are seen.
    pub opaque: Fragments,
    /// Regions in which faces that are not fully opaque are seen.
    pub veils: Fragments,
}

/// An invariant of the map that does not hold.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Invariant {
    /// Fragments name faces of the table.
    #[error("fragment {fragment} is of face {face:?}, but there are {faces} faces")]
    UnknownFace {
        /// Index of the fragment.
        fragment: usize,
        /// What it names.
        face: FaceId,
        /// Rows of the face table.
        faces: usize,
    },
    /// Fragments are positively wound and convex.
    #[error("fragment {fragment} of face {face:?} is not a convex polygon wound positively")]
    NotConvex {
        /// Index of the fragment.
        fragment: usize,
        /// Its face.
        face: FaceId,
    },
    /// Fragments lie in the frame.
    #[error("fragment {fragment} of face {face:?} has the vertex {vertex}, outside the frame")]
    OutsideFrame {
        /// Index of the fragment.
        fragment: usize,
        /// Its face.
        face: FaceId,
        /// The vertex.
        vertex: DVec2,
    },
    /// Opaque fragments do not overlap, so their areas sum to at most the frame's.
    #[error("opaque fragments cover {area} of the frame, more than all of it")]
    Overlap {
        /// The sum of the areas, where the frame's is 1.
        area: f64,
    },
    /// Nor do they anywhere sum to more than there is.
    #[error("opaque fragments overlap at {place}: they cover {area} of a small square around it")]
    OverlapAt {
        /// The middle of the square, in the image plane.
        place: DVec2,
        /// The sum of the areas, where the square's is 1.
        area: f64,
    },
}

/// Squares along each side of the frame in which areas are summed to find overlaps. More find smaller ones
/// beside gaps, and take longer.
const SQUARES: u32 = 256;

/// What the areas in a square may sum to beyond 1. Larger would hide overlaps; smaller would report the
/// last bits of squares that thousands of fragments share.
const MOST_OVERLAP: f64 = 1e-6;

/// How far outside the frame, or on the wrong side of convex, rounding may put a vertex. Larger
/// would hide real faults; smaller would report the last bits of sound maps.
const ROUNDING: f64 = 1e-12;

impl VisibilityMap {
    /// Number of fragments, veils included.
    pub fn fragment_count(&self) -> usize {
        self.opaque.len() + self.veils.len()
    }

    /// Fragment `index`, where those of veils are numbered after all opaque ones.
    #[inline]
    pub fn fragment(&self, index: usize) -> Fragment<'_> {
        match index.checked_sub(self.opaque.len()) {
            None => self.opaque.get(index),
            Some(veil) => self.veils.get(veil),
        }
    }

    /// The face of [fragment](VisibilityMap::fragment) `index`.
    #[inline]
    pub fn face_of(&self, index: usize) -> FaceId {
        match index.checked_sub(self.opaque.len()) {
            None => self.opaque.face(index),
            Some(veil) => self.veils.face(veil),
        }
    }

    /// The faces of all fragments: of opaque ones, ascending, then of veils, ascending.
    pub fn shown_faces(&self) -> Vec<FaceId> {
        (0..self.fragment_count())
            .map(|index| self.face_of(index))
            .collect()
    }

    /// The polygon of a fragment, whole faces included.
    #[inline]
    pub fn polygon<'a>(&'a self, fragment: Fragment<'a>) -> &'a [DVec2] {
        match fragment {
            Fragment::Whole(face) => self.faces.outline(face),
            Fragment::Cut { vertices, .. } => vertices,
        }
    }

    /// The opaque fragment that is seen at a point of the image plane: an index into
    /// [`VisibilityMap::opaque`]. `None` for the background.
    ///
    /// On the border between fragments it is the first of them. Takes time in proportion to the number
    /// of fragments.
    pub fn opaque_at(&self, image: DVec2) -> Option<usize> {
        let mut fragments = self.opaque.iter();
        fragments.position(|fragment| self.contains(fragment, image))
    }

    /// The veils that what is opaque at a point of the image plane is seen through, nearest first: indices
    /// into [`VisibilityMap::veils`], of each face one. Of veils that are as near the smaller face comes first.
    ///
    /// Takes time in proportion to the number of fragments.
    pub fn veils_at(&self, image: DVec2) -> Vec<usize> {
        let fragments = self.veils.iter().enumerate();
        let mut found: Vec<usize> = fragments
            .filter(|&(_, fragment)| self.contains(fragment, image))
            .map(|(index, _)| index)
            .collect();
        // On the border between fragments of a face both hold the point.
        found.dedup_by_key(|&mut index| self.veils.face(index));
        found.sort_by(|&one, &other| {
            let [one, other] = [one, other].map(|index| self.veils.face(index));
            let nearness = |face| self.faces.face_nearness(face).at(image);
            nearness(other)
                .total_cmp(&nearness(one))
                .then(one.cmp(&other))
        });
        found
    }

    fn contains(&self, fragment: Fragment, image: DVec2) -> bool {
        let polygon = self.polygon(fragment);
        (0..polygon.len()).all(|k| {
            let (from, to) = (polygon[k], polygon[(k + 1) % polygon.len()]);
            veduta_geometry::cross(to - from, image - from) >= 0.0
        })
    }

    /// Checks the invariants; the first that fails is returned.
    ///
    /// # Errors
    /// The broken [`Invariant`] and the place where it is broken.
    pub fn check(&self) -> Result<(), Invariant> {
        self.check_fragments(&self.veils)?;
        let area = self.check_fragments(&self.opaque)?;
        if area > 1.0 + 1e-9 {
            return Err(Invariant::Overlap { area });
        }
        self.check_overlaps()
    }

    /// Sums up what opaque fragments cover of each of a grid of squares.
    fn check_overlaps(&self) -> Result<(), Invariant> {
        let mut areas = vec![0.0; (SQUARES * SQUARES) as usize];
        let mut grid_areas = GridAreas::new();
        let mut scaled = Vec::new();
        for fragment in self.opaque.iter() {
            scaled.clear();
            let polygon = self.polygon(fragment).iter();
            scaled.extend(polygon.map(|&vertex| vertex * f64::from(SQUARES)));
            grid_areas.each_cell(&scaled, SQUARES, 0..SQUARES, |cells| {
                let (row, columns, area) = match cells {
                    Cells::Boundary { column, row, area } => (row, column..column + 1, area),
                    Cells::Inside { row, columns } => (row, columns, 1.0),
                };
                for column in columns {
                    areas[(row * SQUARES + column) as usize] += area;
                }
            });
        }
        let over = areas.iter().position(|&area| area > 1.0 + MOST_OVERLAP);
        match over {
            None => Ok(()),
            Some(square) => {
                let (x, y) = (square as u32 % SQUARES, square as u32 / SQUARES);
                let corner = DVec2::new(f64::from(x), f64::from(y));
                Err(Invariant::OverlapAt {
                    place: (corner + 0.5) / f64::from(SQUARES),
                    area: areas[square],
                })
            }
        }
    }

    fn check_fragments(&self, fragments: &Fragments) -> Result<f64, Invariant> {
        let mut sum = 0.0;
        for (index, fragment) in fragments.iter().enumerate() {
            let face = fragment.face();
            if face.index() >= self.faces.len() {
                let faces = self.faces.len();
                return Err(Invariant::UnknownFace {
                    fragment: index,
                    face,
                    faces,
                });
            }
            let polygon = self.polygon(fragment);
            for &vertex in polygon {
                let inside = (vertex - 0.5).abs().max_element() <= 0.5 + ROUNDING;
                if !inside {
                    return Err(Invariant::OutsideFrame {
                        fragment: index,
                        face,
                        vertex,
                    });
                }
            }
            let area = signed_area(polygon);
            let turns_left = (0..polygon.len()).any(|k| {
                let [p, q, r] = [0, 1, 2].map(|step| polygon[(k + step) % polygon.len()]);
                veduta_geometry::cross(q - p, r - q) < -ROUNDING
            });
            if area <= 0.0 || !area.is_finite() || turns_left {
                return Err(Invariant::NotConvex {
                    fragment: index,
                    face,
                });
            }
            sum += area;
        }
        Ok(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ObjectId, Projection, Side};
    use veduta_geometry::{Affine, DVec3};

    #[test]
    fn a_point_finds_the_fragment_that_it_lies_in() {
        let lens = Projection::Parallel {
            height: 1.0,
            aspect: 1.0,
        };
        let camera = Camera::looking(DVec3::ZERO, DVec3::Y, DVec3::Z, lens, 0.0);
        let mut faces = Faces::new();
        let plane = faces.push_plane(Affine::new(0.0, 0.0, 1.0));
        let square = [[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]].map(DVec2::from);
        let [below, right] = [DVec2::new(0.0, 0.5), DVec2::new(0.25, 0.0)];
        let mut push = |by: DVec2| {
            let outline = square.map(|corner| corner + by);
            faces
                .push(&outline, plane, ObjectId(0), 0)
                .expect("has an area")
        };
        let (first, second) = (push(DVec2::ZERO), push(right));
        let mut opaque = Fragments::new();
        opaque.push_whole(first);
        // What the first leaves of the second.
        let rest = [square[1], square[1] + right, square[2] + right, square[2]];
        let side = Side::of_outline(first, 1);
        opaque.push_cut(second, rest.map(|vertex| (vertex, side)).into_iter());
        let map = VisibilityMap {
            camera: camera.expect("a sound camera"),
            faces,
            opaque,
            veils: Fragments::new(),
        };
        map.check().expect("sound");
        let mut twice = map.clone();
        twice
            .opaque
            .push_cut(second, square.map(|vertex| (vertex, side)).into_iter());
        let Err(Invariant::OverlapAt { place, area }) = twice.check() else {
            panic!("the second is seen where the first is, in a quarter of the frame");
        };
        assert!((place - square[0]).max_element() < 0.01 && (area - 2.0).abs() < 1e-9);
        let middle = DVec2::splat(0.5);
        assert_eq!(map.opaque_at(middle), Some(0));
        assert_eq!(map.opaque_at(DVec2::new(0.875, 0.5)), Some(1));
        assert_eq!(
            map.opaque_at(square[1]),
            Some(0),
            "the first of two on the border"
        );
        assert_eq!(map.opaque_at(middle + below), None);
    }
}
