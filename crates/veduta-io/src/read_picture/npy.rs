use super::decoded::{Channels, Decoded, Samples};
use super::{PictureProblem, check_size};
use half::f16;

/// Reads an array of height x width, or height x width x 1 to 4, in C order: unsigned numbers of 8
/// and 16 bits, and floating point of 16, 32 and 64.
pub fn read(bytes: &[u8]) -> Result<Decoded, PictureProblem> {
    let damaged = |message: &str| PictureProblem::Damaged(message.into());
    let unsupported = |message: String| Err(PictureProblem::Unsupported(message));
    let (b"\x93NUMPY", rest) = bytes
        .split_at_checked(6)
        .ok_or_else(|| damaged("it is cut short"))?
    else {
        return Err(damaged("it does not begin as a NumPy array"));
    };
    // Version 1 has a length of two bytes, later ones of four.
    let (length, start) = match *rest {
        [1, _, a, b, ..] => (u32::from_le_bytes([a, b, 0, 0]), 4),
        [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([a, b, c, d]), 6),
        _ => return Err(damaged("its version is not 1, 2 or 3")),
    };
    let (header, data) = rest[start..]
        .split_at_checked(length as usize)
        .ok_or_else(|| damaged("its header is cut short"))?;
    let header = std::str::from_utf8(header).map_err(|_| damaged("its header is no text"))?;
    let field = |name: &str| -> Result<&str, PictureProblem> {
        let found = header.split_once(&format!("'{name}':"));
        let (_, value) =
            found.ok_or_else(|| PictureProblem::Damaged(format!("its header has no {name:?}")))?;
        Ok(value.trim_start())
    };
    if !field("fortran_order")?.starts_with("False") {
        return unsupported("its array is in Fortran order".into());
    }
    let shape = field("shape")?
        .strip_prefix('(')
        .and_then(|rest| rest.split_once(')'))
        .ok_or_else(|| damaged("its shape is no tuple"))?
        .0;
    let sides: Result<Vec<u64>, _> = shape
        .split(',')
        .map(str::trim)
        .filter(|side| !side.is_empty())
        .map(str::parse)
        .collect();
    let sides = sides.map_err(|_| damaged("its shape has what is no number"))?;
    let (height, width, channels) = match *sides {
        [height, width] => (height, width, Some(Channels::Grey)),
        [height, width, channels] => (height, width, Channels::of_count(channels)),
        _ => (0, 0, None),
    };
    let Some(channels) = channels else {
        return unsupported(format!("an array of the shape ({shape})"));
    };
    let (width, height) = check_size(width, height, bytes.len())?;
    let count = width as usize * height as usize * channels as usize;

    let description = field("descr")?
        .strip_prefix('\'')
        .and_then(|rest| rest.split_once('\''))
        .ok_or_else(|| damaged("its descr is no text"))?
        .0;
    let take = |size: usize| {
        data.get(..count * size).ok_or_else(|| {
            let needed = count * size;
            let present = data.len();
            PictureProblem::Damaged(format!(
                "its pixels need {needed} bytes, but {present} are there"
            ))
        })
    };
    fn each<const N: usize, T>(bytes: &[u8], value: impl Fn([u8; N]) -> T) -> Vec<T> {
        let chunks = bytes.as_chunks().0.iter();
        chunks.map(|&bytes| value(bytes)).collect()
    }
    let samples = match description {
        "|u1" | "<u1" | ">u1" => Samples::U8(take(1)?.to_vec()),
        "<u2" => Samples::U16(each(take(2)?, u16::from_le_bytes)),
        ">u2" => Samples::U16(each(take(2)?, u16::from_be_bytes)),
        "<f2" => Samples::F32(each(take(2)?, |bytes| f16::from_le_bytes(bytes).to_f32())),
        ">f2" => Samples::F32(each(take(2)?, |bytes| f16::from_be_bytes(bytes).to_f32())),
        "<f4" => Samples::F32(each(take(4)?, f32::from_le_bytes)),
        ">f4" => Samples::F32(each(take(4)?, f32::from_be_bytes)),
        "<f8" => Samples::F32(each(take(8)?, |bytes| f64::from_le_bytes(bytes) as f32)),
        ">f8" => Samples::F32(each(take(8)?, |bytes| f64::from_be_bytes(bytes) as f32)),
        other => return unsupported(format!("an array of {other:?}")),
    };
    let premultiplied = matches!(samples, Samples::F32(_));
    Ok(Decoded {
        width,
        height,
        channels,
        samples,
        premultiplied,
        panorama: None,
        further_channels: Vec::new(),
        warnings: Vec::new(),
    })
}
