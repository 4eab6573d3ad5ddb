use crate::scene::{AlphaMode, ImageId, Scene};
use rayon::prelude::*;
use std::collections::BTreeSet;
use veduta_map::ObjectId;

/// How much of what is behind a face can be seen through it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opacity {
    /// Nothing.
    Opaque,
    /// Some of it, or through parts of the face: the face is a veil.
    Veil,
    /// All of it: the face is not seen.
    Absent,
}

/// Tells the opacity of faces.
///
/// Models call many materials transparent whose colours, textures and corners are all opaque. What
/// counts is what is there, so that only faces that need it are blended.
pub struct Opacities<'a> {
    scene: &'a Scene,
    all_opaque: bool,
    /// Least and most opacity of the texels of each image that a material with opacity uses.
    texels: Vec<[f32; 2]>,
}

impl<'a> Opacities<'a> {
    /// Looks at the materials and images of `scene`.
    pub fn of(scene: &'a Scene) -> Self {
        let materials = scene.materials.iter();
        let not_opaque = materials.filter(|material| material.alpha_mode != AlphaMode::Opaque);
        let images: BTreeSet<ImageId> = not_opaque
            .clone()
            .filter_map(|material| material.base_color_texture)
            .map(|texture| texture.image)
            .collect();
        let mut texels = vec![[1.0; 2]; scene.images.len()];
        for ImageId(image) in images {
            let pixels = &scene.images[image as usize].pixels;
            let codes = pixels
                .par_iter()
                .with_min_len(1 << 16)
                .map(|pixel| pixel[3]);
            let [least, most] = codes.map(|code| [code; 2]).reduce(
                || [u8::MAX, u8::MIN],
                |[least, most], [low, high]| [least.min(low), most.max(high)],
            );
            texels[image as usize] = [least, most].map(|code| f32::from(code) / 255.0);
        }
        Self {
            scene,
            all_opaque: not_opaque.count() == 0,
            texels,
        }
    }

    /// The opacity of a face of an object.
    pub fn of_face(&self, object: ObjectId, face: u32) -> Opacity {
        if self.all_opaque {
            return Opacity::Opaque;
        }
        let mesh = self.scene.mesh_of(object);
        let material = self.scene.material(mesh.material_of(face));
        if material.alpha_mode == AlphaMode::Opaque {
            return Opacity::Opaque;
        }
        let mut range = [material.base_color[3]; 2];
        let mut times = |[least, most]: [f32; 2]| range = [range[0] * least, range[1] * most];
        if let Some(texture) = material.base_color_texture
            && !mesh.texcoords_of(texture.texcoords).is_empty()
        {
            times(self.texels[texture.image.0 as usize]);
        }
        if !mesh.opacities.is_empty() {
            let corners = mesh.corners_of(face);
            let corners = corners.map(|corner| mesh.opacities[corner as usize]);
            times(corners.fold(
                [f32::INFINITY, f32::NEG_INFINITY],
                |[least, most], opacity| [least.min(opacity), most.max(opacity)],
            ));
        }
        let [least, most] = range;
        let (absent, opaque) = match material.alpha_mode {
            AlphaMode::Mask(cutoff) => (most < cutoff, least >= cutoff),
            _ => (most <= 0.0, least >= 1.0),
        };
        match (absent, opaque) {
            (true, _) => Opacity::Absent,
            (_, true) => Opacity::Opaque,
            _ => Opacity::Veil,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Image, Material, Mesh, MeshId, Object, TextureRef};
    use veduta_geometry::{DMat4, DVec3, Vec2};
    use veduta_map::MaterialId;

    fn opacity(material: Material, corners: [f32; 3], texels: [u8; 2]) -> Opacity {
        let mesh = Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            texcoords: vec![Vec2::ZERO; 3],
            opacities: corners.to_vec(),
            triangles: vec![[0, 1, 2]],
            materials: vec![(0, MaterialId(0))],
            ..Mesh::default()
        };
        let scene = Scene {
            objects: vec![Object {
                name: String::new(),
                mesh: MeshId(0),
                world_from_object: DMat4::IDENTITY,
            }],
            meshes: vec![mesh],
            materials: vec![material],
            images: vec![Image {
                name: String::new(),
                width: 2,
                height: 1,
                pixels: texels.map(|alpha| [0, 0, 0, alpha]).to_vec(),
            }],
            ..Scene::default()
        };
        Opacities::of(&scene).of_face(ObjectId(0), 0)
    }

    fn material(alpha_mode: AlphaMode, alpha: f32) -> Material {
        Material {
            base_color: [1.0, 1.0, 1.0, alpha],
            base_color_texture: Some(TextureRef::new(ImageId(0))),
            alpha_mode,
            ..Material::default()
        }
    }

    #[test]
    fn only_what_lets_something_through_is_a_veil() {
        use Opacity::{Absent, Opaque, Veil};
        let blend = |alpha| material(AlphaMode::Blend, alpha);
        let mask = |alpha| material(AlphaMode::Mask(0.5), alpha);
        for (material, corners, texels, expected) in [
            (material(AlphaMode::Opaque, 0.2), [0.1; 3], [0, 9], Opaque),
            (blend(1.0), [1.0; 3], [255; 2], Opaque),
            (blend(0.5), [1.0; 3], [255; 2], Veil),
            (blend(1.0), [1.0, 0.9, 1.0], [255; 2], Veil),
            (blend(1.0), [1.0; 3], [254, 255], Veil),
            (blend(0.0), [1.0; 3], [255; 2], Absent),
            (mask(1.0), [1.0; 3], [128, 255], Opaque),
            (mask(1.0), [1.0; 3], [127, 128], Veil),
            (mask(1.0), [1.0; 3], [0, 127], Absent),
            (mask(0.9), [0.5; 3], [255; 2], Absent),
        ] {
            let told = format!("{material:?} {corners:?} {texels:?}");
            assert_eq!(opacity(material, corners, texels), expected, "{told}");
        }
    }
}
