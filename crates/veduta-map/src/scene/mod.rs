//! What a map shows: objects made of meshes, their materials, the cameras and lights.
//!
//! World space is right-handed with Z up, in metres. These are plain data; finding visibility needs the
//! whole of a scene, a stored map keeps what is seen of it.

mod light;
mod material;
mod mesh;
mod world;

pub use light::{Light, LightKind};
pub use material::{AlphaMode, Image, Material, TexcoordSet, TextureRef, Wrap};
pub use mesh::{Mesh, MeshError};
pub use world::{Layer, Shown, World};

use crate::{Camera, MaterialId, ObjectId};
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use veduta_geometry::DMat4;

/// Index of a mesh in [`Scene::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MeshId(pub u32);

/// Index of an image in [`Scene::images`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ImageId(pub u32);

/// A mesh placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Path of names from the root, separated by `/`.
    pub name: String,
    /// What it is made of.
    pub mesh: MeshId,
    /// Where it stands. Affine; a mirroring transform turns the winding of the faces.
    pub world_from_object: DMat4,
}

/// Priority of an object's layer, the layer's name, the object's.
pub type ObjectKey<'a> = (Reverse<i32>, &'a str, &'a str);

/// A scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The objects.
    pub objects: Vec<Object>,
    /// Meshes, which objects share.
    pub meshes: Vec<Mesh>,
    /// Materials, by [`MaterialId`].
    pub materials: Vec<Material>,
    /// Pictures that materials refer to.
    pub images: Vec<Image>,
    /// Named cameras that came with the model.
    pub cameras: Vec<(String, Camera)>,
    /// Lights that came with the model. Pictures do not show them yet; see `shade`.
    pub lights: Vec<Light>,
    /// What layers the objects are of, in the order of the objects; empty where there is one only.
    pub layers: Vec<Layer>,
    /// Where on Earth the scene is.
    pub world: World,
}

impl Scene {
    /// The objects in the order that decides which of two faces in one plane is seen, that of the
    /// earlier one: by priority of the layer, descending, then by the names of layer and object. It does
    /// not depend on the order in which files were read.
    pub fn key_order(&self) -> Vec<ObjectId> {
        let mut order: Vec<ObjectId> = (0..self.objects.len()).map(ObjectId::from_index).collect();
        order.sort_by_cached_key(|&object| self.key_of(object));
        order
    }

    /// What [`Scene::key_order`] sorts by.
    pub fn key_of(&self, object: ObjectId) -> ObjectKey<'_> {
        let layer = self.layer_of(object);
        (
            Reverse(layer.map_or(0, |layer| layer.priority)),
            layer.map_or("", |layer| layer.name.as_str()),
            self.object(object).name.as_str(),
        )
    }

    /// The object's row.
    pub fn object(&self, id: ObjectId) -> &Object {
        &self.objects[id.index()]
    }

    /// The mesh an object is made of.
    pub fn mesh_of(&self, id: ObjectId) -> &Mesh {
        &self.meshes[self.objects[id.index()].mesh.0 as usize]
    }

    /// The material of a face of an object.
    pub fn material_of(&self, object: ObjectId, face: u32) -> &Material {
        self.material(self.mesh_of(object).material_of(face))
    }

    /// The material's row.
    pub fn material(&self, id: MaterialId) -> &Material {
        &self.materials[id.index()]
    }

    /// Number of faces of all objects.
    pub fn face_count(&self) -> usize {
        self.objects
            .iter()
            .map(|object| self.meshes[object.mesh.0 as usize].face_count())
            .sum()
    }
}
