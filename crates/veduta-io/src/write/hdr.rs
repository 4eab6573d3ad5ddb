use super::{WriteProblem, image_problem};
use image::codecs::hdr::HdrEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io::Write;
use veduta::accumulate::Picture;

/// Writes a Radiance picture: linear RGB of 8 bits with a common exponent, so that the two weaker channels
/// are coarse, and nothing is below 0. It has no place for opacity: the picture is on black.
pub fn write(writer: &mut impl Write, picture: &Picture) -> Result<(), WriteProblem> {
    // The encoder takes bytes; what is no number would become any.
    let light = |value: f32| if value > 0.0 { value.min(MOST) } else { 0.0 };
    let channels = picture.pixels.iter().flat_map(|&[r, g, b, _]| [r, g, b]);
    let bytes: Vec<u8> = channels
        .flat_map(|value| light(value).to_ne_bytes())
        .collect();
    HdrEncoder::new(writer)
        .write_image(
            &bytes,
            picture.width,
            picture.height,
            ExtendedColorType::Rgb32F,
        )
        .map_err(image_problem)
}

/// The brightest light of the format, 255/256 of 2^127.
const MOST: f32 = 1.69e38;
