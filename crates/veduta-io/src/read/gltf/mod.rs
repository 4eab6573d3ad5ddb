//! glTF 2.0, as `.gltf` or `.glb`.
//!
//! Bytes -> [`container`] (the chunks of a GLB) -> [`document`] (the JSON) -> [`buffers`] (what
//! accessors point into) -> [`animation`] (how nodes stand at a time) -> [`tree`] (which node stands
//! where) -> [`mesh`] by way of [`accessor`], and [`material`] -> scene. Every index and length is checked at its first use; indices in errors
//! are those of the JSON.
//!
//! Extensions: those of [`UNDERSTOOD`]. Of KHR_materials_pbrSpecularGlossiness the colour is read. A
//! file that requires another one is refused; one that merely uses another is read without it, with a
//! warning.
//!
//! A mesh is read once for each [`pose`] in which it stands: its morph targets have the shares that the
//! animation or the file gives them, its joints stand where the node tree puts them.
//! Lights ([`light`]) are read; pictures do not show them yet.

mod accessor;
mod animation;
mod buffers;
mod camera;
mod container;
mod document;
#[cfg(feature = "draco")]
mod draco;
#[cfg(not(feature = "draco"))]
#[path = "no_draco.rs"]
mod draco;
mod instances;
mod light;
mod material;
mod mesh;
#[cfg(feature = "meshopt")]
mod meshopt;
mod pose;
mod primitive;
mod tree;

use super::budget::Budget;
use super::error::{Fault, Place, Problem, Warnings};
use super::files::shortened;
use super::moment::Animation;
use super::names::unique;
use super::picture::PictureDecoder;
use animation::Posed;
use buffers::{Buffers, Files};
use document::{Document, Index};
use material::MaterialReader;
use mesh::MeshReader;
use pose::{Pose, Skin};
use std::collections::HashMap;
use std::path::Path;
use tree::{Placed, Tree};
use veduta::scene::{Light, MeshId, Object, Scene};
use veduta_geometry::DMat4;

pub(crate) use animation::Played;

/// The first bytes of a GLB.
pub(crate) const MAGIC: &[u8] = b"glTF";

/// Extensions that are understood.
const UNDERSTOOD: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    #[cfg(feature = "meshopt")]
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    #[cfg(feature = "draco")]
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    #[cfg(feature = "meshopt")]
    "KHR_meshopt_compression",
    "KHR_texture_transform",
];

/// Extensions that change nothing where they are not required, since the file then holds the same in
/// a form that is read; and what to do where they are.
const REPLACEABLE: &[(&str, &str)] = &[
    (
        "KHR_texture_basisu",
        "export the model with textures in PNG, JPEG or WebP",
    ),
    #[cfg(not(feature = "draco"))]
    (
        "KHR_draco_mesh_compression",
        "export the model uncompressed, or build Veduta with its feature `draco`",
    ),
    #[cfg(not(feature = "meshopt"))]
    (
        "EXT_meshopt_compression",
        "export the model uncompressed, or build Veduta with its feature `meshopt`",
    ),
    #[cfg(not(feature = "meshopt"))]
    (
        "KHR_meshopt_compression",
        "export the model uncompressed, or build Veduta with its feature `meshopt`",
    ),
];

/// Reads a scene in the file's own axes, as it stands while an animation is played, or at rest. Tells
/// of all `animations`.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    played: Option<Played<'_>>,
    animations: &mut Vec<Animation>,
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
    *animations = animation::all(&document, &buffers, budget, warnings)?;
    let posed = animation::pose(&document, &buffers, animations, played, budget, warnings)?;
    let tree = Tree::grow(&document, &posed, budget)?;

    let mut scene = Scene::default();
    place_meshes(
        &document, &buffers, &posed, &tree, &mut scene, budget, warnings,
    )?;
    place_cameras(&document, &tree, &mut scene, budget, warnings)?;
    place_lights(&document, &tree, &mut scene, budget, warnings)?;
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
            let replaceable = REPLACEABLE.iter().find(|row| row.0 == extension);
            let mend = replaceable.map_or("export the model without it", |row| row.1);
            let name = shortened(extension);
            return Err(Problem::RequiredExtension { name, mend }.at_json(at));
        }
    }
    for (index, extension) in document.extensions_used.iter().enumerate() {
        let replaceable = REPLACEABLE.iter().any(|row| row.0 == extension);
        if !understood(&extension) && !replaceable {
            let extension = shortened(extension);
            let message = format!("the extension {extension} is not supported and left out");
            warnings.add(Place::Json(format!("extensionsUsed[{index}]")), message);
        }
    }
    Ok(())
}

