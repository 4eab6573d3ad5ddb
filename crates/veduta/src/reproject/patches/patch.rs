use veduta_geometry::{DMat3, DVec2, DVec3, cross};

/// A triangle of a picture, with the perspective by which it is seen.
///
/// A point of it with barycentric coordinates `w` sees the direction `Σ w_i d_i`, with `d_i` the directions of
/// the corners: a perspective picture, whose camera looks at the triangle askew. Their lengths tell how directions are
/// spaced between the corners. Directions are in eye space (x
/// right, y down, z forward) of the eye that stands in the middle of the picture's world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Corners in pixels of the picture, positively wound.
    corners: [DVec2; 3],
    /// The directions of the corners, as columns.
    directions: DMat3,
    /// Its inverse: weights of the corners from a direction.
    weights_from_direction: DMat3,
    /// Factor of all areas: 1, but in pixels that the rim of a round picture passes through, where the patches have
    /// a polygon in place of the arc.
    pub share: f64,
}

/// Corners whose directions span less than this, by the square of their longest distance, are taken to lie on a
/// line. Larger would move the picture near poles; smaller would leave only rounding of the directions.
const LEAST_SPAN: f64 = 1e-9;

/// The most by which lengths of directions differ in a patch, as a logarithm. Larger would do no good; without bounds, a
/// corner at a pole would have none.
const MOST_UNEVEN: f64 = 2.0;

