use serde::{Deserialize, Serialize};
use veduta_geometry::{Affine, DMat4, DVec2, DVec3, DVec4};

/// How eye space is projected into the image plane.
///
/// The frame is the unit square of the image plane: `(0, 0)` is the top left corner of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Projection {
    /// Central projection: nearness is 1/z.
    Perspective {
        /// Tangent of half the vertical field of view.
        tan_half_height: f64,
        /// Width over height of the frame.
        aspect: f64,
    },
    /// Parallel projection: nearness is -z.
    Parallel {
        /// Height of the frame, in metres.
        height: f64,
        /// Width over height of the frame.
        aspect: f64,
    },
}

/// A camera: where it stands and how it projects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Rigid motion from world to eye space (x right, y down, z forward).
    pub eye_from_world: DMat4,
    /// How eye space is projected.
    pub projection: Projection,
    /// Depth of the near plane in metres. Positive for perspective; any number for parallel.
    pub near: f64,
    /// How far the frame is moved over the plane of projection, away from the line of sight: to the
    /// right in widths of the frame, upwards in heights of it (a lens shift; a rising front).
    ///
    /// The eye does not turn, so that uprights stay upright: with a shift of (0, 0.25) a quarter of
    /// the frame is seen more above, and as much less below.
    pub shift: DVec2,
}

impl Camera {
    /// A camera at `eye` that looks at `look_at`, with `up` upwards in the picture.
    ///
    /// `None` when the direction is undefined: `eye` and `look_at` coincide, `up` is parallel to
    /// the line between them, or a number is not finite.
    pub fn looking(
        eye: DVec3,
        look_at: DVec3,
        up: DVec3,
        projection: Projection,
        near: f64,
    ) -> Option<Self> {
        let forward = (look_at - eye).try_normalize()?;
        let right = forward.cross(up).try_normalize()?;
        let down = forward.cross(right);
        if !eye.is_finite() {
            return None;
        }
        let eye_from_world = DMat4::from_cols(
            DVec3::new(right.x, down.x, forward.x).extend(0.0),
            DVec3::new(right.y, down.y, forward.y).extend(0.0),
            DVec3::new(right.z, down.z, forward.z).extend(0.0),
            DVec3::new(-right.dot(eye), -down.dot(eye), -forward.dot(eye)).extend(1.0),
        );
        Some(Self {
            eye_from_world,
            projection,
            near,
            shift: DVec2::ZERO,
        })
    }

    /// Whether its frame has an extent and its numbers are finite.
    pub fn is_sound(&self) -> bool {
        let extents = match self.projection {
            Projection::Perspective {
                tan_half_height,
                aspect,
            } => [tan_half_height, aspect],
            Projection::Parallel { height, aspect } => [height, aspect],
        };
        let determinant = self.eye_from_world.determinant();
        extents
            .iter()
            .all(|&extent| extent > 0.0 && extent.is_finite())
            && self.eye_from_world.is_finite()
            && (determinant.is_normal() && self.near.is_finite() && self.shift.is_finite())
    }

    /// The camera with a frame of another shape: its height is kept, and the width grows or shrinks on
    /// both sides of the frame's middle.
    pub fn with_aspect(mut self, aspect: f64) -> Self {
        self.shift.x *= self.aspect() / aspect;
        match &mut self.projection {
            Projection::Perspective { aspect: of, .. }
            | Projection::Parallel { aspect: of, .. } => *of = aspect,
        }
        self
    }

    /// The camera whose frame is a part of this one's, from its left top corner in the image plane to its
    /// right bottom one; the part may reach beyond.
    ///
    /// # Panics
    /// If the part has no extent.
    pub fn with_window(mut self, [min, max]: [DVec2; 2]) -> Self {
        let extent = max - min;
        assert!(extent.cmpgt(DVec2::ZERO).all(), "a window has an extent");
        let ahead = (self.principal_point() - min) / extent;
        self.shift = DVec2::new(0.5 - ahead.x, ahead.y - 0.5);
        let (height, aspect) = match &mut self.projection {
            Projection::Perspective {
                tan_half_height,
                aspect,
            } => (tan_half_height, aspect),
            Projection::Parallel { height, aspect } => (height, aspect),
        };
        *height *= extent.y;
        *aspect *= extent.x / extent.y;
        self
    }

