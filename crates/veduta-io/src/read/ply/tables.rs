//! Rows -> vertices and faces.

use super::header::{Element, Header, Number, Property};
use super::rows::Rows;
use crate::read::budget::Budget;
use crate::read::error::{Fault, Problem};
use crate::tone::linear_from_srgb;
use veduta_geometry::{DVec3, Vec2, Vec3};

/// What a file has of what is read. Attributes of vertices have a row for each position, or none.
#[derive(Debug, Default)]
pub struct Tables {
    pub positions: Vec<DVec3>,
    pub normals: Vec<Vec3>,
    pub texcoords: Vec<Vec2>,
    pub colors: Vec<[f32; 3]>,
    /// The vertices at the corners of all faces.
    pub corners: Vec<u32>,
    /// Where the corners of each face end.
    pub face_ends: Vec<usize>,
    /// One for each corner, or none.
    pub corner_texcoords: Vec<Vec2>,
    /// One for each face, or none.
    pub face_colors: Vec<[f32; 3]>,
    pub too_few_corners: u64,
}

impl Tables {
    /// The texture coordinates at a corner: the corner's own, else its vertex's.
    pub fn texcoord(&self, corner: usize) -> Option<Vec2> {
        let own = self.corner_texcoords.get(corner);
        let of_vertex = || self.texcoords.get(self.corners[corner] as usize);
        own.or_else(of_vertex).copied()
    }
}

/// The most corners of a face: none is known to have so many, and cutting it up costs their square.
const MOST_CORNERS: usize = 65_536;

/// Reads all tables.
pub fn read(header: &Header, rows: &mut Rows<'_>, budget: &mut Budget) -> Result<Tables, Fault> {
    let mut tables = Tables::default();
    for element in &header.elements {
        if element.properties.is_empty() {
            continue;
        }
        let what = match element.name.as_str() {
            "vertex" => "the table of vertices",
            "face" => "the table of faces",
            _ => "a table of its header",
        };
        let least = element.least_row(header.encoding) as u64;
        // The last number of a text needs no space behind it.
        let (needed, present) = (least.saturating_mul(element.count), rows.left() as u64 + 1);
        if needed > present {
            let problem = Problem::Truncated {
                what,
                needed,
                present: rows.left() as u64,
            };
            return Err(problem.at(rows.place()));
        }
        match element.name.as_str() {
            "vertex" if tables.positions.is_empty() => {
                // A position, a normal, texture coordinates, a colour.
                let charged = budget.charge(element.count, 24 + 12 + 8 + 12);
                charged.map_err(|problem| problem.at(rows.place()))?;
                read_vertices(element, rows, &mut tables)?;
            }
            "face" => read_faces(element, rows, &mut tables)?,
            "tristrips" => read_strips(element, rows, &mut tables)?,
            _ => {
                for _ in 0..element.count {
                    for property in &element.properties {
                        pass_over(property, rows)?;
                    }
                }
            }
        }
    }
    let count = tables.positions.len();
    if let Some(&vertex) = tables.corners.iter().find(|&&v| v as usize >= count) {
        let (what, index) = ("vertex", vertex.into());
        let problem = Problem::NoSuch { what, index, count };
        return Err(problem.at(crate::read::error::Place::Whole));
    }
    Ok(tables)
}

fn pass_over(property: &Property, rows: &mut Rows<'_>) -> Result<(), Fault> {
    let length = match property.list {
        Some(count) => list_length(count, property.number, rows)?,
        None => 1,
    };
    for _ in 0..length {
        rows.next(property.number)?;
    }
    Ok(())
}

/// Reads the length of a list; the rest of the file has room for it.
fn list_length(count: Number, number: Number, rows: &mut Rows<'_>) -> Result<usize, Fault> {
    let place = rows.place();
    let length = rows.next(count)?;
    if !(length >= 0.0 && length.fract() == 0.0) {
        let found = length.to_string();
        let expected = "the length of a list";
        return Err(Problem::Illegal { found, expected }.at(place));
    }
    let least = match rows {
        Rows::Text { .. } => 1,
        Rows::Binary { .. } => number.bytes(),
    };
    let (needed, present) = (length * least as f64, rows.left());
    if needed > present as f64 {
        let problem = Problem::Truncated {
            what: "a list",
            needed: needed as u64,
            present: present as u64,
        };
        return Err(problem.at(place));
    }
    Ok(length as usize)
}

/// Columns of vertices, in the order of their places in a row of numbers.
const COLUMNS: [&[&str]; 11] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
    &["s", "u", "texture_u", "texcoord_u"],
    &["t", "v", "texture_v", "texcoord_v"],
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
];

/// The place of a property in [`COLUMNS`].
fn column_of(property: &Property) -> Option<usize> {
    let is_named = |names: &&[&str]| names.contains(&property.name.as_str());
    COLUMNS
        .iter()
        .position(is_named)
        .filter(|_| property.list.is_none())
}

/// A channel of a colour, linear.
fn linear(value: f64, number: Number) -> f32 {
    match number {
        Number::F32 | Number::F64 => value as f32,
        Number::U16 | Number::I16 => linear_from_srgb((value / 65_535.0).clamp(0.0, 1.0) as f32),
        // Wider ones, too, are used for bytes.
        _ => linear_from_srgb((value / 255.0).clamp(0.0, 1.0) as f32),
    }
}

