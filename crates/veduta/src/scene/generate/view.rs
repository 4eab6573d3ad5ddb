//! Cameras that look along +Y, for scenes laid out in the picture.

use veduta_geometry::{DMat4, DVec2, DVec3};
use veduta_map::{Camera, Projection};

/// A camera that looks along +Y, with Z up, and the way back from its picture into the world.
///
/// Random scenes are strewn over the picture rather than over the world, so that their density in
/// the picture is what their name says.
pub(super) struct FrontView {
    pub(super) camera: Camera,
    world_from_eye: DMat4,
}

impl FrontView {
    /// Perspective from the origin; the picture is as high as 1/1.2 of its distance.
    pub(super) fn perspective(aspect: f64) -> Self {
        let projection = Projection::Perspective {
            tan_half_height: 0.5 / 1.2,
            aspect,
        };
        Self::new(DVec3::ZERO, projection, 0.01)
    }

    /// Parallel projection onto the plane y = 0; the picture is `height` metres high and its
    /// centre is the origin.
    pub(super) fn parallel(height: f64, aspect: f64) -> Self {
        let projection = Projection::Parallel { height, aspect };
        Self::new(DVec3::new(0.0, -10.0, 0.0), projection, 0.0)
    }

    fn new(eye: DVec3, projection: Projection, near: f64) -> Self {
        let camera = Camera::looking(eye, eye + DVec3::Y, DVec3::Z, projection, near)
            .expect("the direction of view is not the vertical");
        Self {
            camera,
            world_from_eye: camera.eye_from_world.inverse(),
        }
    }

    /// The world point seen at `image` with the given nearness.
    pub(super) fn world_point(&self, image: DVec2, nearness: f64) -> DVec3 {
        self.world_from_eye
            .transform_point3(self.camera.eye_from_image(image, nearness))
    }
}