    /// The image point straight ahead: the middle of the frame, unless it is shifted.
    #[inline]
    pub fn principal_point(&self) -> DVec2 {
        // The frame goes one way, what is seen in it the other; y points down.
        DVec2::new(0.5 - self.shift.x, 0.5 + self.shift.y)
    }

    /// Width over height of the frame.
    pub fn aspect(&self) -> f64 {
        match self.projection {
            Projection::Perspective { aspect, .. } | Projection::Parallel { aspect, .. } => aspect,
        }
    }

    /// Scale from eye space (at depth 1 for perspective) to the image plane, along x and y.
    pub fn image_scale(&self) -> DVec2 {
        match self.projection {
            Projection::Perspective {
                tan_half_height,
                aspect,
            } => DVec2::new(0.5 / (tan_half_height * aspect), 0.5 / tan_half_height),
            Projection::Parallel { height, aspect } => {
                DVec2::new(1.0 / (height * aspect), 1.0 / height)
            }
        }
    }

    /// `(x w, y w, w, z)` of an eye-space point, where `(x, y)` is its place in the image plane.
    #[inline]
    pub fn homogeneous(&self, point: DVec3) -> DVec4 {
        let scale = self.image_scale();
        let ahead = self.principal_point();
        match self.projection {
            Projection::Perspective { .. } => DVec4::new(
                point.x * scale.x + ahead.x * point.z,
                point.y * scale.y + ahead.y * point.z,
                point.z,
                point.z,
            ),
            Projection::Parallel { .. } => DVec4::new(
                point.x * scale.x + ahead.x,
                point.y * scale.y + ahead.y,
                1.0,
                point.z,
            ),
        }
    }

    /// Image point of an eye-space point, which must lie before the eye.
    #[inline]
    pub fn image_from_eye(&self, point: DVec3) -> DVec2 {
        image_from_homogeneous(self.homogeneous(point))
    }

    /// Origin and direction, in eye space, of the line of sight through an image point.
    ///
    /// The direction has z = 1: in perspective the point at nearness q is `direction / q`, in
    /// parallel projection it is `origin - q * direction`.
    #[inline]
    pub fn eye_ray(&self, image: DVec2) -> (DVec3, DVec3) {
        let flat = (image - self.principal_point()) / self.image_scale();
        match self.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, flat.extend(1.0)),
            Projection::Parallel { .. } => (flat.extend(0.0), DVec3::Z),
        }
    }

    /// Eye-space point at `image` with nearness `nearness`.
    #[inline]
    pub fn eye_from_image(&self, image: DVec2, nearness: f64) -> DVec3 {
        let (origin, direction) = self.eye_ray(image);
        match self.projection {
            Projection::Perspective { .. } => direction / nearness,
            Projection::Parallel { .. } => origin - nearness * direction,
        }
    }

    /// Nearness, as an affine function of the image plane, of the plane through eye-space `point`
    /// with normal `normal`. `None` when the plane is seen edge-on.
    pub fn nearness_of_plane(&self, point: DVec3, normal: DVec3) -> Option<Affine> {
        let scale = self.image_scale();
        let (nx, ny) = (normal.x / scale.x, normal.y / scale.y);
        let ahead = self.principal_point();
        let along = nx * ahead.x + ny * ahead.y;
        let distance = normal.dot(point);
        let plane = match self.projection {
            // normal . (ray / q) = distance, ray = ((x - px) / sx, (y - py) / sy, 1).
            Projection::Perspective { .. } => {
                Affine::new(nx / distance, ny / distance, (normal.z - along) / distance)
            }
            // nx (x - px) + ny (y - py) + nz z = distance, and nearness is -z.
            Projection::Parallel { .. } => {
                Affine::new(nx / normal.z, ny / normal.z, -(distance + along) / normal.z)
            }
        };
        (plane.a.is_finite() && plane.b.is_finite() && plane.c.is_finite()).then_some(plane)
    }
}

