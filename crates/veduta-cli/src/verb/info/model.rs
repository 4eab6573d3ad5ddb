//! What a model holds.

use super::tree;
use crate::talk::{grouped, plain};
use serde_json::{Value, json};
use std::fmt::Write;
use veduta::map::{Camera, Projection};
use veduta::scene::{AlphaMode, Bounds, LightKind, Material, Scene};

pub fn as_json(scene: &Scene) -> Value {
    let objects: Vec<_> = scene
        .objects
        .iter()
        .enumerate()
        .map(|(index, object)| json!({ "name": object.name, "faces": tree::faces(scene, index) }))
        .collect();
    let cameras: Vec<_> = scene
        .cameras
        .iter()
        .map(|(name, camera)| camera_as_json(name, camera))
        .collect();
    let lights: Vec<_> = scene
        .lights
        .iter()
        .map(|light| json!({ "name": light.name, "kind": kind_of_light(light.kind) }))
        .collect();
    let layers: Vec<_> = scene
        .layers
        .iter()
        .map(|layer| {
            let objects = layer.objects.len();
            json!({ "name": layer.name, "priority": layer.priority, "objects": objects })
        })
        .collect();
    let materials: Vec<_> = scene
        .materials
        .iter()
        .map(|material| {
            let image = material
                .base_color_texture
                .map(|t| &scene.images[t.image.0 as usize]);
            json!({
                "name": material.name,
                "color": material.base_color,
                "texture": image.map(|image| &image.name),
                "opacity": opacity(material),
                "doubleSided": material.double_sided,
                "unlit": material.unlit,
            })
        })
        .collect();
    let images: Vec<_> = scene
        .images
        .iter()
        .map(|image| json!({ "name": image.name, "size": [image.width, image.height] }))
        .collect();
    let extent = Bounds::of_scene(scene);
    let world = &scene.world;
    json!({
        "faces": scene.face_count(),
        "triangles": total(scene, |mesh| mesh.triangles.len()),
        "vertices": total(scene, |mesh| mesh.positions.len()),
        "meshes": scene.meshes.len(),
        "extent": extent.map(|b| json!({ "min": b.min.to_array(), "max": b.max.to_array() })),
        "crs": world.crs,
        "origin": world.crs.is_some().then(|| world.origin.to_array()),
        "objects": objects,
        "layers": layers,
        "cameras": cameras,
        "lights": lights,
        "materials": materials,
        "images": images,
    })
}

pub fn camera_as_json(name: &str, camera: &Camera) -> Value {
    let mut told = json!({
        "name": name,
        "eye": camera.eye_from_world.inverse().w_axis.truncate().to_array(),
        "shift": camera.shift.to_array(),
    });
    match camera.projection {
        Projection::Perspective {
            tan_half_height, ..
        } => told["fov"] = fov(tan_half_height).into(),
        Projection::Parallel { height, .. } => told["height"] = height.into(),
    }
    told
}

/// Vertical field of view in degrees.
fn fov(tan_half_height: f64) -> f64 {
    (2.0 * tan_half_height.atan()).to_degrees()
}

/// A count over all objects: of a mesh that is placed twice, twice.
fn total(scene: &Scene, count: impl Fn(&veduta::scene::Mesh) -> usize) -> usize {
    let objects = scene.objects.iter();
    objects
        .map(|object| count(&scene.meshes[object.mesh.0 as usize]))
        .sum()
}

fn opacity(material: &Material) -> &'static str {
    match material.alpha_mode {
        AlphaMode::Opaque => "opaque",
        AlphaMode::Mask(_) => "mask",
        AlphaMode::Blend => "blend",
    }
}

fn kind_of_light(kind: LightKind) -> &'static str {
    match kind {
        LightKind::Directional { .. } => "directional",
        LightKind::Point { .. } => "point",
        LightKind::Spot { .. } => "spot",
    }
}

pub fn as_text(scene: &Scene, all: bool) -> String {
    let mut text = String::new();
    write_text(scene, all, &mut text).expect("strings grow");
    text
}

fn write_text(scene: &Scene, all: bool, text: &mut String) -> std::fmt::Result {
    writeln!(
        text,
        "  faces     {} ({} triangles, {} vertices)",
        grouped(scene.face_count()),
        grouped(total(scene, |mesh| mesh.triangles.len())),
        grouped(total(scene, |mesh| mesh.positions.len())),
    )?;
    if let Some(bounds) = Bounds::of_scene(scene) {
        let size = bounds.max - bounds.min;
        writeln!(
            text,
            "  size      {:.6} x {:.6} x {:.6} m",
            size.x, size.y, size.z
        )?;
        for (axis, name) in ["x", "y (front is -)", "z (up)"].into_iter().enumerate() {
            let (low, high) = (bounds.min[axis], bounds.max[axis]);
            writeln!(text, "    {name:14} {low:.6} to {high:.6}")?;
        }
    }
    if let Some(crs) = &scene.world.crs {
        let origin = scene.world.origin;
        writeln!(
            text,
            "  world     {}, its origin at {}, {}, {}",
            plain(crs),
            origin.x,
            origin.y,
            origin.z
        )?;
    }
    if !scene.layers.is_empty() {
        writeln!(text, "  layers    {}", scene.layers.len())?;
        for layer in &scene.layers {
            let (name, objects) = (plain(&layer.name), layer.objects.len());
            writeln!(
                text,
                "    {name}  priority {}, {objects} objects",
                layer.priority
            )?;
        }
    }
    writeln!(text, "  objects   {}", grouped(scene.objects.len()))?;
    tree::write(scene, all, text);
    writeln!(text, "  materials {}", scene.materials.len())?;
    for material in &scene.materials {
        let [r, g, b, a] = material.base_color;
        let name = if material.name.is_empty() {
            "(without name)".into()
        } else {
            plain(&material.name)
        };
        write!(
            text,
            "    {name}  colour {r:.3} {g:.3} {b:.3} {a:.3}, {}",
            opacity(material)
        )?;
        if let Some(texture) = material.base_color_texture {
            let image = &scene.images[texture.image.0 as usize];
            let name = plain(&image.name);
            write!(
                text,
                ", texture {name} ({} x {})",
                image.width, image.height
            )?;
        }
        writeln!(text)?;
    }
    if !scene.images.is_empty() {
        writeln!(text, "  textures  {}", scene.images.len())?;
        for image in &scene.images {
            let name = plain(&image.name);
            writeln!(text, "    {name}  {} x {}", image.width, image.height)?;
        }
    }
    if !scene.lights.is_empty() {
        writeln!(text, "  lights    {}", scene.lights.len())?;
        for light in &scene.lights {
            writeln!(
                text,
                "    {}  {}",
                plain(&light.name),
                kind_of_light(light.kind)
            )?;
        }
    }
    writeln!(text, "  cameras   {}", scene.cameras.len())?;
    for (name, camera) in &scene.cameras {
        let name = plain(name);
        match camera.projection {
            Projection::Perspective {
                tan_half_height, ..
            } => {
                let fov = fov(tan_half_height);
                writeln!(text, "    {name}  perspective, fov {fov:.1}deg")?;
            }
            Projection::Parallel { height, .. } => {
                writeln!(text, "    {name}  parallel, height {height} m")?;
            }
        }
    }
    Ok(())
}
