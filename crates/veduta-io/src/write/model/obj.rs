use super::file_from_world;
use std::fmt::Write;
use veduta::map::MaterialId;
use veduta::scene::{AlphaMode, Mesh, Object, Scene};
use veduta_geometry::{DVec3, Vec3};

/// The OBJ file, which names `library` as its materials'.
pub fn model(scene: &Scene, library: &str) -> String {
    let mut text = format!("# Written by veduta. Y up, metres.\nmtllib {library}\n");
    let mut first_vertex = 1;
    let mut first_normal = 1;
    for object in &scene.objects {
        let mesh = &scene.meshes[object.mesh.0 as usize];
        write_object(&mut text, scene, object, mesh, [first_vertex, first_normal]);
        first_vertex += mesh.positions.len();
        first_normal += mesh.normals.len();
    }
    text
}

/// Appends an object; its vertices and normals count from `first`.
fn write_object(
    text: &mut String,
    scene: &Scene,
    object: &Object,
    mesh: &Mesh,
    [first_vertex, first_normal]: [usize; 2],
) {
    let file_from_object = file_from_world() * object.world_from_object;
    line(text, format_args!("o {}", one_line(&object.name)));
    for (index, &position) in mesh.positions.iter().enumerate() {
        // Adding 0 leaves no "-0".
        let DVec3 { x, y, z } = file_from_object.transform_point3(position) + DVec3::ZERO;
        match mesh.colors.get(index) {
            Some([r, g, b]) => line(text, format_args!("v {x} {y} {z} {r} {g} {b}")),
            None => line(text, format_args!("v {x} {y} {z}")),
        }
    }
    let normals = file_from_object.inverse().transpose();
    for &normal in &mesh.normals {
        let turned = normals.transform_vector3(normal.as_dvec3());
        let Vec3 { x, y, z } = turned.normalize_or_zero().as_vec3() + Vec3::ZERO;
        line(text, format_args!("vn {x} {y} {z}"));
    }
    // A mirror turns the winding, which tells the front.
    let mirrored = file_from_object.determinant() < 0.0;
    let mut material = None;
    for face in 0..mesh.face_count() as u32 {
        let id = mesh.material_of(face);
        if material != Some(id) {
            line(text, format_args!("usemtl {}", name_of(scene, id)));
            material = Some(id);
        }
        let mut corners: Vec<u32> = mesh.corners_of(face).collect();
        if mirrored {
            corners.reverse();
        }
        text.push('f');
        for corner in corners {
            let vertex = first_vertex + corner as usize;
            let written = if mesh.normals.is_empty() {
                write!(text, " {vertex}")
            } else {
                write!(text, " {vertex}//{}", first_normal + corner as usize)
            };
            written.expect("strings grow");
        }
        text.push('\n');
    }
}

/// The MTL file. Colours are linear, as this program reads them.
pub fn library(scene: &Scene) -> String {
    let mut text = "# Written by veduta. Colours are linear.\n".to_owned();
    for (index, material) in scene.materials.iter().enumerate() {
        let [r, g, b, opacity] = material.base_color;
        line(
            &mut text,
            format_args!("newmtl {}", name_of(scene, MaterialId::from_index(index))),
        );
        line(&mut text, format_args!("Kd {r} {g} {b}"));
        let [r, g, b] = material.emissive;
        if material.emissive != [0.0; 3] {
            line(&mut text, format_args!("Ke {r} {g} {b}"));
        }
        if material.alpha_mode != AlphaMode::Opaque {
            line(&mut text, format_args!("d {opacity}"));
        }
    }
    text
}

/// A name that no other material has.
fn name_of(scene: &Scene, id: MaterialId) -> String {
    let name = one_line(&scene.material(id).name);
    let same = scene
        .materials
        .iter()
        .filter(|material| one_line(&material.name) == name);
    match (name.is_empty(), same.count()) {
        (false, 1) => name,
        _ => format!("{name}_{}", id.0),
    }
}

/// The format's names end with their line.
fn one_line(name: &str) -> String {
    name.replace(|c: char| c.is_control(), " ")
        .trim()
        .to_owned()
}

fn line(text: &mut String, what: std::fmt::Arguments<'_>) {
    text.write_fmt(what).expect("strings grow");
    text.push('\n');
}
