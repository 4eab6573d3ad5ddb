use super::{PictureOptions, WriteProblem, coded, image_problem};
use crate::sphere::Panorama;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use std::io::Write;
use veduta::accumulate::Picture;

/// Writes sRGB without opacity, on white. Colour is stored as finely as brightness (4:4:4): edges
/// between colours are what these pictures are made for. Of a panorama it tells in XMP.
pub fn write(
    writer: &mut impl Write,
    picture: &Picture,
    options: &PictureOptions,
) -> Result<(), WriteProblem> {
    let bytes = coded::rgb8_on_white(&picture.pixels);
    let encode = |writer: &mut dyn Write| {
        let (width, height) = (picture.width, picture.height);
        JpegEncoder::new_with_quality(writer, options.jpeg_quality)
            .encode(&bytes, width, height, ExtendedColorType::Rgb8)
            .map_err(image_problem)
    };
    let Some(Panorama::Gpano(told)) = options.panorama else {
        return encode(writer);
    };
    // The encoder has no place for XMP: it goes before the first segment that is not the first of JFIF.
    let mut coded = Vec::new();
    encode(&mut coded)?;
    let at = after_jfif(&coded);
    let (head, rest) = coded.split_at(at);
    writer.write_all(head)?;
    writer.write_all(&xmp_segment(&told.packet())?)?;
    Ok(writer.write_all(rest)?)
}

/// Where the segment JFIF, which comes first, ends; that of the marker of the start where there is none.
fn after_jfif(coded: &[u8]) -> usize {
    const START: usize = 2;
    match coded.get(START..START + 4) {
        Some(&[0xff, 0xe0, high, low]) => START + 2 + usize::from(u16::from_be_bytes([high, low])),
        _ => START,
    }
    .min(coded.len())
}

/// The segment APP1 of a packet of XMP.
fn xmp_segment(packet: &str) -> Result<Vec<u8>, WriteProblem> {
    const NAME: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";
    let length = u16::try_from(2 + NAME.len() + packet.len())
        .map_err(|_| WriteProblem::Encode("its description is too long for a .jpg".into()))?;
    Ok([
        &[0xff, 0xe1],
        &length.to_be_bytes(),
        NAME,
        packet.as_bytes(),
    ]
    .concat())
}
