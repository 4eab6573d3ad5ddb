//! STL, binary or as text.
//!
//! A list of triangles without shared vertices: corners at exactly one place become one vertex. The
//! facets' normals are not used, since they say nothing that the corners do not, or something wrong.
//!
//! Binary files may have colours in the two spare bytes of a facet, in one of two dialects: that of
//! Materialise Magics, told by `COLOR=` in the header, and that of VisCAM and SolidView. Both have
//! five bits a channel, taken as sRGB.

use super::budget::Budget;
use super::error::{Fault, Place, Problem, Warnings};
use super::finish::finish_mesh;
use super::names::unique;
use super::text::{Tokens, next_line, text, wrong_token};
use crate::tone::linear_from_srgb;
use std::collections::HashMap;
use std::path::Path;
use veduta::map::MaterialId;
use veduta::scene::{Material, Mesh, MeshId, Object, Scene};
use veduta_geometry::{DMat4, DVec3};

/// Reads a scene: an object for each solid. Binary files have one, named like the file.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Scene, Fault> {
    let solids = if is_text(bytes) {
        read_text(bytes)?
    } else {
        vec![read_binary(bytes, budget, warnings)?]
    };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut scene = Scene::default();
    let mut names = HashMap::new();
    let has_colors = solids.iter().any(|solid| !solid.mesh.colors.is_empty());
    for Solid { name, mut mesh, .. } in solids {
        if mesh.triangles.is_empty() {
            continue;
        }
        let name = if name.is_empty() {
            stem.clone().into_owned()
        } else {
            name
        };
        let name = unique(name, &mut names);
        finish_mesh(&mut mesh, &name, &Place::Whole, warnings)?;
        scene.objects.push(Object {
            name,
            mesh: MeshId(scene.meshes.len() as u32),
            world_from_object: DMat4::IDENTITY,
        });
        scene.meshes.push(mesh);
    }
    let mut material = Material {
        name: stem.into_owned(),
        ..Material::default()
    };
    if has_colors {
        material.base_color = [1.0; 4];
    }
    scene.materials.push(material);
    Ok(scene)
}

/// Bytes before the triangles of a binary file, of which the last four are their number.
const HEADER: usize = 84;
/// Bytes of a triangle: a normal, three corners, the spare bytes.
const FACET: usize = 50;

/// Whether a file is text. Many binary ones begin with `solid`, too, but have the length that their
/// number of triangles asks for, and no `facet` on the next line.
pub(crate) fn is_text(bytes: &[u8]) -> bool {
    let mut rest = bytes.trim_ascii_start();
    if !starts_with_word(rest, b"solid") {
        return false;
    }
    if facet_count(bytes).is_some_and(|count| bytes.len() as u64 == binary_length(count)) {
        return false;
    }
    next_line(&mut rest);
    let second = rest.trim_ascii_start();
    second.is_empty() || starts_with_word(second, b"facet") || starts_with_word(second, b"endsolid")
}

fn starts_with_word(text: &[u8], word: &[u8]) -> bool {
    text.get(..word.len())
        .is_some_and(|start| start.eq_ignore_ascii_case(word))
}

fn facet_count(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEADER - 4..)?.first_chunk()?;
    Some(u32::from_le_bytes(*count))
}

fn binary_length(facets: u32) -> u64 {
    HEADER as u64 + FACET as u64 * u64::from(facets)
}

/// A solid in the making.
#[derive(Default)]
struct Solid {
    name: String,
    mesh: Mesh,
    vertices: HashMap<([u64; 3], Option<u16>), u32>,
}

impl Solid {
    /// The vertex at a place, of a facet whose color bits are `color`.
    fn vertex(&mut self, position: DVec3, color: Option<(u16, [f32; 3])>) -> u32 {
        // There are two zeros, at one place.
        let key = position.to_array().map(|c| (c + 0.0).to_bits());
        let made = self.mesh.positions.len() as u32;
        let key = (key, color.map(|(bits, _)| bits));
        let vertex = *self.vertices.entry(key).or_insert(made);
        if vertex == made {
            self.mesh.positions.push(position);
            if let Some((_, color)) = color {
                self.mesh.colors.push(color);
            }
        }
        vertex
    }

    fn close(mut self) -> Self {
        self.vertices = HashMap::new();
        if !self.mesh.triangles.is_empty() {
            self.mesh.materials.push((0, MaterialId(0)));
        }
        self
    }
}

/// What the spare bytes of facets mean.
#[derive(Clone, Copy)]
enum Dialect {
    /// Nothing.
    Plain,
    /// Red in the lowest bits; with the highest bit set the color of the header is taken.
    Magics([f32; 3]),
    /// Blue in the lowest bits; without the highest bit there is no color.
    VisCam,
}

impl Dialect {
    fn of(bytes: &[u8]) -> Self {
        let (header, facets) = bytes.split_at(HEADER);
        let mark = b"COLOR=";
        let at = header.windows(mark.len()).position(|word| word == mark);
        if let Some(&[r, g, b]) = at.and_then(|at| header[at + mark.len()..].first_chunk()) {
            let linear = |byte: u8| linear_from_srgb(f32::from(byte) / 255.0);
            return Self::Magics([r, g, b].map(linear));
        }
        if facets
            .chunks_exact(FACET)
            .any(|facet| facet[FACET - 1] & 0x80 != 0)
        {
            Self::VisCam
        } else {
            Self::Plain
        }
    }

