//! PNG, JPEG, WebP and Radiance.

use super::decoded::{Channels, Decoded, Samples};
use super::{PictureProblem, check_size};
use crate::sphere::{Gpano, Panorama};
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

pub fn read(bytes: &[u8], format: ImageFormat) -> Result<Decoded, PictureProblem> {
    let mut decoder = ImageReader::with_format(Cursor::new(bytes), format)
        .into_decoder()
        .map_err(problem)?;
    let (width, height) = decoder.dimensions();
    check_size(u64::from(width), u64::from(height), bytes.len())?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(decoder.total_bytes().saturating_mul(2).max(64 << 20));
    decoder.set_limits(limits).map_err(problem)?;
    let mut warnings = Vec::new();
    let profile = decoder.icc_profile().map_err(problem)?;
    if profile.is_some_and(|profile| !is_srgb(&profile)) {
        warnings.push("has a colour profile that is not applied; it is taken as sRGB".into());
    }
    let mut panorama = None;
    if let Some(packet) = decoder.xmp_metadata().map_err(problem)? {
        // A picture is one whatever it says of itself.
        match Gpano::read(&packet) {
            Ok(found) => panorama = found.map(Panorama::Gpano),
            Err(message) => warnings.push(message),
        }
    }
    if format == ImageFormat::Jpeg && !jpeg_ends(bytes) {
        let message = "it has no end; it was cut short";
        return Err(PictureProblem::Damaged(message.into()));
    }
    let decoded = DynamicImage::from_decoder(decoder).map_err(problem)?;
    use Channels::{Color, ColorOpacity, Grey, GreyOpacity};
    let (channels, samples) = match decoded {
        DynamicImage::ImageLuma8(image) => (Grey, Samples::U8(image.into_raw())),
        DynamicImage::ImageLumaA8(image) => (GreyOpacity, Samples::U8(image.into_raw())),
        DynamicImage::ImageRgb8(image) => (Color, Samples::U8(image.into_raw())),
        DynamicImage::ImageRgba8(image) => (ColorOpacity, Samples::U8(image.into_raw())),
        DynamicImage::ImageLuma16(image) => (Grey, Samples::U16(image.into_raw())),
        DynamicImage::ImageLumaA16(image) => (GreyOpacity, Samples::U16(image.into_raw())),
        DynamicImage::ImageRgb16(image) => (Color, Samples::U16(image.into_raw())),
        DynamicImage::ImageRgba16(image) => (ColorOpacity, Samples::U16(image.into_raw())),
        DynamicImage::ImageRgb32F(image) => (Color, Samples::F32(image.into_raw())),
        other => {
            let message = format!("its samples are {:?}", other.color());
            return Err(PictureProblem::Unsupported(message));
        }
    };
    Ok(Decoded {
        width,
        height,
        channels,
        samples,
        premultiplied: false,
        panorama,
        further_channels: Vec::new(),
        warnings,
    })
}

/// Whether a JPEG has its end marker. The decoder shows a file that is cut short as far as it goes,
/// with grey below, which is no picture to compare.
fn jpeg_ends(bytes: &[u8]) -> bool {
    // Segments before the first scan have a length, and may hold whole JPEGs (thumbnails). In scans
    // the marker cannot occur: 0xff is followed by 0 there, or by a restart.
    const SCAN: u8 = 0xda;
    const END: [u8; 2] = [0xff, 0xd9];
    let mut rest = bytes.get(2..).unwrap_or_default();
    while let [0xff, marker, high, low, ..] = *rest {
        if marker == SCAN {
            return rest.windows(2).any(|window| window == END);
        }
        // Markers may be preceded by any number of 0xff.
        let length = match marker {
            0xff => 1,
            _ => 2 + usize::from(u16::from_be_bytes([high, low])),
        };
        rest = rest.get(length..).unwrap_or_default();
    }
    false
}

/// Whether a profile's description names sRGB, in ASCII (version 2) or UTF-16 (version 4).
fn is_srgb(profile: &[u8]) -> bool {
    let wide: Vec<u8> = "sRGB".bytes().flat_map(|byte| [0, byte]).collect();
    let holds = |name: &[u8]| profile.windows(name.len()).any(|window| window == name);
    holds(b"sRGB") || holds(&wide)
}

fn problem(error: ImageError) -> PictureProblem {
    match error {
        ImageError::Unsupported(error) => PictureProblem::Unsupported(error.to_string()),
        // Bytes in memory can only end too early.
        other => PictureProblem::Damaged(other.to_string().replace('\n', " ")),
    }
}
