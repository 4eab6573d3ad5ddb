use super::{UpAxisArgument, load};
use crate::exit::Failure;
use crate::talk::{Talk, print};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;
use veduta::map::Projection;
use veduta::scene::{AlphaMode, Bounds, Material, Scene};

/// Tell what is inside a model
#[derive(Debug, Args)]
pub struct Info {
    /// The model: .glb, .gltf, .obj, or a scene file: .toml
    file: PathBuf,
    /// The axis of the file that points upwards; the format's habit by default
    #[arg(long, value_name = "AXIS")]
    up_axis: Option<UpAxisArgument>,
    /// Make every warning an error
    #[arg(long)]
    strict: bool,
}

impl Info {
    pub fn run(&self, json: bool, talk: &mut Talk) -> Result<(), Failure> {
        let scene = load(&self.file, self.up_axis, self.strict, talk)?.scene;
        if json {
            let mut told = as_json(&scene);
            told["file"] = self.file.to_string_lossy().into();
            told["warnings"] = talk.warnings().into();
            print(&format!("{told}\n"))
        } else {
            print(&format!("{}\n{}", self.file.display(), as_text(&scene)))
        }
    }
}

/// Faces of the object in row `index`.
fn faces(scene: &Scene, index: usize) -> usize {
    scene.meshes[scene.objects[index].mesh.0 as usize]
        .triangles
        .len()
}

fn as_json(scene: &Scene) -> Value {
    let objects: Vec<_> = scene
        .objects
        .iter()
        .enumerate()
        .map(|(index, object)| json!({ "name": object.name, "faces": faces(scene, index) }))
        .collect();
    let cameras: Vec<_> = scene
        .cameras
        .iter()
        .map(|(name, camera)| {
            let eye = camera.eye_from_world.inverse().w_axis.truncate().to_array();
            match camera.projection {
                Projection::Perspective {
                    tan_half_height, ..
                } => json!({
                    "name": name,
                    "eye": eye,
                    "fov": (2.0 * tan_half_height.atan()).to_degrees(),
                }),
                Projection::Parallel { height, .. } => {
                    json!({ "name": name, "eye": eye, "height": height })
                }
            }
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
    json!({
        "faces": scene.face_count(),
        "extent": extent.map(|b| json!({ "min": b.min.to_array(), "max": b.max.to_array() })),
        "objects": objects,
        "cameras": cameras,
        "materials": materials,
        "images": images,
    })
}

fn opacity(material: &Material) -> &'static str {
    match material.alpha_mode {
        AlphaMode::Opaque => "opaque",
        AlphaMode::Mask(_) => "mask",
        AlphaMode::Blend => "blend",
    }
}

fn as_text(scene: &Scene) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_text(scene, &mut text);
    text
}

fn write_text(scene: &Scene, text: &mut String) -> std::fmt::Result {
    writeln!(text, "  faces     {}", grouped(scene.face_count()))?;
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
    writeln!(text, "  objects   {}", scene.objects.len())?;
    for (index, object) in scene.objects.iter().enumerate() {
        writeln!(
            text,
            "    {}  {} faces",
            object.name,
            grouped(faces(scene, index))
        )?;
    }
    writeln!(text, "  materials {}", scene.materials.len())?;
    for material in &scene.materials {
        let [r, g, b, a] = material.base_color;
        let name = if material.name.is_empty() {
            "(without name)"
        } else {
            &material.name
        };
        write!(
            text,
            "    {name}  colour {r:.3} {g:.3} {b:.3} {a:.3}, {}",
            opacity(material)
        )?;
        if let Some(texture) = material.base_color_texture {
            let image = &scene.images[texture.image.0 as usize];
            write!(
                text,
                ", texture {} ({} x {})",
                image.name, image.width, image.height
            )?;
        }
        writeln!(text)?;
    }
    writeln!(text, "  cameras   {}", scene.cameras.len())?;
    for (name, camera) in &scene.cameras {
        match camera.projection {
            Projection::Perspective {
                tan_half_height, ..
            } => {
                let fov = (2.0 * tan_half_height.atan()).to_degrees();
                writeln!(text, "    {name}  perspective, fov {fov:.1}deg")?;
            }
            Projection::Parallel { height, .. } => {
                writeln!(text, "    {name}  parallel, height {height} m")?;
            }
        }
    }
    Ok(())
}

/// A number with its thousands set apart.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}
