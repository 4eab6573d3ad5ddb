//! The lines of an OBJ file -> flat tables.
//!
//! A line at a time, without copies: a file of a million faces is read in a fraction of a second.

use crate::read::budget::Budget;
use crate::read::error::{Fault, Place, Problem, Warnings};
use crate::read::files::shortened;
use crate::read::polygon::{Cut, Polygon, PolygonCutter, usual_rounding};
use crate::read::text::{Tokens, next_line, number, text, wrong_token};
use std::borrow::Cow;
use std::collections::HashMap;
use veduta_geometry::{DVec3, Vec2, Vec3};

/// What a file says, faces cut into convex ones.
#[derive(Debug, Default)]
pub struct Parsed {
    pub positions: Vec<DVec3>,
    /// Empty, or one for each position.
    pub colors: Vec<[f32; 3]>,
    pub texcoords: Vec<Vec2>,
    pub normals: Vec<Vec3>,
    pub faces: Faces,
    /// Consecutive faces of one group, material and smoothing group.
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

/// Faces from `first` up to the next run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    pub first: usize,
    pub group: usize,
    pub material: usize,
    /// 0 for none.
    pub smoothing: u32,
}

/// Convex faces of three corners or more.
#[derive(Debug, Default)]
pub struct Faces {
    corners: Vec<Corner>,
    /// Where the corners of each face end; empty as long as all faces are triangles.
    ends: Vec<usize>,
}

impl Faces {
    pub fn len(&self) -> usize {
        if self.ends.is_empty() {
            self.corners.len() / 3
        } else {
            self.ends.len()
        }
    }

    /// The corners of a face.
    #[inline]
    pub fn corners(&self, face: usize) -> &[Corner] {
        &self.corners[self.range(face)]
    }

    /// The corners of a face, to be changed.
    #[inline]
    pub fn corners_mut(&mut self, face: usize) -> &mut [Corner] {
        let range = self.range(face);
        &mut self.corners[range]
    }

    #[inline]
    fn range(&self, face: usize) -> std::ops::Range<usize> {
        if self.ends.is_empty() {
            return 3 * face..3 * face + 3;
        }
        let start = face.checked_sub(1).map_or(0, |before| self.ends[before]);
        start..self.ends[face]
    }

    fn push(&mut self, corners: impl ExactSizeIterator<Item = Corner>) {
        if corners.len() != 3 && self.ends.is_empty() {
            self.ends = (1..=self.len()).map(|face| 3 * face).collect();
        }
        let is_uneven = corners.len() != 3 || !self.ends.is_empty();
        self.corners.extend(corners);
        if is_uneven {
            self.ends.push(self.corners.len());
        }
    }
}

/// The most corners of a face: none is known to have so many, and cutting it up costs their square.
const MOST_CORNERS: usize = 65_536;

/// Reads all lines.
///
/// Tables are at most proportional to the bytes, save the groups' names, which repeat that of the
/// object and are charged to the budget.
pub fn parse(bytes: &[u8], budget: &mut Budget, warnings: &mut Warnings) -> Result<Parsed, Fault> {
    let mut parser = Parser::new(budget);
    // Some editors leave a byte order mark.
    let mut rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
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
    smoothing: u32,
    cutter: PolygonCutter,
    corners: Vec<Corner>,
    points: Vec<DVec3>,
    point_texcoords: Vec<Vec2>,
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
            smoothing: 0,
            cutter: PolygonCutter::new(),
            corners: Vec::new(),
            points: Vec::new(),
            point_texcoords: Vec::new(),
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
    no_area: Count,
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
            b"s" => {
                // `off` or a number; some write `on`.
                self.smoothing = match tokens.next_value() {
                    None | Some(b"off") => 0,
                    Some(token) => std::str::from_utf8(token)
                        .ok()
                        .and_then(|text| text.parse().ok())
                        .unwrap_or(1),
                }
            }
            b"mtllib" => self.parsed.libraries.push((number, text(tokens))),
            b"l" | b"p" => self.skipped.points_and_lines.add(number),
            b"vp" | b"cstype" | b"deg" | b"bmat" | b"step" | b"curv" | b"curv2" | b"surf"
            | b"parm" | b"trim" | b"hole" | b"scrv" | b"sp" | b"end" | b"con" | b"bzp" | b"bsp"
            | b"cdc" | b"cdp" | b"res" => self.skipped.curves.add(number),
            // How to shade and display: not used here.
            b"mg" | b"bevel" | b"c_interp" | b"d_interp" | b"lod" | b"shadow_obj"
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
        if found == 3 {
            self.parsed.faces.push(self.corners.iter().copied());
            return Ok(());
        }
        let (parsed, corners) = (&mut self.parsed, &self.corners);
        self.points.clear();
        let position = |corner: &Corner| parsed.positions[corner.position as usize];
        self.points.extend(corners.iter().map(position));
        self.point_texcoords.clear();
        if corners.iter().any(|corner| corner.texcoord != NONE) {
            let texcoord = |corner: &Corner| parsed.texcoords.get(corner.texcoord as usize);
            let texcoords = corners.iter().map(|corner| texcoord(corner).copied());
            self.point_texcoords
                .extend(texcoords.map(Option::unwrap_or_default));
        }
        let polygon = Polygon {
            points: &self.points,
            ring_ends: &[found],
            texcoords: &self.point_texcoords,
            rounding: usual_rounding(&self.points),
        };
        let faces = &mut parsed.faces;
        let emit = |face: &[usize]| faces.push(face.iter().map(|&corner| corners[corner]));
        match self.cutter.cut(&polygon, emit) {
            Cut::Sound => {}
            Cut::NoArea => self.skipped.no_area.add(number),
            Cut::Crossing => self.skipped.crossing.add(number),
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
        if position == NONE {
            return Err(wrong_token(token, EXPECTED));
        }
        let texcoord = reference("texture coordinate", parsed.texcoords.len())?;
        let normal = reference("normal", parsed.normals.len())?;
        if rest.is_some() {
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
            first: self.parsed.faces.len(),
            group,
            material: self.material,
            smoothing: self.smoothing,
        };
        let last = self.parsed.runs.last();
        let of = |run: &Run| (run.group, run.material, run.smoothing);
        if last.is_none_or(|last| of(last) != of(&run)) {
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
        warn(skipped.no_area, "a polygon has no area; it is left out");
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

/// The rest of a line as a name; a slash within it would look like two names.
fn name(tokens: Tokens<'_>) -> String {
    text(tokens).replace('/', "_")
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert!(!cut("7/2/3/4").1);
        for text in ["x", "-", "7/x", "7/-", "1.5", "99999999999999999999/a"] {
            assert!(cut(text).0.contains(&None), "{text}");
        }
    }
}
