//! What the verbs that work with stored maps share.

use super::guests::GuestInput;
use super::look::Look;
use super::refuse_to_replace;
use crate::exit::{Code, Failure};
use crate::talk::Talk;
use clap::Args;
use serde_json::Value;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use veduta::accumulate::{AovSettings, Aovs, Picture};
use veduta::composite::{CompositeError, lay_on, see_through};
use veduta::dice::PixelGrid;
use veduta::filter::Filter;
use veduta::map::file::{FileError, MapReader};
use veduta::map::{Camera, Faces, Origin, SeenScene, SeenSpans, TooFewSubScanlines};
use veduta::pipeline::{self, Shortcoming};
use veduta::scene::Scene;
use veduta_io::{
    MapFileError, OpenMap, ReadError, Warning, change_scene, is_map, open_map, set_in_scene,
    write_map, write_spans,
};

/// Opens a stored map; a file of another kind is refused with what to do.
pub fn open(path: &Path) -> Result<OpenMap, Failure> {
    if GuestInput::of(path)?.is_some() {
        let message = format!(
            "{}: a picture, where a stored map (.veduta) is needed: pictures of other programs are inputs of \
             veduta composite only, which hide by depth",
            path.display()
        );
        return Err(Failure::new(Code::Usage, message));
    }
    if path.is_dir() {
        let message = format!("{}: a folder, not a stored map (.veduta)", path.display());
        return Err(Failure::new(Code::Usage, message));
    }
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
pub fn refuse_filter_of_guests(file: &Path, seen: &Stored, look: &Look) -> Result<(), Failure> {
    if !matches!(seen, Stored::Regions(seen) if !seen.guests.is_empty()) {
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
        CompositeError::OtherWorld { index, difference }
        | CompositeError::OtherSampling { index, difference } => format!(
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
    /// Changes the materials: first as the file says, then as the command line does. Warns of what cannot
    /// be done; if strict, fails.
    pub fn apply(&self, scene: &mut Scene, strict: bool, talk: &mut Talk) -> Result<(), Failure> {
        self.apply_to_all(&mut [scene], strict, talk)
    }

    /// The same for the scenes of several maps, of which not each has all materials.
    pub fn apply_to_all(
        &self,
        scenes: &mut [&mut Scene],
        strict: bool,
        talk: &mut Talk,
    ) -> Result<(), Failure> {
        let mut warnings = Vec::new();
        for step in self.steps()? {
            let mut done = Vec::new();
            let mut refused = None;
            for scene in &mut *scenes {
                match step.apply(scene) {
                    Ok(warnings) => done.push(warnings),
                    Err(error) => refused = refused.or(Some(error)),
                }
            }
            match refused {
                Some(error) if done.is_empty() => return Err(error.into()),
                // What one of them takes without a word is not wrong.
                _ if done.iter().any(Vec::is_empty) => {}
                _ => warnings.extend(done.into_iter().flatten()),
            }
        }
        let mut told: Vec<String> = Vec::new();
        for warning in warnings.iter().map(Warning::to_string) {
            if !told.contains(&warning) {
                talk.warn_or_fail(warning.clone(), strict, Code::BadInput)?;
                told.push(warning);
            }
        }
        Ok(())
    }

    /// The same for another part of a scene that was told all warnings.
    pub fn apply_unheard(&self, scene: &mut Scene) -> Result<(), Failure> {
        for step in self.steps()? {
            step.apply(scene)?;
        }
        Ok(())
    }

    /// What is changed one after the other.
    fn steps(&self) -> Result<Vec<Step<'_>>, Failure> {
        let mut steps = Vec::new();
        if let Some(path) = &self.changes {
            let text = std::fs::read(path).map_err(|error| {
                let message = format!("{}: cannot be read: {error}", path.display());
                Failure::new(Code::InputOutput, message)
            })?;
            steps.push(Step::File(path, text));
        }
        steps.extend(self.set.iter().map(|line| Step::Line(line)));
        Ok(steps)
    }
}

/// A step of what is changed.
enum Step<'a> {
    /// What a file says.
    File(&'a Path, Vec<u8>),
    /// What the command line does.
    Line(&'a str),
}

impl Step<'_> {
    fn apply(&self, scene: &mut Scene) -> Result<Vec<Warning>, ReadError> {
        match self {
            Self::File(path, text) => change_scene(scene, path, text),
            Self::Line(line) => set_in_scene(scene, line),
        }
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

/// What a stored map holds.
#[derive(Debug)]
pub enum Stored {
    /// Regions, found exactly.
    Regions(SeenScene),
    /// Spans on sub-scanlines, which multiscan found.
    Spans(SeenSpans),
}

impl Stored {
    /// Reads all of a map.
    pub fn read(map: &mut OpenMap) -> Result<Self, MapFileError> {
        match map.reader().sub_scanlines_per_row() {
            None => map.read(|reader| reader.read()).map(Self::Regions),
            Some(_) => map.read(|reader| reader.read_spans()).map(Self::Spans),
        }
    }

    /// [`Stored::read`], with every byte and all that it says checked.
    pub fn check(map: &mut OpenMap) -> Result<Self, MapFileError> {
        match map.reader().sub_scanlines_per_row() {
            None => map.read(|reader| reader.check()).map(Self::Regions),
            Some(_) => map.read(|reader| reader.check_spans()).map(Self::Spans),
        }
    }

    /// Writes it into a file of its own.
    pub fn write(&self, place: &Path, origin: &Origin) -> Result<(), MapFileError> {
        match self {
            Self::Regions(seen) => write_map(place, seen, origin),
            Self::Spans(seen) => write_spans(place, seen, origin),
        }
    }

    /// The faces seen.
    pub fn faces(&self) -> &Faces {
        match self {
            Self::Regions(seen) => &seen.map.faces,
            Self::Spans(seen) => &seen.faces,
        }
    }

    /// What is seen of the scene.
    pub fn scene(&self) -> &Scene {
        match self {
            Self::Regions(seen) => &seen.scene,
            Self::Spans(seen) => &seen.scene,
        }
    }

    /// The same, to be changed.
    pub fn scene_mut(&mut self) -> &mut Scene {
        match self {
            Self::Regions(seen) => &mut seen.scene,
            Self::Spans(seen) => &mut seen.scene,
        }
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        match self {
            Self::Regions(seen) => &seen.map.camera,
            Self::Spans(seen) => &seen.camera,
        }
    }

    /// Width and height in pixels of the picture it was made for.
    pub fn size(&self) -> [u32; 2] {
        match self {
            Self::Regions(seen) => seen.size,
            Self::Spans(seen) => [seen.spans.width(), seen.spans.height()],
        }
    }

    /// The picture of it, and the channels beside the light. Spans have no other filter than the box.
    pub fn picture(
        &self,
        grid: &PixelGrid,
        unlit: bool,
        filter: Filter,
        aovs: AovSettings,
    ) -> Result<(Picture, Aovs), TooFewSubScanlines> {
        match self {
            Self::Regions(seen) => Ok(pipeline::render_seen(seen, grid, unlit, filter, aovs)),
            Self::Spans(seen) => pipeline::render_spans(seen, grid, unlit, aovs),
        }
    }

    /// What a picture of it does not show as it should.
    pub fn shortcomings(&self) -> Vec<Shortcoming> {
        match self {
            Self::Regions(seen) => pipeline::shortcomings(&seen.scene, &seen.map),
            Self::Spans(seen) => pipeline::shortcomings_of_spans(seen),
        }
    }

    /// How many faces and pieces it has, for people.
    pub fn summary(&self) -> String {
        let (faces, objects) = (self.faces().len(), self.scene().objects.len());
        let pieces = match self {
            Self::Regions(SeenScene { map, .. }) => {
                format!("{} fragments", map.opaque.len() + map.veils.len())
            }
            Self::Spans(SeenSpans { spans, .. }) => {
                let n = spans.sub_scanlines_per_row();
                format!("{} spans on {n} sub-scanlines a row", spans.len())
            }
        };
        format!("{faces} faces seen in {pieces}, of {objects} objects")
    }
}
