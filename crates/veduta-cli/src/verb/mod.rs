//! The verbs, a file for each.

pub mod check;
pub mod completions;
pub mod composite;
mod deep;
pub mod diff;
pub mod dome;
pub mod examples;
mod frame_names;
pub mod frames;
mod guests;
pub mod info;
mod lens;
mod look;
pub mod man;
mod output;
pub mod render;
pub mod schema;
pub mod shade;
mod side_names;
mod stored;
mod vector;

use crate::exit::{Code, Failure};
use crate::talk::Talk;
use crate::values;
use clap::{Args, ValueEnum};
use output::Output;
use std::path::Path;
use veduta::accumulate::Picture;
use veduta::pipeline::Shortcoming;
use veduta::scene::{Scene, Shown};
use veduta_io::{
    Layers, LevelOfDetail, Loaded, Moment, PictureFormat, ReadOptions, UpAxis, closest_name,
    read_scene,
};

/// `--up-axis`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UpAxisArgument {
    /// Y up, the front along Z
    Y,
    /// Z up, as in the world
    Z,
}

impl From<UpAxisArgument> for UpAxis {
    fn from(axis: UpAxisArgument) -> Self {
        match axis {
            UpAxisArgument::Y => UpAxis::Y,
            UpAxisArgument::Z => UpAxis::Z,
        }
    }
}

/// Whether the file's suffix is that of a picture; everything else is taken for a model.
fn is_picture(path: &Path) -> bool {
    PictureFormat::of(path).is_ok()
}

/// Refuses to write where something stands already, unless told to. Pictures need no leave: they can
/// be made again.
fn refuse_to_replace(path: &Path, force: bool) -> Result<(), Failure> {
    if force || !path.exists() {
        return Ok(());
    }
    let message = format!("{}: exists already; --force replaces it", path.display());
    Err(Failure::new(Code::Usage, message))
}

/// How a model's file is to be understood.
#[derive(Debug, Args)]
pub struct Reading {
    /// The axis of the file that points upwards; the format's habit by default
    #[arg(long, value_name = "AXIS")]
    up_axis: Option<UpAxisArgument>,
    /// The level of detail of a city model, such as 1.3: of each object the most detailed up to that;
    /// the most detailed of all by default
    #[arg(long, value_name = "LEVEL")]
    lod: Option<LevelOfDetail>,
}

impl Reading {
    fn options(&self) -> ReadOptions {
        ReadOptions {
            up_axis: self.up_axis.map(UpAxis::from),
            level_of_detail: self.lod,
            ..ReadOptions::default()
        }
    }
}

/// The moment of what moves.
#[derive(Debug, Args)]
#[command(next_help_heading = "Time")]
pub struct When {
    /// Show this frame of what moves, counted from 0; a second has as many as the scene file says, else 24
    #[arg(long, value_name = "N", conflicts_with = "time")]
    frame: Option<u32>,
    /// Show this moment of what moves, such as 1.5s; without, models stand at rest, and scene files are as
    /// at 0s
    #[arg(long, value_name = "TIME", value_parser = values::time)]
    time: Option<f64>,
    /// The animation of the model that is shown; its first by default
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
}

impl When {
    /// Whether another moment than that at rest is asked for.
    fn is_asked_for(&self) -> bool {
        self.frame.is_some() || self.time.is_some() || self.animation.is_some()
    }

    fn options(&self, reading: &Reading) -> ReadOptions {
        let moment = match (self.frame, self.time) {
            (Some(frame), _) => Moment::Frame(frame),
            (None, Some(seconds)) => Moment::Seconds(seconds),
            // One that is asked for is shown from its beginning.
            (None, None) if self.animation.is_some() => Moment::Seconds(0.0),
            (None, None) => Moment::Rest,
        };
        ReadOptions {
            moment,
            animation: self.animation.clone(),
            ..reading.options()
        }
    }
}

/// Refuses what is no file of a model or scene.
fn refuse_no_model(path: &Path) -> Result<(), Failure> {
    if path.is_dir() {
        let message = format!("{}: is a folder; name the model in it", path.display());
        return Err(Failure::new(Code::InputOutput, message));
    }
    if is_picture(path) {
        let message = format!(
            "{}: is a picture; a model or a scene file is needed",
            path.display()
        );
        return Err(Failure::new(Code::Unsupported, message));
    }
    Ok(())
}

