//! Values with their units: angles, lengths, colours, vectors, names.
//!
//! A quantity is a text of a number and its unit, or, where it is unmistakable, a plain number in
//! degrees or metres.

use super::form::{Leaf, OutOfRange};
use crate::read::finish::REACH;
use crate::tone::linear_from_srgb;
use serde_json::{Value, json};
use std::f64::consts::PI;
use toml::de::DeValue;
use veduta::geometry::{DMat4, DVec2, DVec3, DVec4, Vec2};
use veduta::reproject::Lens;
use veduta::scene::Shown;

/// A number. TOML also has infinities and what is no number at all; those are refused.
fn number(value: &DeValue<'_>) -> Option<f64> {
    let number = match value {
        DeValue::Integer(number) => {
            i64::from_str_radix(number.as_str(), number.radix()).ok()? as f64
        }
        DeValue::Float(number) => number.as_str().parse().ok()?,
        _ => return None,
    };
    number.is_finite().then_some(number)
}

/// A whole number, also as `8.0`, which JSON does not tell from `8`.
fn whole(value: &DeValue<'_>, range: std::ops::RangeInclusive<f64>) -> Option<f64> {
    number(value).filter(|number| number.fract() == 0.0 && range.contains(number))
}

/// An array of `N` values.
fn array<T, const N: usize>(
    value: &DeValue<'_>,
    item: impl Fn(&DeValue<'_>) -> Option<T>,
) -> Option<[T; N]> {
    let items: Option<Vec<T>> = value
        .as_array()?
        .iter()
        .map(|value| item(value.get_ref()))
        .collect();
    items?.try_into().ok()
}

fn array_schema(length: usize, item: Value) -> Value {
    json!({ "type": "array", "minItems": length, "maxItems": length, "items": item })
}

/// A number with one of `units`, in the unit whose factor is 1. It may be too large, infinite.
fn quantity(value: &DeValue<'_>, units: &[(&str, f64)]) -> Option<f64> {
    let text = value.as_str()?;
    units.iter().find_map(|(unit, factor)| {
        let number = text.strip_suffix(unit)?.trim_end_matches(' ');
        let number: f64 = is_number(number).then(|| number.parse().ok())??;
        Some(number * factor)
    })
}

/// The numbers of [`quantity_pattern`].
fn is_number(text: &str) -> bool {
    let unsigned = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let signless = |text: &str| {
        text.strip_prefix(['+', '-'])
            .map_or(text, |rest| rest)
            .to_owned()
    };
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (text, None),
    };
    let mantissa = signless(mantissa);
    let mantissa = match mantissa.split_once('.') {
        Some((whole, fraction)) => unsigned(whole) && unsigned(fraction),
        None => unsigned(&mantissa),
    };
    mantissa && exponent.is_none_or(|exponent| unsigned(&signless(exponent)))
}

/// The same as a regular expression.
fn quantity_pattern(units: &[(&str, f64)]) -> String {
    let units: Vec<_> = units.iter().map(|unit| unit.0).collect();
    let units = units.join("|");
    format!(r"^[+-]?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)? *({units})$")
}

const ANGLE_UNITS: &[(&str, f64)] = &[("deg", PI / 180.0), ("°", PI / 180.0), ("rad", 1.0)];
const LENGTH_UNITS: &[(&str, f64)] = &[("km", 1e3), ("cm", 1e-2), ("mm", 1e-3), ("m", 1.0)];

/// A value that is either out of range or not.
fn ranged<T>(value: T, is_in_range: bool) -> Option<Result<T, OutOfRange>> {
    Some(if is_in_range {
        Ok(value)
    } else {
        Err(OutOfRange)
    })
}

/// An angle in radians.
#[derive(Clone, Copy, Debug)]
pub struct Angle(pub f64);

fn angle(value: &DeValue<'_>) -> Option<f64> {
    number(value)
        .map(f64::to_radians)
        .or_else(|| quantity(value, ANGLE_UNITS))
}

fn angle_schema() -> Value {
    json!({ "anyOf": [
        { "type": "number" },
        { "type": "string", "pattern": quantity_pattern(ANGLE_UNITS) },
    ] })
}

impl Leaf for Angle {
    const EXPECTED: &'static str = "an angle, such as \"30deg\" or \"0.5rad\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let angle = angle(value)?;
        ranged(Self(angle), angle.is_finite())
    }

    fn schema() -> Value {
        angle_schema()
    }
}

