//! Flat tables -> a mesh for each group.

use super::parse::{Corner, NONE, Parsed, Run};
use crate::read::finish::{face_normal, push_face};
use crate::read::vertices::Combinations;
use veduta::map::MaterialId;
use veduta::scene::Mesh;
use veduta_geometry::{Vec2, Vec3};

/// Makes the meshes of groups. OBJ counts positions, texture coordinates and normals apart; a
/// vertex here is a combination of the three.
pub struct Assembler<'a> {
    parsed: &'a Parsed,
    combinations: Combinations,
    /// The vertices of a face.
    face: Vec<u32>,
}

impl<'a> Assembler<'a> {
    pub fn new(parsed: &'a Parsed) -> Self {
        Self {
            parsed,
            combinations: Combinations::new(parsed.positions.len()),
            face: Vec::new(),
        }
    }

    /// The mesh of the faces in `runs`, which belong to one group. `material_ids` has a row for
    /// each material of the file.
    pub fn mesh(&mut self, runs: &[(Run, usize)], material_ids: &[MaterialId]) -> Mesh {
        let parsed = self.parsed;
        let corners = || {
            let of_run = |&(run, end): &(Run, usize)| run.first..end;
            let faces = runs.iter().flat_map(of_run);
            faces.flat_map(|face| parsed.faces.corners(face))
        };
        let has_texcoords = corners().any(|corner| corner.texcoord != NONE);
        let has_normals = corners().any(|corner| corner.normal != NONE);

        self.combinations.begin_mesh();
        let mut mesh = Mesh::default();
        for &(run, end) in runs {
            let material = material_ids[run.material];
            let is_other = |&(_, last): &(u32, MaterialId)| last != material;
            if run.first < end && mesh.materials.last().is_none_or(is_other) {
                mesh.materials.push((mesh.face_count() as u32, material));
            }
            for face in run.first..end {
                let corners = parsed.faces.corners(face);
                self.face.clear();
                for &corner in corners {
                    // Faces without normals are flat: their vertices are their own.
                    let shared = !has_normals || corner.normal != NONE;
                    let vertex = self.vertex(corner, shared, has_texcoords, has_normals, &mut mesh);
                    self.face.push(vertex);
                }
                if has_normals && corners.iter().any(|corner| corner.normal == NONE) {
                    let first = [self.face[0], self.face[1], self.face[2]];
                    let normal = face_normal(&mesh, first).as_vec3();
                    for (&vertex, corner) in self.face.iter().zip(corners) {
                        if corner.normal == NONE {
                            mesh.normals[vertex as usize] = normal;
                        }
                    }
                }
                push_face(&mut mesh, &self.face);
            }
        }
        mesh
    }

    /// The mesh's vertex for a corner: one that is there already, if it may be `shared`.
    fn vertex(
        &mut self,
        corner: Corner,
        shared: bool,
        has_texcoords: bool,
        has_normals: bool,
        mesh: &mut Mesh,
    ) -> u32 {
        let parsed = self.parsed;
        let (vertex, is_new) = if shared {
            let attributes = [corner.texcoord, corner.normal];
            self.combinations.shared(corner.position, attributes)
        } else {
            (self.combinations.own(), true)
        };
        if !is_new {
            return vertex;
        }
        mesh.positions
            .push(parsed.positions[corner.position as usize]);
        if has_texcoords {
            // OBJ has (0, 0) at the bottom left of the picture, the scene at its top left.
            let uv = parsed.texcoords.get(corner.texcoord as usize);
            let uv = uv.map_or(Vec2::ZERO, |uv| Vec2::new(uv.x, 1.0 - uv.y));
            mesh.texcoords.push(uv);
        }
        if has_normals {
            let normal = parsed.normals.get(corner.normal as usize);
            mesh.normals.push(normal.copied().unwrap_or(Vec3::ZERO));
        }
        if let Some(&color) = parsed.colors.get(corner.position as usize) {
            mesh.colors.push(color);
        }
        vertex
    }
}
