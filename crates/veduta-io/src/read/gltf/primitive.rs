//! A primitive -> a mesh of one material.
//!
//! glTF 2.0, §3.7.2.1. The steps: corners, the vertices they use, the attributes of those, the pose.

use super::accessor::Elements;
use super::document::{Index, Primitive};
use super::draco::Decoded;
use super::material::TexcoordSets;
use super::mesh::MeshReader;
use super::pose::Pose;
use super::{Fault, Problem, row};
use crate::read::error::Place;
use rayon::prelude::*;
use veduta::map::MaterialId;
use veduta::scene::Mesh;
use veduta_geometry::{DVec3, Vec2, Vec3};

/// Vertices that a task handles at a time.
pub const VERTICES_PER_TASK: usize = 16 * 1024;

impl<'a> MeshReader<'a> {
    /// Reads a primitive, `at` its path; `None` if it has no faces.
    pub fn primitive(
        &mut self,
        primitive: &Primitive,
        pose: &Pose<'_>,
        at: &str,
    ) -> Result<Option<Mesh>, Fault> {
        let Some(topology) = Topology::of(primitive.mode, at)? else {
            let message = "points and lines have no faces; they are left out";
            self.warnings.add(Place::Json(at.to_owned()), message);
            return Ok(None);
        };
        let (material, sets) = match primitive.material {
            None => (self.document.materials.len(), TexcoordSets::default()),
            Some(index) => {
                let (index, material) = row(&self.document.materials, index, "material", at)?;
                (index, TexcoordSets::of(material))
            }
        };
        let compressed = self.compressed(primitive, at)?;
        let compressed = compressed.as_ref();
        // A stream holds separate triangles, whatever is made of it.
        let topology = compressed.map_or(topology, |_| Topology::Triangles);
        let used = self.corners(primitive, topology, compressed, at)?;
        let rows = used.rows.as_deref();
        let mut vertices = Vertices {
            reader: self,
            primitive,
            compressed,
            count: used.vertices,
            kept: rows.map_or(used.vertices, |rows| rows.len() as u64),
            rows,
            at,
        };
        let mut mesh = Mesh {
            positions: vertices.positions()?,
            normals: vertices.normals()?,
            texcoords: vertices.texcoords(sets.first, sets.first_is_used)?,
            materials: vec![(0, MaterialId::from_index(material))],
            ..Mesh::default()
        };
        if let Some(second) = sets.second {
            mesh.second_texcoords = vertices.texcoords(second, true)?;
        }
        (mesh.colors, mesh.opacities) = vertices.colors()?;
        vertices.morph(&mut mesh, pose.weights, &sets)?;
        if let Some(skin) = pose.skin {
            vertices.bend(&mut mesh, skin)?;
        }
        self.charge(used.corners.len() as u64, 12, at)?;
        mesh.triangles = topology.triangles(&used.corners);
        Ok(Some(mesh))
    }

    /// The corners of a primitive's faces, and the vertices they use.
    fn corners(
        &mut self,
        primitive: &Primitive,
        topology: Topology,
        compressed: Option<&Decoded>,
        at: &str,
    ) -> Result<Corners, Fault> {
        if let Some(decoded) = compressed {
            self.charge(3 * decoded.triangles(), 4, at)?;
            let corners = decoded.corners();
            check_indices(&corners, decoded.vertices(), at)?;
            return Ok(Corners::using(corners, decoded.vertices()));
        }
        let at_attributes = format!("{at}.attributes");
        let Some(&position) = primitive.attributes.get("POSITION") else {
            return Err(Problem::Lacks("POSITION").at_json(at_attributes));
        };
        let at_position = format!("{at_attributes}.POSITION");
        let vertices = self.elements(position, "VEC3", &at_position)?.count;
        let used = match primitive.indices {
            Some(index) => {
                let corners = self.indices(index, vertices, &format!("{at}.indices"))?;
                Corners::using(corners, vertices)
            }
            None => {
                self.charge(vertices, 4, &at_position)?;
                let most = u32::try_from(vertices).map_err(|_| {
                    let found = format!("{vertices} vertices");
                    let expected = "fewer than 2^32";
                    Problem::Illegal { found, expected }.at_json(&at_position)
                })?;
                Corners {
                    corners: (0..most).collect(),
                    rows: None,
                    vertices,
                }
            }
        };
        if topology == Topology::Triangles && used.corners.len() % 3 != 0 {
            let message = format!(
                "{} corners are no whole number of triangles; the last are left out",
                used.corners.len()
            );
            self.warnings.add(Place::Json(at.to_owned()), message);
        }
        Ok(used)
    }

