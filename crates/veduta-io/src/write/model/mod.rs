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