/// A field of view in radians, between 0 and pi.
#[derive(Clone, Copy, Debug)]
pub struct FieldOfView(pub f64);

impl Leaf for FieldOfView {
    const EXPECTED: &'static str = "an angle above 0deg and below 180deg, such as \"40deg\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let angle = angle(value)?;
        ranged(Self(angle), angle > 0.0 && angle < PI)
    }

    fn schema() -> Value {
        angle_schema()
    }
}

/// A length above 0, in metres.
#[derive(Clone, Copy, Debug)]
pub struct Length(pub f64);

impl Leaf for Length {
    const EXPECTED: &'static str = "a length above 0 in metres, or with a unit, such as \"2.5 m\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let length = number(value).or_else(|| quantity(value, LENGTH_UNITS))?;
        ranged(Self(length), length > 0.0 && length < REACH)
    }

    fn schema() -> Value {
        json!({ "anyOf": [
            { "type": "number" },
            { "type": "string", "pattern": quantity_pattern(LENGTH_UNITS) },
        ] })
    }
}

/// A length above 0 that must have its unit, in metres: of a lens nobody would expect metres.
#[derive(Clone, Copy, Debug)]
pub struct LensLength(pub f64);

impl Leaf for LensLength {
    const EXPECTED: &'static str = "a length above 0 with its unit, such as \"35 mm\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let length = quantity(value, LENGTH_UNITS)?;
        ranged(Self(length), length > 0.0 && length < REACH)
    }

    fn schema() -> Value {
        json!({ "type": "string", "pattern": quantity_pattern(LENGTH_UNITS) })
    }
}

/// A time after the beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Time {
    Seconds(f64),
    Frames(f64),
}

const TIME_UNITS: &[(&str, f64)] = &[("min", 60.0), ("ms", 1e-3), ("s", 1.0)];
const FRAME_UNITS: &[(&str, f64)] = &[("frames", 1.0), ("frame", 1.0)];

impl Time {
    /// The latest: some months. Later times are slips, and only they could lose their fractions.
    const MOST: f64 = 1e7;

    pub fn seconds(self, frames_per_second: f64) -> f64 {
        match self {
            Self::Seconds(seconds) => seconds,
            Self::Frames(frames) => frames / frames_per_second,
        }
    }
}

impl Leaf for Time {
    const EXPECTED: &'static str =
        "a time from 0 on in seconds, or with a unit, such as \"1.5 s\" or \"36 frames\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let seconds = number(value).or_else(|| quantity(value, TIME_UNITS));
        let frames = || quantity(value, FRAME_UNITS).map(Self::Frames);
        let time = seconds.map(Self::Seconds).or_else(frames)?;
        let (Self::Seconds(number) | Self::Frames(number)) = time;
        ranged(time, (0.0..=Self::MOST).contains(&number))
    }

    fn schema() -> Value {
        let units = [TIME_UNITS, FRAME_UNITS].concat();
        json!({ "anyOf": [
            { "type": "number" },
            { "type": "string", "pattern": quantity_pattern(&units) },
        ] })
    }
}

/// How many frames a second has.
#[derive(Clone, Copy, Debug)]
pub struct FramesPerSecond(pub f64);

impl Leaf for FramesPerSecond {
    const EXPECTED: &'static str = "a number from 0.001 to 1000, such as 24 or 29.97";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let number = number(value).filter(|number| (0.001..=1000.0).contains(number))?;
        Some(Ok(Self(number)))
    }

    fn schema() -> Value {
        json!({ "type": "number", "minimum": 0.001, "maximum": 1000 })
    }
}

/// What is between two keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    Step,
    #[default]
    Linear,
    Ease,
}

impl Leaf for Interpolation {
    const EXPECTED: &'static str = "\"linear\", \"ease\" or \"step\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        match value.as_str()? {
            "step" => Some(Ok(Self::Step)),
            "linear" => Some(Ok(Self::Linear)),
            "ease" => Some(Ok(Self::Ease)),
            _ => None,
        }
    }

    fn schema() -> Value {
        json!({ "enum": ["linear", "ease", "step"] })
    }
}

/// An animation of a model: true for its first, or its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Played {
    None,
    First,
    Named(String),
}

impl Leaf for Played {
    const EXPECTED: &'static str = "a name of an animation, true for the first, or false for none";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        Some(Ok(match value {
            DeValue::Boolean(false) => Self::None,
            DeValue::Boolean(true) => Self::First,
            DeValue::String(name) if !name.is_empty() => Self::Named(name.as_ref().to_owned()),
            _ => return None,
        }))
    }

    fn schema() -> Value {
        json!({ "anyOf": [{ "type": "boolean" }, { "type": "string", "minLength": 1 }] })
    }
}

