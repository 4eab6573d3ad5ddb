//! Parts and their radiance -> pixels.

/// A picture in linear light: RGBA, colour premultiplied by opacity, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` pixels.
    pub pixels: Vec<[f32; 4]>,
}
