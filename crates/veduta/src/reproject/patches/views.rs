//! What a lens looks through: perspective cameras that stand in its eye.

use super::Patch;
use veduta_geometry::{Affine, DMat3, DMat4, DVec2, DVec3};
use veduta_map::{Camera, Projection};

/// A frame through which a lens's eye looks: a perspective camera of that eye, turned in any way, with any frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    camera: Camera,
    /// Directions of the camera's own eye space (x right, y down, z forward) from those of the lens's eye.
    view_from_eye: DMat3,
    /// [`Camera::image_scale`].
    scale: DVec2,
    /// [`Camera::principal_point`].
    ahead: DVec2,
}

/// Why a lens does not look through a camera.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// It has no eye.
    #[error(
        "projects in parallel, and a lens looks from an eye; make it with a camera that has one"
    )]
    Parallel,
    /// It stretches the world.
    #[error("is no rigid motion of the world, so that directions have no lengths")]
    NotRigid,
    /// Its eye is another one.
    #[error(
        "is seen by an eye that stands {distance} m away; a lens looks from one eye, so make all maps from there"
    )]
    OtherEye {
        /// Between the two, in metres.
        distance: f64,
    },
}

/// Eyes that differ by less than this share of their distance from the world's origin are one: what rounding makes of
/// a position. Larger would let pictures shift where frames meet; smaller would refuse maps of one eye that
/// were made one by one.
const SAME_EYE: f64 = 1e-12;

/// Turns whose numbers are that close to 0, 1 or -1 are meant to be quarters: the sides of a cube, stored and read
/// again. Only then directions on the border of two sides are the same numbers in both. Larger would move what is
/// seen, though by far less than a pixel; smaller would leave rounding.
const QUARTER: f64 = 1e-12;

/// How far from 1 lengths may be that a camera's turn makes of 1.
const RIGID: f64 = 1e-9;

impl View {
    /// What `camera` sees, for a lens whose eye is that of `eye`: where it stands, and how it is turned.
    ///
    /// # Errors
    /// When the camera has no eye or another one.
    pub fn new(eye: &Camera, camera: &Camera) -> Result<Self, ViewError> {
        if matches!(camera.projection, Projection::Parallel { .. }) {
            return Err(ViewError::Parallel);
        }
        let [of_eye, of_camera] = [eye, camera].map(|c| DMat3::from_mat4(c.eye_from_world));
        let off = of_camera * of_camera.transpose() - DMat3::IDENTITY;
        if !off.abs_diff_eq(DMat3::ZERO, RIGID) {
            return Err(ViewError::NotRigid);
        }
        let [from, to] = [eye, camera].map(eye_position);
        let distance = (to - from).length();
        if distance > SAME_EYE * (1.0 + from.length()) {
            return Err(ViewError::OtherEye { distance });
        }
        let turn = of_camera * of_eye.transpose();
        let quarters = turn.to_cols_array().map(f64::round);
        let quarters = DMat3::from_cols_array(&quarters);
        let view_from_eye = if turn.abs_diff_eq(quarters, QUARTER) {
            quarters
        } else {
            turn
        };
        Ok(Self::turned(*camera, view_from_eye))
    }

    fn turned(camera: Camera, view_from_eye: DMat3) -> Self {
        Self {
            camera,
            view_from_eye,
            scale: camera.image_scale(),
            ahead: camera.principal_point(),
        }
    }