/// A point, or an offset, in metres.
#[derive(Clone, Copy, Debug)]
pub struct Vector(pub DVec3);

fn vector(value: &DeValue<'_>) -> Option<DVec3> {
    array(value, number).map(DVec3::from_array)
}

impl Leaf for Vector {
    const EXPECTED: &'static str = "three numbers in metres, such as [26, -44.5, 1.7]";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let vector = vector(value)?;
        ranged(Self(vector), vector.abs().max_element() < REACH)
    }

    fn schema() -> Value {
        array_schema(3, json!({ "type": "number" }))
    }
}

/// A unit vector.
#[derive(Clone, Copy, Debug)]
pub struct Direction(pub DVec3);

impl Leaf for Direction {
    const EXPECTED: &'static str = "three numbers that are not all 0, such as [0, 0, 1]";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        Some(match vector(value)?.try_normalize() {
            Some(unit) => Ok(Self(unit)),
            None => Err(OutOfRange),
        })
    }

    fn schema() -> Value {
        array_schema(3, json!({ "type": "number" }))
    }
}

/// Width and height of a picture in pixels.
#[derive(Clone, Copy, Debug)]
pub struct PictureSize(pub [u32; 2]);

/// Widest and highest picture, in pixels.
const MOST_SIDE: u32 = 65_535;

impl Leaf for PictureSize {
    const EXPECTED: &'static str = "a width and a height from 1 to 65535, such as [1920, 1080]";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let side = |value: &DeValue<'_>| whole(value, 1.0..=f64::from(MOST_SIDE));
        let sides = array(value, side)?;
        Some(Ok(Self(sides.map(|side| side as u32))))
    }

    fn schema() -> Value {
        let side = json!({ "type": "integer", "minimum": 1, "maximum": MOST_SIDE });
        array_schema(2, side)
    }
}

/// A shift of the frame, in widths to the right and heights upwards.
#[derive(Clone, Copy, Debug)]
pub struct Shift(pub DVec2);

impl Leaf for Shift {
    const EXPECTED: &'static str = "two numbers from -1000 to 1000, such as [0, 0.25]";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let part = |value: &DeValue<'_>| number(value).filter(|part| part.abs() <= 1000.0);
        Some(Ok(Self(array(value, part).map(DVec2::from_array)?)))
    }

    fn schema() -> Value {
        array_schema(
            2,
            json!({ "type": "number", "minimum": -1000, "maximum": 1000 }),
        )
    }
}

/// Factors along x, y and z, none of them 0.
#[derive(Clone, Copy, Debug)]
pub struct Scale(pub DVec3);

impl Scale {
    /// Factors beyond would leave nothing to see, and numbers that overflow.
    const LEAST: f64 = 1e-9;
    const MOST: f64 = 1e9;
}

impl Leaf for Scale {
    const EXPECTED: &'static str = "a factor or three, from 1e-9 to 1e9, such as 2 or [1, 1, 0.5]";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let scale = number(value).map(DVec3::splat).or_else(|| vector(value))?;
        let sizes = scale.abs();
        let fits = sizes.min_element() >= Self::LEAST && sizes.max_element() <= Self::MOST;
        ranged(Self(scale), fits)
    }

    fn schema() -> Value {
        json!({ "anyOf": [{ "type": "number" }, array_schema(3, json!({ "type": "number" }))] })
    }
}

/// An affine transform.
#[derive(Clone, Copy, Debug)]
pub struct Matrix(pub DMat4);

impl Leaf for Matrix {
    const EXPECTED: &'static str = "three rows of four numbers that leave a volume its volume, \
        such as [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 2]]";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let [x, y, z]: [[f64; 4]; 3] = array(value, |row| array(row, number))?;
        let rows = [x, y, z].map(DVec4::from_array);
        let matrix = DMat4::from_cols(rows[0], rows[1], rows[2], DVec4::W).transpose();
        let sizes = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(DVec4::length);
        // Relative to its columns, so that a small model is not taken for a flat one.
        let volume = matrix.determinant().abs() / sizes.iter().product::<f64>();
        let fits = sizes
            .iter()
            .all(|size| (Scale::LEAST..=Scale::MOST).contains(size))
            && volume > 1e-9
            && matrix.w_axis.abs().max_element() < REACH;
        ranged(Self(matrix), fits)
    }

    fn schema() -> Value {
        array_schema(3, array_schema(4, json!({ "type": "number" })))
    }
}

