use super::surface::{Varying, Viewer};
use crate::scene::Scene;
use rayon::prelude::*;
use veduta_geometry::{DMat4, DVec2, DVec3, Vec3};
use veduta_map::{Camera, FaceId, Faces};

/// Where in the world the points of seen faces are, and how they are turned.
pub struct Points<'a> {
    camera: &'a Camera,
    faces: &'a Faces,
    world_from_eye: DMat4,
    /// Of each fragment; empty if they were not asked for.
    normals: Vec<Normal>,
    varying: Vec<Varying>,
}

/// How the normal of a face goes over it.
#[derive(Clone, Copy, Debug)]
enum Normal {
    /// It is the same everywhere.
    Constant(Vec3),
    /// It differs from point to point: row of [`Points::varying`].
    Varying(u32),
}

impl<'a> Points<'a> {
    /// Looks at what `camera` sees of `scene`: `shown` are the faces of the fragments, ascending.
    /// Normals take time and memory, and are made ready only `with_normals`.
    pub fn new(
        scene: &'a Scene,
        camera: &'a Camera,
        faces: &'a Faces,
        shown: &[FaceId],
        with_normals: bool,
    ) -> Self {
        let mut points = Self {
            camera,
            faces,
            world_from_eye: camera.eye_from_world.inverse(),
            normals: Vec::new(),
            varying: Vec::new(),
        };
        if with_normals {
            points.find_normals(&Viewer::new(scene, camera, faces), shown);
        }
        points
    }

    fn find_normals(&mut self, viewer: &Viewer, shown: &[FaceId]) {
        let normal = |&face| match viewer.constant_normal(face) {
            Some(normal) => Normal::Constant(normal),
            None => Normal::Varying(0),
        };
        self.normals = shown.par_iter().with_min_len(256).map(normal).collect();
        // A face that is seen in pieces gets one row.
        let mut varying: Vec<FaceId> = Vec::new();
        for (&face, normal) in shown.iter().zip(&mut self.normals) {
            if let Normal::Varying(row) = normal {
                if varying.last() != Some(&face) {
                    varying.push(face);
                }
                *row = varying.len() as u32 - 1;
            }
        }
        let varying = varying.par_iter().map(|&face| viewer.varying(face));
        self.varying = varying.collect();
    }

    /// The point of a face that is seen at an image point, in eye space: x right, y down, z the depth.
    ///
    /// Rounding may put the image point a little outside the face, and on one seen nearly edge-on
    /// a little is far. So the point is never nearer or farther than all of the face.
    pub fn eye_point(&self, face: FaceId, image: DVec2) -> DVec3 {
        let plane = self.faces.face_nearness(face);
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for &vertex in self.faces.outline(face) {
            let nearness = plane.at(vertex);
            least = least.min(nearness);
            most = most.max(nearness);
        }
        let nearness = plane.at(image).max(least).min(most);
        self.camera.eye_from_image(image, nearness)
    }

    /// A point of eye space in world space.
    pub fn world_point(&self, eye: DVec3) -> DVec3 {
        self.world_from_eye.transform_point3(eye)
    }

    /// Unit normal of a fragment at an image point, in world space, on the eye's side: interpolated
    /// where the model has normals, as for light.
    ///
    /// # Panics
    /// If normals were not asked for.
    pub fn normal(&self, fragment: u32, image: DVec2) -> Vec3 {
        match self.normals[fragment as usize] {
            Normal::Constant(normal) => normal,
            Normal::Varying(row) => self.varying[row as usize].normal_at(image),
        }
    }
}
