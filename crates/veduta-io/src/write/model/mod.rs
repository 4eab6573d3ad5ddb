//! Scenes -> model files that other programs read.
//!
//! What is written: meshes with their places, names, normals, vertex colours and plain materials, and
//! cameras where the format has them. A scene with more (textures, lights) is refused by name rather
//! than written with less.

#[cfg(feature = "gltf")]
mod glb;
mod obj;

use super::partial_file::PartialFile;
use super::{WriteError, WriteProblem};
use std::io::Write;
use std::path::Path;
use veduta::scene::Scene;
use veduta_geometry::{DMat4, DVec4};

/// Suffixes of the files that [`write_model`] writes.
pub const MODEL_SUFFIXES: &[&str] = &[
    #[cfg(feature = "gltf")]
    "glb",
    "obj",
];

/// Writes a scene without textures and lights as `.glb` or `.obj`, with Y up as is usual there; old
/// files of that name are replaced.
///
/// - `.glb` (glTF 2.0): polygons become triangles; coordinates are f32, as the format has them.
/// - `.obj`, with its `.mtl` beside it: polygons stay whole and coordinates keep every digit. It has no
///   cameras, no unlit materials and no transforms; objects are written where they stand.
///
/// # Errors
/// When the suffix is another, the scene has what is not written, or a file cannot be written.
pub fn write_model(path: &Path, scene: &Scene) -> Result<(), WriteError> {
    let fail = |problem| WriteError {
        file: path.to_owned(),
        problem,
    };
    let suffix = path.extension().unwrap_or_default().to_ascii_lowercase();
    check(scene).map_err(fail)?;
    match suffix.to_str() {
        #[cfg(feature = "gltf")]
        Some("glb") => {
            let bytes = glb::encode(scene).map_err(fail)?;
            write_file(path, &bytes)
        }
        Some("obj") => {
            let library = path.with_extension("mtl");
            let name = library.file_name().unwrap_or_default().to_string_lossy();
            // The library first: who sees the model finds it.
            write_file(&library, obj::library(scene).as_bytes())?;
            write_file(path, obj::model(scene, &name).as_bytes())
        }
        _ => {
            let known: Vec<_> = MODEL_SUFFIXES.iter().map(|s| format!(".{s}")).collect();
            Err(fail(WriteProblem::UnknownModelSuffix(known.join(", "))))
        }
    }
}

/// Refuses what would be lost.
fn check(scene: &Scene) -> Result<(), WriteProblem> {
    let textured = scene.materials.iter().find(|material| {
        material.base_color_texture.is_some() || material.emissive_texture.is_some()
    });
    if let Some(material) = textured {
        let message = format!("the material {:?} has a texture", material.name);
        return Err(WriteProblem::Model(message));
    }
    if let Some(light) = scene.lights.first() {
        return Err(WriteProblem::Model(format!(
            "it has a light, {:?}",
            light.name
        )));
    }
    Ok(())
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let write = || {
        let mut file = PartialFile::create(path)?;
        file.write_all(bytes)?;
        file.finish()
    };
    write().map_err(|error| WriteError {
        file: path.to_owned(),
        problem: WriteProblem::Io(error),
    })
}

/// World axes (Z up, the front -Y) -> those of files with Y up: (x, y, z) -> (x, z, -y).
fn file_from_world() -> DMat4 {
    DMat4::from_cols(DVec4::X, -DVec4::Z, DVec4::Y, DVec4::W)
}

#[cfg(all(test, feature = "gltf", feature = "obj"))]
mod tests {
    use super::*;
    use crate::{ReadOptions, read_scene};
    use tempfile::TempDir;
    use veduta::map::{Camera, MaterialId, Projection};
    use veduta::scene::{ImageId, Light, LightKind, Material, Mesh, MeshId, Object, TextureRef};
    use veduta_geometry::{DVec2, DVec3, Vec3};

