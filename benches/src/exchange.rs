//! Scenes in a file that the programs in `benches/peers` read: the same triangles, camera and
//! colours for all.
//!
//! Little-endian, without padding:
//!
//! | bytes | what |
//! | --- | --- |
//! | 8 | `VPEERS1\n` |
//! | 3 x u32 | number of vertices; of triangles; 1 for a perspective, 0 for a parallel projection |
//! | u32 | 0 |
//! | 16 x f64 | `clip_from_eye`, by rows |
//! | 3 x f64 each vertex | eye space: x right, y down, z forward |
//! | 3 x u32 each triangle | corners, counterclockwise seen from the front |
//! | 3 x f32 each triangle | colour in linear light, the same all over the triangle and from any side |
//! | u8 each triangle | 1 if it is seen from behind as well |
//!
//! Clip space is OpenGL's, but for two choices. Its y points down, so that row 0 of a target is
//! the picture's top and counterclockwise faces come out clockwise. Its z runs from 0 at the
//! farthest to w at the nearest, which is what floating-point depth needs.

use crate::cases::Case;
use std::collections::HashMap;
use std::io::{self, Write};
use veduta::geometry::{DMat4, DVec3, DVec4};
use veduta::map::{Camera, MaterialId, ObjectId, Projection};
use veduta::scene::{Mesh, MeshId, Object, Scene};

const MAGIC: &[u8; 8] = b"VPEERS1\n";

/// A scene of flat-coloured triangles before a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Exchange {
    /// Whether the projection is a perspective.
    pub perspective: bool,
    /// From eye space to clip space.
    pub clip_from_eye: DMat4,
    /// Eye-space vertices.
    pub positions: Vec<DVec3>,
    /// The triangles' corners, indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// The triangles' colours.
    pub colors: Vec<[f32; 3]>,
    /// Whether triangles are seen from behind as well.
    pub double_sided: Vec<bool>,
}

impl Exchange {
    /// All triangles of a case, those out of view included. Equal vertices become one.
    ///
    /// # Panics
    /// If there are more than `u32::MAX` vertices.
    pub fn new(case: &Case) -> Self {
        let mut positions = Vec::new();
        let mut triangles = Vec::with_capacity(case.scene.face_count());
        let mut colors = Vec::with_capacity(case.scene.face_count());
        let mut double_sided = Vec::with_capacity(case.scene.face_count());
        let mut places: HashMap<[u64; 3], u32> = HashMap::new();
        for (index, object) in case.scene.objects.iter().enumerate() {
            let id = ObjectId::from_index(index);
            let mesh = case.scene.mesh_of(id);
            let eye_from_object = case.camera.eye_from_world * object.world_from_object;
            let rows: Vec<u32> = mesh
                .positions
                .iter()
                .map(|&position| {
                    let eye = eye_from_object.transform_point3(position);
                    *places
                        .entry(eye.to_array().map(f64::to_bits))
                        .or_insert_with(|| {
                            positions.push(eye);
                            u32::try_from(positions.len() - 1).expect("at most u32::MAX vertices")
                        })
                })
                .collect();
            for (face, &corners) in mesh.triangles.iter().enumerate() {
                triangles.push(corners.map(|corner| rows[corner as usize]));
                colors.push(mesh.colors[corners[0] as usize]);
                double_sided.push(case.scene.material_of(id, face as u32).double_sided);
            }
        }
        Self {
            perspective: matches!(case.camera.projection, Projection::Perspective { .. }),
            clip_from_eye: clip_from_eye(&case.camera, &positions),
            positions,
            triangles,
            colors,
            double_sided,
        }
    }

    /// Writes the file.
    ///
    /// # Errors
    /// When `out` cannot be written.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        out.write_all(MAGIC)?;
        let counts = [self.positions.len(), self.triangles.len()].map(|count| count as u32);
        for number in [counts[0], counts[1], u32::from(self.perspective), 0] {
            out.write_all(&number.to_le_bytes())?;
        }
        let by_rows = self.clip_from_eye.transpose().to_cols_array();
        let coordinates = self.positions.iter().flat_map(|p| p.to_array());
        for number in by_rows.into_iter().chain(coordinates) {
            out.write_all(&number.to_le_bytes())?;
        }
        for corner in self.triangles.iter().flatten() {
            out.write_all(&corner.to_le_bytes())?;
        }
        for channel in self.colors.iter().flatten() {
            out.write_all(&channel.to_le_bytes())?;
        }
        let flags: Vec<u8> = self.double_sided.iter().copied().map(u8::from).collect();
        out.write_all(&flags)
    }

    /// Reads what [`Exchange::write`] wrote.
    ///
    /// # Errors
    /// A sentence on what is wrong with `bytes`.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let mut rest = bytes;
        if rest.split_off(..8) != Some(MAGIC.as_slice()) {
            return Err("this is not an exported scene".to_owned());
        }
        let [vertices, triangles, perspective, _] = {
            let mut numbers = numbers(&mut rest, 4, u32::from_le_bytes)?;
            [(); 4].map(|()| numbers.next().unwrap_or_default())
        };
        let by_rows: Vec<f64> = numbers(&mut rest, 16, f64::from_le_bytes)?.collect();
        let (vertices, triangles) = (vertices as usize, triangles as usize);
        let positions = triples(numbers(&mut rest, 3 * vertices, f64::from_le_bytes)?);
        let corners = triples(numbers(&mut rest, 3 * triangles, u32::from_le_bytes)?);
        let colors = triples(numbers(&mut rest, 3 * triangles, f32::from_le_bytes)?);
        let flags = numbers(&mut rest, triangles, u8::from_le_bytes)?;
        Ok(Self {
            perspective: perspective != 0,
            clip_from_eye: DMat4::from_cols_slice(&by_rows).transpose(),
            positions: positions.into_iter().map(DVec3::from_array).collect(),
            triangles: corners,
            colors,
            double_sided: flags.map(|flag| flag != 0).collect(),
        })
    }

    /// The scene as Veduta knows it, in eye space: one object for the faces seen from the front and
    /// one for those seen from both sides.
    ///
    /// A mesh keeps colours by corner, so that no triangle shares one with its neighbour.
    pub fn scene(&self) -> Scene {
        let mut scene = Scene::default();
        for double_sided in [false, true] {
            let faces = || {
                let faces = self.triangles.iter().zip(&self.colors);
                faces
                    .zip(&self.double_sided)
                    .filter(move |(_, both)| **both == double_sided)
                    .map(|(face, _)| face)
            };
            let count = faces().count();
            if count == 0 {
                continue;
            }
            let mut mesh = Mesh {
                materials: vec![(0, MaterialId::from_index(scene.materials.len()))],
                ..Mesh::default()
            };
            mesh.positions.reserve_exact(3 * count);
            mesh.colors.reserve_exact(3 * count);
            for (corners, &color) in faces() {
                mesh.positions
                    .extend(corners.map(|corner| self.positions[corner as usize]));
                mesh.colors.extend([color; 3]);
            }
            mesh.triangles = (0..count as u32)
                .map(|face| [0, 1, 2].map(|corner| 3 * face + corner))
                .collect();
            let mesh_id = MeshId(scene.meshes.len() as u32);
            scene.materials.push(veduta::scene::Material {
                base_color: [1.0; 4],
                double_sided,
                unlit: true,
                ..Default::default()
            });
            scene.meshes.push(mesh);
            scene.objects.push(Object {
                name: format!("double-sided {double_sided}"),
                mesh: mesh_id,
                world_from_object: DMat4::IDENTITY,
            });
        }
        scene
    }
}

