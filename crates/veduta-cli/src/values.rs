//! Values of the command line, with their units.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use veduta::pipeline::Sampling;
use veduta_geometry::{DVec2, DVec3};
use veduta_io::tone::{Exposure, linear_from_srgb};
use veduta_io::{PictureFormat, is_map};

/// Size of a picture in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    pub width: u32,
    pub height: u32,
}

/// Widest and highest picture.
const MOST_SIDE: u32 = 65_535;
/// The most pixels of a picture: 4 GiB as linear f32.
const MOST_PIXELS: u64 = 1 << 28;

impl Size {
    /// A size within what a picture may have.
    pub fn new(width: u64, height: u64) -> Result<Self, String> {
        let most = u64::from(MOST_SIDE);
        if width == 0 || height == 0 || width > most || height > most {
            return Err(format!("each side must be 1 to {MOST_SIDE} pixels"));
        }
        if width * height > MOST_PIXELS {
            return Err(format!(
                "{} pixels are too many, at most {MOST_PIXELS} fit; render parts and join them",
                width * height
            ));
        }
        Ok(Self {
            width: width as u32,
            height: height as u32,
        })
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides = text.split_once(['x', 'X']);
        let parsed =
            sides.and_then(|(w, h)| Some((w.parse::<u64>().ok()?, h.parse::<u64>().ok()?)));
        let Some((width, height)) = parsed else {
            return Err("expected WIDTHxHEIGHT in pixels, such as 1280x960".into());
        };
        Self::new(width, height)
    }
}

/// An angle in radians, above 0 and below 180 degrees: `40deg`, `40` or `0.7rad`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOfView(pub f64);

impl FromStr for FieldOfView {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match radians(text) {
            Some(angle) if angle > 0.0 && angle < std::f64::consts::PI => Ok(Self(angle)),
            Some(_) => Err("a field of view lies above 0deg and below 180deg".into()),
            None => Err("expected an angle such as 40deg or 0.7rad".into()),
        }
    }
}

/// An angle with its unit, degrees if it has none.
fn radians(text: &str) -> Option<f64> {
    if let Some(number) = text.strip_suffix("rad") {
        return number.trim().parse().ok();
    }
    let number = text.strip_suffix("deg").or(text.strip_suffix('°'));
    let degrees: f64 = number.unwrap_or(text).trim().parse().ok()?;
    Some(degrees.to_radians())
}

/// Any finite angle, in radians: `-11deg`, `90` or `0.5rad`.
pub fn angle(text: &str) -> Result<f64, String> {
    let angle = radians(text).filter(|angle| angle.is_finite());
    angle.ok_or_else(|| "expected an angle such as 11deg or 0.5rad".into())
}

/// `X,Y,Z`, finite.
pub fn vector(text: &str) -> Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok())
        .collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) if DVec3::new(x, y, z).is_finite() => Ok(DVec3::new(x, y, z)),
        _ => Err("expected X,Y,Z such as 3,-4.5,2".into()),
    }
}

/// `X,Y`: a shift of the frame, in its widths and heights.
pub fn shift(text: &str) -> Result<DVec2, String> {
    let parts = text.split_once(',');
    let parsed =
        parts.and_then(|(x, y)| Some(DVec2::new(x.trim().parse().ok()?, y.trim().parse().ok()?)));
    match parsed {
        Some(shift) if shift.is_finite() && shift.abs().max_element() <= 1000.0 => Ok(shift),
        _ => Err("expected X,Y from -1000 to 1000, such as 0,0.25".into()),
    }
}

/// `S` or `SX,SY`: factors of a picture's size.
pub fn scale(text: &str) -> Result<DVec2, String> {
    let (x, y) = text.split_once(',').unwrap_or((text, text));
    let parsed = x.trim().parse().ok().zip(y.trim().parse().ok());
    match parsed.map(|(x, y)| DVec2::new(x, y)) {
        Some(scale) if scale.min_element() > 0.0 && scale.max_element() <= 1e6 => Ok(scale),
        _ => Err("expected a factor above 0, or two, such as 2 or 2,0.5".into()),
    }
}

/// A part of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Its left top corner, in pixels of the whole.
    pub left_top: DVec2,
    pub size: Size,
}

