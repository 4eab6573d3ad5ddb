//! `veduta check`: reads files and reports all that is wrong or odd with them.

mod topology;

use super::stored::Stored;
use super::{Reading, is_picture};
use crate::exit::{Ending, Failure};
use crate::talk::{Talk, counted, plain, print};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use topology::Topology;
use veduta::scene::Scene;
use veduta_io::{MapFileError, check_source, is_map, open_map, read_picture, read_scene};

/// Read models, stored maps and pictures, and report every error and warning
///
/// Of meshes it is told, as information, how many faces have no area, how many edges are open (of one
/// face only) or of more than two faces, and how many vertices no face uses. Corners at the same place
/// count as one vertex there.
///
/// Of a stored map every byte is compared with its checksum, and what it says with what maps must be;
/// with --sources also the files that it was made of with theirs.
///
/// Exit code 1 if a file cannot be read, or, with --strict, has warnings.
#[derive(Debug, Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Check {
    /// Models, scene files, stored maps and pictures
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Compare the files that a stored map was made of with what they were then
    #[arg(long)]
    sources: bool,
    /// Make every warning an error
    #[arg(long)]
    strict: bool,
}

const EXAMPLES: &str = "\
Examples:
  A model and a picture:
      veduta check town.obj sky.jpg
  A stored map, and whether its scene is still the same:
      veduta render town.obj -o checked.veduta
      veduta check --sources checked.veduta
  In a script, where warnings matter too:
      veduta check --strict --quiet town.obj && echo sound
";

/// What was found out of a file.
struct Report {
    file: PathBuf,
    errors: Vec<String>,
    warnings: Vec<String>,
    held: Option<Held>,
}

/// What a file holds.
enum Held {
    Picture {
        width: u32,
        height: u32,
    },
    Map {
        summary: String,
    },
    Model {
        summary: String,
        meshes: Vec<MeshReport>,
    },
}

struct MeshReport {
    /// The first object that it is part of, and how many there are.
    object: String,
    objects: usize,
    topology: Topology,
}

impl Check {
    pub fn run(&self, json: bool, talk: &mut Talk) -> Result<Ending, Failure> {
        let mut reports = Vec::new();
        for file in &self.files {
            talk.begin(format!("checking {}", plain(&file.to_string_lossy())));
            reports.push(self.check(file));
            talk.end();
        }
        let failed = reports
            .iter()
            .filter(|report| report.failed(self.strict))
            .count();
        if json {
            let files: Vec<Value> = reports
                .iter()
                .map(|report| report.as_json(self.strict))
                .collect();
            print(&format!(
                "{}\n",
                json!({ "failed": failed, "files": files })
            ))?;
        } else if !talk.is_quiet() || failed > 0 {
            let mut text: String = reports
                .iter()
                .filter(|report| !talk.is_quiet() || report.failed(self.strict))
                .map(|report| report.as_text(talk.is_quiet()))
                .collect();
            if reports.len() > 1 {
                let count = reports.len();
                writeln!(text, "{count} files, {failed} failed").expect("strings grow");
            }
            print(&text)?;
        }
        Ok(if failed > 0 {
            Ending::CheckFailed
        } else {
            Ending::Fine
        })
    }

    fn check(&self, file: &Path) -> Report {
        let mut report = Report {
            file: file.to_owned(),
            errors: Vec::new(),
            warnings: Vec::new(),
            held: None,
        };
        if is_map(file) {
            match self.check_map(file, &mut report.errors) {
                Ok(summary) => report.held = Some(Held::Map { summary }),
                Err(error) => report.errors.push(error.to_string()),
            }
            return report;
        }
        if is_picture(file) {
            match read_picture(file) {
                Ok(loaded) => {
                    report.warnings = loaded
                        .warnings
                        .iter()
                        .map(|warning| format!("{}: {warning}", file.display()))
                        .collect();
                    report.held = Some(Held::Picture {
                        width: loaded.picture.width,
                        height: loaded.picture.height,
                    });
                }
                Err(error) => report.errors.push(error.to_string()),
            }
            return report;
        }
        match read_scene(file, &self.reading.options()) {
            Ok(loaded) => {
                report.warnings = loaded.warnings.iter().map(ToString::to_string).collect();
                report.held = Some(model(&loaded.scene));
            }
            Err(error) => report.errors.extend(error.all().map(ToString::to_string)),
        }
        report
    }
}