/// The point of the image plane that [`Camera::homogeneous`] tells.
#[inline]
pub fn image_from_homogeneous(point: DVec4) -> DVec2 {
    DVec2::new(point.x / point.z, point.y / point.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(projection: Projection) -> Camera {
        Camera::looking(
            DVec3::new(3.0, -5.0, 2.0),
            DVec3::ZERO,
            DVec3::Z,
            projection,
            0.1,
        )
        .expect("a sound camera")
    }

    const BOTH: [Projection; 2] = [
        Projection::Perspective {
            tan_half_height: 0.4,
            aspect: 1.5,
        },
        Projection::Parallel {
            height: 3.0,
            aspect: 1.5,
        },
    ];

    #[test]
    fn what_is_up_in_the_world_is_up_in_the_picture() {
        for projection in BOTH {
            let camera = camera(projection);
            let at = |p| camera.image_from_eye(camera.eye_from_world.transform_point3(p));
            assert!((at(DVec3::ZERO) - 0.5).length() < 1e-12);
            assert!(at(DVec3::Z).y < 0.5);
            // Seen from (3, -5), what lies at +x +y·0.6 is to the right.
            assert!(at(DVec3::new(1.0, 0.6, 0.0)).x > 0.5);
        }
    }

    #[test]
    fn a_frame_shifted_up_and_right_shows_things_lower_and_further_left() {
        for projection in BOTH {
            let mut camera = camera(projection);
            camera.shift = DVec2::new(0.25, 0.125);
            let ahead = camera.eye_from_world.transform_point3(DVec3::ZERO);
            let expected = DVec2::new(0.25, 0.625);
            assert!((camera.image_from_eye(ahead) - expected).length() < 1e-12);
            // Another shape of the frame keeps its middle where it is.
            let middle = |camera: &Camera| camera.eye_from_image(DVec2::splat(0.5), -1.0);
            let wide = camera.with_aspect(3.0);
            assert!((middle(&wide) - middle(&camera)).length() < 1e-12);
        }
    }

    #[test]
    fn a_window_shows_its_part_of_the_frame() {
        for projection in BOTH {
            let mut camera = camera(projection);
            camera.shift = DVec2::new(0.2, -0.1);
            let window = [DVec2::new(0.25, -0.5), DVec2::new(0.5, 0.25)];
            let part = camera.with_window(window);
            for point in [DVec3::new(0.3, 0.2, 4.0), DVec3::new(-1.0, 0.5, 2.0)] {
                let image = camera.image_from_eye(point);
                let expected = (image - window[0]) / (window[1] - window[0]);
                assert!((part.image_from_eye(point) - expected).length() < 1e-12);
            }
        }
    }

    #[test]
    fn a_plane_has_the_nearness_of_its_points() {
        for projection in BOTH {
            let mut camera = camera(projection);
            camera.shift = DVec2::new(-0.3, 0.7);
            let points = [
                DVec3::new(0.3, 0.2, 4.0),
                DVec3::new(-0.5, 0.1, 5.0),
                DVec3::new(0.1, -0.4, 4.5),
            ];
            let normal = (points[1] - points[0]).cross(points[2] - points[0]);
            let plane = camera
                .nearness_of_plane(points[0], normal)
                .expect("not edge-on");
            for point in points {
                let image = camera.image_from_eye(point);
                let back = camera.eye_from_image(image, plane.at(image));
                assert!((back - point).length() < 1e-12, "{back} is not {point}");
            }
        }
    }
}