/// `X,Y,W,H`: a part of a picture, in its pixels.
pub fn window(text: &str) -> Result<Window, String> {
    let expected = || "expected X,Y,WIDTH,HEIGHT in pixels, such as 100,50,640,480".to_owned();
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let &[x, y, width, height] = parts.as_slice() else {
        return Err(expected());
    };
    let place = x.parse().ok().zip(y.parse().ok());
    let left_top = place
        .map(|(x, y)| DVec2::new(x, y))
        .filter(|place| place.is_finite());
    let size = width.parse().ok().zip(height.parse().ok());
    let (left_top, (width, height)) = left_top.zip(size).ok_or_else(expected)?;
    Ok(Window {
        left_top,
        size: Size::new(width, height)?,
    })
}

/// A finite length above 0, in metres.
pub fn length(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('m').unwrap_or(text).trim().parse::<f64>();
    match number {
        Ok(length) if length.is_finite() && length > 0.0 => Ok(length),
        _ => Err("expected a length above 0 in metres, such as 2.5".into()),
    }
}

/// A time from 0 on, in seconds: `1.5s`, `200ms`, `2min`, or a number of seconds.
pub fn time(text: &str) -> Result<f64, String> {
    let units = [("ms", 1e-3), ("min", 60.0), ("s", 1.0), ("", 1.0)];
    let seconds = units.iter().find_map(|(unit, seconds)| {
        let number = text.strip_suffix(unit)?.trim().parse::<f64>().ok()?;
        Some(number * seconds)
    });
    match seconds {
        // Beyond some months a double would lose the fractions.
        Some(seconds) if (0.0..=1e7).contains(&seconds) => Ok(seconds),
        _ => Err("expected a time from 0 on, such as 1.5s or 200ms".into()),
    }
}

/// Some frames of an animation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    pub first: u32,
    /// Not before the first; it is one of them if the steps lead to it.
    pub last: u32,
    /// At least 1.
    pub step: u32,
}

impl FrameRange {
    pub fn is_one(&self) -> bool {
        self.first == self.last
    }

    pub fn count(&self) -> usize {
        ((self.last - self.first) / self.step) as usize + 1
    }

    pub fn numbers(&self) -> impl Iterator<Item = u32> + use<> {
        (self.first..=self.last).step_by(self.step as usize)
    }
}

impl FromStr for FrameRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (range, step) = match text.split_once('x') {
            Some((range, step)) => (range, step.parse().ok()),
            None => (text, Some(1)),
        };
        let (first, last) = range.split_once("..").unwrap_or((range, range));
        match (first.parse(), last.parse(), step) {
            (Ok(first), Ok(last), Some(1..)) if first > last => {
                Err(format!("frame {last} comes before frame {first}"))
            }
            (Ok(first), Ok(last), Some(step @ 1..)) => Ok(Self { first, last, step }),
            _ => Err("expected frames such as 0..47, 0..47x2 or 12".into()),
        }
    }
}

/// Background of a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Background {
    /// Transparent.
    None,
    /// Linear Rec.709.
    Color([f32; 3]),
    /// The picture in this file.
    Picture(PathBuf),
    /// The stored map in this file.
    Map(PathBuf),
}

impl FromStr for Background {
    type Err = String;

    /// `none`, `#rgb` or `#rrggbb` (sRGB), or a file with the suffix of a picture or a stored map.
    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self::None);
        }
        if is_map(Path::new(text)) {
            return Ok(Self::Map(PathBuf::from(text)));
        }
        if PictureFormat::of(Path::new(text)).is_ok() {
            return Ok(Self::Picture(PathBuf::from(text)));
        }
        let expected = "expected none, a colour such as '#8ab4d8' (in quotes, since shells take # for a \
            comment), or a picture such as sky.jpg";
        color(text)
            .map(Self::Color)
            .map_err(|_| expected.to_owned())
    }
}

/// A colour, `#rgb` or `#rrggbb` (sRGB), as linear Rec.709.
pub fn color(text: &str) -> Result<[f32; 3], String> {
    let expected = || "expected a colour such as '#8ab4d8'".to_owned();
    let digits = text.strip_prefix('#').ok_or_else(expected)?;
    let digits: Option<Vec<u32>> = digits.chars().map(|digit| digit.to_digit(16)).collect();
    let bytes = match digits.as_deref() {
        Some(&[r, g, b]) => [r, g, b].map(|digit| 17 * digit),
        Some(&[r, r2, g, g2, b, b2]) => [16 * r + r2, 16 * g + g2, 16 * b + b2],
        _ => return Err(expected()),
    };
    Ok(bytes.map(|byte| linear_from_srgb(byte as f32 / 255.0)))
}