    /// The color for the spare bytes of a facet, and bits that tell it from others.
    fn color(self, spare: u16) -> Option<(u16, [f32; 3])> {
        const OWN_MARK: u16 = 0x8000;
        let channel = |shift: u16| linear_from_srgb(f32::from(spare >> shift & 31) / 31.0);
        let low_to_high = [channel(0), channel(5), channel(10)];
        let marked = spare & OWN_MARK != 0;
        match self {
            Self::Plain => None,
            Self::Magics(whole) if marked => Some((OWN_MARK, whole)),
            Self::Magics(_) => Some((spare, low_to_high)),
            Self::VisCam if marked => {
                let [blue, green, red] = low_to_high;
                Some((spare, [red, green, blue]))
            }
            Self::VisCam => {
                let [r, g, b, _] = Material::default().base_color;
                Some((0, [r, g, b]))
            }
        }
    }
}

fn read_binary(bytes: &[u8], budget: &mut Budget, warnings: &mut Warnings) -> Result<Solid, Fault> {
    let Some(count) = facet_count(bytes) else {
        let found = bytes[..bytes.len().min(4)].to_vec();
        let format = "STL";
        return Err(Problem::WrongMagic { format, found }.at(Place::Whole));
    };
    let place = Place::Byte(HEADER as u64 - 4);
    let (needed, present) = (binary_length(count), bytes.len() as u64);
    if present < needed {
        let what = "a binary STL file with this number of triangles";
        return Err(Problem::Truncated {
            what,
            needed,
            present,
        }
        .at(place));
    }
    if present > needed {
        let message = format!(
            "{} bytes behind the triangles are left out",
            present - needed
        );
        warnings.add(Place::Byte(needed), message);
    }
    // A triangle, and up to three vertices with their place in a hash table.
    budget
        .charge(count.into(), 12 + 3 * 128)
        .map_err(|problem| problem.at(place))?;
    let bytes = &bytes[..needed as usize];
    let dialect = Dialect::of(bytes);
    let mut solid = Solid::default();
    for facet in bytes[HEADER..].as_chunks::<FACET>().0 {
        let float = |at: usize| {
            let bytes = [facet[at], facet[at + 1], facet[at + 2], facet[at + 3]];
            f64::from(f32::from_le_bytes(bytes))
        };
        let color = dialect.color(u16::from_le_bytes([facet[FACET - 2], facet[FACET - 1]]));
        let triangle = [12, 24, 36].map(|at| {
            let position = DVec3::new(float(at), float(at + 4), float(at + 8));
            solid.vertex(position, color)
        });
        solid.mesh.triangles.push(triangle);
    }
    Ok(solid.close())
}

/// Reads `solid NAME`, then for each triangle `facet normal …`, `outer loop`, three times
/// `vertex x y z`, `endloop`, `endfacet`; then `endsolid`.
fn read_text(bytes: &[u8]) -> Result<Vec<Solid>, Fault> {
    let mut solids = Vec::new();
    let mut solid: Option<Solid> = None;
    let mut corners: Vec<DVec3> = Vec::new();
    let mut rest = bytes;
    let mut number = 0;
    while !rest.is_empty() {
        number += 1;
        let line = next_line(&mut rest);
        let mut tokens = Tokens(line);
        let Some(keyword) = tokens.next() else {
            continue;
        };
        let at_line = |problem: Problem| problem.at(Place::Line(number));
        let keyword = keyword.to_ascii_lowercase();
        match (keyword.as_slice(), &mut solid) {
            (b"solid", None) => {
                let name = text(tokens).replace('/', "_");
                solid = Some(Solid {
                    name,
                    ..Solid::default()
                });
            }
            (b"endsolid", Some(_)) => solids.extend(solid.take().map(Solid::close)),
            (b"facet", Some(_)) => corners.clear(),
            (b"vertex", Some(_)) => {
                let position = tokens.three_numbers().map_err(at_line)?;
                corners.push(DVec3::from_array(position));
            }
            (b"endfacet", Some(solid)) => {
                let &[a, b, c] = corners.as_slice() else {
                    let (found, most) = (corners.len(), 3);
                    return Err(at_line(Problem::Corners { found, most }));
                };
                let triangle = [a, b, c].map(|corner| solid.vertex(corner, None));
                solid.mesh.triangles.push(triangle);
                corners.clear();
            }
            (b"outer" | b"endloop", Some(_)) => {}
            (_, Some(_)) => {
                let expected = "facet, outer loop, vertex, endloop, endfacet or endsolid";
                return Err(at_line(wrong_token(&keyword, expected)));
            }
            (_, None) => return Err(at_line(wrong_token(&keyword, "solid"))),
        }
    }
    if solid.is_some() {
        let found = "the file ends before endsolid; it is cut short".into();
        let format = "STL";
        return Err(Problem::NotValid { format, found }.at(Place::Line(number)));
    }
    Ok(solids)
}