impl Patch {
    /// The triangle with these corners, positively wound, and their unit directions, spaced so that it sees
    /// `middles` near the middles of its sides, in the order of the corners that they follow. `None` as of
    /// [`Patch::new`].
    ///
    /// With directions of one length, what is seen in the middle of a side is shown nearer to one of its ends, as if that
    /// end's direction were too short for it. Three sides ask for more than three lengths can give: what is left goes
    /// to short sides, where it moves least.
    pub fn through(
        corners: [DVec2; 3],
        directions: [DVec3; 3],
        middles: [DVec3; 3],
    ) -> Option<Self> {
        let plain = Self::new(corners, directions)?;
        let mut wanted = [0.0; 3];
        let mut give = [0.0; 3];
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let side = b - a;
            let shown = plain.point(plain.weights(middles[k]));
            // Along the side, from its middle; what is off across it no length helps.
            let along = (shown - 0.5 * (a + b)).dot(side) / side.length_squared();
            // The logarithm of the ratio of lengths that moves it back.
            let ratio = ((0.5 + along) / (0.5 - along)).ln();
            wanted[k] = if ratio.is_finite() { ratio } else { 0.0 };
            give[k] = side.length_squared().recip();
        }
        let left = wanted.iter().sum::<f64>() / give.iter().sum::<f64>();
        let step = |k: usize| (wanted[k] - left * give[k]).clamp(-MOST_UNEVEN, MOST_UNEVEN);
        Some(plain.with_lengths([1.0, step(0).exp(), (-step(2)).exp()]))
    }

    /// The same triangle with directions of these lengths.
    fn with_lengths(self, [l0, l1, l2]: [f64; 3]) -> Self {
        let [d0, d1, d2] = self.directions();
        let lengths = DMat3::from_diagonal(DVec3::new(l0.recip(), l1.recip(), l2.recip()));
        Self {
            directions: DMat3::from_cols(d0 * l0, d1 * l1, d2 * l2),
            weights_from_direction: lengths * self.weights_from_direction,
            ..self
        }
    }

    /// The triangle with these corners, positively wound, and their unit directions. `None` where the directions lie
    /// on a great circle, as at a pole: nothing has an extent there.
    pub fn new(corners: [DVec2; 3], directions: [DVec3; 3]) -> Option<Self> {
        let [d0, d1, d2] = directions;
        // Of the differences, which are small and nearly exact, not of the directions, which are nearly the same.
        let sides = [d2 - d1, d0 - d2, d1 - d0];
        let normals = [d1.cross(sides[0]), d2.cross(sides[1]), d0.cross(sides[2])];
        let span = d0.dot(sides[1].cross(sides[2]));
        let longest = sides
            .map(DVec3::length_squared)
            .into_iter()
            .fold(0.0, f64::max);
        if span.is_nan() || span.abs() <= LEAST_SPAN * longest {
            return None;
        }
        let [n0, n1, n2] = normals.map(|normal| normal / span);
        Some(Self {
            corners,
            directions: DMat3::from_cols(d0, d1, d2),
            weights_from_direction: DMat3::from_cols(n0, n1, n2).transpose(),
            share: 1.0,
        })
    }

    /// Corners in pixels.
    pub fn corners(&self) -> &[DVec2; 3] {
        &self.corners
    }

    /// Directions of the corners, of lengths that space what is between them.
    pub fn directions(&self) -> [DVec3; 3] {
        let columns = &self.directions;
        [columns.x_axis, columns.y_axis, columns.z_axis]
    }

    /// Area in square pixels.
    pub fn area(&self) -> f64 {
        let [a, b, c] = self.corners;
        0.5 * cross(b - a, c - a)
    }

    /// Weights of the corners in a direction, up to a positive factor. None is negative where the patch sees the
    /// direction.
    #[inline(always)]
    pub fn weights(&self, direction: DVec3) -> DVec3 {
        self.weights_from_direction * direction
    }

    /// The picture's point with these weights.
    #[inline(always)]
    pub fn point(&self, weights: DVec3) -> DVec2 {
        let [a, b, c] = self.corners;
        let sum = weights.x + weights.y + weights.z;
        a + ((b - a) * weights.y + (c - a) * weights.z) / sum
    }

    /// The direction at a point of the patch, up to a positive factor, and how it changes along x and y of the
    /// picture. What rounding has put outside is moved to the border.
    pub fn look(&self, point: DVec2) -> [DVec3; 3] {
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let twice = cross(ab, ac);
        let v = (cross(point - a, ac) / twice).max(0.0);
        let w = (cross(ab, point - a) / twice).max(0.0);
        let u = (1.0 - v - w).max(0.0);
        let [d0, d1, d2] = self.directions();
        let (along_b, along_c) = ((d1 - d0) / twice, (d2 - d0) / twice);
        [
            (d0 * u + d1 * v + d2 * w) / (u + v + w),
            along_b * ac.y - along_c * ab.y,
            along_c * ab.x - along_b * ac.x,
        ]
    }

    /// A linear function of directions (its vector is given) as one of the picture's points from `corner` on.
    pub fn along_picture(&self, function: DVec3, corner: DVec2) -> veduta_geometry::Affine {
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let twice = cross(ab, ac);
        let [at_a, at_b, at_c] = self.directions().map(|direction| function.dot(direction));
        let (along_b, along_c) = ((at_b - at_a) / twice, (at_c - at_a) / twice);
        let x = along_b * ac.y - along_c * ab.y;
        let y = along_c * ab.x - along_b * ac.x;
        let from_a = corner - a;
        veduta_geometry::Affine::new(x, y, at_a + x * from_a.x + y * from_a.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch() -> Patch {
        let corners = [(3.0, 1.0), (9.0, 2.0), (4.0, 7.0)].map(DVec2::from);
        let directions = [(0.1, -0.3, 1.0), (0.4, -0.2, 0.9), (0.2, 0.1, 0.8)];
        let directions = directions.map(|d| DVec3::from(d).normalize());
        Patch::new(corners, directions).expect("spans something")
    }

    #[test]
    fn a_direction_seen_at_a_point_is_seen_there() {
        let patch = patch();
        for point in [(4.0, 3.0), (5.0, 2.5), (7.0, 2.2)].map(DVec2::from) {
            let [direction, along_x, along_y] = patch.look(point);
            let weights = patch.weights(3.0 * direction);
            assert!(weights.min_element() >= 0.0);
            assert!((patch.point(weights) - point).length() < 1e-13);
            for (step, along) in [(DVec2::X, along_x), (DVec2::Y, along_y)] {
                let ahead = patch.look(point + 1e-3 * step)[0];
                assert!(((ahead - direction) / 1e-3 - along).length() < 1e-12);
            }
            let function = DVec3::new(0.3, -2.0, 0.7);
            let corner = DVec2::new(4.0, 2.0);
            let affine = patch.along_picture(function, corner);
            let off = affine.at(point - corner) - function.dot(direction);
            assert!(off.abs() < 1e-14, "{off}");
        }
    }

    #[test]
    fn a_patch_at_a_pole_has_no_extent() {
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(DVec2::from);
        let pole = DVec3::new(6e-17, 1.0, 0.0);
        let beside = DVec3::new(1e-4, 1.0, 0.0).normalize();
        assert_eq!(Patch::new(corners, [pole, DVec3::Y, beside]), None);
    }
}
