use super::{WriteProblem, coded, image_problem};
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use std::io::Write;
use veduta::accumulate::Picture;

/// Writes sRGB without opacity, on white. Colour is stored as finely as brightness (4:4:4): edges
/// between colours are what these pictures are made for.
pub fn write(writer: &mut impl Write, picture: &Picture, quality: u8) -> Result<(), WriteProblem> {
    let bytes = coded::rgb8_on_white(&picture.pixels);
    JpegEncoder::new_with_quality(writer, quality)
        .encode(
            &bytes,
            picture.width,
            picture.height,
            ExtendedColorType::Rgb8,
        )
        .map_err(image_problem)
}
