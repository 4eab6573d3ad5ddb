//! Point samples: a third opinion, by asking at many points which face is nearest.

use super::rng::Rng;
use veduta::geometry::DVec2;
use veduta::map::{FaceId, Faces};

/// Samples along each side of a pixel; 4,096 in the pixel.
pub const SIDE: u32 = 64;

/// What share of a pixel's samples shows each face. Sorted by pixel and face; zeros are left out.
pub struct Shares {
    pub opaque: Vec<(u32, u32, f64)>,
    pub veils: Vec<(u32, u32, f64)>,
}

/// Samples each pixel of a grid at one random point in each of its `SIDE * SIDE` squares.
pub fn sample(faces: &Faces, width: u32, height: u32, seed: u64) -> Shares {
    let mut rng = Rng::new(seed);
    let mut shares = Shares {
        opaque: Vec::new(),
        veils: Vec::new(),
    };
    for pixel in 0..width * height {
        let corner = DVec2::new(f64::from(pixel % width), f64::from(pixel / width));
        let size = DVec2::new(f64::from(width), f64::from(height));
        let near = touching(faces, corner / size, (corner + 1.0) / size);
        let (mut opaque, mut veils) = (Vec::new(), Vec::new());
        for square in 0..SIDE * SIDE {
            let square = DVec2::new(f64::from(square % SIDE), f64::from(square / SIDE));
            let jitter = DVec2::new(rng.unit(), rng.unit());
            let point = (corner + (square + jitter) / f64::from(SIDE)) / size;
            let seen = nearest(faces, &near, point);
            opaque.extend(seen.map(|face| face.0));
            veils.extend(
                near.iter()
                    .filter(|&&face| faces.is_veil(face) && contains(faces, face, point))
                    .filter(|&&face| seen.is_none_or(|seen| is_in_front(faces, face, seen, point)))
                    .map(|face| face.0),
            );
        }
        count(pixel, opaque, &mut shares.opaque);
        count(pixel, veils, &mut shares.veils);
    }
    shares
}

/// The nearest opaque face at a point.
pub fn nearest_at(faces: &Faces, point: DVec2) -> Option<FaceId> {
    nearest(faces, &touching(faces, point, point), point)
}

fn nearest(faces: &Faces, candidates: &[FaceId], point: DVec2) -> Option<FaceId> {
    candidates
        .iter()
        .copied()
        .filter(|&face| !faces.is_veil(face) && contains(faces, face, point))
        .reduce(|nearest, face| {
            if is_in_front(faces, face, nearest, point) {
                face
            } else {
                nearest
            }
        })
}

/// Faces whose bounding box touches the given one.
fn touching(faces: &Faces, low: DVec2, high: DVec2) -> Vec<FaceId> {
    faces
        .ids()
        .filter(|&face| {
            let outline = faces.outline(face);
            let (mut from, mut to) = (outline[0], outline[0]);
            for &vertex in outline {
                from = from.min(vertex);
                to = to.max(vertex);
            }
            from.cmple(high).all() && to.cmpge(low).all()
        })
        .collect()
}

/// Whether the point is on the inner side of every edge of a positively wound outline.
fn contains(faces: &Faces, face: FaceId, point: DVec2) -> bool {
    let outline = faces.outline(face);
    (0..outline.len()).all(|index| {
        let from = outline[index];
        let to = outline[(index + 1) % outline.len()];
        (to - from).perp_dot(point - from) >= 0.0
    })
}

fn is_in_front(faces: &Faces, face: FaceId, other: FaceId, point: DVec2) -> bool {
    let nearness = |face| faces.face_nearness(face).at(point);
    if faces.face_nearness(face) == faces.face_nearness(other) {
        // A veil on a wall is seen.
        match (faces.is_veil(face), faces.is_veil(other)) {
            (true, false) => true,
            (false, true) => false,
            _ => face < other,
        }
    } else {
        nearness(face) > nearness(other)
    }
}

fn count(pixel: u32, mut seen: Vec<u32>, shares: &mut Vec<(u32, u32, f64)>) {
    seen.sort_unstable();
    for run in seen.chunk_by(|face, other| face == other) {
        let share = run.len() as f64 / f64::from(SIDE * SIDE);
        shares.push((pixel, run[0], share));
    }
}

/// How far a share of samples may be from an area.
///
/// Only squares that the region's outline passes through can be wrong, and each by at most its own
/// sample, independently of the others and right on average. So by Hoeffding's inequality a sum over
/// `n` such squares is off by more than `t` with a probability of at most `2 exp(-2 t^2 / n)`. An
/// outline of length `l` pixels in a pixel touches at most `2 SIDE l` squares and a few for each
/// polygon.
pub fn tolerance(perimeter: f64, fragments: u32) -> f64 {
    /// So small that all comparisons of a test together are sound.
    const PROBABILITY: f64 = 1e-12;
    let squares = 2.0 * f64::from(SIDE) * perimeter + 8.0 * f64::from(fragments);
    let squares = squares.min(f64::from(SIDE * SIDE));
    (0.5 * squares * (2.0 / PROBABILITY).ln()).sqrt() / f64::from(SIDE * SIDE)
}