fn read_vertices(element: &Element, rows: &mut Rows<'_>, tables: &mut Tables) -> Result<(), Fault> {
    let columns: Vec<Option<usize>> = element.properties.iter().map(column_of).collect();
    let has =
        |wanted: std::ops::Range<usize>| wanted.into_iter().all(|c| columns.contains(&Some(c)));
    if !has(0..3) {
        let problem = Problem::Lacks("properties x, y and z of its vertices");
        return Err(problem.at(rows.place()));
    }
    let (has_normals, has_texcoords, has_colors) = (has(3..6), has(6..8), has(8..11));
    for _ in 0..element.count {
        let mut row = [0.0; COLUMNS.len()];
        for (property, column) in element.properties.iter().zip(&columns) {
            let Some(column) = *column else {
                pass_over(property, rows)?;
                continue;
            };
            let value = rows.next(property.number)?;
            row[column] = if column >= 8 {
                linear(value, property.number).into()
            } else {
                value
            };
        }
        let [x, y, z, nx, ny, nz, u, v, r, g, b] = row;
        tables.positions.push(DVec3::new(x, y, z));
        if has_normals {
            tables.normals.push(DVec3::new(nx, ny, nz).as_vec3());
        }
        if has_texcoords {
            tables.texcoords.push(Vec2::new(u as f32, 1.0 - v as f32));
        }
        if has_colors {
            tables.colors.push([r, g, b].map(|c| c as f32));
        }
    }
    Ok(())
}

const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];

fn read_faces(element: &Element, rows: &mut Rows<'_>, tables: &mut Tables) -> Result<(), Fault> {
    let indices = element
        .properties
        .iter()
        .position(|p| p.list.is_some() && INDICES.contains(&p.name.as_str()));
    let Some(indices) = indices else {
        let problem = Problem::Lacks("list vertex_indices of its faces");
        return Err(problem.at(rows.place()));
    };
    let texcoords = element
        .properties
        .iter()
        .position(|p| p.list.is_some() && p.name == "texcoord");
    let colors: Vec<Option<usize>> = element
        .properties
        .iter()
        .map(|p| column_of(p).and_then(|column| column.checked_sub(8)))
        .collect();
    let has_colors = (0..3).all(|channel| colors.contains(&Some(channel)));
    let mut face_texcoords = Vec::new();
    for _ in 0..element.count {
        let first = tables.corners.len();
        let mut color = [0.0; 3];
        face_texcoords.clear();
        for (column, property) in element.properties.iter().enumerate() {
            if column == indices {
                let length =
                    list_length(property.list.unwrap_or(Number::U8), property.number, rows)?;
                if length > MOST_CORNERS {
                    let (found, most) = (length, MOST_CORNERS);
                    return Err(Problem::Corners { found, most }.at(rows.place()));
                }
                for _ in 0..length {
                    let index = read_index(property.number, rows)?;
                    tables.corners.push(index);
                }
            } else if Some(column) == texcoords {
                let length =
                    list_length(property.list.unwrap_or(Number::U8), property.number, rows)?;
                for _ in 0..length {
                    face_texcoords.push(rows.next(property.number)? as f32);
                }
            } else if let Some(channel) = colors[column] {
                color[channel] = linear(rows.next(property.number)?, property.number);
            } else {
                pass_over(property, rows)?;
            }
        }
        let corners = tables.corners.len() - first;
        if corners < 3 {
            tables.corners.truncate(first);
            tables.too_few_corners += 1;
            continue;
        }
        tables.face_ends.push(tables.corners.len());
        if has_colors {
            tables.face_colors.push(color);
        }
        if texcoords.is_some() {
            let pairs = face_texcoords.as_chunks::<2>().0.iter();
            let pairs = pairs.map(|&[u, v]| Vec2::new(u, 1.0 - v));
            // Faces without texture have an empty list.
            let missing = std::iter::repeat(Vec2::ZERO);
            tables
                .corner_texcoords
                .extend(pairs.chain(missing).take(corners));
        }
    }
    Ok(())
}

/// Reads the index of a vertex. Whether that exists is known when all tables have been read.
fn read_index(number: Number, rows: &mut Rows<'_>) -> Result<u32, Fault> {
    let place = rows.place();
    let index = rows.next(number)?;
    index_of(index).map_err(|problem| problem.at(place))
}

fn index_of(number: f64) -> Result<u32, Problem> {
    if number >= 0.0 && number < f64::from(u32::MAX) && number.fract() == 0.0 {
        Ok(number as u32)
    } else {
        let found = number.to_string();
        let expected = "the index of a vertex, from 0";
        Err(Problem::Illegal { found, expected })
    }
}

/// Reads strips: each vertex makes a triangle with the two before it, of alternating winding; -1
/// begins anew.
fn read_strips(element: &Element, rows: &mut Rows<'_>, tables: &mut Tables) -> Result<(), Fault> {
    for _ in 0..element.count {
        for property in &element.properties {
            let (Some(count), true) = (property.list, INDICES.contains(&property.name.as_str()))
            else {
                pass_over(property, rows)?;
                continue;
            };
            let mut strip: Vec<u32> = Vec::new();
            for _ in 0..list_length(count, property.number, rows)? {
                let place = rows.place();
                let index = rows.next(property.number)?;
                if index == -1.0 {
                    strip.clear();
                    continue;
                }
                strip.push(index_of(index).map_err(|problem| problem.at(place))?);
                if let &[.., a, b, c] = strip.as_slice() {
                    let triangle = if strip.len() % 2 == 1 {
                        [a, b, c]
                    } else {
                        [b, a, c]
                    };
                    tables.corners.extend(triangle);
                    tables.face_ends.push(tables.corners.len());
                }
            }
        }
    }
    Ok(())
}