/// Reads the meshes that the tree shows, each once for each pose, and places them.
fn place_meshes(
    document: &Document,
    buffers: &Buffers<'_>,
    posed: &Posed,
    tree: &Tree,
    scene: &mut Scene,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<(), Fault> {
    let mut poses = Poses {
        posed,
        skins: document.skins.iter().map(|_| None).collect(),
        read: HashMap::new(),
    };
    for placed in &tree.placed {
        let at = format!("nodes[{}]", placed.node);
        let mut reader = MeshReader {
            document,
            buffers,
            budget,
            warnings,
        };
        let Some(mesh) = poses.mesh_of(placed, tree, &mut reader, scene, &at)? else {
            continue;
        };
        let name = tree.path(placed.node, budget);
        let name = name.map_err(|problem| problem.at_json(&at))?;
        let node = &document.nodes[placed.node];
        let Some(instances) = &node.extensions.instances else {
            scene.objects.push(Object {
                name,
                mesh,
                world_from_object: match node.skin {
                    None => placed.world_from_node,
                    // Joints have put the mesh into the world.
                    Some(_) => DMat4::IDENTITY,
                },
            });
            continue;
        };
        if node.skin.is_some() {
            let problem = Problem::Illegal {
                found: "a node with instances and a skin".into(),
                expected: "one or the other",
            };
            return Err(problem.at_json(at));
        }
        let places = instances::places(document, buffers, instances, budget, name.len(), &at)?;
        let mut labels = tree.children_of(document, placed.node);
        for (index, node_from_instance) in places.into_iter().enumerate() {
            let label = unique(format!("instance{index}"), &mut labels);
            scene.objects.push(Object {
                name: format!("{name}/{label}"),
                mesh,
                world_from_object: placed.world_from_node * node_from_instance,
            });
        }
    }
    Ok(())
}

/// The meshes read so far, by pose.
struct Poses<'a> {
    posed: &'a Posed,
    /// For each skin of the document, once it was asked for.
    skins: Vec<Option<Skin>>,
    /// The mesh's id, unless it has no faces.
    read: HashMap<PoseKey, Option<MeshId>>,
}

/// What makes one posed mesh differ from another.
#[derive(PartialEq, Eq, Hash)]
struct PoseKey {
    mesh: usize,
    skin: Option<Index>,
    /// Bits of the node's shares of morph targets, if it has its own.
    weights: Option<Vec<u32>>,
}

impl Poses<'_> {
    /// The mesh that a node shows, if it shows one; read if it was not yet. `at` is the node's path.
    fn mesh_of(
        &mut self,
        placed: &Placed,
        tree: &Tree,
        reader: &mut MeshReader<'_>,
        scene: &mut Scene,
        at: &str,
    ) -> Result<Option<MeshId>, Fault> {
        let document = reader.document;
        let node = &document.nodes[placed.node];
        let Some(mesh) = node.mesh else {
            return Ok(None);
        };
        let (index, mesh) = row(&document.meshes, mesh, "mesh", at)?;
        let moved = self.posed.node(placed.node);
        let weights = moved.and_then(|moved| moved.weights.as_ref());
        let weights = weights.or(node.weights.as_ref());
        let bits = |weights: &Vec<f32>| weights.iter().map(|weight| weight.to_bits()).collect();
        let key = PoseKey {
            mesh: index,
            skin: node.skin,
            weights: weights.map(bits),
        };
        if let Some(&known) = self.read.get(&key) {
            return Ok(known);
        }
        let mut pose = Pose {
            weights: weights.unwrap_or(&mesh.weights),
            skin: None,
        };
        if let Some(skin) = node.skin {
            let (index, _) = row(&document.skins, skin, "skin", at)?;
            let slot = &mut self.skins[index];
            let skin = match slot.take() {
                Some(skin) => skin,
                None => Skin::read(document, reader.buffers, tree, index, reader.budget)?,
            };
            pose.skin = Some(slot.insert(skin));
        }
        let mesh = reader.read(index, mesh, &pose)?;
        let id = (!mesh.triangles.is_empty()).then(|| {
            scene.meshes.push(mesh);
            MeshId(scene.meshes.len() as u32 - 1)
        });
        self.read.insert(key, id);
        Ok(id)
    }
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
                let name = own_name([&camera.name, &node.name], budget);
                let name = name.map_err(|problem| problem.at_json(at))?;
                let name = name.unwrap_or_else(|| format!("camera{index}"));
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

/// Places the lights, named by themselves or their nodes.
fn place_lights(
    document: &Document,
    tree: &Tree,
    scene: &mut Scene,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<(), Fault> {
    let lights = document.extensions.lights.as_ref();
    let lights = lights.map_or(&[][..], |extension| &extension.lights);
    let mut names = HashMap::new();
    for placed in &tree.placed {
        let node = &document.nodes[placed.node];
        let Some(light) = &node.extensions.light else {
            continue;
        };
        let at = format!("nodes[{}]", placed.node);
        let (index, light) = row(lights, light.light, "light", &at)?;
        match light::place(light, &placed.world_from_node) {
            Ok((kind, world_from_light)) => {
                let name = own_name([&light.name, &node.name], budget);
                let name = name.map_err(|problem| problem.at_json(at))?;
                let name = name.unwrap_or_else(|| format!("light{index}"));
                scene.lights.push(Light {
                    name: unique(name, &mut names),
                    color: light.color,
                    kind,
                    world_from_light,
                });
            }
            Err(message) => {
                let place = format!("extensions.KHR_lights_punctual.lights[{index}]");
                let message = format!("{message}; the light is left out");
                warnings.add(Place::Json(place), message);
            }
        }
    }
    if !scene.lights.is_empty() {
        let count = scene.lights.len();
        let are = if count == 1 { "light is" } else { "lights are" };
        let message = format!("{count} {are} read, but pictures do not show what they light yet");
        let place = Place::Json("extensions.KHR_lights_punctual".into());
        warnings.add(place, message);
    }
    Ok(())
}

/// The first name that is not empty. Long names that many nodes repeat are charged to the budget.
fn own_name(names: [&Option<String>; 2], budget: &mut Budget) -> Result<Option<String>, Problem> {
    let mut names = names.into_iter().flatten();
    let name = names.find(|name| !name.is_empty());
    budget.charge(name.map_or(0, String::len) as u64, 2)?;
    Ok(name.cloned())
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
