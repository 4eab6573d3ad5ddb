//! The verbs, a file for each.

pub mod info;
mod look;
mod output;
pub mod render;

use crate::exit::{Code, Failure};
use crate::talk::Talk;
use clap::ValueEnum;
use std::path::Path;
use veduta::scene::Scene;
use veduta_io::{ReadOptions, UpAxis, read_scene};

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

/// Reads a scene and tells what was read otherwise than its file asks for; if `strict`, fails on it.
fn load(
    path: &Path,
    up_axis: Option<UpAxisArgument>,
    strict: bool,
    talk: &mut Talk,
) -> Result<Scene, Failure> {
    talk.begin("reading");
    let up_axis = up_axis.map(UpAxis::from);
    let loaded = read_scene(path, &ReadOptions { up_axis })?;
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
