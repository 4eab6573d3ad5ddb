use super::{Samples, WriteProblem, coded};
use crate::sphere::Panorama;
use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};
use std::io::Write;
use veduta::accumulate::Picture;

/// Rows that are converted at a time, so that the converted picture need not fit in memory too.
const BAND_ROWS: usize = 256;

/// Writes RGBA in sRGB with straight opacity, and says so in an `sRGB` chunk; of a panorama in XMP.
pub fn write(
    writer: &mut impl Write,
    picture: &Picture,
    samples: Samples,
    panorama: Option<Panorama>,
) -> Result<(), WriteProblem> {
    let sixteen = samples == Samples::U16;
    let mut encoder = Encoder::new(writer, picture.width, picture.height);
    encoder.set_color(ColorType::Rgba);
    encoder.set_depth(if sixteen {
        BitDepth::Sixteen
    } else {
        BitDepth::Eight
    });
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    if let Some(Panorama::Gpano(told)) = panorama {
        let keyword = "XML:com.adobe.xmp".to_owned();
        encoder
            .add_itxt_chunk(keyword, told.packet())
            .map_err(problem)?;
    }
    let mut writer = encoder.write_header().map_err(problem)?;
    let mut stream = writer.stream_writer().map_err(problem)?;
    for band in picture.pixels.chunks(picture.width as usize * BAND_ROWS) {
        if sixteen {
            let words = coded::rgba16(band);
            let bytes: Vec<u8> = words.into_iter().flat_map(u16::to_be_bytes).collect();
            stream.write_all(&bytes)?;
        } else {
            stream.write_all(&coded::rgba8(band))?;
        }
    }
    stream.finish().map_err(problem)?;
    writer.finish().map_err(problem)
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
    fn the_file_says_that_it_is_srgb_and_holds_the_numbers() {
        let pixels = vec![[0.25, 1.0, 0.0, 1.0], [0.125, 0.5, 0.0, 0.5]];
        let picture = Picture {
            width: 2,
            height: 1,
            pixels,
        };
        for samples in [Samples::U8, Samples::U16] {
            let mut bytes = Vec::new();
            write(&mut bytes, &picture, samples, None).expect("memory takes all");
            let decoder = png::Decoder::new(std::io::Cursor::new(bytes));
            let mut reader = decoder.read_info().expect("a PNG");
            assert!(
                reader.info().srgb.is_some(),
                "the file says that it is sRGB"
            );
            let mut found = vec![0; reader.output_buffer_size().expect("is small")];
            reader.next_frame(&mut found).expect("a PNG");
            let expected = match samples {
                Samples::U16 => {
                    let words = coded::rgba16(&picture.pixels);
                    words.into_iter().flat_map(u16::to_be_bytes).collect()
                }
                _ => coded::rgba8(&picture.pixels),
            };
            assert_eq!(found, expected);
        }
    }
}
