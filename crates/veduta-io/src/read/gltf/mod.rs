//! glTF 2.0, as `.gltf` or `.glb`.
//!
//! Bytes -> [`container`] (the chunks of a GLB) -> [`document`] (the JSON) -> [`buffers`] (what
//! accessors point into) -> [`tree`] (which node stands where) -> [`mesh`] by way of [`accessor`],
//! and [`material`] -> scene. Every index and length is checked at its first use; indices in errors
//! are those of the JSON.
//!
//! Extensions: KHR_mesh_quantization, KHR_texture_transform, KHR_materials_unlit,
//! KHR_materials_emissive_strength, KHR_materials_pbrSpecularGlossiness (its colour). Skins, morph
//! targets and animations are not applied: the model stands as its nodes place it.

mod accessor;
mod buffers;
mod camera;
mod container;
mod document;
mod material;
mod mesh;
mod tree;

use super::budget::Budget;
use super::error::{Fault, Place, Problem, Warnings};
use super::names::unique;
use super::picture::PictureDecoder;
use buffers::{Buffers, Files};
use document::{Document, Index};
use material::MaterialReader;
use mesh::MeshReader;
use std::collections::HashMap;
use std::path::Path;
use tree::Tree;
use veduta::scene::{Mesh, MeshId, Object, Scene};

/// The first bytes of a GLB.
pub(crate) const MAGIC: &[u8] = b"glTF";

/// Extensions that are understood.
const UNDERSTOOD: &[&str] = &[
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Reads a scene in the file's own axes.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Scene, Fault> {
    let (json, bin) = if bytes.starts_with(MAGIC) || has_suffix(path, "glb") {
        let chunks = container::chunks(bytes)?;
        (chunks.json, chunks.bin)
    } else {
        (bytes, None)
    };
    let document = parse(json)?;
    check_version_and_extensions(&document, warnings)?;
    let mut files = Files::new(path.parent().unwrap_or(Path::new("")));
    let buffers = Buffers::fetch(&document, bin, &mut files, budget)?;
    let tree = Tree::grow(&document, budget)?;

    let mut scene = Scene::default();
    place_meshes(&document, &buffers, &tree, &mut scene, budget, warnings)?;
    place_cameras(&document, &tree, &mut scene, budget, warnings)?;
    read_materials(
        &document, &buffers, &mut files, &mut scene, budget, warnings,
    )?;
    Ok(scene)
}

fn has_suffix(path: &Path, suffix: &str) -> bool {
    path.extension()
        .is_some_and(|found| found.eq_ignore_ascii_case(suffix))
}

/// Parses the JSON; the error names the path of the value that is wrong.
fn parse(json: &[u8]) -> Result<Document, Fault> {
    // A byte order mark is not JSON, but some editors leave one.
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let mut deserializer = serde_json::Deserializer::from_slice(json);
    serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        let problem = Problem::Json(error.into_inner().to_string());
        match path.as_str() {
            "." => problem.at(Place::Whole),
            _ => problem.at_json(path),
        }
    })
}

/// The row of `table` that `index` refers to, with its place; `at` is who refers to it.
fn row<'a, T>(
    table: &'a [T],
    index: Index,
    what: &'static str,
    at: &str,
) -> Result<(usize, &'a T), Fault> {
    let place = usize::try_from(index).unwrap_or(usize::MAX);
    match table.get(place) {
        Some(row) => Ok((place, row)),
        None => {
            let count = table.len();
            Err(Problem::NoSuch { what, index, count }.at_json(at))
        }
    }
}

fn check_version_and_extensions(document: &Document, warnings: &mut Warnings) -> Result<(), Fault> {
    let asset = &document.asset;
    let needed = asset.min_version.as_deref();
    if !asset.version.starts_with("2.") || needed.is_some_and(|needed| needed != "2.0") {
        let found = format!("glTF {}", needed.unwrap_or(&asset.version).escape_debug());
        let expected = "glTF 2.0";
        return Err(Problem::Version { found, expected }.at_json("asset.version"));
    }
    let understood = |extension: &&String| UNDERSTOOD.contains(&extension.as_str());
    for (index, extension) in document.extensions_required.iter().enumerate() {
        if !understood(&extension) {
            let at = format!("extensionsRequired[{index}]");
            return Err(Problem::RequiredExtension(extension.clone()).at_json(at));
        }
    }
    for (index, extension) in document.extensions_used.iter().enumerate() {
        if !understood(&extension) {
            let message = format!("the extension {extension} is not supported and left out");
            warnings.add(Place::Json(format!("extensionsUsed[{index}]")), message);
        }
    }
    Ok(())
}