    /// Indices of corners, all of them below `vertices`.
    fn indices(&mut self, index: Index, vertices: u64, at: &str) -> Result<Vec<u32>, Fault> {
        let elements = self.elements(index, "SCALAR", at)?;
        if !elements.is_unsigned_integer() {
            let found = "an accessor of signed numbers or fractions".to_owned();
            let expected = "unsigned integers";
            return Err(Problem::Illegal { found, expected }.at_json(at));
        }
        self.charge(elements.count, 4, at)?;
        let indices = elements.indices();
        check_indices(&indices, vertices, at)?;
        Ok(indices)
    }

    /// What a primitive's compressed stream holds, if it has one.
    fn compressed(&mut self, primitive: &Primitive, at: &str) -> Result<Option<Decoded>, Fault> {
        let Some(extension) = &primitive.extensions.draco else {
            return Ok(None);
        };
        let at = format!("{at}.extensions.KHR_draco_mesh_compression");
        let (bytes, _) = self.buffers.view(extension.buffer_view, &at)?;
        // Many primitives may name one stream, which is long and decodes to little.
        self.charge(bytes.len() as u64, 1, &at)?;
        let decoded = Decoded::new(bytes, self.budget);
        decoded.map_err(|problem| problem.at_json(at))
    }

    fn elements(
        &self,
        index: Index,
        shapes: &'static str,
        at: &str,
    ) -> Result<Elements<'a>, Fault> {
        Elements::find(self.document, self.buffers, index, shapes, at)
    }

    fn charge(&mut self, rows: u64, row_bytes: usize, at: &str) -> Result<(), Fault> {
        let charged = self.budget.charge(rows, row_bytes);
        charged.map_err(|problem| problem.at_json(at))
    }
}

/// The corners of a primitive's faces, and the vertices they use.
struct Corners {
    /// Rows of the kept vertices.
    corners: Vec<u32>,
    /// The vertices that are kept, ascending; `None`: all.
    rows: Option<Vec<u32>>,
    /// Number of vertices, whether kept or not.
    vertices: u64,
}

impl Corners {
    /// Keeps those of the `vertices` that are corners, all of which are below `vertices`.
    fn using(mut corners: Vec<u32>, vertices: u64) -> Self {
        let rows = keep_used(&mut corners, vertices);
        Self {
            corners,
            rows,
            vertices,
        }
    }
}

/// The vertices of a primitive: its attributes, of those vertices that faces use.
pub struct Vertices<'r, 'a> {
    pub reader: &'r mut MeshReader<'a>,
    pub primitive: &'r Primitive,
    compressed: Option<&'r Decoded>,
    /// Number of elements of every accessor.
    count: u64,
    /// Number of those that are kept.
    kept: u64,
    /// The rows that are kept, ascending; `None`: all.
    pub rows: Option<&'r [u32]>,
    /// Path of the primitive.
    pub at: &'r str,
}

