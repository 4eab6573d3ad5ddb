//! Texture files -> pictures, within limits.

use image::{ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use veduta::scene::Image;

/// Widest and highest picture that is decoded, in pixels.
const MOST_SIDE: u32 = 32_768;
/// Bytes that all pictures of a scene may take together when decoded. Compressed pictures may
/// honestly be a thousand times smaller than this, so input length cannot bound them.
const MOST_BYTES: u64 = 2 << 30;

/// Decodes the pictures of one scene, which share a limit.
#[derive(Debug)]
pub(crate) struct PictureDecoder {
    left: u64,
}

impl PictureDecoder {
    pub fn new() -> Self {
        Self { left: MOST_BYTES }
    }

    /// Decodes PNG, JPEG or WebP, told apart by their first bytes.
    ///
    /// # Errors
    /// A sentence for a warning: a broken texture is no reason to lose the model.
    pub fn decode(&mut self, name: &str, bytes: &[u8]) -> Result<Image, String> {
        let format = image::guess_format(bytes).ok();
        let known = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP];
        let Some(format) = format.filter(|format| known.contains(format)) else {
            return Err("is neither PNG nor JPEG nor WebP".into());
        };
        let mut limits = Limits::default();
        limits.max_image_width = Some(MOST_SIDE);
        limits.max_image_height = Some(MOST_SIDE);
        limits.max_alloc = Some(self.left);
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        reader.limits(limits);
        let decoded = reader.decode().map_err(|error| error.to_string())?;
        let (width, height) = (decoded.width(), decoded.height());
        if width == 0 || height == 0 {
            return Err("is empty".into());
        }
        let rgba_bytes = u64::from(width) * u64::from(height) * 4;
        self.left = self
            .left
            .checked_sub(rgba_bytes)
            .ok_or("does not fit in memory with the other textures")?;
        let pixels = decoded.into_rgba8().as_chunks::<4>().0.to_vec();
        Ok(Image {
            name: name.to_owned(),
            width,
            height,
            pixels,
        })
    }
}
