//! The lines of an OBJ file -> flat tables.
//!
//! A line at a time, without copies: a file of a million faces is read in a fraction of a second.

use super::polygon::Triangulator;
use crate::read::budget::Budget;
use crate::read::error::{Fault, Place, Problem, Warnings};
use crate::read::files::shortened;
use memchr::memchr;
use std::borrow::Cow;
use std::collections::HashMap;
use veduta_geometry::{DVec3, Vec2, Vec3};

/// What a file says, faces cut into triangles.
#[derive(Debug, Default)]
pub struct Parsed {
    pub positions: Vec<DVec3>,
    /// Empty, or one for each position.
    pub colors: Vec<[f32; 3]>,
    pub texcoords: Vec<Vec2>,
    pub normals: Vec<Vec3>,
    pub triangles: Vec<[Corner; 3]>,
    /// Consecutive triangles of one group and material.
    pub runs: Vec<Run>,
    /// Names of the groups; no two are equal.
    pub groups: Vec<String>,
    /// Names of the materials in use; the first is empty and stands for none.
    pub materials: Vec<String>,
    /// Material libraries, with the lines that name them.
    pub libraries: Vec<(u64, String)>,
}

/// A corner of a face: indices of what it is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Corner {
    pub position: u32,
    /// [`NONE`] without.
    pub texcoord: u32,
    /// [`NONE`] without.
    pub normal: u32,
}

/// The index of nothing.
pub const NONE: u32 = u32::MAX;

/// Triangles from `first` up to the next run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    pub first: usize,
    pub group: usize,
    pub material: usize,
}

/// The most corners of a face: none is known to have so many, and cutting it up costs their square.
const MOST_CORNERS: usize = 65_536;

/// Reads all lines.
///
/// Tables are at most proportional to the bytes, save the groups' names, which repeat that of the
/// object and are charged to the budget.
pub fn parse(bytes: &[u8], budget: &mut Budget, warnings: &mut Warnings) -> Result<Parsed, Fault> {
    let mut parser = Parser::new(budget);
    let mut rest = bytes;
    let mut number = 0;
    while !rest.is_empty() {
        number += 1;
        let first_number = number;
        let mut line = Cow::Borrowed(next_line(&mut rest));
        // A backslash at its end joins a line with the next.
        while line.ends_with(b"\\") && !rest.is_empty() {
            number += 1;
            let joined = line.to_mut();
            joined.pop();
            joined.extend_from_slice(next_line(&mut rest));
        }
        parser
            .line(&line, first_number)
            .map_err(|problem| problem.at(Place::Line(first_number)))?;
    }
    parser.report(warnings);
    Ok(parser.parsed)
}

/// Cuts the next line off `rest`, without its end.
fn next_line<'a>(rest: &mut &'a [u8]) -> &'a [u8] {
    let end = memchr(b'\n', rest).unwrap_or(rest.len());
    let line = &rest[..end];
    *rest = rest.get(end + 1..).unwrap_or_default();
    line.strip_suffix(b"\r").unwrap_or(line)
}

#[derive(Debug)]
struct Parser<'a> {
    budget: &'a mut Budget,
    parsed: Parsed,
    group_of_name: HashMap<String, usize>,
    material_of_name: HashMap<String, usize>,
    object: String,
    group: String,
    /// Set when `object` or `group` have changed since the last face.
    group_index: Option<usize>,
    material: usize,
    triangulator: Triangulator,
    corners: Vec<Corner>,
    points: Vec<DVec3>,
    skipped: Skipped,
}

impl<'a> Parser<'a> {
    fn new(budget: &'a mut Budget) -> Self {
        Self {
            budget,
            parsed: Parsed {
                materials: vec![String::new()],
                ..Parsed::default()
            },
            group_of_name: HashMap::new(),
            material_of_name: HashMap::from([(String::new(), 0)]),
            object: String::new(),
            group: String::new(),
            group_index: None,
            material: 0,
            triangulator: Triangulator::new(),
            corners: Vec::new(),
            points: Vec::new(),
            skipped: Skipped::default(),
        }
    }
}