/// Which axis of a model points upwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    Y,
    Z,
}

impl Leaf for Up {
    const EXPECTED: &'static str = "\"y\" or \"z\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        match value.as_str()? {
            "y" => Some(Ok(Self::Y)),
            "z" => Some(Ok(Self::Z)),
            _ => None,
        }
    }

    fn schema() -> Value {
        json!({ "enum": ["y", "z"] })
    }
}

impl Leaf for Shown {
    const EXPECTED: &'static str = "\"seen\", \"matte\", \"caster-only\" or \"shadow-only\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        match value.as_str()? {
            "seen" => Some(Ok(Self::Seen)),
            "matte" => Some(Ok(Self::Matte)),
            "caster-only" => Some(Ok(Self::CasterOnly)),
            "shadow-only" => Some(Ok(Self::ShadowOnly)),
            _ => None,
        }
    }

    fn schema() -> Value {
        json!({ "enum": ["seen", "matte", "caster-only", "shadow-only"] })
    }
}

/// A level of detail of a city model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lod {
    pub level: u8,
    pub refinement: Option<u8>,
}

impl Leaf for Lod {
    const EXPECTED: &'static str = "a level of detail as a text, such as \"2\" or \"2.2\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let digit = |byte: u8| byte.is_ascii_digit().then(|| byte - b'0');
        let (level, refinement) = match *value.as_str()?.as_bytes() {
            [level] => (digit(level)?, None),
            [level, b'.', refinement] => (digit(level)?, Some(digit(refinement)?)),
            _ => return None,
        };
        Some(Ok(Self { level, refinement }))
    }

    fn schema() -> Value {
        json!({ "type": "string", "pattern": r"^[0-9](\.[0-9])?$" })
    }
}

/// Which of coplanar faces are seen.
#[derive(Clone, Copy, Debug)]
pub struct Priority(pub i32);

impl Leaf for Priority {
    const EXPECTED: &'static str = "a whole number of at most nine digits";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let number = whole(value, -999_999_999.0..=999_999_999.0)?;
        Some(Ok(Self(number as i32)))
    }

    fn schema() -> Value {
        json!({ "type": "integer", "minimum": -999_999_999, "maximum": 999_999_999 })
    }
}

/// Yes or no.
#[derive(Clone, Copy, Debug)]
pub struct Flag(pub bool);

impl Leaf for Flag {
    const EXPECTED: &'static str = "true or false";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        Some(Ok(Self(value.as_bool()?)))
    }

    fn schema() -> Value {
        json!({ "type": "boolean" })
    }
}

/// How much of what is behind a surface it hides.
#[derive(Clone, Copy, Debug)]
pub struct Opacity(pub f32);

impl Leaf for Opacity {
    const EXPECTED: &'static str = "a number from 0 (not there) to 1 (opaque)";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let opacity = number(value).filter(|opacity| (0.0..=1.0).contains(opacity))?;
        Some(Ok(Self(opacity as f32)))
    }

    fn schema() -> Value {
        json!({ "type": "number", "minimum": 0, "maximum": 1 })
    }
}

/// A colour of a surface, linear Rec.709.
#[derive(Clone, Copy, Debug)]
pub struct Color(pub [f32; 3]);

const HEX_PATTERN: &str = "^#([0-9a-fA-F]{3}|[0-9a-fA-F]{6})$";

/// `#rgb` or `#rrggbb`, which are sRGB, or three linear numbers of at most `most`.
fn color(value: &DeValue<'_>, most: f64) -> Option<[f32; 3]> {
    if let Some(text) = value.as_str() {
        let digits: Option<Vec<u32>> = text
            .strip_prefix('#')?
            .chars()
            .map(|digit| digit.to_digit(16))
            .collect();
        let bytes = match *digits?.as_slice() {
            [r, g, b] => [r, g, b].map(|digit| 17 * digit),
            [r, r2, g, g2, b, b2] => [16 * r + r2, 16 * g + g2, 16 * b + b2],
            _ => return None,
        };
        return Some(bytes.map(|byte| linear_from_srgb(byte as f32 / 255.0)));
    }
    let part = |value: &DeValue<'_>| number(value).filter(|part| (0.0..=most).contains(part));
    array(value, part).map(|parts: [f64; 3]| parts.map(|part| part as f32))
}