    /// A square and a triangle in two materials, placed twice, once mirrored; a camera.
    fn scene() -> Scene {
        let mut mesh = Mesh {
            positions: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 2.0]]
                .map(|[x, y]| DVec3::new(x, y, 0.25))
                .to_vec(),
            normals: vec![Vec3::Z; 5],
            colors: vec![[0.25, 0.5, 1.0]; 5],
            materials: vec![(0, MaterialId(0)), (1, MaterialId(1))],
            ..Mesh::default()
        };
        mesh.push_polygon(&[0, 1, 2, 3]);
        mesh.push_polygon(&[3, 2, 4]);
        let place = DMat4::from_translation(DVec3::new(3.0, 0.5, -1.0));
        let object = |name: &str, world_from_object| Object {
            name: name.into(),
            mesh: MeshId(0),
            world_from_object,
        };
        let lens = Projection::Perspective {
            tan_half_height: 0.5,
            aspect: 1.5,
        };
        let eye = DVec3::new(4.0, -5.0, 3.0);
        let camera = Camera::looking(eye, DVec3::ZERO, DVec3::Z, lens, 0.125);
        Scene {
            objects: vec![
                object("plain", DMat4::IDENTITY),
                object(
                    "mirrored",
                    place * DMat4::from_scale(DVec3::new(-1.0, 2.0, 1.0)),
                ),
            ],
            meshes: vec![mesh],
            materials: vec![
                Material {
                    name: "red".into(),
                    base_color: [0.75, 0.0, 0.0, 1.0],
                    double_sided: false,
                    ..Material::default()
                },
                Material {
                    name: "lamp".into(),
                    emissive: [0.5, 0.25, 0.0],
                    unlit: true,
                    ..Material::default()
                },
            ],
            cameras: vec![("view".into(), camera.expect("a sound camera"))],
            ..Scene::default()
        }
    }

    fn round_trip(name: &str) -> Scene {
        let folder = TempDir::new().expect("a folder for the test");
        let path = folder.path().join(name);
        write_model(&path, &scene()).expect("can be written");
        let loaded = read_scene(&path, &ReadOptions::default()).expect("can be read");
        assert_eq!(loaded.warnings, [], "{name}");
        loaded.scene
    }

    /// The corners of all triangles in world space, with unit normals of their faces and their
    /// materials' names.
    fn triangles(scene: &Scene) -> Vec<([DVec3; 3], String)> {
        let mut rows = Vec::new();
        for object in &scene.objects {
            let mesh = &scene.meshes[object.mesh.0 as usize];
            let mirrored = object.world_from_object.determinant() < 0.0;
            for (row, corners) in mesh.triangles.iter().enumerate() {
                let [a, b, c] = corners.map(|corner| {
                    let position = mesh.positions[corner as usize];
                    object.world_from_object.transform_point3(position)
                });
                let face = mesh.face_of_triangle(row as u32);
                let material = &scene.material(mesh.material_of(face)).name;
                // Wound as seen: a mirror turns the winding.
                let wound = if mirrored { [a, c, b] } else { [a, b, c] };
                rows.push((wound, material.clone()));
            }
        }
        rows
    }

    /// From the smallest corner on, so that the start of a fan does not matter.
    fn turned([a, b, c]: [DVec3; 3]) -> [[f64; 3]; 3] {
        let turns = [[a, b, c], [b, c, a], [c, a, b]].map(|t| t.map(|p| p.to_array()));
        let first = turns
            .into_iter()
            .min_by(|s, t| s.partial_cmp(t).expect("finite"));
        first.expect("three of them")
    }

    #[test]
    fn what_is_written_is_read_again() {
        for name in ["a.glb", "a.obj"] {
            let read = round_trip(name);
            let mut expected: Vec<_> = triangles(&scene())
                .into_iter()
                .map(|(corners, material)| (turned(corners), material))
                .collect();
            let mut found: Vec<_> = triangles(&read)
                .into_iter()
                .map(|(corners, material)| (turned(corners), material))
                .collect();
            // Which diagonal a square is cut by is free; all coordinates here are exact in f32.
            let is_red = |row: &([[f64; 3]; 3], String)| row.1.ends_with("red");
            assert_eq!(found.iter().filter(|row| is_red(row)).count(), 4, "{name}");
            expected.retain(|row| !is_red(row));
            found.retain(|row| !is_red(row));
            let places = |rows: &[([[f64; 3]; 3], String)]| -> Vec<_> {
                rows.iter().map(|row| row.0).collect()
            };
            assert_eq!(places(&found), places(&expected), "{name}");
            let color = read.meshes[0].colors[0];
            assert_eq!(color, [0.25, 0.5, 1.0], "{name}");
            let lamp = read.materials.iter().find(|m| m.name.ends_with("lamp"));
            assert_eq!(lamp.expect("is there").emissive, [0.5, 0.25, 0.0], "{name}");
        }
    }

    #[test]
    fn a_glb_keeps_cameras_sides_and_what_is_unlit() {
        let read = round_trip("a.glb");
        let material = |name: &str| read.materials.iter().find(|m| m.name == name);
        assert!(!material("red").expect("is there").double_sided);
        assert!(material("lamp").expect("is there").unlit);
        let (_, camera) = &read.cameras[0];
        let (_, expected) = &scene().cameras[0];
        for point in [DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)] {
            let [found, expected] =
                [camera, expected].map(|c| c.eye_from_world.transform_point3(point));
            assert!(
                (found - expected).length() < 1e-12,
                "{found} is not {expected}"
            );
        }
        // Measured by the length of the axes of its node, which are rounded.
        assert!((camera.near - 0.125).abs() < 1e-12);
    }

    #[test]
    fn what_would_be_lost_is_refused() {
        let folder = TempDir::new().expect("a folder for the test");
        let refuse = |name: &str, scene: &Scene, reason: &str| {
            let error = write_model(&folder.path().join(name), scene).expect_err(reason);
            assert!(error.to_string().contains(reason), "{error}");
        };
        let mut textured = scene();
        textured.materials[0].base_color_texture = Some(TextureRef::new(ImageId(0)));
        refuse("a.glb", &textured, "the material \"red\" has a texture");
        let mut lit = scene();
        lit.lights.push(Light {
            name: "lamp".into(),
            color: [1.0; 3],
            kind: LightKind::Directional { illuminance: 1.0 },
            world_from_light: DMat4::IDENTITY,
        });
        refuse("a.obj", &lit, "it has a light");
        let mut shifted = scene();
        shifted.cameras[0].1.shift = DVec2::new(0.25, 0.0);
        refuse("a.glb", &shifted, "is shifted");
        refuse("a.stl", &scene(), "models are written as .glb, .obj");
        let left = std::fs::read_dir(folder.path()).expect("the test's folder");
        assert_eq!(left.count(), 0);
    }
}