/// What was passed over, for warnings: how often and where first.
#[derive(Debug, Default)]
struct Skipped {
    points_and_lines: Count,
    curves: Count,
    unknown: Count,
    first_unknown: String,
    too_few_corners: Count,
    crossing: Count,
}

#[derive(Clone, Copy, Debug, Default)]
struct Count {
    count: u64,
    first_line: u64,
}

impl Count {
    fn add(&mut self, line: u64) {
        if self.count == 0 {
            self.first_line = line;
        }
        self.count += 1;
    }
}

impl Parser<'_> {
    fn line(&mut self, line: &[u8], number: u64) -> Result<(), Problem> {
        let mut tokens = Tokens(line);
        let Some(keyword) = tokens.next() else {
            return Ok(());
        };
        match keyword {
            b"v" => self.vertex(tokens)?,
            b"vt" => {
                let u = tokens.number("a number")?;
                // Curves have one coordinate, and solids a third.
                let v = tokens.number_or(0.0)?;
                self.parsed.texcoords.push(Vec2::new(u as f32, v as f32));
            }
            b"vn" => {
                let [x, y, z] = tokens.three_numbers()?;
                self.parsed
                    .normals
                    .push(Vec3::new(x as f32, y as f32, z as f32));
            }
            b"f" | b"fo" => self.face(tokens, number)?,
            b"o" => {
                self.object = name(tokens);
                self.group.clear();
                self.group_index = None;
            }
            b"g" => {
                self.group = name(tokens);
                self.group_index = None;
            }
            b"usemtl" => {
                let name = name(tokens);
                let count = self.parsed.materials.len();
                self.material = *self
                    .material_of_name
                    .entry(name)
                    .or_insert_with_key(|name| {
                        self.parsed.materials.push(name.clone());
                        count
                    });
            }
            b"mtllib" => self.parsed.libraries.push((number, text(tokens))),
            b"l" | b"p" => self.skipped.points_and_lines.add(number),
            b"vp" | b"cstype" | b"deg" | b"bmat" | b"step" | b"curv" | b"curv2" | b"surf"
            | b"parm" | b"trim" | b"hole" | b"scrv" | b"sp" | b"end" | b"con" | b"bzp" | b"bsp"
            | b"cdc" | b"cdp" | b"res" => self.skipped.curves.add(number),
            // How to shade and display: not used here.
            b"s" | b"mg" | b"bevel" | b"c_interp" | b"d_interp" | b"lod" | b"shadow_obj"
            | b"trace_obj" | b"ctech" | b"stech" | b"usemap" | b"maplib" => {}
            _ if keyword.starts_with(b"#") => {}
            _ => {
                if self.skipped.unknown.count == 0 {
                    self.skipped.first_unknown = shortened(&String::from_utf8_lossy(keyword));
                }
                self.skipped.unknown.add(number);
            }
        }
        Ok(())
    }

    /// `v x y z`, which a weight, a colour or both may follow.
    fn vertex(&mut self, mut tokens: Tokens<'_>) -> Result<(), Problem> {
        let position = tokens.three_numbers()?;
        let mut more = [0.0; 4];
        let mut count = 0;
        while count < more.len() {
            let Some(token) = tokens.next_value() else {
                break;
            };
            more[count] = number(token, "a number")?;
            count += 1;
        }
        let color = match count {
            3 => Some([more[0], more[1], more[2]]),
            4 => Some([more[1], more[2], more[3]]),
            _ => None,
        };
        let colors = &mut self.parsed.colors;
        if let Some(color) = color {
            colors.resize(self.parsed.positions.len(), [1.0; 3]);
            colors.push(color.map(|c| c as f32));
        } else if !colors.is_empty() {
            colors.push([1.0; 3]);
        }
        self.parsed.positions.push(DVec3::from_array(position));
        Ok(())
    }

    /// `f v v v …`, where v is `position`, `position/texcoord`, `position//normal` or all three.
    fn face(&mut self, mut tokens: Tokens<'_>, number: u64) -> Result<(), Problem> {
        self.corners.clear();
        while let Some(token) = tokens.next_value() {
            self.corners.push(self.corner(token)?);
        }
        let found = self.corners.len();
        if found > MOST_CORNERS {
            let most = MOST_CORNERS;
            return Err(Problem::Corners { found, most });
        }
        if found < 3 {
            self.skipped.too_few_corners.add(number);
            return Ok(());
        }
        self.start_run()?;
        let corners = &self.corners;
        let triangles = &mut self.parsed.triangles;
        if let [a, b, c] = corners[..] {
            triangles.push([a, b, c]);
            return Ok(());
        }
        self.points.clear();
        let positions = &self.parsed.positions;
        self.points.extend(
            corners
                .iter()
                .map(|corner| positions[corner.position as usize]),
        );
        let emit = |triangle: [usize; 3]| triangles.push(triangle.map(|corner| corners[corner]));
        if !self.triangulator.triangulate(&self.points, emit) {
            self.skipped.crossing.add(number);
        }
        Ok(())
    }

    fn corner(&self, token: &[u8]) -> Result<Corner, Problem> {
        const EXPECTED: &str = "a corner such as 1, 1/2, 1//3 or 1/2/3";
        let parsed = &self.parsed;
        let mut rest = Some(token);
        let mut reference = |what, count| match cut_reference(&mut rest) {
            Some(None) => Ok(NONE),
            Some(Some(reference)) => resolve(reference, what, count),
            None => Err(wrong_token(token, EXPECTED)),
        };
        let position = reference("vertex", parsed.positions.len())?;
        let texcoord = reference("texture coordinate", parsed.texcoords.len())?;
        let normal = reference("normal", parsed.normals.len())?;
        if position == NONE || rest.is_some() {
            return Err(wrong_token(token, EXPECTED));
        }
        Ok(Corner {
            position,
            texcoord,
            normal,
        })
    }

    /// Begins a run if group or material differ from those of the last face.
    fn start_run(&mut self) -> Result<(), Problem> {
        let group = match self.group_index {
            Some(group) => group,
            None => {
                let names = [self.object.as_str(), self.group.as_str()];
                let names: Vec<_> = names.into_iter().filter(|name| !name.is_empty()).collect();
                let length: usize = names.iter().map(|name| name.len() + 1).sum();
                // Twice: in the list, and as key.
                self.budget.charge(length as u64, 2)?;
                let count = self.parsed.groups.len();
                let groups = &mut self.parsed.groups;
                let entry = self.group_of_name.entry(names.join("/"));
                let group = *entry.or_insert_with_key(|name| {
                    groups.push(name.clone());
                    count
                });
                *self.group_index.insert(group)
            }
        };
        let run = Run {
            first: self.parsed.triangles.len(),
            group,
            material: self.material,
        };
        let last = self.parsed.runs.last();
        if last.is_none_or(|last| (last.group, last.material) != (run.group, run.material)) {
            self.parsed.runs.push(run);
        }
        Ok(())
    }

    fn report(&self, warnings: &mut Warnings) {
        let mut warn = |count: Count, message: &str| {
            if count.count > 0 {
                let place = Place::Line(count.first_line);
                warnings.add(
                    place,
                    format!("{message} (lines of this kind: {})", count.count),
                );
            }
        };
        let skipped = &self.skipped;
        warn(
            skipped.points_and_lines,
            "points and lines have no faces; they are left out",
        );
        warn(
            skipped.curves,
            "curves and curved surfaces are not supported; they are left out",
        );
        warn(
            skipped.too_few_corners,
            "a face has fewer than 3 corners; it is left out",
        );
        warn(
            skipped.crossing,
            "a face crosses itself; its triangles may overlap",
        );
        let message = format!(
            "unknown word {:?}; the line is left out",
            skipped.first_unknown
        );
        warn(skipped.unknown, &message);
    }
}