/// Pixels of a millimetre, at the 96 to an inch of CSS.
pub const PIXELS_PER_MM: f64 = 96.0 / 25.4;

/// Width of a line in pixels: `0.5px`, `0.35mm`, or a number of pixels.
pub fn line_width(text: &str) -> Result<f64, String> {
    let (number, unit) = match text.strip_suffix("mm") {
        Some(number) => (number, PIXELS_PER_MM),
        None => (text.strip_suffix("px").unwrap_or(text), 1.0),
    };
    match number.trim().parse::<f64>() {
        Ok(width) if width > 0.0 && width <= 1000.0 => Ok(width * unit),
        _ => Err("expected a width above 0 and up to 1000, such as 0.5px or 0.35mm".into()),
    }
}

/// How near lines may come to one another, in pixels.
pub fn spacing(text: &str) -> Result<f64, String> {
    match text.strip_suffix("px").unwrap_or(text).trim() {
        "0" => Ok(0.0),
        _ => line_width(text)
            .map_err(|_| "expected a distance from 0 to 1000, such as 2px or 0.5mm".into()),
    }
}

/// How far shapes reach under others, in pixels.
pub fn trap(text: &str) -> Result<f64, String> {
    match text
        .strip_suffix("px")
        .unwrap_or(text)
        .trim()
        .parse::<f64>()
    {
        Ok(trap) if (0.0..=100.0).contains(&trap) => Ok(trap),
        _ => Err("expected a number of pixels from 0 to 100, such as 4".into()),
    }
}

/// An angle in radians from 0 to 180 degrees: `30deg`, `30` or `0.5rad`.
pub fn crease_angle(text: &str) -> Result<f64, String> {
    match radians(text) {
        Some(angle) if (0.0..=std::f64::consts::PI).contains(&angle) => Ok(angle),
        _ => Err("expected an angle from 0deg to 180deg, such as 30deg".into()),
    }
}

/// `auto`, or a number of EV.
pub fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    // Beyond 60 EV neither sunlight nor starlight leaves anything to see.
    match text
        .strip_suffix("EV")
        .unwrap_or(text)
        .trim()
        .parse::<f32>()
    {
        Ok(ev) if ev.abs() <= 60.0 => Ok(Exposure::Ev(ev)),
        _ => Err("expected auto or a number of EV from -60 to 60".into()),
    }
}

/// The most sub-scanlines of a row of pixels; the exact way is cheaper long before.
const MOST_SUB_SCANLINES: u32 = 1024;

