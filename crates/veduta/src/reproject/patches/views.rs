//! Which parts of the faces of a cube around the eye are looked at, and the cameras that see them.

use super::Patch;
use crate::reproject::Orientation;
use veduta_geometry::{DMat3, DMat4, DVec2, DVec3};
use veduta_map::{Camera, Projection};

/// A face of the cube around an eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CubeFace {
    /// Ahead.
    Front,
    /// To the right.
    Right,
    /// Behind.
    Back,
    /// To the left.
    Left,
    /// Above: the front is at its lower side.
    Top,
    /// Below: the front is at its upper side.
    Bottom,
}

impl CubeFace {
    /// All six.
    pub const ALL: [Self; 6] = [
        Self::Front,
        Self::Right,
        Self::Back,
        Self::Left,
        Self::Top,
        Self::Bottom,
    ];

    /// Its name in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Right => "right",
            Self::Back => "back",
            Self::Left => "left",
            Self::Top => "top",
            Self::Bottom => "bottom",
        }
    }

    /// How the face's picture is turned in the world of the eye: right, up and backward.
    pub fn orientation(self) -> Orientation {
        let of_eye = self.turn().transpose();
        let [down, forward] = [of_eye.y_axis, of_eye.z_axis];
        let world = |axis: DVec3| DVec3::new(axis.x, -axis.y, -axis.z);
        Orientation::looking(world(forward), world(-down)).expect("the axes of a cube")
    }

    /// Directions of the face's own eye space (x right, y down, z forward) from those of the eye. Only signs and
    /// places of coordinates change, so that nothing is rounded.
    pub fn turn(self) -> DMat3 {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let [right, down, forward] = match self {
            Self::Front => [x, y, z],
            Self::Right => [-z, y, x],
            Self::Back => [-x, y, -z],
            Self::Left => [z, y, -x],
            Self::Top => [x, z, -y],
            Self::Bottom => [x, -z, y],
        };
        DMat3::from_cols(right, down, forward).transpose()
    }
}

/// A part of a face of the cube, as a camera sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubeView {
    /// The face.
    pub face: CubeFace,
    /// Left top and right bottom corner of the part, where the face reaches from (0, 0) to (1, 1).
    pub window: [DVec2; 2],
    /// The camera.
    pub camera: Camera,
    /// [`CubeFace::turn`].
    turn: DMat3,
}

/// Windows begin and end at multiples of this share of a face, so that rounding moves no border. Less would save
/// hardly anything.
const WINDOW_STEP: f64 = 1.0 / 128.0;

/// A part of a face that is narrower is a border along which a lens's picture ends. Larger would leave parts out;
/// smaller would find faces for the sake of rounding.
const NO_EXTENT: f64 = 1e-9;

impl CubeView {
    fn new(eye: &Camera, face: CubeFace, window: [DVec2; 2]) -> Self {
        let turn = face.turn();
        let whole = Camera {
            eye_from_world: DMat4::from_mat3(turn) * eye.eye_from_world,
            projection: Projection::Perspective {
                tan_half_height: 1.0,
                aspect: 1.0,
            },
            near: eye.near,
            shift: DVec2::ZERO,
        };
        Self {
            face,
            window,
            camera: whole.with_window(window),
            turn,
        }
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

    /// `(x w, y w, w)` of a direction of the eye, where (x, y) is its place in the image plane.
    #[inline(always)]
    pub fn homogeneous(&self, direction: DVec3) -> DVec3 {
        let eye = self.turn * direction;
        let (scale, ahead) = (self.camera.image_scale(), self.camera.principal_point());
        (eye.truncate() * scale + ahead * eye.z).extend(eye.z)
    }

    /// The direction of the eye at a point of the image plane as a linear function of (x, y, 1).
    pub fn direction_from_image(&self) -> DMat3 {
        let (scale, ahead) = (self.camera.image_scale(), self.camera.principal_point());
        let back = self.turn.transpose();
        let [x, y] = [back.x_axis / scale.x, back.y_axis / scale.y];
        DMat3::from_cols(x, y, back.z_axis - x * ahead.x - y * ahead.y)
    }

    /// A function of the image plane, times w, as a linear function of directions of the eye.
    pub fn along_directions(&self, function: &veduta_geometry::Affine) -> DVec3 {
        let (scale, ahead) = (self.camera.image_scale(), self.camera.principal_point());
        let DVec2 { x, y } = DVec2::new(function.a, function.b) * scale;
        let along_axis = function.a * ahead.x + function.b * ahead.y + function.c;
        self.turn.transpose() * DVec3::new(x, y, along_axis)
    }
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

/// The views that patches look at. `touched` finds which parts of six whole faces they touch, as
/// [`CubeView::touched`] does for each.
///
/// `eye` tells where the eye stands, where its front is, and the near plane of all.
pub fn cube_views(
    eye: &Camera,
    touched: impl FnOnce(&[CubeView; 6]) -> [Option<[DVec2; 2]>; 6],
) -> Vec<CubeView> {
    let whole = CubeFace::ALL.map(|face| CubeView::new(eye, face, [DVec2::ZERO, DVec2::ONE]));
    let parts = CubeFace::ALL.into_iter().zip(touched(&whole));
    let views = parts.filter_map(|(face, part)| {
        let [min, max] = part.filter(|[min, max]| (*max - *min).min_element() > NO_EXTENT)?;
        let min = (min / WINDOW_STEP).floor() * WINDOW_STEP;
        let max = (max / WINDOW_STEP).ceil() * WINDOW_STEP;
        let whole = |corner: DVec2| corner.clamp(DVec2::ZERO, DVec2::ONE);
        let window = [whole(min), whole(max)];
        Some(CubeView::new(eye, face, window))
    });
    views.collect()
}
