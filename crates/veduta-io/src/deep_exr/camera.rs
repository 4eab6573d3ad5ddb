//! Cameras in OpenEXR's standard attributes `worldToCamera` and `worldToNDC`.
//!
//! Both are for row vectors, so that their sixteen numbers in order are the columns of our matrices.
//! Camera space is our eye space with y turned up; normalised device coordinates are our image
//! plane, the unit square of the frame with y down.

use veduta::map::{Camera, Projection};
use veduta_geometry::{DMat4, DVec2, DVec4};

/// The near plane of a camera of which a file tells none, in metres: nothing is nearer.
const NEAR_UNTOLD: f64 = 1e-6;

/// How far matrices of single precision may be off what they should be, as a share of 1. Cameras in
/// national coordinates lose four digits to their distance from the origin; a wrong convention is off by
/// about 1.
const TOLERANCE: f64 = 1e-3;

fn turned_up() -> DMat4 {
    DMat4::from_diagonal(DVec4::new(1.0, -1.0, 1.0, 1.0))
}

/// `worldToCamera` and `worldToNDC` of a camera.
pub fn matrices_of_camera(camera: &Camera) -> [[f32; 16]; 2] {
    let scale = camera.image_scale();
    let ahead = camera.principal_point();
    // Columns: what x, y, z and 1 of eye space add to x, y, depth and divisor. Depth is thrown away by
    // those who read the matrix; here it is 0 on the near plane.
    let along_x = DVec4::new(scale.x, 0.0, 0.0, 0.0);
    let along_y = DVec4::new(0.0, scale.y, 0.0, 0.0);
    let image_from_eye = match camera.projection {
        Projection::Perspective { .. } => DMat4::from_cols(
            along_x,
            along_y,
            DVec4::new(ahead.x, ahead.y, 1.0, 1.0),
            DVec4::new(0.0, 0.0, -camera.near, 0.0),
        ),
        Projection::Parallel { .. } => DMat4::from_cols(
            along_x,
            along_y,
            DVec4::Z,
            DVec4::new(ahead.x, ahead.y, -camera.near, 1.0),
        ),
    };
    [
        turned_up() * camera.eye_from_world,
        image_from_eye * camera.eye_from_world,
    ]
    .map(|matrix| matrix.to_cols_array().map(|number| number as f32))
}

