use veduta_geometry::{DMat4, DVec3};
use veduta_map::{Camera, Projection, SeenScene, VisibilityMap};

/// A map in parallel projection cannot be seen in perspective, nor the other way round: nearness is not
/// the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "one projects in parallel, the other in perspective, so that no depth of one is one of the other"
)]
pub struct CameraMismatch;

/// A map as if `camera` had seen it: what it shows at a point of the frame, and how near, stays; its
/// scene is moved before that camera, and sheared where the lenses differ.
///
/// The near plane stays that of the map.
///
/// # Errors
/// [`CameraMismatch`].
pub fn see_through(seen: &SeenScene, camera: &Camera) -> Result<SeenScene, CameraMismatch> {
    let own = &seen.map.camera;
    let by_depth = match (own.projection, camera.projection) {
        (Projection::Perspective { .. }, Projection::Perspective { .. }) => true,
        (Projection::Parallel { .. }, Projection::Parallel { .. }) => false,
        _ => return Err(CameraMismatch),
    };
    // x/z * scale + ahead is the same for both; in parallel projection x in place of x/z.
    let scale = own.image_scale() / camera.image_scale();
    let aside = (own.principal_point() - camera.principal_point()) / camera.image_scale();
    let mut lens = DMat4::from_scale(DVec3::new(scale.x, scale.y, 1.0));
    let aside = DVec3::new(aside.x, aside.y, 0.0);
    if by_depth {
        lens.z_axis = aside.extend(0.0) + lens.z_axis;
    } else {
        lens.w_axis = aside.extend(1.0);
    }
    let moved = camera.eye_from_world.inverse() * lens * own.eye_from_world;
    let mut scene = seen.scene.clone();
    for object in &mut scene.objects {
        object.world_from_object = moved * object.world_from_object;
    }
    Ok(SeenScene {
        map: VisibilityMap {
            camera: Camera {
                near: own.near,
                ..*camera
            },
            ..seen.map.clone()
        },
        scene,
        ..seen.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::find_visibility;
    use crate::scene::generate::by_name;
    use veduta_geometry::DVec2;
    use veduta_map::FaceId;

    #[test]
    fn a_map_seen_through_another_camera_shows_the_same_at_the_same_places() {
        let made = by_name("pierce").expect("a scene");
        let seen = SeenScene::of(
            &made.scene,
            &find_visibility(&made.scene, &made.camera),
            [64, 64],
        );
        let eye = DVec3::new(3.0, -5.0, 2.0);
        let lens = Projection::Perspective {
            tan_half_height: 0.3,
            aspect: 1.7,
        };
        let other = Camera::looking(eye, DVec3::ZERO, DVec3::Z, lens, 0.1).expect("a camera");
        let other = Camera {
            shift: DVec2::new(0.2, -0.1),
            ..other
        };
        let through = see_through(&seen, &other).expect("both in perspective");
        assert_eq!(through.map.opaque, seen.map.opaque);
        // The corners of the scene project to those of the outlines still.
        let faces = &through.map.faces;
        let mut seen_whole = 0;
        for face in faces.ids() {
            let object = faces.object(face);
            let mesh = through.scene.mesh_of(object);
            let eye_from_object =
                other.eye_from_world * through.scene.object(object).world_from_object;
            for corner in mesh.corners_of(faces.source(face)) {
                let point = eye_from_object.transform_point3(mesh.positions[corner as usize]);
                let image = other.image_from_eye(point);
                let nearness = faces.face_nearness(face).at(image);
                assert!((nearness * point.z - 1.0).abs() < 1e-9, "{face:?}");
                let is_corner = |p: &DVec2| (*p - image).length() < 1e-9;
                seen_whole += usize::from(faces.outline(face).iter().any(is_corner));
            }
        }
        assert!(
            seen_whole > 3 * faces.len() - 100,
            "{seen_whole} of {:?}",
            FaceId(0)
        );
        let parallel = Camera {
            projection: Projection::Parallel {
                height: 1.0,
                aspect: 1.0,
            },
            ..other
        };
        assert_eq!(see_through(&seen, &parallel), Err(CameraMismatch));
    }
}
