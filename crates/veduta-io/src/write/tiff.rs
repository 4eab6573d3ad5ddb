use super::{Samples, WriteProblem, coded};
use std::io::{Seek, Write};
use tiff::TiffError;
use tiff::encoder::colortype::{ColorType, RGBA8, RGBA16, RGBA32Float};
use tiff::encoder::{
    Compression, DeflateLevel, Predictor, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard,
    TiffValue,
};
use tiff::tags::Tag;
use veduta::accumulate::Picture;

/// Rows of a strip, which are compressed together.
const STRIP_ROWS: u32 = 64;

/// Values of the tag `ExtraSamples` (TIFF 6.0, section 18): premultiplied opacity, and straight.
const ASSOCIATED: u16 = 1;
const UNASSOCIATED: u16 = 2;

/// From this size on a file needs offsets of 64 bits (BigTIFF). Deflate may make noise a little
/// larger, therefore not 2^32.
const BIG: u64 = 4_000_000_000;

/// Writes RGBA, compressed without loss: 8 and 16 bits as straight sRGB, f32 as the picture is
/// (linear, premultiplied).
pub fn write(
    writer: &mut (impl Write + Seek),
    picture: &Picture,
    samples: Samples,
) -> Result<(), WriteProblem> {
    let sample_bytes = match samples {
        Samples::U8 => 1,
        Samples::U16 => 2,
        Samples::F16 | Samples::F32 => 4,
    };
    let bytes = picture.pixels.len() as u64 * 4 * sample_bytes;
    let written = if bytes < BIG {
        write_as::<TiffKindStandard>(writer, picture, samples)
    } else {
        write_as::<TiffKindBig>(writer, picture, samples)
    };
    written.map_err(|error| match error {
        TiffError::IoError(error) => WriteProblem::Io(error),
        other => WriteProblem::Encode(other.to_string()),
    })
}

fn write_as<Kind: TiffKind>(
    writer: &mut (impl Write + Seek),
    picture: &Picture,
    samples: Samples,
) -> Result<(), TiffError> {
    let pixels = &picture.pixels;
    match samples {
        Samples::U8 => {
            let coded = coded::rgba8(pixels);
            write_image::<Kind, RGBA8>(writer, picture, UNASSOCIATED, &coded)
        }
        Samples::U16 => {
            let coded = coded::rgba16(pixels);
            write_image::<Kind, RGBA16>(writer, picture, UNASSOCIATED, &coded)
        }
        Samples::F16 | Samples::F32 => {
            write_image::<Kind, RGBA32Float>(writer, picture, ASSOCIATED, pixels.as_flattened())
        }
    }
}

fn write_image<Kind: TiffKind, Color: ColorType>(
    writer: &mut (impl Write + Seek),
    picture: &Picture,
    opacity: u16,
    samples: &[Color::Inner],
) -> Result<(), TiffError>
where
    [Color::Inner]: TiffValue,
{
    // The differences of neighbours compress better than they themselves, if they are whole numbers.
    let predictor = match opacity {
        UNASSOCIATED => Predictor::Horizontal,
        _ => Predictor::None,
    };
    let mut encoder = TiffEncoder::<_, Kind>::new_generic(writer)?
        .with_compression(Compression::Deflate(DeflateLevel::Balanced))
        .with_predictor(predictor);
    let mut image = encoder.new_image::<Color>(picture.width, picture.height)?;
    image.encoder().write_tag(Tag::ExtraSamples, opacity)?;
    image.encoder().write_tag(Tag::Software, "veduta")?;
    image.rows_per_strip(STRIP_ROWS.min(picture.height))?;
    // All at once: strips that are written one by one are not compressed by this crate (0.11).
    image.write_data(samples)
}
