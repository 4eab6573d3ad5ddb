//! The verbs, a file for each.

pub mod check;
pub mod completions;
pub mod diff;
pub mod examples;
pub mod info;
mod look;
pub mod man;
mod output;
pub mod render;

use crate::exit::{Code, Failure};
use crate::talk::Talk;
use clap::ValueEnum;
use std::path::Path;
use veduta::scene::Scene;
use veduta_io::{PictureFormat, ReadOptions, UpAxis, read_scene};

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

/// Reads a scene and tells what was read otherwise than its file asks for; if `strict`, fails on it.
fn load(
    path: &Path,
    up_axis: Option<UpAxisArgument>,
    strict: bool,
    talk: &mut Talk,
) -> Result<Scene, Failure> {
    talk.begin("reading");
    let up_axis = up_axis.map(UpAxis::from);
    let options = ReadOptions {
        up_axis,
        ..ReadOptions::default()
    };
    let loaded = read_scene(path, &options)?;
    talk.end();
    for warning in &loaded.warnings {
        if strict {
            let message = format!("{warning} (an error because of --strict)");
            return Err(Failure::new(Code::BadInput, message));
        }
        talk.warn(warning.to_string());
    }
    Ok(loaded.scene)
}
