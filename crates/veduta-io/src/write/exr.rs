use super::WriteProblem;
use exr::prelude::{
    Blocks, Compression, Encoding, Image, LineOrder, SpecificChannels, Text, Vec2, WritableImage,
};
use std::io::{Seek, Write};
use veduta::accumulate::Picture;

/// Writes linear premultiplied RGBA as f32, without loss.
pub fn write(writer: &mut (impl Write + Seek), picture: &Picture) -> Result<(), WriteProblem> {
    let size = Vec2(picture.width as usize, picture.height as usize);
    let channels = SpecificChannels::rgba(|at: Vec2<usize>| {
        let [r, g, b, alpha] = picture.pixels[at.1 * size.0 + at.0];
        (r, g, b, alpha)
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        // The same bytes whatever the number of threads.
        line_order: LineOrder::Increasing,
    };
    let mut image = Image::from_encoded_channels(size, encoding, channels);
    image.layer_data.attributes.software_name = Some(Text::from("veduta"));
    image
        .write()
        .to_buffered(writer)
        .map_err(|error| match error {
            exr::error::Error::Io(error) => WriteProblem::Io(error),
            other => WriteProblem::Encode(other.to_string()),
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels, ReadLayers};
    use std::io::Cursor;

    #[test]
    fn what_is_written_is_read_bit_for_bit() {
        let (width, height) = (37u32, 21u32);
        let pixels: Vec<[f32; 4]> = (0..width * height)
            .map(|i| [i as f32 * 0.1, -1e-7 * i as f32, 1e9, (i % 2) as f32])
            .collect();
        let picture = Picture {
            width,
            height,
            pixels,
        };
        let mut bytes = Cursor::new(Vec::new());
        write(&mut bytes, &picture).expect("memory takes all");
        let mut again = Cursor::new(Vec::new());
        write(&mut again, &picture).expect("memory takes all");
        assert_eq!(bytes.get_ref(), again.get_ref());

        bytes.set_position(0);
        let read = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .rgba_channels(
                |size, _| (size.0, vec![[0.0f32; 4]; size.area()]),
                |(width, pixels), at, (r, g, b, a): (f32, f32, f32, f32)| {
                    pixels[at.1 * *width + at.0] = [r, g, b, a];
                },
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(bytes)
            .expect("an EXR");
        assert_eq!(read.layer_data.channel_data.pixels.1, picture.pixels);
    }
}