/// Cuts the next reference of a corner off `rest`, up to a slash or the end; `rest` is nothing when
/// its end has been reached.
///
/// `Some(None)` where it is left out, `None` where it is no number.
#[inline]
fn cut_reference(rest: &mut Option<&[u8]>) -> Option<Option<i64>> {
    let Some(text) = *rest else {
        return Some(None);
    };
    let negative = text.starts_with(b"-");
    let mut value = 0i64;
    let mut end = usize::from(negative);
    let start = end;
    while let Some(digit) = text.get(end).filter(|byte| byte.is_ascii_digit()) {
        value = value
            .saturating_mul(10)
            .saturating_add(i64::from(digit - b'0'));
        end += 1;
    }
    *rest = match text.get(end) {
        None => None,
        Some(b'/') => Some(&text[end + 1..]),
        Some(_) => return None,
    };
    match (end > start, negative) {
        (true, true) => Some(Some(-value)),
        (true, false) => Some(Some(value)),
        (false, true) => None,
        (false, false) => Some(None),
    }
}

/// A reference counted from 1, or from the end if negative -> an index.
#[inline]
fn resolve(reference: i64, what: &'static str, count: usize) -> Result<u32, Problem> {
    let index = if reference < 0 {
        count as i64 + reference
    } else {
        reference - 1
    };
    // Absent attributes are `NONE`, so the last index is not available; memory ends before.
    if (0..count.min(NONE as usize) as i64).contains(&index) {
        Ok(index as u32)
    } else {
        let index = reference;
        Err(Problem::NoSuchBefore { what, index, count })
    }
}

