//! Materials and textures.
//!
//! glTF 2.0, §3.8 and §3.9: base colour, opacity and emission are kept; metal and roughness, and
//! the maps of normals and occlusion, are not.

use super::buffers::{Buffers, Files};
use super::document::{self, Document, TextureInfo};
use super::{Fault, Problem, row};
use crate::read::budget::Budget;
use crate::read::error::{Place, Warnings};
use crate::read::picture::PictureDecoder;
use veduta::scene::{AlphaMode, Image, ImageId, Material, TexcoordSet, TextureRef, Wrap};
use veduta_geometry::Vec2;

/// The texture of a material's colour.
pub fn color_texture(material: &document::Material) -> Option<&TextureInfo> {
    match &material.extensions.specular_glossiness {
        Some(older) => older.diffuse_texture.as_ref(),
        None => material.pbr_metallic_roughness.base_color_texture.as_ref(),
    }
}

/// The texture of a material's emission, unless nothing is emitted.
fn emissive_texture(material: &document::Material) -> Option<&TextureInfo> {
    let emits = material.emissive_factor != [0.0; 3];
    material.emissive_texture.as_ref().filter(|_| emits)
}

/// Which of a primitive's sets of texture coordinates become the tables of the mesh.
///
/// A file may have any number of sets; a material's two textures ask for two at most. So each
/// material has its own numbering: the first table is the set of its colour, the second that of its
/// emission if it is another one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TexcoordSets {
    pub first: u64,
    /// Whether a texture asks for the first; otherwise it is kept if it is there.
    pub first_is_used: bool,
    pub second: Option<u64>,
}

impl TexcoordSets {
    pub fn of(material: &document::Material) -> Self {
        let color = color_texture(material).map(TextureInfo::texcoord_set);
        let emission = emissive_texture(material).map(TextureInfo::texcoord_set);
        let first = color.or(emission);
        Self {
            first: first.unwrap_or(0),
            first_is_used: first.is_some(),
            second: emission.filter(|_| emission != first),
        }
    }
}

/// What primitives without material are made of: white, seen from the front (glTF 2.0, §3.7.2.1).
pub fn default_material() -> Material {
    Material {
        base_color: [1.0; 4],
        double_sided: false,
        ..Material::default()
    }
}

/// What reading materials needs besides the document.
pub struct MaterialReader<'a> {
    pub document: &'a Document,
    pub buffers: &'a Buffers<'a>,
    pub files: &'a mut Files,
    pub budget: &'a mut Budget,
    pub warnings: &'a mut Warnings,
    pub decoder: PictureDecoder,
    /// The pictures decoded so far.
    pub images: Vec<Image>,
    /// For each image of the document that was asked for: its row in `images`, or nothing if it
    /// cannot be decoded, which has been warned of.
    pub decoded: Vec<Option<Option<ImageId>>>,
}

