//! Primitives -> one mesh.
//!
//! glTF 2.0, §3.7.2. Only the vertices that a primitive's faces use are kept: exporters like to
//! share one large table of vertices among many primitives.

use super::accessor::Elements;
use super::buffers::Buffers;
use super::document::{Document, Index, MeshOfPrimitives, Primitive};
use super::{Fault, Problem, row};
use crate::read::budget::Budget;
use crate::read::error::{Place, Warnings};
use crate::read::finish::{face_normal, finish_mesh};
use veduta::map::MaterialId;
use veduta::scene::Mesh;
use veduta_geometry::{DVec3, Vec2, Vec3};

/// What reading a mesh needs besides the mesh.
pub struct MeshReader<'a> {
    pub document: &'a Document,
    pub buffers: &'a Buffers<'a>,
    pub budget: &'a mut Budget,
    pub warnings: &'a mut Warnings,
}

impl<'a> MeshReader<'a> {
    /// Reads a mesh; `index` is its row in the document. A mesh whose primitives are all points or
    /// lines has no triangles.
    ///
    /// The material of a primitive without one is the row after the document's last material.
    pub fn read(&mut self, index: usize, mesh: &MeshOfPrimitives) -> Result<Mesh, Fault> {
        let mut parts = Vec::with_capacity(mesh.primitives.len());
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let at = format!("meshes[{index}].primitives[{number}]");
            parts.extend(self.primitive(primitive, &at)?);
        }
        let mut mesh_name = mesh.name.clone().unwrap_or_default();
        if mesh_name.is_empty() {
            mesh_name = format!("mesh{index}");
        }
        let mut joined = join(parts);
        let place = Place::Json(format!("meshes[{index}]"));
        finish_mesh(&mut joined, &mesh_name, &place, self.warnings)?;
        Ok(joined)
    }

    /// Reads a primitive, `at` its path; `None` if it has no faces.
    fn primitive(&mut self, primitive: &Primitive, at: &str) -> Result<Option<Mesh>, Fault> {
        let topology = match primitive.mode {
            0..=3 => {
                let message = "points and lines have no faces; they are left out";
                self.warnings.add(Place::Json(at.to_owned()), message);
                return Ok(None);
            }
            4 => Topology::Triangles,
            5 => Topology::Strip,
            6 => Topology::Fan,
            mode => {
                return Err(Problem::Illegal {
                    found: mode.to_string(),
                    expected: "0 to 6",
                }
                .at_json(format!("{at}.mode")));
            }
        };
        if !primitive.targets.is_empty() {
            let message = "morph targets are not supported; the shape without them is shown";
            self.warnings.add(Place::Json(at.to_owned()), message);
        }
        let material = match primitive.material {
            None => self.document.materials.len(),
            Some(index) => row(&self.document.materials, index, "material", at)?.0,
        };

        let at_attributes = format!("{at}.attributes");
        let Some(position) = primitive.attributes.position else {
            return Err(Problem::Lacks("POSITION").at_json(at_attributes));
        };
        let at_position = format!("{at_attributes}.POSITION");
        let positions = self.elements(position, "VEC3", &at_position)?;
        let vertices = positions.count;

        let mut corners = match primitive.indices {
            Some(index) => self.indices(index, vertices, &format!("{at}.indices"))?,
            None => {
                self.charge(vertices, 4, &at_position)?;
                let most = u32::try_from(vertices).map_err(|_| {
                    let found = format!("{vertices} vertices");
                    let expected = "fewer than 2^32";
                    Problem::Illegal { found, expected }.at_json(&at_position)
                })?;
                (0..most).collect()
            }
        };
        let rows = keep_used(&mut corners, vertices);
        let kept = rows.as_ref().map_or(vertices, |rows| rows.len() as u64);
        let rows = rows.as_deref();
        if topology == Topology::Triangles && corners.len() % 3 != 0 {
            let message = format!(
                "{} corners are no whole number of triangles; the last are left out",
                corners.len()
            );
            self.warnings.add(Place::Json(at.to_owned()), message);
        }
        self.charge(corners.len() as u64, 12, at)?;
        let triangles = topology.triangles(&corners);

        self.charge(kept, 3 * 4 + 3 * 8, &at_position)?;
        let positions = positions.vectors::<3>(rows);
        if let Some(lost) = positions
            .iter()
            .position(|p| !p.iter().all(|c| c.is_finite()))
        {
            let vertex = rows.map_or(lost as u32, |rows| rows[lost]);
            return Err(Problem::Illegal {
                found: format!("{:?} at vertex {vertex}", positions[lost]),
                expected: "finite coordinates",
            }
            .at_json(at_position));
        }
        let mut mesh = Mesh {
            positions: positions
                .iter()
                .map(|p| DVec3::from_array(p.map(f64::from)))
                .collect(),
            triangles,
            materials: vec![(0, MaterialId::from_index(material))],
            ..Mesh::default()
        };

        if let Some(index) = primitive.attributes.normal {
            let at = format!("{at_attributes}.NORMAL");
            let normals = self.attribute(index, "VEC3", vertices, &at)?;
            self.charge(kept, 12, &at)?;
            mesh.normals = normals
                .vectors(rows)
                .into_iter()
                .map(Vec3::from_array)
                .collect();
        }
        if let Some((index, name)) = self.texcoords_of(primitive, at) {
            let at = format!("{at_attributes}.{name}");
            let texcoords = self.attribute(index, "VEC2", vertices, &at)?;
            self.charge(kept, 8, &at)?;
            mesh.texcoords = texcoords
                .vectors(rows)
                .into_iter()
                .map(Vec2::from_array)
                .collect();
        }
        if let Some(index) = primitive.attributes.color_0 {
            let at = format!("{at_attributes}.COLOR_0");
            let colors = self.attribute(index, "VEC3 or VEC4", vertices, &at)?;
            self.charge(kept, 12, &at)?;
            mesh.colors = colors.vectors(rows);
        }
        Ok(Some(mesh))
    }

    /// The texture coordinates that the primitive's material asks for.
    fn texcoords_of(&mut self, primitive: &Primitive, at: &str) -> Option<(Index, &'static str)> {
        let material = primitive
            .material
            .map(|index| &self.document.materials[index as usize]);
        let texture = material.and_then(super::material::color_texture);
        let attributes = &primitive.attributes;
        let found = match texture.map_or(0, |texture| texture.texcoord_set()) {
            0 => attributes.texcoord_0.map(|index| (index, "TEXCOORD_0")),
            1 => attributes.texcoord_1.map(|index| (index, "TEXCOORD_1")),
            _ => None,
        };
        if texture.is_some() && found.is_none() {
            let message = "lacks the texture coordinates that its material asks for; 0 is taken";
            self.warnings.add(Place::Json(at.to_owned()), message);
        }
        found
    }

    /// The accessor of an attribute, which must have a row for each of the `vertices`.
    fn attribute(
        &self,
        index: Index,
        shapes: &'static str,
        vertices: u64,
        at: &str,
    ) -> Result<Elements<'a>, Fault> {
        let elements = self.elements(index, shapes, at)?;
        if elements.count != vertices {
            return Err(Problem::Illegal {
                found: format!("{} elements for {vertices} vertices", elements.count),
                expected: "as many as POSITION has",
            }
            .at_json(at));
        }
        Ok(elements)
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
        let largest = indices.iter().copied().max().unwrap_or(0);
        if u64::from(largest) >= vertices && !indices.is_empty() {
            let wrong = |&index: &u32| u64::from(index) >= vertices;
            let at_index = indices.iter().position(wrong).unwrap_or(0);
            return Err(Problem::IndexOutOfRange {
                at: at_index,
                index: indices[at_index],
                vertices,
            }
            .at_json(at));
        }
        Ok(indices)
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

