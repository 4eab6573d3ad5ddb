use super::{PngDepth, WriteProblem};
use crate::tone::srgb_from_linear;
use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};
use rayon::prelude::*;
use std::io::Write;
use veduta::accumulate::Picture;

/// Rows that are converted at a time, so that the converted picture need not fit in memory too.
const BAND_ROWS: usize = 256;

/// Writes RGBA in sRGB with straight opacity.
pub fn write(
    writer: &mut impl Write,
    picture: &Picture,
    depth: PngDepth,
) -> Result<(), WriteProblem> {
    let mut encoder = Encoder::new(writer, picture.width, picture.height);
    encoder.set_color(ColorType::Rgba);
    encoder.set_depth(match depth {
        PngDepth::Eight => BitDepth::Eight,
        PngDepth::Sixteen => BitDepth::Sixteen,
    });
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().map_err(problem)?;
    let mut stream = writer.stream_writer().map_err(problem)?;
    let width = picture.width as usize;
    for band in picture.pixels.chunks(width * BAND_ROWS) {
        let bytes: Vec<u8> = match depth {
            PngDepth::Eight => band
                .par_iter()
                .flat_map_iter(|&pixel| straight_srgb(pixel).map(|value| round(value, 255.0) as u8))
                .collect(),
            PngDepth::Sixteen => band
                .par_iter()
                .flat_map_iter(|&pixel| {
                    let values = straight_srgb(pixel).map(|value| round(value, 65_535.0) as u16);
                    values.into_iter().flat_map(u16::to_be_bytes)
                })
                .collect(),
        };
        stream.write_all(&bytes)?;
    }
    stream.finish().map_err(problem)?;
    writer.finish().map_err(problem)
}

/// Premultiplied linear RGBA -> straight sRGB with opacity, all from 0 to 1.
fn straight_srgb([r, g, b, alpha]: [f32; 4]) -> [f32; 4] {
    if alpha <= 0.0 {
        return [0.0; 4];
    }
    let [r, g, b] = [r, g, b].map(|channel| srgb_from_linear((channel / alpha).clamp(0.0, 1.0)));
    [r, g, b, alpha.min(1.0)]
}

/// A value from 0 to 1 -> the nearest of the whole numbers up to `most`.
fn round(value: f32, most: f32) -> f32 {
    (value * most).round()
}

fn problem(error: EncodingError) -> WriteProblem {
    match error {
        EncodingError::IoError(error) => WriteProblem::Io(error),
        other => WriteProblem::Encode(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_covered_pixels_keep_the_colour_of_their_surface() {
        let pixels = vec![
            [0.25, 1.0, 0.0, 1.0],
            [0.125, 0.5, 0.0, 0.5],
            [0.0; 4],
            [9.0; 4],
        ];
        let picture = Picture {
            width: 2,
            height: 2,
            pixels,
        };
        // sRGB of 0.25 is 0.5371.
        let expected: [(PngDepth, &[u16]); 2] = [
            (
                PngDepth::Eight,
                &[
                    137, 255, 0, 255, 137, 255, 0, 128, 0, 0, 0, 0, 255, 255, 255, 255,
                ],
            ),
            (
                PngDepth::Sixteen,
                &[
                    35_199, 65_535, 0, 65_535, 35_199, 65_535, 0, 32_768, 0, 0, 0, 0, 65_535,
                    65_535, 65_535, 65_535,
                ],
            ),
        ];
        for (depth, expected) in expected {
            let mut bytes = Vec::new();
            write(&mut bytes, &picture, depth).expect("memory takes all");
            let decoder = png::Decoder::new(std::io::Cursor::new(bytes));
            let mut reader = decoder.read_info().expect("a PNG");
            assert!(
                reader.info().srgb.is_some(),
                "the file says that it is sRGB"
            );
            let mut found = vec![0; reader.output_buffer_size().expect("is small")];
            reader.next_frame(&mut found).expect("a PNG");
            let found: Vec<u16> = match depth {
                PngDepth::Eight => found.into_iter().map(u16::from).collect(),
                PngDepth::Sixteen => {
                    let words = found.as_chunks().0.iter();
                    words.map(|&word| u16::from_be_bytes(word)).collect()
                }
            };
            assert_eq!(found, expected);
        }
    }
}