impl MaterialReader<'_> {
    /// Reads a material; `index` is its row in the document. Pictures of a material that is not
    /// `used` are left alone.
    pub fn read(
        &mut self,
        index: usize,
        material: &document::Material,
        used: bool,
    ) -> Result<Material, Fault> {
        let at = format!("materials[{index}]");
        let extensions = &material.extensions;
        let factor = match &extensions.specular_glossiness {
            Some(older) => older.diffuse_factor,
            None => material.pbr_metallic_roughness.base_color_factor,
        };
        let sets = TexcoordSets::of(material);
        let mut texture = |info: Option<&TextureInfo>| match info {
            Some(info) if used => self.texture(info, &sets, &at),
            _ => Ok(None),
        };
        let base_color_texture = texture(color_texture(material))?;
        let emissive_info = emissive_texture(material);
        let emissive_texture = texture(emissive_info)?;
        let strength = extensions.emissive_strength.as_ref();
        let strength = strength.and_then(|e| e.emissive_strength).unwrap_or(1.0);
        let mut emissive = material.emissive_factor.map(|factor| factor * strength);
        if emissive_info.is_some() && emissive_texture.is_none() {
            // Without its picture, emission would cover the whole surface instead of a lamp on it.
            emissive = [0.0; 3];
        }
        let base_color = factor.unwrap_or([1.0; 4]);
        for (field, values) in [("colour", &base_color[..]), ("emission", &emissive[..])] {
            if !values
                .iter()
                .all(|value| value.is_finite() && *value >= 0.0)
            {
                let found = format!("{field} {values:?}");
                let expected = "finite values of at least 0";
                return Err(Problem::Illegal { found, expected }.at_json(at));
            }
        }
        Ok(Material {
            name: material.name.clone(),
            base_color,
            base_color_texture,
            emissive,
            emissive_texture,
            alpha_mode: match material.alpha_mode.as_deref() {
                None | Some("OPAQUE") => AlphaMode::Opaque,
                Some("MASK") => AlphaMode::Mask(material.alpha_cutoff.unwrap_or(0.5)),
                Some("BLEND") => AlphaMode::Blend,
                Some(other) => {
                    let found = format!("{:?}", other.chars().take(16).collect::<String>());
                    let expected = "OPAQUE, MASK or BLEND";
                    let at = format!("{at}.alphaMode");
                    return Err(Problem::Illegal { found, expected }.at_json(at));
                }
            },
            double_sided: material.double_sided,
            unlit: extensions.unlit.is_some(),
        })
    }

    /// The picture a texture lays on a surface; `None`, with a warning, if it cannot be had.
    fn texture(
        &mut self,
        info: &TextureInfo,
        sets: &TexcoordSets,
        at: &str,
    ) -> Result<Option<TextureRef>, Fault> {
        let (index, texture) = row(&self.document.textures, info.index, "texture", at)?;
        let at = format!("textures[{index}]");
        let webp = texture.extensions.webp.as_ref();
        let Some(source) = webp.and_then(|webp| webp.source).or(texture.source) else {
            let message = "has no PNG, JPEG or WebP image; it is left out";
            self.warnings.add(Place::Json(at), message);
            return Ok(None);
        };
        let (image_index, image) = row(&self.document.images, source, "image", &at)?;
        let image = match self.decoded[image_index] {
            Some(known) => known,
            None => {
                let image = self.image(image_index, image)?;
                *self.decoded[image_index].insert(image)
            }
        };
        let Some(image) = image else {
            return Ok(None);
        };
        let mut texture_ref = TextureRef::new(image);
        if sets.second == Some(info.texcoord_set()) {
            texture_ref.texcoords = TexcoordSet::Second;
        }
        if let Some(sampler) = texture.sampler {
            let (_, sampler) = row(&self.document.samplers, sampler, "sampler", &at)?;
            texture_ref.wrap = [sampler.wrap_s, sampler.wrap_t].map(|wrap| match wrap {
                Some(33_071) => Wrap::Clamp,
                Some(33_648) => Wrap::Mirror,
                _ => Wrap::Repeat,
            });
        }
        if let Some(transform) = &info.extensions.transform {
            texture_ref.offset = Vec2::from_array(transform.offset);
            texture_ref.rotation = transform.rotation;
            texture_ref.scale = Vec2::from_array(transform.scale);
        }
        Ok(Some(texture_ref))
    }

    /// Decodes an image; `None`, with a warning, if it cannot be had.
    fn image(&mut self, index: usize, image: &document::Image) -> Result<Option<ImageId>, Fault> {
        let at = format!("images[{index}]");
        let outside;
        let found = match (&image.uri, image.buffer_view) {
            (_, Some(view)) => Ok(self.buffers.view(view, &at)?.0),
            (Some(uri), None) => match self.files.bytes_of(uri, self.budget) {
                Ok(bytes) => {
                    outside = bytes;
                    Ok(outside.as_slice())
                }
                Err(problem) => Err(problem.to_string()),
            },
            (None, None) => Err("has neither uri nor bufferView".to_owned()),
        };
        let name = match (&image.name, &image.uri) {
            (Some(name), _) if !name.is_empty() => name.clone(),
            (_, Some(uri)) if !uri.starts_with("data:") => uri.clone(),
            _ => at.clone(),
        };
        match found.and_then(|bytes| self.decoder.decode(&name, bytes)) {
            Ok(decoded) => {
                self.images.push(decoded);
                Ok(Some(ImageId(self.images.len() as u32 - 1)))
            }
            Err(message) => {
                let message = format!("{message}; textures of it are left out");
                self.warnings.add(Place::Json(at), message);
                Ok(None)
            }
        }
    }
}
