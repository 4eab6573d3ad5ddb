//! Wavefront OBJ, with its material libraries.
//!
//! Bytes -> [`mod@parse`] (flat tables, faces cut into convex ones by [`polygon`](super::polygon)) ->
//! [`smooth`] (normals of smoothing groups) -> [`assemble`] (a mesh for each group) and [`mtl`]
//! (materials) -> scene.
//!
//! Our own rather than the `tobj` crate, whose errors do not tell the line and which cuts every
//! polygon as if it were convex.
//!
//! Faces without normals are smooth within their smoothing group (`s`), and flat outside of one.
//! A polygon over which normals or colours change becomes triangles.

mod assemble;
mod mtl;
mod parse;
mod smooth;

use super::budget::Budget;
use super::error::{Fault, Place, Problem, Warnings};
use super::files::ReadFiles;
use super::finish::finish_mesh;
use assemble::Assembler;
use mtl::Library;
use parse::{Parsed, Run, parse};
use std::collections::HashSet;
use std::path::Path;
use veduta::map::MaterialId;
use veduta::scene::{Material, MeshId, Object, Scene};
use veduta_geometry::DMat4;

/// Reads a scene in the file's own axes.
pub(crate) fn read(
    path: &Path,
    bytes: &[u8],
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Scene, Fault> {
    let mut parsed = parse(bytes, budget, warnings)?;
    if parsed.positions.is_empty() && !bytes.is_empty() {
        return Err(Problem::Lacks("vertices; it may be no OBJ file").at(Place::Whole));
    }
    smooth::give_normals(&mut parsed);
    let mut scene = Scene::default();
    let material_ids = read_materials(path, &parsed, &mut scene, &mut budget.files, warnings);

    let mut runs_of_group: Vec<Vec<(Run, usize)>> = vec![Vec::new(); parsed.groups.len()];
    let ends = parsed.runs.iter().skip(1).map(|run| run.first);
    for (&run, end) in parsed.runs.iter().zip(ends.chain([parsed.faces.len()])) {
        runs_of_group[run.group].push((run, end));
    }
    let mut assembler = Assembler::new(&parsed);
    for (name, runs) in parsed.groups.iter().zip(&runs_of_group) {
        let mut mesh = assembler.mesh(runs, &material_ids);
        let name = match name.as_str() {
            "" => path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            name => name.to_owned(),
        };
        finish_mesh(&mut mesh, &name, &Place::Whole, warnings)?;
        scene.objects.push(Object {
            name,
            mesh: MeshId(scene.meshes.len() as u32),
            world_from_object: DMat4::IDENTITY,
        });
        scene.meshes.push(mesh);
    }
    Ok(scene)
}

/// Makes a material for each name in use. Those that no library knows are plain.
fn read_materials(
    path: &Path,
    parsed: &Parsed,
    scene: &mut Scene,
    files: &mut ReadFiles,
    warnings: &mut Warnings,
) -> Vec<MaterialId> {
    let mut library = Library::new(path.parent().unwrap_or(Path::new("")));
    let mut read = HashSet::new();
    for (line, names) in &parsed.libraries {
        // Some exporters name the library before each object.
        if read.insert(names) {
            library.add(names, *line, warnings);
        }
    }
    let mut used = vec![false; parsed.materials.len()];
    for run in &parsed.runs {
        used[run.material] = true;
    }
    let mut ids = vec![MaterialId(0); parsed.materials.len()];
    for (index, name) in parsed.materials.iter().enumerate() {
        if !used[index] {
            continue;
        }
        let material = library.material(name, warnings).unwrap_or_else(|| {
            if !name.is_empty() && !parsed.libraries.is_empty() {
                let message = format!("no library has the material {name:?}; it is shown plain");
                warnings.add(Place::Whole, message);
            }
            plain(name, parsed)
        });
        ids[index] = MaterialId::from_index(scene.materials.len());
        scene.materials.push(material);
    }
    if parsed.libraries.is_empty() && used.iter().skip(1).any(|&used| used) {
        let message = "names materials but no library of them; they are shown plain";
        warnings.add(Place::Whole, message);
    }
    files.append(library.files.finish());
    scene.images = library.images;
    ids
}

/// What stands in for an unknown material. Vertex colours are shown as they are.
fn plain(name: &str, parsed: &Parsed) -> Material {
    let mut material = Material {
        name: name.to_owned(),
        ..Material::default()
    };
    if !parsed.colors.is_empty() {
        material.base_color = [1.0; 4];
    }
    material
}
