//! Which of two faces is in front: the depth order that all engines obey.

use veduta_geometry::{Affine, DVec2};
use veduta_map::{FaceId, Faces};

/// How the nearness of two faces differs over the image plane.
pub(super) enum Difference {
    /// The first face's nearness minus the second's; not zero everywhere.
    Affine(Affine),
    /// They share a plane, in which the first face is seen.
    FirstInFront,
    /// They share a plane, in which the second face is seen.
    SecondInFront,
}

impl Difference {
    /// Compares two faces.
    pub fn of(faces: &Faces, first: FaceId, second: FaceId) -> Self {
        let (plane, other) = (faces.plane(first), faces.plane(second));
        let difference = faces.nearness(plane).minus(faces.nearness(other));
        if plane != other && difference != Affine::default() {
            Self::Affine(difference)
        } else if faces.wins_tie(first, second) {
            Self::FirstInFront
        } else {
            Self::SecondInFront
        }
    }

    /// Whether the first face is in front at `point`.
    pub fn is_in_front(&self, point: DVec2) -> bool {
        match self {
            Self::Affine(difference) => difference.at(point) > 0.0,
            Self::FirstInFront => true,
            Self::SecondInFront => false,
        }
    }
}

/// Relative to the coefficients of two planes, how far apart they may be where faces are said to
/// touch. Only names depend on it: larger would name edges of hidden faces, smaller would leave the
/// edges of faces that touch without a name.
const TOUCHING: f64 = 1e-12;

/// How far `other` is behind `face` at `point`, an affine function of the point in some unit.
///
/// Where it is positive an edge of `other` cannot be where `face` stops being seen. It is never so for
/// the face's own edges, and always for those of veils, which hide nothing.
pub(super) fn behind(faces: &Faces, face: FaceId, other: FaceId, point: DVec2) -> f64 {
    if other == face {
        return -1.0;
    }
    if faces.is_veil(other) {
        return 1.0;
    }
    match Difference::of(faces, face, other) {
        Difference::FirstInFront => 1.0,
        Difference::SecondInFront => -1.0,
        Difference::Affine(difference) => {
            let scale: f64 = [face, other]
                .map(|face| faces.face_nearness(face))
                .map(|plane| plane.a.abs() + plane.b.abs() + plane.c.abs())
                .iter()
                .sum();
            difference.at(point) - TOUCHING * scale
        }
    }
}
