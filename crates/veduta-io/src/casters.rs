//! What casts shadows of a stored map: from the file itself, or by reading its sources again.

use crate::read::read_scene;
use crate::{MapFileError, ObjectNames, OpenMap, ReadError, ReadOptions, UpAxis};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use veduta::composite::unite;
use veduta::map::{Casters, Choice, Reading, Source};
use veduta::scene::Scene;

/// Why what casts is not to be had.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CastersError {
    /// The map cannot be read.
    #[error(transparent)]
    Map(#[from] MapFileError),
    /// The map is older than casters are.
    #[error("{}: does not tell what casts shadows; make the map again", .0.display())]
    Unknown(PathBuf),
    /// A file is not there, or not as it was.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// A file can be read, but not understood.
    #[error(transparent)]
    Scene(Box<ReadError>),
    /// The map asks for what this program does not know.
    #[error("{}: how it was read is told as {what}, which is not known here", file.display())]
    Reading {
        /// The source.
        file: PathBuf,
        /// What is asked for.
        what: String,
    },
}

/// Why a file is not what a map was made of.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", file.display())]
pub struct SourceError {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it. Part of the message, therefore not also its `source`.
    pub problem: SourceProblem,
}

/// What is wrong with a file that a map was made of.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SourceProblem {
    /// It cannot be read.
    #[error("is needed, since the map was made of it, but cannot be read: {}", crate::reason(.0))]
    Unreadable(io::Error),
    /// It has changed.
    #[error("has changed since the map was made of it; make the map again")]
    Changed,
    /// It was not read when the map was made.
    #[error("was not there when the map was made; make the map again")]
    New,
}

/// Whether the file of a source is still the same.
///
/// # Errors
/// [`SourceError`] that tells why it is not.
pub fn check_source(source: &Source) -> Result<(), SourceError> {
    let found = File::open(&source.path).and_then(|file| Source::of(&source.path, file));
    let problem = match found {
        Ok(found) if found.is_alike(source) => return Ok(()),
        Ok(_) => SourceProblem::Changed,
        Err(error) => SourceProblem::Unreadable(error),
    };
    Err(SourceError {
        file: PathBuf::from(&source.path),
        problem,
    })
}

/// Reads all that casts shadows of what a map shows: the scenes that it was made of, as one.
///
/// Files that are read again must be those that the map was made of.
///
/// # Errors
/// [`CastersError`].
pub fn read_casters(map: &mut OpenMap) -> Result<Scene, CastersError> {
    let casters = map.origin()?.casters;
    let Some(Casters { embedded, readings }) = casters else {
        return Err(CastersError::Unknown(map.path().to_owned()));
    };
    let mut scenes: Vec<Scene> = embedded.into_iter().collect();
    for reading in &readings {
        scenes.push(read_again(reading)?);
    }
    if scenes.len() == 1 {
        return Ok(scenes.remove(0));
    }
    Ok(unite(&scenes.iter().collect::<Vec<_>>()))
}

fn read_again(reading: &Reading) -> Result<Scene, CastersError> {
    let Some(first) = reading.files.first() else {
        return Ok(Scene::default());
    };
    // Before anything is read, so that the message is about the file that changed.
    reading.files.iter().try_for_each(check_source)?;
    let path = Path::new(&first.path);
    let mut loaded = read_scene(path, &options(reading, path)?)
        .map_err(|error| CastersError::Scene(error.into()))?;
    for found in &loaded.files {
        let known = reading.files.iter().find(|file| file.path == found.path);
        let problem = match known {
            Some(known) if known.is_alike(found) => continue,
            Some(_) => SourceProblem::Changed,
            None => SourceProblem::New,
        };
        let file = PathBuf::from(&found.path);
        return Err(SourceError { file, problem }.into());
    }
    if let Some(layers) = &reading.layers {
        loaded
            .scene
            .keep_layers(|layer| layers.contains(&layer.name));
    }
    for choice in &reading.choices {
        choose_objects(&mut loaded.scene, choice).map_err(|what| CastersError::Reading {
            file: path.to_owned(),
            what,
        })?;
    }
    Ok(loaded.scene)
}

/// Leaves out the objects that were not chosen.
///
/// # Errors
/// A pattern that is none.
pub fn choose_objects(scene: &mut Scene, choice: &Choice) -> Result<(), String> {
    let parse = |patterns: &[String]| -> Result<Vec<ObjectNames>, String> {
        let parsed = patterns.iter().map(|pattern| pattern.parse());
        parsed.collect()
    };
    let (only, without) = (parse(&choice.only)?, parse(&choice.without)?);
    let is_of = |list: &[ObjectNames], name: &str| list.iter().any(|names| names.match_name(name));
    scene.keep_objects(|object| {
        (only.is_empty() || is_of(&only, &object.name)) && !is_of(&without, &object.name)
    });
    Ok(())
}

/// How the files of `options` were read, as a map tells it.
pub fn reading_of(files: Vec<Source>, options: &ReadOptions) -> Reading {
    let axis = |axis: UpAxis| match axis {
        UpAxis::Y => "y".to_owned(),
        UpAxis::Z => "z".to_owned(),
    };
    Reading {
        files,
        up_axis: options.up_axis.map(axis),
        #[cfg(feature = "cityjson")]
        level_of_detail: options.level_of_detail.map(|level| level.to_string()),
        ..Reading::default()
    }
}

fn options(reading: &Reading, file: &Path) -> Result<ReadOptions, CastersError> {
    let unknown = |what: &String| CastersError::Reading {
        file: file.to_owned(),
        what: what.clone(),
    };
    let up_axis = match reading.up_axis.as_deref() {
        None => None,
        Some("y") => Some(UpAxis::Y),
        Some("z") => Some(UpAxis::Z),
        Some(other) => return Err(unknown(&other.to_owned())),
    };
    #[cfg_attr(not(feature = "cityjson"), expect(unused_mut))]
    let mut options = ReadOptions {
        up_axis,
        ..ReadOptions::default()
    };
    if let Some(level) = &reading.level_of_detail {
        #[cfg(feature = "cityjson")]
        {
            options.level_of_detail = Some(level.parse().map_err(|_| unknown(level))?);
        }
        #[cfg(not(feature = "cityjson"))]
        return Err(unknown(level));
    }
    Ok(options)
}
