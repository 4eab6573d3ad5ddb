use super::Parts;
use veduta_geometry::DVec2;
use veduta_map::FaceId;

/// What of a pixel shows a face, in however many fragments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// The pixel, counted from the band's first one.
    pub pixel: u32,
    /// The face.
    pub face: FaceId,
    /// A fragment of the face: the first that the pixel shows.
    pub fragment: u32,
    /// Area in square pixels, more than 0.
    pub area: f64,
    /// Integral of the position over the area, from the pixel's top left corner.
    pub moment: DVec2,
}

impl Share {
    /// Centroid of the area, from the pixel's top left corner: a point of the face, since faces are
    /// convex. Of a face whose centroids [`dice`](super::dice) was not asked for, the pixel's centre.
    pub fn centroid(&self) -> DVec2 {
        (self.moment / self.area).clamp(DVec2::ZERO, DVec2::ONE)
    }
}

/// Sums up parts: a row for each pair of a pixel and a face in it, ascending by pixel and face.
/// `shares` is overwritten.
///
/// `shown` are the faces of the fragments that the parts refer to.
pub fn sum_by_face(parts: &Parts, shown: &[FaceId], shares: &mut Vec<Share>) {
    shares.clear();
    let share = |pixel: u32, fragment: u32, area: f64, centroid: DVec2| Share {
        pixel,
        face: shown[fragment as usize],
        fragment,
        area,
        moment: area * centroid,
    };
    // An area that single precision rounds to nothing is nothing: the light does not count it either.
    let boundary = parts.boundary.iter().filter(|part| part.area > 0.0);
    shares.extend(boundary.map(|part| {
        let centroid = part.centroid.as_dvec2();
        share(part.pixel, part.fragment, f64::from(part.area), centroid)
    }));
    for run in &parts.runs {
        let pixels = run.pixel..run.pixel + run.length;
        shares.extend(pixels.map(|pixel| share(pixel, run.fragment, 1.0, DVec2::splat(0.5))));
    }
    // A stable sort: fragments of a face are summed in their order.
    shares.sort_by_key(|share| (share.pixel, share.face));
    shares.dedup_by(|next, first| {
        let same = (next.pixel, next.face) == (first.pixel, first.face);
        if same {
            first.area += next.area;
            first.moment += next.moment;
        }
        same
    });
}

/// Of each pixel that shows a face, the one that covers most of it; of equals the first. `shares` are
/// as [`sum_by_face`] makes them.
pub fn largest(shares: &[Share]) -> impl Iterator<Item = &Share> {
    let pixels = shares.chunk_by(|a, b| a.pixel == b.pixel);
    pixels.filter_map(|of_pixel| {
        let shares = of_pixel.iter();
        shares.reduce(|best, next| if next.area > best.area { next } else { best })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dice::{Part, Run};
    use veduta_geometry::Vec2;

    fn part(pixel: u32, fragment: u32, area: f32, centroid: (f32, f32)) -> Part {
        Part {
            pixel,
            fragment,
            area,
            centroid: Vec2::from(centroid),
        }
    }

    #[test]
    fn fragments_of_a_face_are_one_share() {
        let shown = [4, 4, 7].map(FaceId);
        let parts = Parts {
            boundary: vec![
                part(1, 0, 0.25, (0.25, 0.5)),
                part(1, 1, 0.25, (0.75, 0.5)),
                part(1, 2, 0.375, (0.5, 0.125)),
                part(3, 2, 0.0, (0.5, 0.5)),
            ],
            runs: vec![Run {
                pixel: 4,
                length: 2,
                fragment: 2,
            }],
        };
        let mut shares = Vec::new();
        sum_by_face(&parts, &shown, &mut shares);
        let told: Vec<_> = shares
            .iter()
            .map(|share| (share.pixel, share.face.0, share.fragment, share.area))
            .collect();
        assert_eq!(
            told,
            [
                (1, 4, 0, 0.5),
                (1, 7, 2, 0.375),
                (4, 7, 2, 1.0),
                (5, 7, 2, 1.0)
            ]
        );
        assert_eq!(shares[0].centroid(), DVec2::splat(0.5));
        // Neither fragment of face 4 is as large as that of face 7, but both together are.
        let largest: Vec<_> = largest(&shares)
            .map(|share| (share.pixel, share.face.0))
            .collect();
        assert_eq!(largest, [(1, 4), (4, 7), (5, 7)]);
    }

    #[test]
    fn of_equal_shares_the_first_face_is_taken() {
        let shown = [2, 5].map(FaceId);
        let halves = [part(0, 1, 0.5, (0.5, 0.5)), part(0, 0, 0.5, (0.5, 0.5))];
        let parts = Parts {
            boundary: halves.to_vec(),
            runs: Vec::new(),
        };
        let mut shares = Vec::new();
        sum_by_face(&parts, &shown, &mut shares);
        assert_eq!(
            largest(&shares)
                .map(|share| share.face.0)
                .collect::<Vec<_>>(),
            [2]
        );
    }
}
