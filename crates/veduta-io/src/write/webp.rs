use super::{WriteProblem, coded, image_problem};
use image::ExtendedColorType;
use image::codecs::webp::WebPEncoder;
use std::io::Write;
use veduta::accumulate::Picture;

/// Writes sRGB with straight opacity, without loss.
pub fn write(writer: &mut impl Write, picture: &Picture) -> Result<(), WriteProblem> {
    let bytes = coded::rgba8(&picture.pixels);
    WebPEncoder::new_lossless(writer)
        .encode(
            &bytes,
            picture.width,
            picture.height,
            ExtendedColorType::Rgba8,
        )
        .map_err(image_problem)
}
