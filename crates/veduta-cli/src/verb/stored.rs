//! What the verbs that work with stored maps share.

use super::look::Look;
use super::refuse_to_replace;
use crate::exit::{Code, Failure};
use crate::talk::Talk;
use clap::Args;
use serde_json::Value;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use veduta::composite::{CompositeError, lay_on, see_through};
use veduta::map::SeenScene;
use veduta::map::file::{FileError, MapReader};
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

/// Whether cameras may differ.
#[derive(Clone, Copy, Debug, Args)]
pub struct Trust {
    /// Take all maps as seen by the camera of the first, whatever theirs was: what they show at a point
    /// of the frame, and how near, stays
    #[arg(long)]
    trust_camera: bool,
}

impl Trust {
    /// Whether they may.
    pub fn camera(self) -> bool {
        self.trust_camera
    }

    /// `seen`, of the file `path`, as if the camera of `first` had seen it, if that is asked for.
    pub fn apply(
        self,
        path: &Path,
        seen: SeenScene,
        first: &SeenScene,
    ) -> Result<SeenScene, Failure> {
        if !self.trust_camera {
            return Ok(seen);
        }
        let mut through = see_through(&seen, &first.map.camera).map_err(|error| {
            let message = format!("{}: {error}", path.display());
            Failure::new(Code::BadInput, message)
        })?;
        through.scene.world = first.scene.world.clone();
        Ok(through)
    }
}

/// Lays `front` on the map that is asked for as a background. `read` reads what is needed of it.
pub fn laid_on(
    front: SeenScene,
    look: &Look,
    trust: Trust,
    read: impl FnOnce(&mut MapReader<BufReader<File>>) -> Result<SeenScene, FileError>,
) -> Result<SeenScene, Failure> {
    let Some(path) = look.background_map() else {
        return Ok(front);
    };
    let background = trust.apply(path, open(path)?.read(read)?, &front)?;
    lay_on(&front, &background).map_err(|error| refusal(&error, &[Path::new("the maps"), path]))
}

/// Fails for a filter that reaches beyond the pixels into which guests are laid.
pub fn refuse_filter_of_guests(file: &Path, seen: &SeenScene, look: &Look) -> Result<(), Failure> {
    if seen.guests.is_empty() {
        return Ok(());
    }
    let why = "pictures of other programs are laid into pixels by area";
    look.refuse_filter(&format!("{}: {why}", file.display()))
}

/// What is wrong, with the names of the files.
pub fn refusal(error: &CompositeError, files: &[&Path]) -> Failure {
    let message = match error {
        CompositeError::OtherCamera { index, difference } => format!(
            "{}: cannot be composited with {}: {difference}; --trust-camera takes it as it is",
            files[*index].display(),
            files[0].display()
        ),
        CompositeError::OtherWorld { index, difference } => format!(
            "{}: cannot be composited with {}: {difference}",
            files[*index].display(),
            files[0].display()
        ),
        CompositeError::Guests { index } => {
            let message = format!(
                "{}: holds pictures of other programs, which only hide by depth and are hidden by it: they \
                 cannot hold out, be cut by --in, --out or --atop, nor stand before a map as background",
                files[*index].display()
            );
            return Failure::new(Code::Unsupported, message);
        }
        other => other.to_string(),
    };
    Failure::new(Code::BadInput, message)
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
