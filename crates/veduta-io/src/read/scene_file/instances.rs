//! Tables of the places at which a model stands.
//!
//! The table is CSV: a header that names the columns, then a line for each place; empty lines and
//! those that begin with `#` are skipped. Columns may stand in any order:
//!
//! | column | what | if it is not there |
//! | --- | --- | --- |
//! | `x`, `y`, `z` | where the model's origin stands, in metres of the scene | an error |
//! | `heading` | turn clockwise seen from above, in degrees: where the model's +y points to, from north | 0 |
//! | `pitch` | how much the model's +y is lifted, in degrees | 0 |
//! | `roll` | how much the model's +x is lowered, in degrees | 0 |
//! | `scale` | a factor, not 0 | 1 |
//! | `name` | a name for the instance, without slash | the number of the row, from 1 |
//!
//! The model is scaled, rolled, pitched, turned and moved, in that order.
//!
//! Split by hand rather than by a library, because errors point at the field.

use super::inclusion::Inclusion;
use super::source::{Faults, Source, Span};
use super::value::Name;
use crate::read::error::{Place, Problem, ReadError, Warnings};
use crate::read::files::shortened;
use crate::read::finish::REACH;
use crate::read::names::{closest, unique};
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;
use veduta::geometry::{DMat4, DQuat, DVec3};

/// A place at which a model stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    pub name: String,
    pub world_from_model: DMat4,
}

/// Reads a table.
pub fn read(
    path: &Path,
    inclusion: &mut Inclusion<'_>,
    warnings: &mut Warnings,
) -> Result<Vec<Instance>, ReadError> {
    let whole = |problem: Problem| problem.at(Place::Whole).of(path);
    let bytes = inclusion.read(path);
    let bytes = bytes.map_err(|error| whole(Problem::Unreadable(error)))?;
    let source = Source::new(path, &bytes)?;
    let mut faults = Faults::default();
    let mut lines = lines(source.text);
    let Some(header) = lines.next() else {
        let message = "is empty; expected a header such as x,y,z,heading, and rows below it";
        return Err(whole(Problem::Senseless(message.into())));
    };
    let header = fields(header, &mut faults).unwrap_or_default();
    let columns = Columns::of(header, &mut faults);
    for (span, name) in &columns.unknown {
        let help = closest(name, COLUMNS.iter().copied());
        let help = help.map_or_else(String::new, |known| format!("; did you mean {known:?}?"));
        let message = format!(
            "the column {:?} is not known and ignored{help}",
            shortened(name)
        );
        warnings.add_in(path.to_owned(), source.place(span.start), message);
    }
    faults.finish(&source)?;

    let mut faults = Faults::default();
    let mut instances = Vec::new();
    let mut names = HashMap::new();
    for (row, line) in lines.enumerate() {
        let charged = inclusion.charge(1, size_of::<Instance>());
        charged.map_err(|problem| source.error(line.0.clone(), problem))?;
        let span = line.0.clone();
        let fields = fields(line, &mut faults);
        let instance =
            fields.and_then(|fields| columns.instance(row + 1, &span, &fields, &mut faults));
        if let Some(instance) = instance {
            let name = unique(instance.name, &mut names);
            instances.push(Instance { name, ..instance });
        }
    }
    faults.finish(&source)?;
    if instances.is_empty() {
        warnings.add_in(
            path.to_owned(),
            Place::Whole,
            "has no rows; nothing stands there",
        );
    }
    Ok(instances)
}

/// All columns; the first three must be there.
const COLUMNS: [&str; 8] = ["x", "y", "z", "heading", "pitch", "roll", "scale", "name"];
const NAME: usize = 7;

/// A field and its place.
type Field<'a> = (Span, Cow<'a, str>);

/// Which column is what.
struct Columns {
    count: usize,
    /// For each of [`COLUMNS`]: which field it is.
    field_of: [Option<usize>; COLUMNS.len()],
    unknown: Vec<(Span, String)>,
}

