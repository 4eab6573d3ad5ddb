//! Cameras of the model.

use super::document::Camera as CameraRow;
use veduta::map::{Camera, Projection};
use veduta_geometry::{DMat4, DVec3};

/// The camera in its place. It looks along the node's -Z, with +Y up (glTF 2.0, §3.10).
///
/// A frame without aspect is square; who renders replaces it with that of the picture.
///
/// # Errors
/// A sentence for a warning: a model is not lost with its camera.
pub fn place(row: &CameraRow, world_from_node: &DMat4) -> Result<Camera, String> {
    // The node's scale applies to lengths along its axes, but must not shear the picture.
    let scale = |axis: DVec3| world_from_node.transform_vector3(axis).length();
    let (projection, near) = match (&row.perspective, &row.orthographic) {
        (Some(lens), None) => {
            if !(lens.yfov > 0.0 && lens.yfov < std::f64::consts::PI) {
                return Err(format!("yfov is {}, expected 0 to pi", lens.yfov));
            }
            let projection = Projection::Perspective {
                tan_half_height: (0.5 * lens.yfov).tan(),
                aspect: lens.aspect_ratio.unwrap_or(1.0),
            };
            if lens.znear <= 0.0 {
                return Err(format!("znear is {}, expected more than 0", lens.znear));
            }
            (projection, lens.znear * scale(DVec3::Z))
        }
        (None, Some(lens)) => {
            let projection = Projection::Parallel {
                height: 2.0 * lens.ymag.abs() * scale(DVec3::Y),
                aspect: (lens.xmag / lens.ymag).abs() * scale(DVec3::X) / scale(DVec3::Y),
            };
            (projection, lens.znear * scale(DVec3::Z))
        }
        _ => return Err("is neither perspective nor orthographic".into()),
    };
    let (height, aspect) = match projection {
        Projection::Perspective {
            tan_half_height,
            aspect,
        } => (tan_half_height, aspect),
        Projection::Parallel { height, aspect } => (height, aspect),
    };
    let sound = |number: f64| number.is_finite() && number > 0.0;
    let near_sound = match projection {
        Projection::Perspective { .. } => sound(near),
        Projection::Parallel { .. } => near.is_finite(),
    };
    if !(sound(height) && sound(aspect) && near_sound) {
        return Err("has a frame or a near plane that is not finite".into());
    }
    let eye = world_from_node.transform_point3(DVec3::ZERO);
    let forward = world_from_node.transform_vector3(-DVec3::Z);
    let up = world_from_node.transform_vector3(DVec3::Y);
    // Taken apart from the eye, whose distance from the origin would cost it digits.
    let turned = Camera::looking(DVec3::ZERO, forward, up, projection, near);
    match turned {
        Some(mut camera) if eye.is_finite() => {
            camera.eye_from_world *= DMat4::from_translation(-eye);
            Ok(camera)
        }
        _ => Err("stands where its node's transform leaves no direction to look".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::gltf::document::PerspectiveCamera;

    #[test]
    fn a_camera_looks_along_minus_z_whatever_its_scale() {
        let row = CameraRow {
            name: None,
            perspective: Some(PerspectiveCamera {
                aspect_ratio: None,
                yfov: 1.0,
                znear: 2.0,
            }),
            orthographic: None,
        };
        let node = DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0))
            * DMat4::from_scale(DVec3::splat(0.01));
        let camera = place(&row, &node).expect("a sound camera");
        assert!((camera.near - 0.02).abs() < 1e-15);
        let ahead = camera
            .eye_from_world
            .transform_point3(DVec3::new(1.0, 3.0, -4.0));
        // One up, seven ahead; down is positive.
        assert!(
            (ahead - DVec3::new(0.0, -1.0, 7.0)).length() < 1e-12,
            "{ahead}"
        );
    }
}