impl Check {
    /// Checks a stored map; what it holds. Sources that have changed are added to `errors`.
    fn check_map(&self, file: &Path, errors: &mut Vec<String>) -> Result<String, MapFileError> {
        let mut map = open_map(file)?;
        let seen = Stored::check(&mut map)?;
        if self.sources {
            let checked = map.sources();
            let failed = checked
                .iter()
                .filter_map(|source| check_source(source).err());
            errors.extend(failed.map(|error| format!("{}: {error}", file.display())));
        }
        Ok(seen.summary())
    }
}

fn model(scene: &Scene) -> Held {
    let mut meshes: Vec<Option<MeshReport>> = scene.meshes.iter().map(|_| None).collect();
    for object in &scene.objects {
        let row = object.mesh.0 as usize;
        match &mut meshes[row] {
            Some(report) => report.objects += 1,
            none => {
                *none = Some(MeshReport {
                    object: object.name.clone(),
                    objects: 1,
                    topology: Topology::of(&scene.meshes[row]),
                });
            }
        }
    }
    let summary = format!(
        "{} in {}, {}",
        counted(scene.face_count(), "face"),
        counted(scene.objects.len(), "object"),
        counted(scene.materials.len(), "material")
    );
    Held::Model {
        summary,
        meshes: meshes.into_iter().flatten().collect(),
    }
}

/// Meshes that are listed for people.
const MOST_MESHES: usize = 20;

impl Report {
    fn failed(&self, strict: bool) -> bool {
        !self.errors.is_empty() || strict && !self.warnings.is_empty()
    }

    fn as_json(&self, strict: bool) -> Value {
        let mut told = json!({
            "file": self.file.to_string_lossy(),
            "failed": self.failed(strict),
            "errors": self.errors,
            "warnings": self.warnings,
        });
        match &self.held {
            None => {}
            Some(Held::Map { summary }) => told["map"] = summary.as_str().into(),
            Some(Held::Picture { width, height }) => told["size"] = json!([width, height]),
            Some(Held::Model { meshes, .. }) => {
                let rows = meshes.iter().map(|mesh| {
                    json!({
                        "object": mesh.object,
                        "objects": mesh.objects,
                        "faces": mesh.topology.faces,
                        "facesWithoutArea": mesh.topology.without_area,
                        "openEdges": mesh.topology.open_edges,
                        "crowdedEdges": mesh.topology.crowded_edges,
                        "unusedVertices": mesh.topology.unused_vertices,
                    })
                });
                told["meshes"] = rows.collect();
            }
        }
        told
    }

    /// `brief` leaves out what is mere information.
    fn as_text(&self, brief: bool) -> String {
        let mut text = String::new();
        self.write_text(brief, &mut text).expect("strings grow");
        text
    }

    fn write_text(&self, brief: bool, text: &mut String) -> std::fmt::Result {
        let file = plain(&self.file.to_string_lossy());
        // The messages begin with the file's name, and the place in it.
        for error in &self.errors {
            writeln!(text, "error: {}", plain(error))?;
        }
        match &self.held {
            None => {}
            Some(Held::Picture { width, height }) => {
                writeln!(text, "{file}: a picture of {width} x {height} pixels")?;
            }
            Some(Held::Map { summary } | Held::Model { summary, .. }) => {
                writeln!(text, "{file}: {summary}")?
            }
        }
        for warning in &self.warnings {
            writeln!(text, "  warning: {}", plain(warning))?;
        }
        if let (false, Some(Held::Model { meshes, .. })) = (brief, &self.held) {
            let odd = || meshes.iter().filter(|mesh| !mesh.topology.is_plain());
            for mesh in odd().take(MOST_MESHES) {
                let name = plain(&mesh.object);
                writeln!(text, "  {name}: {}", mesh.topology.as_text())?;
            }
            if odd().count() > MOST_MESHES {
                let rest = odd().count() - MOST_MESHES;
                writeln!(text, "  … and {rest} meshes more; --json tells all")?;
            }
        }
        Ok(())
    }
}