impl<'a> Vertices<'_, 'a> {
    /// The elements of one of the primitive's attributes, for each of which `row_bytes` bytes are
    /// taken from the budget.
    pub fn attribute(
        &mut self,
        name: &str,
        shapes: &'static str,
        row_bytes: usize,
    ) -> Result<Option<Elements<'a>>, Fault> {
        let Some(&index) = self.primitive.attributes.get(name) else {
            return Ok(None);
        };
        let at = format!("{}.attributes.{name}", self.at);
        let extension = self.primitive.extensions.draco.as_ref();
        let id = extension.and_then(|extension| extension.attributes.get(name));
        let elements = match (self.compressed, id) {
            (Some(decoded), Some(&id)) => {
                let table = decoded.attribute(id, self.reader.budget);
                let Some(table) = table.map_err(|problem| problem.at_json(&at))? else {
                    let found = format!("attribute {id}, which the compressed stream lacks");
                    let expected = "one that is there";
                    return Err(Problem::Illegal { found, expected }.at_json(at));
                };
                let (document, buffers) = (self.reader.document, self.reader.buffers);
                Elements::decompressed(document, buffers, index, shapes, table, &at)?
            }
            _ => self.reader.elements(index, shapes, &at)?,
        };
        self.checked(elements, row_bytes, &at).map(Some)
    }

    /// The elements of what a morph target adds to an attribute.
    pub fn difference(
        &mut self,
        target: usize,
        name: &str,
        shapes: &'static str,
        row_bytes: usize,
    ) -> Result<Option<Elements<'a>>, Fault> {
        let Some(&index) = self.primitive.targets[target].get(name) else {
            return Ok(None);
        };
        let at = format!("{}.targets[{target}].{name}", self.at);
        let elements = self.reader.elements(index, shapes, &at)?;
        self.checked(elements, row_bytes, &at).map(Some)
    }

    /// Elements that must be as many as the vertices are.
    fn checked(
        &mut self,
        elements: Elements<'a>,
        row_bytes: usize,
        at: &str,
    ) -> Result<Elements<'a>, Fault> {
        if elements.count != self.count {
            return Err(Problem::Illegal {
                found: format!("{} elements for {} vertices", elements.count, self.count),
                expected: "as many as POSITION has",
            }
            .at_json(at));
        }
        self.reader.charge(self.kept, row_bytes, at)?;
        Ok(elements)
    }

    fn positions(&mut self) -> Result<Vec<DVec3>, Fault> {
        let Some(elements) = self.attribute("POSITION", "VEC3", 3 * 4 + 3 * 8)? else {
            return Err(Problem::Lacks("POSITION").at_json(format!("{}.attributes", self.at)));
        };
        let wide = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
        let positions = elements.vectors(self.rows, wide);
        let sound = positions
            .par_chunks(VERTICES_PER_TASK)
            .all(|chunk| chunk.iter().all(|p| p.is_finite()));
        let lost = match sound {
            true => None,
            false => positions.iter().position(|p| !p.is_finite()),
        };
        if let Some(lost) = lost {
            let vertex = self.rows.map_or(lost as u32, |rows| rows[lost]);
            return Err(Problem::Illegal {
                found: format!(
                    "{:?} at vertex {vertex}",
                    positions[lost].as_vec3().to_array()
                ),
                expected: "finite coordinates",
            }
            .at_json(format!("{}.attributes.POSITION", self.at)));
        }
        Ok(positions)
    }

    fn normals(&mut self) -> Result<Vec<Vec3>, Fault> {
        let elements = self.attribute("NORMAL", "VEC3", 12)?;
        Ok(elements.map_or(Vec::new(), |e| e.vectors(self.rows, Vec3::from_array)))
    }

    /// The texture coordinates of a set; where a texture asks for them and there are none, all 0.
    fn texcoords(&mut self, set: u64, is_used: bool) -> Result<Vec<Vec2>, Fault> {
        let elements = self.attribute(&format!("TEXCOORD_{set}"), "VEC2", 8)?;
        if let Some(elements) = elements {
            return Ok(elements.vectors(self.rows, Vec2::from_array));
        }
        if !is_used {
            return Ok(Vec::new());
        }
        let message = format!("lacks TEXCOORD_{set}, which its material asks for; 0 is taken");
        let place = Place::Json(self.at.to_owned());
        self.reader.warnings.add(place, message);
        self.reader.charge(self.kept, 8, self.at)?;
        Ok(vec![Vec2::ZERO; self.kept as usize])
    }

    /// Colours, and opacities unless all are 1.
    fn colors(&mut self) -> Result<(Vec<[f32; 3]>, Vec<f32>), Fault> {
        let Some(elements) = self.attribute("COLOR_0", "VEC3 or VEC4", 12)? else {
            return Ok((Vec::new(), Vec::new()));
        };
        if elements.components == 3 {
            return Ok((elements.vectors(self.rows, |color| color), Vec::new()));
        }
        self.reader.charge(self.kept, 4, self.at)?;
        let colors = elements.vectors(self.rows, |[r, g, b, _]: [f32; 4]| [r, g, b]);
        let mut opacities = elements.vectors(self.rows, |[_, _, _, a]: [f32; 4]| a);
        if opacities.iter().all(|&opacity| opacity == 1.0) {
            opacities = Vec::new();
        }
        Ok((colors, opacities))
    }
}

/// How corners make triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Topology {
    Triangles,
    Strip,
    Fan,
}