    /// The view of a frame as high and wide as it is far away, turned by `view_from_eye` from the eye of `eye`, whose
    /// near plane it has; of it the part `window`.
    pub(super) fn square(eye: &Camera, view_from_eye: DMat3, window: [DVec2; 2]) -> Self {
        let whole = Camera {
            eye_from_world: DMat4::from_mat3(view_from_eye) * eye.eye_from_world,
            projection: Projection::Perspective {
                tan_half_height: 1.0,
                aspect: 1.0,
            },
            near: eye.near,
            shift: DVec2::ZERO,
        };
        Self::turned(whole.with_window(window), view_from_eye)
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Smallest rectangle around what a patch looks at in the view, in its image plane; `None` if nothing.
    pub fn touched(&self, patch: &Patch) -> Option<[DVec2; 2]> {
        let seen = patch.directions().map(|d| self.homogeneous(d));
        // Sides of the view that a corner is beyond.
        let beyond = seen.map(|p| sides(p).map(|side| side < 0.0));
        if (0..4).any(|side| beyond.iter().all(|corner| corner[side])) {
            return None;
        }
        let (mut min, mut max) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let mut enclose = |p: DVec3| {
            let image = p.truncate() / p.z;
            (min, max) = (min.min(image), max.max(image));
        };
        if beyond.as_flattened().contains(&true) {
            let polygon = in_view(&seen);
            if polygon.len() < 3 {
                return None;
            }
            polygon.into_iter().for_each(&mut enclose);
        } else {
            seen.into_iter().for_each(&mut enclose);
        }
        min.cmple(max).all().then_some([min, max])
    }

    /// Whether all that a patch looks at lies in the frame.
    pub fn sees_all_of(&self, patch: &Patch) -> bool {
        let corners = patch.directions().map(|d| sides(self.homogeneous(d)));
        corners.as_flattened().iter().all(|&side| side >= 0.0)
    }

    /// `(x w, y w, w)` of a direction of the eye, where (x, y) is its place in the image plane.
    #[inline(always)]
    pub fn homogeneous(&self, direction: DVec3) -> DVec3 {
        let seen = self.view_from_eye * direction;
        let (scale, ahead) = (self.scale, self.ahead);
        (seen.truncate() * scale + ahead * seen.z).extend(seen.z)
    }

    /// The direction of the eye at a point of the image plane as a linear function of (x, y, 1).
    pub fn direction_from_image(&self) -> DMat3 {
        let (scale, ahead) = (self.scale, self.ahead);
        let back = self.view_from_eye.transpose();
        let [x, y] = [back.x_axis / scale.x, back.y_axis / scale.y];
        DMat3::from_cols(x, y, back.z_axis - x * ahead.x - y * ahead.y)
    }

    /// A function of the image plane, times w, as a linear function of directions of the eye.
    pub fn along_directions(&self, function: &Affine) -> DVec3 {
        let (scale, ahead) = (self.scale, self.ahead);
        let DVec2 { x, y } = DVec2::new(function.a, function.b) * scale;
        let along_axis = function.a * ahead.x + function.b * ahead.y + function.c;
        self.view_from_eye.transpose() * DVec3::new(x, y, along_axis)
    }

    /// The sides of the frame as linear functions of directions of the eye, not negative on the inner side.
    pub fn sides(&self) -> [DVec3; 4] {
        [
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 1.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 1.0],
        ]
        .map(|[a, b, c]| self.along_directions(&Affine::new(a, b, c)))
    }

    /// Directions of the eye in the corners of the frame, one after the other around it.
    pub fn corners(&self) -> [DVec3; 4] {
        let direction_from_image = self.direction_from_image();
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .map(|(x, y)| direction_from_image * DVec3::new(x, y, 1.0))
    }
}

/// Where a camera's eye stands in the world.
fn eye_position(camera: &Camera) -> DVec3 {
    camera
        .eye_from_world
        .inverse()
        .transform_point3(DVec3::ZERO)
}

/// Distances, up to a factor, of a homogeneous point from the sides of the unit square; not negative inside.
fn sides(p: DVec3) -> [f64; 4] {
    [p.x, p.z - p.x, p.y, p.z - p.y]
}

/// What of a triangle of homogeneous points lies in the unit square (Sutherland and Hodgman).
fn in_view(triangle: &[DVec3; 3]) -> Vec<DVec3> {
    let mut polygon = triangle.to_vec();
    for side in 0..4 {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (k, &p) in polygon.iter().enumerate() {
            let q = polygon[(k + 1) % polygon.len()];
            let (dp, dq) = (sides(p)[side], sides(q)[side]);
            if dp >= 0.0 {
                kept.push(p);
            }
            if (dp > 0.0 && dq < 0.0) || (dp < 0.0 && dq > 0.0) {
                kept.push(p + (q - p) * (dp / (dp - dq)));
            }
        }
        polygon = kept;
    }
    // All that is in view is ahead, but for the eye itself.
    polygon.retain(|p| p.z > 0.0);
    polygon
}
