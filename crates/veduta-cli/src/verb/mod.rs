//! The verbs, a file for each.

pub mod info;
pub mod render;
pub mod schema;

use crate::exit::{Code, Failure};
use crate::talk::Talk;
use clap::ValueEnum;
use std::path::Path;
use veduta_io::{Loaded, ReadOptions, UpAxis, closest_name, read_scene};

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
) -> Result<Loaded, Failure> {
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
    Ok(loaded)
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
