//! Whether parts of two scenes are the same, by their data.

use crate::scene::{ImageId, Material, Mesh, MeshId, Scene, TextureRef};
use std::collections::HashMap;
use std::ops::Range;
use veduta_map::{MaterialId, ObjectId};

/// Two scenes, and what is known already of which of their rows are the same. Meshes and pictures are
/// large, and many objects share them.
pub struct Comparison<'a> {
    one: &'a Scene,
    other: &'a Scene,
    meshes: HashMap<(MeshId, MeshId), bool>,
    materials: HashMap<(MaterialId, MaterialId), bool>,
    images: HashMap<(ImageId, ImageId), bool>,
}

impl<'a> Comparison<'a> {
    pub fn of(one: &'a Scene, other: &'a Scene) -> Self {
        Self {
            one,
            other,
            meshes: HashMap::new(),
            materials: HashMap::new(),
            images: HashMap::new(),
        }
    }

    /// Whether rows of objects of the two scenes are the same, with all that they are made of and the
    /// priority of their layers.
    pub fn same_objects(&mut self, some: Range<u32>, others: Range<u32>) -> bool {
        some.len() == others.len()
            && some.zip(others).all(|(one, other)| {
                let [one, other] = [one, other].map(ObjectId);
                let (a, b) = (self.one.object(one), self.other.object(other));
                a.world_from_object == b.world_from_object
                    && self.one.key_of(one) == self.other.key_of(other)
                    && self.same_meshes(a.mesh, b.mesh)
            })
    }

    fn same_meshes(&mut self, one: MeshId, other: MeshId) -> bool {
        if let Some(&known) = self.meshes.get(&(one, other)) {
            return known;
        }
        let a = &self.one.meshes[one.0 as usize];
        let b = &self.other.meshes[other.0 as usize];
        let same = same_shapes(a, b)
            && a.materials.len() == b.materials.len()
            && a.materials.iter().zip(&b.materials).all(|(a, b)| {
                // From the same face on.
                a.0 == b.0 && self.same_materials(a.1, b.1)
            });
        self.meshes.insert((one, other), same);
        same
    }

    fn same_materials(&mut self, one: MaterialId, other: MaterialId) -> bool {
        if let Some(&known) = self.materials.get(&(one, other)) {
            return known;
        }
        let (a, b) = (self.one.material(one), self.other.material(other));
        let textures =
            |material: &Material| [material.base_color_texture, material.emissive_texture];
        let pairs = textures(a).into_iter().zip(textures(b));
        let same = without_images(a) == without_images(b)
            && pairs.into_iter().all(|pair| match pair {
                (Some(a), Some(b)) => self.same_images(a.image, b.image),
                // Both are absent, or the materials differ already.
                _ => true,
            });
        self.materials.insert((one, other), same);
        same
    }

    fn same_images(&mut self, one: ImageId, other: ImageId) -> bool {
        let (a, b) = (
            &self.one.images[one.0 as usize],
            &self.other.images[other.0 as usize],
        );
        *self.images.entry((one, other)).or_insert_with(|| a == b)
    }
}

/// Whether all of two meshes is the same but for their materials.
fn same_shapes(one: &Mesh, other: &Mesh) -> bool {
    // All fields are named, so that none that is new is overlooked.
    let Mesh {
        positions,
        triangles,
        fans,
        normals,
        texcoords,
        second_texcoords,
        colors,
        opacities,
        materials: _,
    } = one;
    *positions == other.positions
        && *triangles == other.triangles
        && *fans == other.fans
        && *normals == other.normals
        && *texcoords == other.texcoords
        && *second_texcoords == other.second_texcoords
        && *colors == other.colors
        && *opacities == other.opacities
}

/// A material with the same row for all its pictures.
fn without_images(material: &Material) -> Material {
    let mut material = material.clone();
    let textures = [
        &mut material.base_color_texture,
        &mut material.emissive_texture,
    ];
    for TextureRef { image, .. } in textures.into_iter().flatten() {
        *image = ImageId(0);
    }
    material
}