/// Reads a scene and tells what was read otherwise than its file asks for; if `strict`, fails on it.
fn load(
    path: &Path,
    options: &ReadOptions,
    strict: bool,
    talk: &mut Talk,
) -> Result<Loaded, Failure> {
    refuse_no_model(path)?;
    talk.begin("reading");
    let loaded = read_scene(path, options)?;
    talk.end();
    for warning in &loaded.warnings {
        talk.warn_or_fail(warning.to_string(), strict, Code::BadInput)?;
    }
    Ok(loaded)
}

/// Warns of what a picture of `file` will not show as it should; if strict, fails.
fn tell_shortcomings(
    file: &Path,
    scene: &Scene,
    shortcomings: &[Shortcoming],
    strict: bool,
    talk: &mut Talk,
) -> Result<(), Failure> {
    let file = file.display();
    let mut messages = Vec::new();
    for layer in &scene.layers {
        let name = &layer.name;
        messages.extend(match layer.shown {
            Shown::CasterOnly => Some(format!(
                "{file}: the layer {name:?} only casts shadows, and there are none yet: it gives nothing"
            )),
            Shown::ShadowOnly => Some(format!(
                "{file}: the layer {name:?} only catches shadows, and there are none yet: it hides what \
                 is behind it and gives nothing"
            )),
            _ => None,
        });
    }
    // A layer whose objects differ in it stands there several times.
    messages.dedup();
    messages.extend(shortcomings.iter().map(|shortcoming| match shortcoming {
        Shortcoming::DrawnOpaque(material) => {
            let name = &scene.material(*material).name;
            format!(
                "{file}: the material {name:?} is not opaque any more, but drawn so: what is \
                 behind is not in the map; make the map of a scene with that material"
            )
        }
        Shortcoming::VeilsLeftOut(count) => {
            format!("{file}: {count} pieces of surfaces that are not opaque are left out")
        }
        other => format!("{file}: not shown as it should be: {other:?}"),
    }));
    for message in messages {
        talk.warn_or_fail(message, strict, Code::Unsupported)?;
    }
    Ok(())
}

/// Warns of mattes that do not tell all of the picture of `file`; if strict, fails.
fn tell_of_mattes(
    file: &Path,
    layers: &Layers,
    strict: bool,
    talk: &mut Talk,
) -> Result<(), Failure> {
    let mut messages = Vec::new();
    let mattes = [&layers.aovs.object_matte, &layers.aovs.material_matte];
    let mattes = mattes.into_iter().flatten();
    if let Some(matte) = mattes.max_by_key(|matte| matte.most)
        && matte.most > matte.ranks
    {
        let enough = matte.most.min(usize::from(Output::MOST_RANKS));
        messages.push(format!(
            "a pixel shows up to {} names, and the Cryptomatte tells the {} largest; \
             --crypto-ranks {enough} tells more",
            matte.most, matte.ranks
        ));
    }
    for [a, b] in layers.collisions() {
        messages.push(format!(
            "{a:?} and {b:?} have the same id in a Cryptomatte; rename one to tell them apart"
        ));
    }
    for message in messages {
        let message = format!("{}: {message}", file.display());
        talk.warn_or_fail(message, strict, Code::Unsupported)?;
    }
    Ok(())
}

/// What to say of a name that is not among `known`, which are called `what`.
fn unknown_name<'a>(
    found: &str,
    what: &str,
    known: impl IntoIterator<Item = &'a str> + Clone,
) -> String {
    if let Some(meant) = closest_name(found, known.clone()) {
        return format!("did you mean {meant:?}?");
    }
    match known.into_iter().collect::<Vec<_>>().as_slice() {
        [] => format!("it has no {what}"),
        names => format!("it has: {}", names.join(", ")),
    }
}

/// Warns of a picture in which nothing is seen; if strict, fails.
fn tell_of_nothing(
    file: &Path,
    picture: &Picture,
    strict: bool,
    talk: &mut Talk,
) -> Result<(), Failure> {
    if picture.pixels.iter().any(|pixel| pixel[3] != 0.0) {
        return Ok(());
    }
    let message = format!("{}: nothing is seen in this picture of it", file.display());
    talk.warn_or_fail(message, strict, Code::BadInput)
}