/// The words of a line.
pub struct Tokens<'a>(pub &'a [u8]);

impl<'a> Iterator for Tokens<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let is_space = |byte: &u8| matches!(byte, b' ' | b'\t' | b'\r' | 0x0b | 0x0c);
        let start = self.0.iter().position(|byte| !is_space(byte))?;
        let rest = &self.0[start..];
        let end = rest.iter().position(is_space).unwrap_or(rest.len());
        self.0 = &rest[end..];
        Some(&rest[..end])
    }
}

impl<'a> Tokens<'a> {
    /// The next word, unless a comment starts there.
    pub fn next_value(&mut self) -> Option<&'a [u8]> {
        self.next().filter(|token| !token.starts_with(b"#"))
    }

    pub fn number(&mut self, expected: &'static str) -> Result<f64, Problem> {
        number(self.next_value().unwrap_or_default(), expected)
    }

    /// The next number, or `absent` at the end of the line.
    pub fn number_or(&mut self, absent: f64) -> Result<f64, Problem> {
        match self.next_value() {
            None => Ok(absent),
            Some(token) => number(token, "a number"),
        }
    }

    pub fn three_numbers(&mut self) -> Result<[f64; 3], Problem> {
        Ok([
            self.number("three numbers")?,
            self.number("three numbers")?,
            self.number("three numbers")?,
        ])
    }
}

/// A finite number.
#[inline]
fn number(token: &[u8], expected: &'static str) -> Result<f64, Problem> {
    if let Some(number) = plain_decimal(token) {
        return Ok(number);
    }
    std::str::from_utf8(token)
        .ok()
        .and_then(|text| text.parse().ok())
        .filter(|number: &f64| number.is_finite())
        .ok_or_else(|| wrong_token(token, expected))
}