fn color_schema(most: f64) -> Value {
    let part = json!({ "type": "number", "minimum": 0, "maximum": most });
    json!({ "anyOf": [{ "type": "string", "pattern": HEX_PATTERN }, array_schema(3, part)] })
}

impl Leaf for Color {
    const EXPECTED: &'static str =
        "a colour such as \"#b5523b\" (sRGB) or [0.46, 0.08, 0.04] (linear)";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        Some(Ok(Self(color(value, 1.0)?)))
    }

    fn schema() -> Value {
        color_schema(1.0)
    }
}

/// Radiance of a surface that gives off light, linear Rec.709.
#[derive(Clone, Copy, Debug)]
pub struct Emission(pub [f32; 3]);

impl Emission {
    const MOST: f64 = 1e9;
}

impl Leaf for Emission {
    const EXPECTED: &'static str =
        "a colour such as \"#ffd9a0\" (sRGB) or [4, 3.2, 2] (linear, may exceed 1)";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        Some(Ok(Self(color(value, Self::MOST)?)))
    }

    fn schema() -> Value {
        color_schema(Self::MOST)
    }
}

/// How often a picture repeats in a unit of texture coordinates, along u and v.
#[derive(Clone, Copy, Debug)]
pub struct Repeat(pub Vec2);

impl Leaf for Repeat {
    const EXPECTED: &'static str = "two numbers from -1e6 to 1e6, such as [0.3, 0.3]";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let part = |value: &DeValue<'_>| number(value).filter(|part| part.abs() <= 1e6);
        let [u, v] = array(value, part)?;
        Some(Ok(Self(DVec2::new(u, v).as_vec2())))
    }

    fn schema() -> Value {
        array_schema(
            2,
            json!({ "type": "number", "minimum": -1e6, "maximum": 1e6 }),
        )
    }
}

/// A text that is not empty.
#[derive(Clone, Debug)]
pub struct Text(pub String);

impl Leaf for Text {
    const EXPECTED: &'static str = "a text that is not empty";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let text = value.as_str().filter(|text| !text.is_empty())?;
        Some(Ok(Self(text.to_owned())))
    }

    fn schema() -> Value {
        json!({ "type": "string", "minLength": 1 })
    }
}

/// A path, relative to the scene file.
#[derive(Clone, Debug)]
pub struct FilePath(pub String);

impl Leaf for FilePath {
    const EXPECTED: &'static str = "a path to a file, relative to this one";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let text = value.as_str().filter(|text| !text.is_empty())?;
        Some(Ok(Self(text.to_owned())))
    }

    fn schema() -> Value {
        json!({ "type": "string", "minLength": 1 })
    }
}

/// A name that may be a part of a path of names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name(pub String);

impl Name {
    /// Whether `text` may be a name.
    pub fn is_sound(text: &str) -> bool {
        !text.is_empty() && text.chars().all(|c| c != '/' && !c.is_control())
    }
}

impl Leaf for Name {
    const EXPECTED: &'static str = "a name without slash, such as \"city\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let text = value.as_str().filter(|text| Self::is_sound(text))?;
        Some(Ok(Self(text.to_owned())))
    }

    fn schema() -> Value {
        json!({ "type": "string", "pattern": r"^[^/\u0000-\u001f\u007f-\u009f]+$" })
    }
}

/// A name of a camera. `auto` is what the command calls a camera that shows everything.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraName(pub String);

impl Leaf for CameraName {
    const EXPECTED: &'static str = "a name without slash other than \"auto\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let text = value.as_str().filter(|text| Name::is_sound(text))?;
        (text != "auto").then(|| Ok(Self(text.to_owned())))
    }

    fn schema() -> Value {
        let mut schema = <Name as Leaf>::schema();
        schema["not"] = json!({ "const": "auto" });
        schema
    }
}

/// A lens, by the name that `veduta dome` gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensName(pub Lens);

impl Leaf for LensName {
    const EXPECTED: &'static str =
        "a lens such as \"perspective:60\", \"fisheye:180\" or \"equirect\"";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        Some(value.as_str()?.parse().map(Self).map_err(|_| OutOfRange))
    }

    fn schema() -> Value {
        json!({ "type": "string", "minLength": 1 })
    }
}

/// The centre and the radius of a circle, in pixels.
#[derive(Clone, Copy, Debug)]
pub struct Circle(pub [f64; 3]);

