use crate::scene::ImageId;
use serde::{Deserialize, Serialize};
use veduta_geometry::Vec2;

/// How a surface looks. Colours are linear Rec.709.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name from the model.
    pub name: String,
    /// Colour and opacity, multiplied with the texture and the vertex colours.
    pub base_color: [f32; 4],
    /// Picture of the colour (sRGB) and opacity.
    pub base_color_texture: Option<TextureRef>,
    /// Radiance it gives off by itself, multiplied with the emissive texture.
    pub emissive: [f32; 3],
    /// Picture of the radiance (sRGB); its opacity means nothing.
    pub emissive_texture: Option<TextureRef>,
    /// What opacity means.
    pub alpha_mode: AlphaMode,
    /// Seen from both sides; otherwise faces turned away from the eye are left out.
    pub double_sided: bool,
    /// Shows its colour as it is, whatever the light.
    pub unlit: bool,
}

impl Default for Material {
    /// Light grey, opaque, seen from both sides.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: [0.6, 0.6, 0.6, 1.0],
            base_color_texture: None,
            emissive: [0.0; 3],
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: true,
            unlit: false,
        }
    }
}

/// What a material's opacity means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum AlphaMode {
    /// Opacity is ignored.
    #[default]
    Opaque,
    /// Opaque where opacity is at least the cutoff, absent elsewhere.
    Mask(f32),
    /// Opacity blends with what is behind.
    Blend,
}

/// A picture laid on a surface by its texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureRef {
    /// The picture.
    pub image: ImageId,
    /// The texture coordinates that place it.
    pub texcoords: TexcoordSet,
    /// What lies outside the unit square, along u and v.
    pub wrap: [Wrap; 2],
    /// Picture coordinates are `offset + rotation(scale * uv)` (KHR_texture_transform).
    pub offset: Vec2,
    /// Rotation in radians.
    pub rotation: f32,
    /// Scale along u and v.
    pub scale: Vec2,
}

impl TextureRef {
    /// The picture as it is, placed by the first texture coordinates, repeated.
    pub fn new(image: ImageId) -> Self {
        Self {
            image,
            texcoords: TexcoordSet::First,
            wrap: [Wrap::Repeat; 2],
            offset: Vec2::ZERO,
            rotation: 0.0,
            scale: Vec2::ONE,
        }
    }
}

/// One of a mesh's tables of texture coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum TexcoordSet {
    /// [`Mesh::texcoords`](crate::scene::Mesh::texcoords).
    #[default]
    First,
    /// [`Mesh::second_texcoords`](crate::scene::Mesh::second_texcoords).
    Second,
}

/// What lies outside a texture's unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// The picture mirrored.
    Mirror,
    /// The border's colour.
    Clamp,
}

/// A picture: 8-bit sRGB with straight alpha, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Where it came from, for messages.
    pub name: String,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// `width * height` pixels.
    pub pixels: Vec<[u8; 4]>,
}
