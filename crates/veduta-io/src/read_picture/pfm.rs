use super::decoded::{Channels, Decoded, Samples};
use super::{PictureProblem, check_size};

/// Reads colour (`PF`) and grey (`Pf`), either byte order. The scale's size is a unit of light that
/// programs write as they like and do not read; it is left out of account here too.
pub fn read(bytes: &[u8]) -> Result<Decoded, PictureProblem> {
    let damaged = |message: &str| PictureProblem::Damaged(message.into());
    let mut rest = bytes;
    let channels = match next_word(&mut rest) {
        Some(b"PF") => Channels::Color,
        Some(b"Pf") => Channels::Grey,
        _ => return Err(damaged("it does not begin with PF or Pf")),
    };
    let mut number = |what: &str| -> Result<f64, PictureProblem> {
        let word = next_word(&mut rest).and_then(|word| std::str::from_utf8(word).ok());
        let number = word.and_then(|word| word.parse().ok());
        number.ok_or_else(|| PictureProblem::Damaged(format!("the {what} is no number")))
    };
    let (width, height) = (number("width")?, number("height")?);
    let scale = number("scale")?;
    if width.fract() != 0.0 || height.fract() != 0.0 || width < 0.0 || height < 0.0 {
        return Err(damaged("its size is no whole number of pixels"));
    }
    if scale == 0.0 || scale.is_nan() {
        return Err(damaged("its scale tells no byte order"));
    }
    // A float's cast saturates, which is too large for any file.
    let (width, height) = check_size(width as u64, height as u64, bytes.len())?;
    let row_samples = width as usize * channels as usize;
    let needed = row_samples * height as usize * 4;
    let Some(rows) = rest.get(..needed) else {
        return Err(PictureProblem::Damaged(format!(
            "its pixels need {needed} bytes, but {} are there",
            rest.len()
        )));
    };
    let value = if scale < 0.0 {
        f32::from_le_bytes
    } else {
        f32::from_be_bytes
    };
    let samples = rows
        .chunks_exact(row_samples * 4)
        .rev()
        .flat_map(|row| row.as_chunks().0)
        .map(|&bytes| value(bytes))
        .collect();
    Ok(Decoded {
        width,
        height,
        channels,
        samples: Samples::F32(samples),
        premultiplied: true,
        panorama: None,
        further_channels: Vec::new(),
        warnings: Vec::new(),
    })
}

/// The next word and the one white space after it: pixels begin right there.
fn next_word<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let bytes: &'a [u8] = rest;
    let start = bytes.iter().position(|byte| !byte.is_ascii_whitespace())?;
    let length = bytes[start..].iter().position(u8::is_ascii_whitespace)?;
    *rest = &bytes[start + length + 1..];
    Some(&bytes[start..start + length])
}
