use super::{WriteProblem, coded, image_problem};
use image::ExtendedColorType;
use image::codecs::webp::WebPEncoder;
use std::io::Write;
use veduta::accumulate::Picture;

/// The widest and highest picture of the format.
const MOST_SIDE: u32 = 16_384;

/// Writes sRGB with straight opacity, without loss.
pub fn write(writer: &mut impl Write, picture: &Picture) -> Result<(), WriteProblem> {
    if picture.width > MOST_SIDE || picture.height > MOST_SIDE {
        return Err(WriteProblem::Encode(format!(
            "WebP ends at {MOST_SIDE} pixels a side, and it has {} x {}; write .png",
            picture.width, picture.height
        )));
    }
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