/// How corners make triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Topology {
    Triangles,
    Strip,
    Fan,
}

impl Topology {
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

/// One mesh of several. Attributes that only some parts have are made up for the others: flat
/// normals, texture coordinates 0, white.
fn join(mut parts: Vec<Mesh>) -> Mesh {
    parts.retain(|part| !part.triangles.is_empty());
    if parts.iter().any(|part| !part.normals.is_empty()) {
        for part in parts.iter_mut().filter(|part| part.normals.is_empty()) {
            make_flat(part);
        }
    }
    let texcoords = parts.iter().any(|part| !part.texcoords.is_empty());
    let colors = parts.iter().any(|part| !part.colors.is_empty());
    for part in &mut parts {
        let vertices = part.positions.len();
        if texcoords {
            part.texcoords.resize(vertices, Vec2::ZERO);
        }
        if colors {
            part.colors.resize(vertices, [1.0; 3]);
        }
    }
    let mut parts = parts.into_iter();
    let Some(mut joined) = parts.next() else {
        return Mesh {
            materials: vec![(0, MaterialId(0))],
            ..Mesh::default()
        };
    };
    for part in parts {
        let first_vertex = joined.positions.len() as u32;
        let first_face = joined.triangles.len() as u32;
        joined.positions.extend(part.positions);
        joined.normals.extend(part.normals);
        joined.texcoords.extend(part.texcoords);
        joined.colors.extend(part.colors);
        let moved = |corners: [u32; 3]| corners.map(|corner| corner + first_vertex);
        joined
            .triangles
            .extend(part.triangles.into_iter().map(moved));
        if joined.materials.last().map(|range| range.1) != Some(part.materials[0].1) {
            joined.materials.push((first_face, part.materials[0].1));
        }
    }
    joined
}

/// Gives each face corners and normals of its own, as glTF asks for where normals are not given.
fn make_flat(mesh: &mut Mesh) {
    let old = std::mem::take(mesh);
    let corners = || {
        old.triangles
            .iter()
            .flatten()
            .map(|&corner| corner as usize)
    };
    mesh.positions = corners().map(|corner| old.positions[corner]).collect();
    if !old.texcoords.is_empty() {
        mesh.texcoords = corners().map(|corner| old.texcoords[corner]).collect();
    }
    if !old.colors.is_empty() {
        mesh.colors = corners().map(|corner| old.colors[corner]).collect();
    }
    for (face, &triangle) in old.triangles.iter().enumerate() {
        mesh.normals
            .extend([face_normal(&old, triangle).as_vec3(); 3]);
        let first = 3 * face as u32;
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh.materials = old.materials;
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

    #[test]
    fn parts_without_normals_become_flat_beside_parts_with_them() {
        let part = |normals: Vec<Vec3>, material| Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y],
            triangles: vec![[0, 1, 2], [1, 3, 2]],
            normals,
            materials: vec![(0, MaterialId(material))],
            ..Mesh::default()
        };
        let joined = join(vec![part(vec![Vec3::X; 4], 0), part(Vec::new(), 1)]);
        joined.check().expect("a sound mesh");
        assert_eq!(joined.positions.len(), 4 + 6);
        assert_eq!(joined.normals[4..], [Vec3::Z; 6]);
        assert_eq!(joined.materials, [(0, MaterialId(0)), (2, MaterialId(1))]);
    }
}