/// `exact`, or `multiscan:N`.
pub fn sampling(text: &str) -> Result<Sampling, String> {
    if text == "exact" {
        return Ok(Sampling::Exact);
    }
    let count = text
        .strip_prefix("multiscan:")
        .and_then(|count| count.parse().ok());
    match count {
        Some(count @ 1..=MOST_SUB_SCANLINES) => Ok(Sampling::Multiscan(count)),
        _ => Err(format!(
            "expected exact, or multiscan:N with N from 1 to {MOST_SUB_SCANLINES}"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_whole_numbers_within_reason() {
        let size = |width, height| Ok(Size { width, height });
        assert_eq!("1280x960".parse(), size(1280, 960));
        assert_eq!("1X65535".parse(), size(1, 65_535));
        for text in [
            "0x1",
            "1x0",
            "65536x1",
            "100000x100000",
            "20000x20000",
            "12",
            "axb",
            "-1x5",
            "1x2x3",
            "99999999999999999999x1",
        ] {
            assert!(text.parse::<Size>().is_err(), "{text}");
        }
    }

    #[test]
    fn angles_carry_their_unit() {
        for text in ["90deg", "90", "90°", "1.5707963267948966rad", "90 deg"] {
            let FieldOfView(angle) = text.parse().expect(text);
            assert!(
                (angle - std::f64::consts::FRAC_PI_2).abs() < 1e-15,
                "{text}"
            );
        }
        for text in ["0deg", "180deg", "-5", "nan", "inf", "4rad", "deg", ""] {
            assert!(text.parse::<FieldOfView>().is_err(), "{text}");
        }
    }

    #[test]
    fn colours_are_srgb() {
        let Ok(Background::Color(color)) = "#ff8000".parse() else {
            panic!("a colour");
        };
        assert_eq!((color[0], color[2]), (1.0, 0.0));
        assert!((color[1] - 0.2159).abs() < 1e-4);
        assert_eq!("#f80".parse::<Background>(), "#ff8800".parse());
        assert_eq!("none".parse(), Ok(Background::None));
        let picture = Background::Picture("my sky.JPG".into());
        assert_eq!("my sky.JPG".parse(), Ok(picture));
        for text in ["ff8000", "#ff80", "#gg0000", "red", "#ff80000", "#é00"] {
            assert!(text.parse::<Background>().is_err(), "{text}");
        }
    }

    #[test]
    fn widths_of_lines_are_pixels_or_millimetres() {
        assert_eq!(line_width("0.5px"), Ok(0.5));
        assert_eq!(line_width("2"), Ok(2.0));
        assert_eq!(line_width("25.4mm"), Ok(96.0));
        for text in ["0", "-1px", "nan", "1e9mm", "px", "1cm"] {
            assert!(line_width(text).is_err(), "{text}");
        }
    }

    #[test]
    fn traps_have_some_width_or_none() {
        assert_eq!((trap("0"), trap("2.5px")), (Ok(0.0), Ok(2.5)));
        for text in ["-1", "101", "nan", "2mm", ""] {
            assert!(trap(text).is_err(), "{text}");
        }
    }

    #[test]
    fn crease_angles_may_be_nothing_or_all_round() {
        assert_eq!(crease_angle("0"), Ok(0.0));
        assert_eq!(crease_angle("180deg"), Ok(std::f64::consts::PI));
        for text in ["-1deg", "181", "nan", "4rad", ""] {
            assert!(crease_angle(text).is_err(), "{text}");
        }
    }

    #[test]
    fn times_have_units_and_frames_both_ends() {
        for text in ["1.5s", "1.5", "1500 ms", "0.025min"] {
            assert!((time(text).expect(text) - 1.5).abs() < 1e-12, "{text}");
        }
        for text in ["-1s", "nan", "1h", "s", "", "1e9"] {
            assert!(time(text).is_err(), "{text}");
        }
        let numbers = |text: &str| {
            text.parse()
                .map(|f: FrameRange| f.numbers().collect::<Vec<_>>())
        };
        assert_eq!(numbers("3..5"), Ok(vec![3, 4, 5]));
        assert_eq!(numbers("3..8x2"), Ok(vec![3, 5, 7]));
        assert_eq!(numbers("12"), Ok(vec![12]));
        for text in ["5..3", "1..", "..2", "1..2x0", "1..2x", "-1..2", "a", ""] {
            assert!(text.parse::<FrameRange>().is_err(), "{text}");
        }
    }

    #[test]
    fn vectors_have_three_finite_numbers() {
        assert_eq!(vector("1,-2.5, 3e2"), Ok(DVec3::new(1.0, -2.5, 300.0)));
        for text in ["1,2", "1,2,3,4", "1,2,nan", "a,b,c", ""] {
            assert!(vector(text).is_err(), "{text}");
        }
    }

    #[test]
    fn shifts_have_two_numbers_within_reason() {
        assert_eq!(shift("0, -0.25"), Ok(DVec2::new(0.0, -0.25)));
        for text in ["1", "1,2,3", "nan,0", "0,1e9", "a,b", ""] {
            assert!(shift(text).is_err(), "{text}");
        }
    }

    #[test]
    fn samplings_are_exact_or_counted() {
        assert_eq!(sampling("exact"), Ok(Sampling::Exact));
        assert_eq!(sampling("multiscan:4"), Ok(Sampling::Multiscan(4)));
        for text in [
            "multiscan",
            "multiscan:0",
            "multiscan:5000",
            "multiscan:-1",
            "4",
        ] {
            assert!(sampling(text).is_err(), "{text}");
        }
    }
}