/// See the module's page.
fn clip_from_eye(camera: &Camera, positions: &[DVec3]) -> DMat4 {
    let scale = 2.0 * camera.image_scale();
    let ahead = 2.0 * camera.principal_point() - 1.0;
    let (z, w) = match camera.projection {
        Projection::Perspective { .. } => (DVec4::new(0.0, 0.0, 0.0, camera.near), DVec4::Z),
        Projection::Parallel { .. } => {
            let depths = || positions.iter().map(|position| position.z);
            let nearest = depths().fold(camera.near, f64::min) - 1.0;
            let farthest = depths().fold(camera.near, f64::max) + 1.0;
            let slope = 1.0 / (farthest - nearest);
            (DVec4::new(0.0, 0.0, -slope, farthest * slope), DVec4::W)
        }
    };
    let x = DVec4::new(scale.x, 0.0, 0.0, 0.0) + ahead.x * w;
    let y = DVec4::new(0.0, scale.y, 0.0, 0.0) + ahead.y * w;
    DMat4::from_cols(x, y, z, w).transpose()
}

/// Takes `count` numbers off `bytes`.
fn numbers<'a, const N: usize, T>(
    bytes: &mut &'a [u8],
    count: usize,
    from_bytes: fn([u8; N]) -> T,
) -> Result<impl Iterator<Item = T> + use<'a, N, T>, String> {
    let taken = count
        .checked_mul(N)
        .and_then(|length| bytes.split_off(..length));
    let (numbers, _) = taken.ok_or("the file ends too early")?.as_chunks();
    Ok(numbers.iter().map(move |&number| from_bytes(number)))
}

fn triples<T: Copy + Default>(mut numbers: impl Iterator<Item = T>) -> Vec<[T; 3]> {
    let mut triples = Vec::with_capacity(numbers.size_hint().0 / 3);
    while let Some(first) = numbers.next() {
        triples.push([
            first,
            numbers.next().unwrap_or_default(),
            numbers.next().unwrap_or_default(),
        ]);
    }
    triples
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta::geometry::DVec2;

    fn case(title: &str) -> Case {
        Case::parse(title).expect("a sound title")
    }

    #[test]
    fn what_was_written_is_read_again() {
        let scene = Exchange::new(&case("buildings"));
        let mut bytes = Vec::new();
        scene.write(&mut bytes).expect("memory takes all");
        assert_eq!(Exchange::read(&bytes), Ok(scene));
        assert!(Exchange::read(&bytes[..bytes.len() - 1]).is_err());
        assert!(Exchange::read(b"VPEERS2\n").is_err());
    }

    #[test]
    fn clip_space_is_the_image_plane_with_greater_depth_nearer() {
        for title in ["buildings", "radial", "mesh5"] {
            let case = case(title);
            let scene = Exchange::new(&case);
            for &eye in &scene.positions {
                let clip = scene.clip_from_eye * eye.extend(1.0);
                let image = DVec2::new(clip.x, clip.y) / clip.w * 0.5 + 0.5;
                let expected = case.camera.image_from_eye(eye);
                assert!((image - expected).length() < 1e-12, "{title}: {image}");
                let nearer = scene.clip_from_eye * (eye - 0.1 * DVec3::Z).extend(1.0);
                assert!(clip.z / clip.w < nearer.z / nearer.w, "{title}");
                assert!((0.0..=clip.w).contains(&clip.z), "{title}: {clip}");
            }
        }
    }

    #[test]
    fn equal_vertices_become_one_and_no_face_is_lost() {
        // 41 rings between the poles with 42 vertices each, and likewise 40 with 41; two poles each.
        let scene = Exchange::new(&case("pierce"));
        assert_eq!(scene.positions.len(), 41 * 42 + 2 + 40 * 41 + 2);
        assert_eq!(scene.triangles.len(), 6_724);
        assert_eq!(scene.scene().face_count(), 6_724);
    }
}