impl Leaf for Circle {
    const EXPECTED: &'static str = "x and y of a centre and a radius in pixels, the radius at least 0.5, such as [960, 540, 520]";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let circle: [f64; 3] = array(value, number)?;
        let is_in_range = circle[2] >= 0.5 && circle.iter().all(|number| number.abs() <= 1e6);
        ranged(Self(circle), is_in_range)
    }

    fn schema() -> Value {
        array_schema(3, json!({ "type": "number" }))
    }
}

/// Quarters of a turn, told in degrees.
#[derive(Clone, Copy, Debug)]
pub struct Quarters(pub u8);

impl Leaf for Quarters {
    const EXPECTED: &'static str = "0, 90, 180 or 270 degrees";

    fn parse(value: &DeValue<'_>) -> Option<Result<Self, OutOfRange>> {
        let degrees = whole(value, 0.0..=270.0)?;
        (degrees % 90.0 == 0.0).then_some(Ok(Self((degrees / 90.0) as u8)))
    }

    fn schema() -> Value {
        json!({ "enum": [0, 90, 180, 270] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed<T: Leaf>(text: &str) -> Option<Result<T, OutOfRange>> {
        T::parse(DeValue::parse(text).expect("sound TOML").get_ref())
    }

    #[test]
    fn quantities_are_numbers_with_a_unit() {
        for (text, metres) in [
            ("\"35 mm\"", 0.035),
            ("\"35mm\"", 0.035),
            ("\"2.5 m\"", 2.5),
            ("\"1e-1km\"", 100.0),
            ("\"+24  cm\"", 0.24),
        ] {
            let Some(Ok(LensLength(length))) = parsed(text) else {
                panic!("{text} is a length");
            };
            assert!((length - metres).abs() < 1e-12, "{text}: {length}");
        }
        for text in [
            "35",
            "\"35\"",
            "\"mm\"",
            "\".5 m\"",
            "\"5. m\"",
            "\"1 parsec\"",
            "\"1e m\"",
            "\"--1 m\"",
            "\"1 m \"",
            "\"0x10 m\"",
            "\"inf m\"",
            "\"nan m\"",
            "[1]",
        ] {
            assert!(parsed::<LensLength>(text).is_none(), "{text}");
        }
        for text in ["\"-1 m\"", "\"0 m\"", "\"1e999 m\""] {
            assert!(
                parsed::<LensLength>(text).is_some_and(|l| l.is_err()),
                "{text}"
            );
        }
    }

    #[test]
    fn plain_numbers_are_degrees_and_metres() {
        for text in [
            "90",
            "90.0",
            "\"90deg\"",
            "\"90 °\"",
            "\"1.5707963267948966rad\"",
        ] {
            let Some(Ok(Angle(angle))) = parsed(text) else {
                panic!("{text} is an angle");
            };
            assert!((angle - 0.5 * PI).abs() < 1e-15, "{text}");
        }
        assert!(matches!(parsed("2"), Some(Ok(Length(2.0)))));
        assert!(parsed::<FieldOfView>("180").is_some_and(|fov| fov.is_err()));
    }

    #[test]
    fn hex_colours_are_srgb_and_arrays_linear() {
        let Some(Ok(Color([r, g, b]))) = parsed("\"#ff8000\"") else {
            panic!("a colour");
        };
        assert_eq!((r, b), (1.0, 0.0));
        assert!((g - 0.2159).abs() < 1e-4);
        assert!(matches!(
            parsed("[1, 0.5, 0]"),
            Some(Ok(Color([1.0, 0.5, 0.0])))
        ));
        for text in [
            "\"#ff80\"",
            "\"red\"",
            "[1, 2, 0]",
            "[1, 1]",
            "\"#\"",
            "[-0.1, 0, 0]",
        ] {
            assert!(parsed::<Color>(text).is_none(), "{text}");
        }
    }

    #[test]
    fn a_matrix_that_flattens_is_refused() {
        let flat = "[[1, 0, 0, 0], [0, 1, 0, 0], [1, 1, 0, 0]]";
        assert!(parsed::<Matrix>(flat).is_some_and(|matrix| matrix.is_err()));
        let small = "[[1e-6, 0, 0, 7], [0, 1e-6, 0, 8], [0, 0, 1e-6, 9]]";
        let Some(Ok(Matrix(matrix))) = parsed(small) else {
            panic!("a sound matrix");
        };
        assert_eq!(
            matrix.transform_point3(DVec3::ZERO),
            DVec3::new(7.0, 8.0, 9.0)
        );
    }
}
