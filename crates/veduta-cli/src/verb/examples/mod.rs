//! `veduta examples`: scenes of our own, to try things on.

mod river;

use super::{refuse_to_replace, render::Render};
use crate::Common;
use crate::exit::{Code, Failure};
use crate::talk::{Talk, grouped, print};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use veduta::scene::{Scene, generate};
use veduta_io::{closest_name, write_model};

/// List the example scenes, or write one as a model
///
/// They are our own making and may be used for anything. As .glb they bring their camera and are shown
/// in their own colours; .obj has neither cameras nor unlit colours, but keeps every digit of the
/// coordinates (.glb has single precision) and polygons of more than three corners.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Examples {
    /// The scene to write; without it all are listed
    name: Option<String>,
    /// The model to write, .glb or .obj; NAME.glb by default
    #[arg(short, long, value_name = "FILE", requires = "name")]
    output: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  What is there:
      veduta examples
  The scene of the pictures in the README, in the terminal:
      veduta examples river && veduta render river.glb --preview=blocks
  Wires thinner than a pixel, through the camera that they are made for:
      veduta examples mesh5
      veduta render mesh5.glb --camera view --size 512x512 -o mesh5.png
  With every digit of its coordinates:
      veduta examples pierce -o pierce.obj
";

/// The example with which to begin.
const RIVER: &str = "river";

/// All names, with what they are; first those to look at, then those to test with.
const SCENES: &[(&str, &str)] = &[
    (
        RIVER,
        "a suspension bridge over a river between a town and its suburb",
    ),
    (
        "bridge",
        "the suspension bridge of Tanaka & Takahashi 1991, hangers thinner than a pixel",
    ),
    ("buildings", "a small town of 151 triangles"),
    ("balls3", "three balls"),
    ("balls7", "seven balls"),
    ("pierce", "two balls that pierce each other"),
    ("radial", "80 thin triangles about a centre"),
    ("mesh0", "25 wires across 25, a twentieth of a pixel thick"),
    ("mesh5", "the same, turned by 5 degrees"),
    (
        "soup",
        "large random triangles that pierce one another everywhere",
    ),
    ("wires", "3,000 random wires, a twentieth of a pixel thick"),
    ("leaves20", "20,000 random leaves with gaps between them"),
    ("leaves100", "100,000 of them"),
    ("leaves400", "400,000 of them"),
    (
        "field100k",
        "a height field of 100,000 triangles at a grazing angle",
    ),
    ("field1m", "the same of a million"),
    ("field10m", "the same of ten million"),
    (
        "layers",
        "16 sheets of small triangles, each across the whole picture",
    ),
];

impl Examples {
    pub fn run(&self, common: &Common, talk: &mut Talk) -> Result<(), Failure> {
        let Some(name) = &self.name else {
            return list(common.json);
        };
        let output = match &self.output {
            Some(output) => output.clone(),
            None => PathBuf::from(format!("{name}.glb")),
        };
        if !SCENES.iter().any(|(known, _)| known == name) {
            let names = SCENES.iter().map(|&(name, _)| name);
            let meant = closest_name(name, names).map(|name| format!("did you mean {name:?}? "));
            let message = format!(
                "no example {name:?}; {}veduta examples lists them",
                meant.unwrap_or_default()
            );
            return Err(Failure::new(Code::Usage, message));
        }
        super::output::refuse_output_nowhere(&output)?;
        for file in files(&output) {
            refuse_to_replace(&file, common.force)?;
        }
        talk.begin("making");
        let Some((scene, size)) = scene(name) else {
            let message = format!("the example {name:?} is listed but cannot be made");
            return Err(Failure::new(Code::Internal, message));
        };
        talk.begin("writing");
        write_model(&output, &scene)?;
        talk.end();
        let faces = scene.face_count();
        if common.json {
            let told = json!({
                "output": output.to_string_lossy(),
                "faces": faces,
                "size": size,
            });
            return print(&format!("{told}\n"));
        }
        if talk.is_quiet() {
            return Ok(());
        }
        print(&format!(
            "{}: {} faces\nshow it:  {}\n",
            output.display(),
            grouped(faces),
            command(&output, &scene, size)
        ))
    }
}

fn list(json: bool) -> Result<(), Failure> {
    if json {
        let rows: Vec<_> = SCENES
            .iter()
            .map(|(name, what)| json!({ "name": name, "description": what }))
            .collect();
        return print(&format!("{}\n", json!(rows)));
    }
    let mut text = String::new();
    for (name, what) in SCENES {
        text += &format!("{name:10} {what}\n");
    }
    text += &format!("\nwrite one:  veduta examples {RIVER}\n");
    print(&text)
}

/// The scene, with its camera if it is made for one, and the size of the picture it is made for.
fn scene(name: &str) -> Option<(Scene, [u32; 2])> {
    if name == RIVER {
        return Some((river::scene(), Render::USUAL_SIZE));
    }
    let made = generate::by_name(name)?;
    let mut scene = made.scene;
    scene.cameras.push((CAMERA.to_owned(), made.camera));
    Some((scene, made.size))
}

/// The name of the generated scenes' cameras.
const CAMERA: &str = "view";

/// The files that a model is written to.
fn files(output: &Path) -> Vec<PathBuf> {
    let is_obj = output
        .extension()
        .is_some_and(|suffix| suffix.eq_ignore_ascii_case("obj"));
    let library = is_obj.then(|| output.with_extension("mtl"));
    [output.to_owned()].into_iter().chain(library).collect()
}

/// A command that shows the model.
fn command(output: &Path, scene: &Scene, [width, height]: [u32; 2]) -> String {
    let model = output.display();
    let picture = output.with_extension("png");
    let picture = picture.display();
    let mut command = format!("veduta render {model} -o {picture} --size {width}x{height}");
    // An .obj has its library beside it, and no cameras.
    let holds_camera = files(output).len() == 1;
    if holds_camera && !scene.cameras.is_empty() {
        command += &format!(" --camera {CAMERA}");
    }
    if !holds_camera && scene.materials.iter().all(|material| material.unlit) {
        command += " --unlit";
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_generated_scene_is_listed_and_every_listed_one_can_be_made() {
        for name in generate::NAMES {
            assert!(SCENES.iter().any(|(known, _)| known == name), "{name}");
        }
        assert_eq!(SCENES.len(), generate::NAMES.len() + 1);
    }

    #[test]
    fn the_river_is_sound() {
        let scene = river::scene();
        for mesh in &scene.meshes {
            mesh.check().expect("sound");
        }
        let mut names: Vec<_> = scene.objects.iter().map(|object| &object.name).collect();
        names.dedup();
        assert_eq!(names.len(), scene.objects.len(), "names are different");
    }
}