impl Columns {
    fn of(header: Vec<Field<'_>>, faults: &mut Faults) -> Self {
        let mut columns = Self {
            count: header.len(),
            field_of: [None; COLUMNS.len()],
            unknown: Vec::new(),
        };
        let whole = header.first().map_or(0, |f| f.0.start)..header.last().map_or(0, |f| f.0.end);
        for (at, (span, name)) in header.into_iter().enumerate() {
            let name = name.to_ascii_lowercase();
            match COLUMNS.iter().position(|known| *known == name) {
                None => columns.unknown.push((span, name)),
                Some(known) => {
                    if columns.field_of[known].replace(at).is_some() {
                        faults.senseless(span, format!("a second column is called {name:?}"));
                    }
                }
            }
        }
        let lacks = |known: &usize| columns.field_of[*known].is_none();
        let lacking: Vec<_> = (0..3).filter(lacks).map(|known| COLUMNS[known]).collect();
        if !lacking.is_empty() {
            let message = format!(
                "has no column {}; expected a header such as x,y,z,heading, with commas between",
                lacking.join(", ")
            );
            faults.senseless(whole, message);
        }
        columns
    }

    /// The instance that a line tells of.
    fn instance(
        &self,
        row: usize,
        line: &Span,
        fields: &[Field<'_>],
        faults: &mut Faults,
    ) -> Option<Instance> {
        if fields.len() != self.count {
            let message = format!(
                "row {row} has {} fields, but the header names {}",
                fields.len(),
                self.count
            );
            faults.senseless(line.clone(), message);
            return None;
        }
        let mut numbers = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let mut is_sound = true;
        for (known, number) in numbers.iter_mut().enumerate() {
            let Some(field) = self.field_of[known] else {
                continue;
            };
            let (span, text) = &fields[field];
            let range = match COLUMNS[known] {
                "scale" => 1e-9..1e9,
                _ => 0.0..REACH,
            };
            match text.parse::<f64>() {
                Ok(found) if range.contains(&found.abs()) => *number = found,
                _ => {
                    let expected = match COLUMNS[known] {
                        "scale" => "a factor other than 0, such as 1.2",
                        "x" | "y" | "z" => "a number in metres, such as 12.5",
                        _ => "a number in degrees, such as 90",
                    };
                    let found = shortened(text);
                    let column = COLUMNS[known];
                    let message =
                        format!("row {row}, column {column}: {found:?}, expected {expected}");
                    faults.senseless(span.clone(), message);
                    is_sound = false;
                }
            }
        }
        let name = match self.field_of[NAME].map(|field| &fields[field]) {
            None => row.to_string(),
            Some((_, text)) if Name::is_sound(text) => text.clone().into_owned(),
            Some((span, text)) => {
                let found = shortened(text);
                let message =
                    format!("row {row}, column name: {found:?}, expected a name without slash");
                faults.senseless(span.clone(), message);
                is_sound = false;
                String::new()
            }
        };
        let [x, y, z, heading, pitch, roll, scale] = numbers;
        let turn = DQuat::from_rotation_z(-heading.to_radians())
            * DQuat::from_rotation_x(pitch.to_radians())
            * DQuat::from_rotation_y(roll.to_radians());
        is_sound.then(|| Instance {
            name,
            world_from_model: DMat4::from_scale_rotation_translation(
                DVec3::splat(scale),
                turn,
                DVec3::new(x, y, z),
            ),
        })
    }
}

/// The lines that say something, with their places.
fn lines(text: &str) -> impl Iterator<Item = (Span, &str)> {
    let mut start = 0;
    text.split_inclusive('\n').filter_map(move |line| {
        let at = start;
        start += line.len();
        let line = line.trim_end_matches(['\r', '\n']);
        // What some editors put before the first line.
        let line_start = if at == 0 && line.starts_with('\u{feff}') {
            3
        } else {
            0
        };
        let said = &line[line_start..];
        let is_said = !said.trim().is_empty() && !said.starts_with('#');
        let at = at + line_start;
        is_said.then(|| (at..at + said.len(), said))
    })
}

/// The fields of a line: between commas, without blanks around them. A field in double quotes may
/// hold commas, and a quote as two (RFC 4180).
///
/// `None`, after `faults` was told, where quotes are wrong.
fn fields<'a>((span, line): (Span, &'a str), faults: &mut Faults) -> Option<Vec<Field<'a>>> {
    let mut fields = Vec::new();
    let mut at = 0;
    loop {
        let rest = &line[at..];
        let blanks = rest.len() - rest.trim_start_matches([' ', '\t']).len();
        let is_quoted = rest[blanks..].starts_with('"');
        let length = if is_quoted {
            let inside = at + blanks + 1;
            let Some(length) = quoted_length(&line[inside..]) else {
                let message = "a double quote that opens a field is not closed on its line";
                faults.senseless(span.start + inside - 1..span.end, message);
                return None;
            };
            let end = inside + length;
            let text = &line[inside..end];
            let text = if text.contains('"') {
                Cow::Owned(text.replace("\"\"", "\""))
            } else {
                Cow::Borrowed(text)
            };
            fields.push((span.start + inside..span.start + end, text));
            let after = &line[end + 1..];
            let to_comma = after.find(',').unwrap_or(after.len());
            if !after[..to_comma].trim().is_empty() {
                let message = "something stands between the closing quote and the comma";
                faults.senseless(
                    span.start + end + 1..span.start + end + 1 + to_comma,
                    message,
                );
                return None;
            }
            end + 1 + to_comma - at
        } else {
            let length = rest.find(',').unwrap_or(rest.len());
            let text = rest[..length].trim();
            let start = span.start + at + blanks.min(length);
            fields.push((start..start + text.len(), Cow::Borrowed(text)));
            length
        };
        at += length;
        if at >= line.len() {
            return Some(fields);
        }
        // Past the comma.
        at += 1;
    }
}

