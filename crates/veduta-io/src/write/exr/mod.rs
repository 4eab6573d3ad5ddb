use super::{ExrCompression, PictureOptions, Samples, WriteProblem};
use exr::prelude::{
    Blocks, Compression, Encoding, Image, LineOrder, SpecificChannels, Text, Vec2, WritableImage,
    f16,
};
use std::io::{Seek, Write};
use veduta::accumulate::Picture;

/// Writes linear premultiplied RGBA, as f32 without loss or as f16.
pub fn write(
    writer: &mut (impl Write + Seek),
    picture: &Picture,
    samples: Samples,
    options: &PictureOptions,
) -> Result<(), WriteProblem> {
    let size = Vec2(picture.width as usize, picture.height as usize);
    let pixel = |at: Vec2<usize>| picture.pixels[at.1 * size.0 + at.0];
    let encoding = Encoding {
        compression: match options.exr_compression {
            ExrCompression::None => Compression::Uncompressed,
            ExrCompression::Rle => Compression::RLE,
            ExrCompression::Zips => Compression::ZIP1,
            ExrCompression::Zip => Compression::ZIP16,
            ExrCompression::Piz => Compression::PIZ,
        },
        blocks: match options.exr_tile {
            None => Blocks::ScanLines,
            Some(side) => Blocks::Tiles(Vec2(side as usize, side as usize)),
        },
        // The same bytes whatever the number of threads.
        line_order: LineOrder::Increasing,
    };
    macro_rules! write_channels {
        ($channels:expr) => {{
            let mut image = Image::from_encoded_channels(size, encoding, $channels);
            image.layer_data.attributes.software_name = Some(Text::from("veduta"));
            image.write().to_buffered(writer)
        }};
    }
    let written = if samples == Samples::F16 {
        write_channels!(SpecificChannels::rgba(|at: Vec2<usize>| {
            let [r, g, b, alpha] = pixel(at).map(half);
            (r, g, b, alpha)
        }))
    } else {
        write_channels!(SpecificChannels::rgba(|at: Vec2<usize>| {
            let [r, g, b, alpha] = pixel(at);
            (r, g, b, alpha)
        }))
    };
    written.map_err(|error| match error {
        exr::error::Error::Io(error) => WriteProblem::Io(error),
        other => WriteProblem::Encode(other.to_string()),
    })
}

/// The nearest f16. What is too bright becomes the brightest there is: infinities would spread
/// through every filter that follows.
fn half(value: f32) -> f16 {
    let most = f16::MAX.to_f32();
    f16::from_f32(if value.is_finite() {
        value.clamp(-most, most)
    } else {
        value
    })
}
