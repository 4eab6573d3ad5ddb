//! What a model holds.

use super::{lights, tree};
use crate::talk::{grouped, plain};
use serde_json::{Value, json};
use std::fmt::Write;
use veduta::map::{Camera, Projection};
use veduta::scene::{AlphaMode, Bounds, Image, Material, Scene, Shown, TextureRef};

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
    let lights: Vec<_> = scene.lights.iter().map(lights::as_json).collect();
    let layers: Vec<_> = scene
        .layers
        .iter()
        .map(|layer| {
            let objects = layer.objects.len();
            json!({
                "name": layer.name,
                "priority": layer.priority,
                "shown": layer.shown,
                "objects": objects,
            })
        })
        .collect();
    let materials: Vec<_> = scene
        .materials
        .iter()
        .map(|material| {
            let name_of = |texture: Option<TextureRef>| Some(&image_of(scene, texture?).name);
            json!({
                "name": material.name,
                "color": material.base_color,
                "texture": name_of(material.base_color_texture),
                "emissive": material.emissive,
                "emissiveTexture": name_of(material.emissive_texture),
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

/// The picture that a texture lays on a surface.
fn image_of(scene: &Scene, texture: TextureRef) -> &Image {
    &scene.images[texture.image.0 as usize]
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
            let shown = match layer.shown {
                Shown::Seen => "",
                Shown::Matte => ", a matte",
                Shown::CasterOnly => ", only casts shadows",
                Shown::ShadowOnly => ", only catches shadows",
            };
            writeln!(
                text,
                "    {name}  priority {}, {objects} objects{shown}",
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
        let write_texture = |texture: Option<TextureRef>, text: &mut String| match texture {
            Some(texture) => {
                let image = image_of(scene, texture);
                let (name, width, height) = (plain(&image.name), image.width, image.height);
                write!(text, ", texture {name} ({width} x {height})")
            }
            None => Ok(()),
        };
        write_texture(material.base_color_texture, text)?;
        if material.emissive != [0.0; 3] {
            let [r, g, b] = material.emissive;
            write!(text, "; emits {r:.3} {g:.3} {b:.3}")?;
            write_texture(material.emissive_texture, text)?;
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
            lights::write(light, text)?;
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