impl Topology {
    /// By the number in the file; `None` for points and lines.
    fn of(mode: u64, at: &str) -> Result<Option<Self>, Fault> {
        Ok(match mode {
            0..=3 => None,
            4 => Some(Self::Triangles),
            5 => Some(Self::Strip),
            6 => Some(Self::Fan),
            _ => {
                let (found, expected) = (mode.to_string(), "0 to 6");
                let problem = Problem::Illegal { found, expected };
                return Err(problem.at_json(format!("{at}.mode")));
            }
        })
    }

    fn triangles(self, corners: &[u32]) -> Vec<[u32; 3]> {
        match self {
            Self::Triangles => corners.as_chunks::<3>().0.to_vec(),
            // Every second triangle is turned, so that all have the winding of the first.
            Self::Strip => corners
                .windows(3)
                .enumerate()
                .map(|(i, c)| {
                    if i % 2 == 0 {
                        [c[0], c[1], c[2]]
                    } else {
                        [c[0], c[2], c[1]]
                    }
                })
                .collect(),
            Self::Fan => match corners.split_first() {
                None => Vec::new(),
                Some((&hub, rim)) => rim.windows(2).map(|c| [c[0], c[1], hub]).collect(),
            },
        }
    }
}

/// Numbers the used vertices anew, from 0 in their old order.
///
/// Tells which they are, ascending; `None` when all are used and nothing changes. All corners must
/// be below `vertices`. Memory is proportional to the corners, however many vertices there are.
fn keep_used(corners: &mut [u32], vertices: u64) -> Option<Vec<u32>> {
    if (corners.len() as u64).saturating_mul(4) < vertices {
        let mut used = corners.to_vec();
        used.sort_unstable();
        used.dedup();
        for corner in corners {
            *corner = used.partition_point(|vertex| vertex < corner) as u32;
        }
        return Some(used);
    }
    const UNUSED: u32 = u32::MAX;
    let mut new_from_old = vec![UNUSED; vertices as usize];
    for &corner in corners.iter() {
        new_from_old[corner as usize] = 0;
    }
    if !new_from_old.contains(&UNUSED) {
        return None;
    }
    let mut used = Vec::new();
    for (old, new) in new_from_old.iter_mut().enumerate() {
        if *new != UNUSED {
            *new = used.len() as u32;
            used.push(old as u32);
        }
    }
    for corner in corners {
        *corner = new_from_old[*corner as usize];
    }
    Some(used)
}

/// An error at the first index that no vertex has.
fn check_indices(indices: &[u32], vertices: u64, at: &str) -> Result<(), Fault> {
    let wrong = |&index: &u32| u64::from(index) >= vertices;
    match indices.iter().position(wrong) {
        None => Ok(()),
        Some(place) => Err(Problem::IndexOutOfRange {
            at: place,
            index: indices[place],
            vertices,
        }
        .at_json(at)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_the_winding_of_their_first_triangle() {
        // A unit square as strip, and as fan: all triangles are counterclockwise.
        let square = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y];
        let up = |corners: [u32; 3]| {
            let [a, b, c] = corners.map(|corner| square[corner as usize]);
            (b - a).cross(c - a).z
        };
        let strip = Topology::Strip.triangles(&[0, 1, 2, 3]);
        let fan = Topology::Fan.triangles(&[0, 1, 3, 2]);
        assert_eq!((strip.len(), fan.len()), (2, 2));
        for corners in strip.into_iter().chain(fan) {
            assert_eq!(up(corners), 1.0, "{corners:?}");
        }
        for topology in [Topology::Triangles, Topology::Strip, Topology::Fan] {
            assert!(topology.triangles(&[]).is_empty());
            assert!(topology.triangles(&[0, 1]).is_empty());
        }
    }

    #[test]
    fn unused_vertices_are_dropped_whether_few_or_most() {
        for vertices in [9, 10, 1_000_000_000] {
            let mut corners = [8, 1, 5, 5, 1, 7];
            assert_eq!(keep_used(&mut corners, vertices), Some(vec![1, 5, 7, 8]));
            assert_eq!(corners, [3, 0, 1, 1, 0, 2]);
        }
        let mut corners = [2, 1, 0];
        assert_eq!(keep_used(&mut corners, 3), None);
        assert_eq!(corners, [2, 1, 0]);
    }
}
