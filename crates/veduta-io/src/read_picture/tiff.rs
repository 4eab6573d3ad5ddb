use super::decoded::{Channels, Decoded, Samples};
use super::{PictureProblem, check_size};
use std::io::Cursor;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{ColorType, TiffError};

/// The value of the tag `ExtraSamples` for premultiplied opacity.
const ASSOCIATED: u16 = 1;

pub fn read(bytes: &[u8]) -> Result<Decoded, PictureProblem> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(problem)?;
    let (width, height) = decoder.dimensions().map_err(problem)?;
    check_size(u64::from(width), u64::from(height), bytes.len())?;
    let kind = decoder.colortype().map_err(problem)?;
    let (channels, bits) = match kind {
        ColorType::Gray(bits) => (Channels::Grey, bits),
        ColorType::GrayA(bits) => (Channels::GreyOpacity, bits),
        ColorType::RGB(bits) => (Channels::Color, bits),
        ColorType::RGBA(bits) => (Channels::ColorOpacity, bits),
        other => return Err(PictureProblem::Unsupported(format!("{other:?}"))),
    };
    if bits < 8 {
        return Err(PictureProblem::Unsupported(format!(
            "it has {bits} bits a sample"
        )));
    }
    let opacity = match decoder.find_tag(Tag::ExtraSamples).map_err(problem)? {
        Some(value) => value.into_u16_vec().map_err(problem)?.first().copied(),
        None => None,
    };
    let count = width as usize * height as usize * channels as usize;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = count.saturating_mul(8);
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    let mut decoder = decoder.with_limits(limits);
    let samples = match decoder.read_image().map_err(problem)? {
        DecodingResult::U8(samples) => Samples::U8(samples),
        DecodingResult::U16(samples) => Samples::U16(samples),
        DecodingResult::F16(samples) => {
            Samples::F32(samples.into_iter().map(|value| value.to_f32()).collect())
        }
        DecodingResult::F32(samples) => Samples::F32(samples),
        DecodingResult::F64(samples) => {
            Samples::F32(samples.into_iter().map(|value| value as f32).collect())
        }
        _ => {
            let message = "its samples are neither unsigned of 8 or 16 bits nor floating point";
            return Err(PictureProblem::Unsupported(message.into()));
        }
    };
    let found = match &samples {
        Samples::U8(samples) => samples.len(),
        Samples::U16(samples) => samples.len(),
        Samples::F32(samples) => samples.len(),
    };
    if found != count {
        // Channels one after the other, of which only the first came.
        return Err(PictureProblem::Unsupported(format!(
            "{found} samples were found where {count} are expected"
        )));
    }
    let linear = matches!(samples, Samples::F32(_));
    Ok(Decoded {
        width,
        height,
        channels,
        // Where the file does not say: floating point is premultiplied by habit, other is not.
        premultiplied: opacity.map_or(linear, |kind| kind == ASSOCIATED),
        samples,
        panorama: None,
        further_channels: Vec::new(),
        warnings: Vec::new(),
    })
}

fn problem(error: TiffError) -> PictureProblem {
    match error {
        TiffError::UnsupportedError(error) => PictureProblem::Unsupported(error.to_string()),
        other => PictureProblem::Damaged(other.to_string().replace('\n', " ")),
    }
}