/// Length of what is quoted, up to the quote that closes it.
fn quoted_length(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        match (bytes[at], bytes.get(at + 1)) {
            (b'"', Some(b'"')) => at += 2,
            (b'"', _) => return Some(at),
            _ => at += 1,
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(line: &str) -> Vec<String> {
        let mut faults = Faults::default();
        fields((0..line.len(), line), &mut faults)
            .expect("quotes are closed")
            .into_iter()
            .map(|(_, text)| text.into_owned())
            .collect()
    }

    #[test]
    fn fields_stand_between_commas_and_quotes_keep_commas() {
        assert_eq!(texts("1, 2 ,3"), ["1", "2", "3"]);
        assert_eq!(texts("a,,"), ["a", "", ""]);
        assert_eq!(texts("\"a, b\" ,\"say \"\"c\"\"\""), ["a, b", "say \"c\""]);
        assert_eq!(texts(" \"\",x"), ["", "x"]);
    }

    #[test]
    fn the_place_of_a_field_is_that_of_its_text() {
        let line = "ab,  cd ,\"e\"";
        let mut faults = Faults::default();
        for (span, text) in fields((0..line.len(), line), &mut faults).expect("no quotes") {
            assert_eq!(line[span], *text);
        }
    }

    #[test]
    fn headings_turn_clockwise_pitch_lifts_the_nose_and_roll_lowers_the_right() {
        let header = vec![(0..1, "x"), (2..3, "y"), (4..5, "z"), (6..13, "heading")];
        let mut header: Vec<Field<'_>> = header
            .into_iter()
            .map(|(span, text)| (span, Cow::Borrowed(text)))
            .collect();
        for name in ["pitch", "roll"] {
            header.push((0..1, Cow::Borrowed(name)));
        }
        let mut faults = Faults::default();
        let columns = Columns::of(header, &mut faults);
        let mut turned = |text: &str, axis: DVec3| {
            let fields: Vec<_> = text
                .split(',')
                .map(|text| (0..1, Cow::Borrowed(text)))
                .collect();
            let instance = columns.instance(1, &(0..1), &fields, &mut faults);
            instance
                .expect("is sound")
                .world_from_model
                .transform_vector3(axis)
        };
        let near = |a: DVec3, b: DVec3| (a - b).length() < 1e-12;
        assert!(
            near(turned("0,0,0,90,0,0", DVec3::Y), DVec3::X),
            "north to east"
        );
        assert!(near(turned("0,0,0,0,90,0", DVec3::Y), DVec3::Z));
        assert!(near(turned("0,0,0,0,0,90", DVec3::X), -DVec3::Z));
        // Heading comes last: a nose that is lifted stays lifted.
        assert!(turned("0,0,0,90,30,0", DVec3::Y).z > 0.49);
        assert!(turned("0,0,0,90,30,0", DVec3::Y).x > 0.8);
    }
}
