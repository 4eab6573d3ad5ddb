//! What the verbs that work with stored maps share.

use super::refuse_to_replace;
use crate::exit::{Code, Failure};
use crate::talk::Talk;
use clap::Args;
use serde_json::Value;
use std::path::{Path, PathBuf};
use veduta::map::SeenScene;
use veduta::scene::Scene;
use veduta_io::{OpenMap, change_scene, is_map, open_map, set_in_scene};

/// Opens a stored map; a file of another kind is refused with what to do.
pub fn open(path: &Path) -> Result<OpenMap, Failure> {
    if !is_map(path) {
        let message = format!(
            "{}: not a stored map (.veduta); `veduta render {} -o map.veduta` makes one of a scene",
            path.display(),
            path.display()
        );
        return Err(Failure::new(Code::Usage, message));
    }
    Ok(open_map(path)?)
}

/// Other colours and textures for the materials of a map.
#[derive(Debug, Args)]
#[command(next_help_heading = "Changes")]
pub struct Changes {
    /// Change a material, as a scene file does: 'material."city/roofs".color=#446'; names match with *,
    /// ** and ?. May be given several times
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<String>,
    /// Change materials as this file says: tables [material."…"] as in a scene file
    #[arg(long, value_name = "FILE")]
    changes: Option<PathBuf>,
}

impl Changes {
    /// Changes the materials: first as the file says, then as the command line does.
    pub fn apply(&self, scene: &mut Scene, strict: bool, talk: &mut Talk) -> Result<(), Failure> {
        let mut warnings = Vec::new();
        if let Some(path) = &self.changes {
            let text = std::fs::read(path).map_err(|error| {
                let message = format!("{}: cannot be read: {error}", path.display());
                Failure::new(Code::InputOutput, message)
            })?;
            warnings.extend(change_scene(scene, path, &text)?);
        }
        for line in &self.set {
            warnings.extend(set_in_scene(scene, line)?);
        }
        for warning in warnings {
            if strict {
                let message = format!("{warning} (an error because of --strict)");
                return Err(Failure::new(Code::BadInput, message));
            }
            talk.warn(warning.to_string());
        }
        Ok(())
    }
}

/// Adds to `told` how much visibility was found by this run.
pub fn tell_work(told: &mut Value) {
    let work = veduta::visibility::work();
    told["facesProjected"] = work.projected.into();
    told["facesClipped"] = work.clipped.into();
}

/// A place for a map: nothing may stand there unless told.
pub fn refuse_place(path: &Path, force: bool) -> Result<(), Failure> {
    super::output::refuse_output_nowhere(path)?;
    refuse_to_replace(path, force)
}

/// How many faces and pieces a map has, for people.
pub fn summary(seen: &SeenScene) -> String {
    let count = seen.map.opaque.len() + seen.map.veils.len();
    format!(
        "{} faces seen in {count} fragments, of {} objects",
        seen.map.faces.len(),
        seen.scene.objects.len()
    )
}