/// The value of digits with at most a sign and a point, if it is found exactly without effort.
///
/// Up to 15 digits and the power of ten below them are exact in f64, so their quotient is rounded
/// once, as it should be (Clinger, "How to read floating point numbers accurately", 1990). Most
/// numbers of OBJ files are such, and most time would go into them.
#[inline]
fn plain_decimal(token: &[u8]) -> Option<f64> {
    const POWERS: [f64; 16] = [
        1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
    ];
    let (negative, digits) = match token.strip_prefix(b"-") {
        Some(digits) => (true, digits),
        None => (false, token),
    };
    // One of the 16 bytes may be the point.
    if digits.len() > 16 {
        return None;
    }
    let mut value = 0u64;
    let mut count = 0;
    let mut point = None;
    for &byte in digits {
        match byte {
            b'0'..=b'9' => {
                value = value * 10 + u64::from(byte - b'0');
                count += 1;
            }
            b'.' if point.is_none() => point = Some(count),
            _ => return None,
        }
    }
    if count == 0 || count > 15 {
        return None;
    }
    let magnitude = value as f64 / POWERS[count - point.unwrap_or(count)];
    Some(if negative { -magnitude } else { magnitude })
}

fn wrong_token(token: &[u8], expected: &'static str) -> Problem {
    let found = match token {
        b"" => "end of line".into(),
        _ => shortened(&String::from_utf8_lossy(token)),
    };
    Problem::Token { found, expected }
}

/// The rest of a line, which may hold spaces.
pub fn text(tokens: Tokens<'_>) -> String {
    String::from_utf8_lossy(tokens.0.trim_ascii()).into_owned()
}

/// The rest of a line as a name; a slash within it would look like two names.
fn name(tokens: Tokens<'_>) -> String {
    text(tokens).replace('/', "_")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quick_way_to_a_number_equals_the_general_one() {
        let mut state = 3u64;
        for _ in 0..200_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let digits = (state >> 33) as usize % 15 + 1;
            let point = (state >> 40) as usize % (digits + 1);
            let mut text = format!("{:015}", (state >> 12) % 10u64.pow(15))[..digits].to_owned();
            text.insert(point, '.');
            if state & 2048 != 0 {
                text.insert(0, '-');
            }
            let quick = plain_decimal(text.as_bytes()).expect(&text);
            let general: f64 = text.parse().expect(&text);
            assert_eq!(quick.to_bits(), general.to_bits(), "{text}");
        }
    }

    #[test]
    fn numbers_are_read_in_all_their_spellings_and_nothing_else_is() {
        for (text, value) in [
            ("1", 1.0),
            ("-.5", -0.5),
            ("2.", 2.0),
            ("+3", 3.0),
            ("-0", -0.0),
            ("1e-3", 1e-3),
            ("6.02E23", 6.02e23),
            ("0.1234567890123456789", 0.123_456_789_012_345_68),
        ] {
            assert_eq!(number(text.as_bytes(), "").expect(text), value, "{text}");
        }
        for text in [
            "", ".", "-", "1,5", "nan", "inf", "-inf", "1e999", "0x10", "1.2.3", "1\u{e9}",
        ] {
            assert!(number(text.as_bytes(), "a number").is_err(), "{text}");
        }
    }

    #[test]
    fn corners_are_read_in_all_their_spellings_and_nothing_else_is() {
        let cut = |text: &str| {
            let mut rest = Some(text.as_bytes());
            let references = [(); 3].map(|()| cut_reference(&mut rest));
            (references, rest.is_none())
        };
        assert_eq!(cut("7"), ([Some(Some(7)), Some(None), Some(None)], true));
        assert_eq!(
            cut("7/-2"),
            ([Some(Some(7)), Some(Some(-2)), Some(None)], true)
        );
        assert_eq!(
            cut("7//3"),
            ([Some(Some(7)), Some(None), Some(Some(3))], true)
        );
        assert_eq!(
            cut("7/2/3"),
            ([Some(Some(7)), Some(Some(2)), Some(Some(3))], true)
        );
        assert_eq!(cut("7/2/3/4").1, false);
        for text in ["x", "-", "7/x", "7/-", "1.5", "99999999999999999999/a"] {
            assert!(cut(text).0.contains(&None), "{text}");
        }
    }
}
