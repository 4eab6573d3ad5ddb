//! Flat tables -> a mesh for each group.

use super::parse::{Corner, NONE, Parsed, Run};
use crate::read::finish::face_normal;
use veduta::map::MaterialId;
use veduta::scene::Mesh;
use veduta_geometry::{Vec2, Vec3};

/// Makes the meshes of groups. OBJ counts positions, texture coordinates and normals apart; a
/// vertex here is a combination of the three.
pub struct Assembler<'a> {
    parsed: &'a Parsed,
    /// For each position: the group that last used it, and its newest vertex there.
    newest: Vec<(u32, u32)>,
    /// For each vertex of the current group: its attributes, and the vertex made before it at the
    /// same position.
    vertices: Vec<Vertex>,
    group: u32,
}

struct Vertex {
    texcoord: u32,
    normal: u32,
    older: u32,
}

/// Older vertices of a position that are looked at before a new one is made. Real models have a few;
/// without a bound, a thousand combinations at one position would cost their square.
const MOST_OLDER: usize = 64;

impl<'a> Assembler<'a> {
    pub fn new(parsed: &'a Parsed) -> Self {
        Self {
            parsed,
            newest: vec![(NONE, NONE); parsed.positions.len()],
            vertices: Vec::new(),
            group: 0,
        }
    }

    /// The mesh of the triangles in `runs`, which belong to one group. `material_ids` has a row for
    /// each material of the file.
    pub fn mesh(&mut self, runs: &[(Run, usize)], material_ids: &[MaterialId]) -> Mesh {
        let parsed = self.parsed;
        let triangles = || {
            let of_run = |&(run, end): &(Run, usize)| &parsed.triangles[run.first..end];
            runs.iter().flat_map(of_run)
        };
        let has_texcoords = triangles().flatten().any(|corner| corner.texcoord != NONE);
        let has_normals = triangles().flatten().any(|corner| corner.normal != NONE);

        self.group += 1;
        self.vertices.clear();
        let mut mesh = Mesh::default();
        for &(run, end) in runs {
            let material = material_ids[run.material];
            if mesh
                .materials
                .last()
                .is_none_or(|&(_, last)| last != material)
            {
                mesh.materials.push((mesh.triangles.len() as u32, material));
            }
            for corners in &parsed.triangles[run.first..end] {
                let vertices = corners.map(|corner| {
                    // Faces without normals are flat: their vertices are their own.
                    let shared = !has_normals || corner.normal != NONE;
                    self.vertex(corner, shared, has_texcoords, has_normals, &mut mesh)
                });
                if has_normals && corners.iter().any(|corner| corner.normal == NONE) {
                    let normal = face_normal(&mesh, vertices).as_vec3();
                    for (vertex, corner) in vertices.iter().zip(corners) {
                        if corner.normal == NONE {
                            mesh.normals[*vertex as usize] = normal;
                        }
                    }
                }
                mesh.triangles.push(vertices);
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
        let newest = &mut self.newest[corner.position as usize];
        if newest.0 != self.group {
            *newest = (self.group, NONE);
        }
        if shared {
            let mut known = newest.1;
            for _ in 0..MOST_OLDER {
                if known == NONE {
                    break;
                }
                let vertex = &self.vertices[known as usize];
                if (vertex.texcoord, vertex.normal) == (corner.texcoord, corner.normal) {
                    return known;
                }
                known = vertex.older;
            }
        }
        let made = self.vertices.len() as u32;
        self.vertices.push(Vertex {
            texcoord: corner.texcoord,
            normal: corner.normal,
            older: newest.1,
        });
        if shared {
            newest.1 = made;
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
        made
    }
}