/// Reads the meshes that the tree shows, each once, and places them.
fn place_meshes(
    document: &Document,
    buffers: &Buffers<'_>,
    tree: &Tree,
    scene: &mut Scene,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<(), Fault> {
    // For each mesh that was read: its id, unless it has no faces.
    let mut read: Vec<Option<Option<MeshId>>> = vec![None; document.meshes.len()];
    for placed in &tree.placed {
        let node = &document.nodes[placed.node];
        let Some(mesh) = node.mesh else {
            continue;
        };
        let at = format!("nodes[{}]", placed.node);
        let (index, mesh) = row(&document.meshes, mesh, "mesh", &at)?;
        if node.skin.is_some() {
            let message = "skins are not supported; the mesh is shown unposed";
            warnings.add(Place::Json(at.clone()), message);
        }
        let id = match read[index] {
            Some(known) => known,
            None => {
                let mut reader = MeshReader {
                    document,
                    buffers,
                    budget,
                    warnings,
                };
                let mesh: Mesh = reader.read(index, mesh)?;
                let id = (!mesh.triangles.is_empty()).then(|| {
                    scene.meshes.push(mesh);
                    MeshId(scene.meshes.len() as u32 - 1)
                });
                *read[index].insert(id)
            }
        };
        if let Some(mesh) = id {
            let name = tree
                .path(placed.node, budget)
                .map_err(|problem| problem.at_json(at))?;
            scene.objects.push(Object {
                name,
                mesh,
                world_from_object: placed.world_from_node,
            });
        }
    }
    Ok(())
}

/// Places the cameras, named by themselves or their nodes.
fn place_cameras(
    document: &Document,
    tree: &Tree,
    scene: &mut Scene,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<(), Fault> {
    let mut names = HashMap::new();
    for placed in &tree.placed {
        let node = &document.nodes[placed.node];
        let Some(camera) = node.camera else {
            continue;
        };
        let at = format!("nodes[{}]", placed.node);
        let (index, camera) = row(&document.cameras, camera, "camera", &at)?;
        match camera::place(camera, &placed.world_from_node) {
            Ok(sound) => {
                let name = [camera.name.as_ref(), node.name.as_ref()]
                    .into_iter()
                    .flatten()
                    .find(|name| !name.is_empty());
                let charged = budget.charge(name.map_or(0, String::len) as u64, 2);
                charged.map_err(|problem| problem.at_json(at))?;
                let name = name.cloned().unwrap_or_else(|| format!("camera{index}"));
                scene.cameras.push((unique(name, &mut names), sound));
            }
            Err(message) => {
                let message = format!("{message}; the camera is left out");
                warnings.add(Place::Json(format!("cameras[{index}]")), message);
            }
        }
    }
    Ok(())
}

/// Reads all materials, and the pictures of those that the scene's meshes use.
fn read_materials(
    document: &Document,
    buffers: &Buffers<'_>,
    files: &mut Files,
    scene: &mut Scene,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<(), Fault> {
    let default = document.materials.len();
    let mut used = vec![false; default + 1];
    for (_, material) in scene.meshes.iter().flat_map(|mesh| &mesh.materials) {
        used[material.index()] = true;
    }
    let mut reader = MaterialReader {
        document,
        buffers,
        files,
        budget,
        warnings,
        decoder: PictureDecoder::new(),
        images: Vec::new(),
        decoded: vec![None; document.images.len()],
    };
    for (index, material) in document.materials.iter().enumerate() {
        let material = reader.read(index, material, used[index])?;
        scene.materials.push(material);
    }
    scene.images = reader.images;
    if used[default] {
        scene.materials.push(material::default_material());
    }
    Ok(())
}