/// The camera that `worldToCamera` and `worldToNDC` tell; its near plane is at 1e-6 m in perspective,
/// at 0 in parallel projection, since they tell none.
///
/// `None` if they are those of no camera: the first must be a rigid motion of a right-handed world,
/// and both must agree on where the line of sight is.
pub fn camera_from_matrices(
    world_to_camera: &[f32; 16],
    world_to_ndc: &[f32; 16],
) -> Option<Camera> {
    let [camera_from_world, image_from_world] =
        [world_to_camera, world_to_ndc].map(|m| DMat4::from_cols_array(&m.map(f64::from)));
    if !camera_from_world.is_finite() || !image_from_world.is_finite() {
        return None;
    }
    let eye_from_world = turned_up() * camera_from_world;
    let axes = [
        eye_from_world.x_axis,
        eye_from_world.y_axis,
        eye_from_world.z_axis,
    ];
    let [x, y, z] = axes.map(|axis| axis.truncate());
    let off = [x.dot(y), y.dot(z), z.dot(x), x.cross(y).dot(z) - 1.0];
    let lengths = [x, y, z].map(|axis| axis.length() - 1.0);
    let is_off = |share: &f64| share.abs() > TOLERANCE;
    if off.iter().chain(&lengths).any(is_off)
        || axes.iter().any(|axis| axis.w != 0.0)
        || eye_from_world.w_axis.w != 1.0
    {
        return None;
    }
    let image_from_eye = image_from_world * eye_from_world.inverse();
    let [divisor_x, divisor_y, divisor_z, divisor_1] = image_from_eye.row(3).to_array();
    let is_perspective = divisor_z.abs() > divisor_1.abs();
    let divisor = if is_perspective { divisor_z } else { divisor_1 };
    if divisor == 0.0 {
        return None;
    }
    let [row_x, row_y] = [image_from_eye.row(0), image_from_eye.row(1)].map(|row| row / divisor);
    let scale = DVec2::new(row_x.x, row_y.y);
    let (ahead, rest) = if is_perspective {
        (DVec2::new(row_x.z, row_y.z), DVec2::new(row_x.w, row_y.w))
    } else {
        (DVec2::new(row_x.w, row_y.w), DVec2::new(row_x.z, row_y.z))
    };
    let slants = [
        row_x.y / scale.x,
        row_y.x / scale.y,
        divisor_x / divisor,
        divisor_y / divisor,
    ];
    // In perspective the divisor's own constant, and the eye's offset, shrink with distance; what is
    // left of them by rounding is of the size of the world's coordinates.
    let far = 1.0 + eye_from_world.w_axis.truncate().length();
    let rests = [rest.x / far, rest.y / far];
    let is_camera = scale.cmpgt(DVec2::ZERO).all()
        && ahead.is_finite()
        && !slants.iter().chain(&rests).any(is_off);
    if !is_camera {
        return None;
    }
    let aspect = scale.y / scale.x;
    let (projection, near) = if is_perspective {
        let tan_half_height = 0.5 / scale.y;
        let projection = Projection::Perspective {
            tan_half_height,
            aspect,
        };
        (projection, NEAR_UNTOLD)
    } else {
        let height = 1.0 / scale.y;
        (Projection::Parallel { height, aspect }, 0.0)
    };
    Some(Camera {
        eye_from_world,
        projection,
        near,
        shift: DVec2::new(0.5 - ahead.x, ahead.y - 0.5),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta_geometry::DVec3;

    fn cameras() -> Vec<Camera> {
        let both = [
            Projection::Perspective {
                tan_half_height: 0.4,
                aspect: 1.5,
            },
            Projection::Parallel {
                height: 30.0,
                aspect: 0.75,
            },
        ];
        let eye = DVec3::new(84_900.0, -50.0, 20.0);
        let look_at = DVec3::new(84_903.0, 7.0, 9.0);
        let looking = |projection| Camera::looking(eye, look_at, DVec3::Z, projection, 0.1);
        both.into_iter()
            .map(|projection| Camera {
                shift: DVec2::new(0.25, -0.125),
                ..looking(projection).expect("a sound camera")
            })
            .collect()
    }

    #[test]
    fn a_camera_comes_back_from_its_matrices() {
        for camera in cameras() {
            let [to_camera, to_ndc] = matrices_of_camera(&camera);
            let back = camera_from_matrices(&to_camera, &to_ndc).expect("a camera");
            let point = DVec3::new(84_905.0, 10.0, 12.0);
            let at = |c: &Camera| c.image_from_eye(c.eye_from_world.transform_point3(point));
            // Single precision leaves 4 mm of 84.9 km, seen from 60 m.
            assert!((at(&back) - at(&camera)).length() < 1e-3, "{back:?}");
            assert!((back.shift - camera.shift).length() < 1e-3);
            assert!((back.aspect() - camera.aspect()).abs() < 1e-3);
        }
    }

    #[test]
    fn matrices_are_those_of_openexr() {
        // An eye at the origin that looks along +y with z up: camera x is world x, y is z, z is y.
        let projection = Projection::Perspective {
            tan_half_height: 0.5,
            aspect: 2.0,
        };
        let camera = Camera::looking(DVec3::ZERO, DVec3::Y, DVec3::Z, projection, 0.5);
        let [to_camera, to_ndc] = matrices_of_camera(&camera.expect("a sound camera"));
        // Row vectors: v * M.
        let times = |v: [f32; 4], m: &[f32; 16]| {
            [0, 1, 2, 3].map(|j| (0..4).map(|i| v[i] * m[4 * i + j]).sum::<f32>())
        };
        assert_eq!(
            times([1.0, 2.0, 3.0, 1.0], &to_camera),
            [1.0, 3.0, 2.0, 1.0]
        );
        // Straight ahead is the middle of the frame; half its height up is its upper border.
        let [x, y, _, w] = times([0.0, 4.0, 2.0, 1.0], &to_ndc);
        assert_eq!([x / w, y / w], [0.5, 0.0]);
    }

    #[test]
    fn matrices_of_no_camera_are_refused() {
        let [to_camera, to_ndc] = matrices_of_camera(&cameras()[0]);
        assert!(camera_from_matrices(&[0.0; 16], &[0.0; 16]).is_none());
        assert!(camera_from_matrices(&[f32::NAN; 16], &to_ndc).is_none());
        assert!(camera_from_matrices(&to_camera, &[0.0; 16]).is_none());
        let mirrored = std::array::from_fn(|k| {
            if k % 4 == 0 {
                -to_camera[k]
            } else {
                to_camera[k]
            }
        });
        assert!(camera_from_matrices(&mirrored, &to_ndc).is_none());
    }
}
