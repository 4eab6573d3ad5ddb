//! Primitives -> one mesh.
//!
//! glTF 2.0, §3.7.2. Only the vertices that a primitive's faces use are kept: exporters like to
//! share one large table of vertices among many primitives.

use super::Fault;
use super::buffers::Buffers;
use super::document::{Document, MeshOfPrimitives};
use super::pose::Pose;
use crate::read::budget::Budget;
use crate::read::error::{Place, Warnings};
use crate::read::finish::{face_normal, finish_mesh};
use veduta::map::MaterialId;
use veduta::scene::Mesh;
use veduta_geometry::Vec2;

/// What reading a mesh needs besides the mesh.
pub struct MeshReader<'a> {
    pub document: &'a Document,
    pub buffers: &'a Buffers<'a>,
    pub budget: &'a mut Budget,
    pub warnings: &'a mut Warnings,
}

impl MeshReader<'_> {
    /// Reads a mesh in a pose; `index` is its row in the document. A mesh whose primitives are all
    /// points or lines has no triangles.
    ///
    /// The material of a primitive without one is the row after the document's last material.
    pub fn read(
        &mut self,
        index: usize,
        mesh: &MeshOfPrimitives,
        pose: &Pose<'_>,
    ) -> Result<Mesh, Fault> {
        let mut parts = Vec::with_capacity(mesh.primitives.len());
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let at = format!("meshes[{index}].primitives[{number}]");
            parts.extend(self.primitive(primitive, pose, &at)?);
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
}

/// One mesh of several. Attributes that only some parts have are made up for the others: flat
/// normals, texture coordinates 0, opaque white.
fn join(mut parts: Vec<Mesh>) -> Mesh {
    parts.retain(|part| !part.triangles.is_empty());
    if parts.iter().any(|part| !part.normals.is_empty()) {
        for part in parts.iter_mut().filter(|part| part.normals.is_empty()) {
            make_flat(part);
        }
    }
    let texcoords = parts.iter().any(|part| !part.texcoords.is_empty());
    let second_texcoords = parts.iter().any(|part| !part.second_texcoords.is_empty());
    let colors = parts.iter().any(|part| !part.colors.is_empty());
    let opacities = parts.iter().any(|part| !part.opacities.is_empty());
    for part in &mut parts {
        let vertices = part.positions.len();
        if texcoords {
            part.texcoords.resize(vertices, Vec2::ZERO);
        }
        if second_texcoords {
            part.second_texcoords.resize(vertices, Vec2::ZERO);
        }
        if colors {
            part.colors.resize(vertices, [1.0; 3]);
        }
        if opacities {
            part.opacities.resize(vertices, 1.0);
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
        joined.second_texcoords.extend(part.second_texcoords);
        joined.colors.extend(part.colors);
        joined.opacities.extend(part.opacities);
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
    fn spread<T: Copy>(rows: &[T], corners: impl Iterator<Item = usize>) -> Vec<T> {
        if rows.is_empty() {
            return Vec::new();
        }
        corners.map(|corner| rows[corner]).collect()
    }
    mesh.positions = spread(&old.positions, corners());
    mesh.texcoords = spread(&old.texcoords, corners());
    mesh.second_texcoords = spread(&old.second_texcoords, corners());
    mesh.colors = spread(&old.colors, corners());
    mesh.opacities = spread(&old.opacities, corners());
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
    use veduta_geometry::{DVec3, Vec3};

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
