//! Stored maps: `.veduta` files by their names.
//!
//! The format itself is [`veduta::map::file`]; here are the places, as of all other files.

use crate::write::PartialFile;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use veduta::map::SeenScene;
use veduta::map::file::{self, FileError, MapReader, Source};

/// Suffix of stored maps.
pub const MAP_SUFFIX: &str = "veduta";

/// Why a stored map could not be read or written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", file.display())]
pub struct MapFileError {
    /// The file.
    pub file: PathBuf,
    /// What went wrong. Part of the message, therefore not also its `source`.
    pub problem: FileError,
}

/// Whether a file is a stored map, by its suffix.
pub fn is_map(path: &Path) -> bool {
    path.extension()
        .is_some_and(|suffix| suffix.eq_ignore_ascii_case(MAP_SUFFIX))
}

fn failed(path: &Path, problem: FileError) -> MapFileError {
    MapFileError {
        file: path.to_owned(),
        problem,
    }
}

fn io(what: &'static str) -> impl Fn(std::io::Error) -> FileError {
    move |source| FileError::Io { what, source }
}

/// Opens a stored map: what it is of is known, and nothing is read but that.
///
/// # Errors
/// When it cannot be read, is damaged, or is none.
pub fn open_map(path: &Path) -> Result<OpenMap, MapFileError> {
    let open = || {
        let file = File::open(path).map_err(io("cannot be opened"))?;
        MapReader::new(BufReader::new(file))
    };
    Ok(OpenMap {
        path: path.to_owned(),
        reader: open().map_err(|problem| failed(path, problem))?,
    })
}

/// A stored map whose contents are read when they are asked for.
#[derive(Debug)]
pub struct OpenMap {
    path: PathBuf,
    reader: MapReader<BufReader<File>>,
}

impl OpenMap {
    /// What is in the file.
    pub fn reader(&self) -> &MapReader<BufReader<File>> {
        &self.reader
    }

    /// Reads what is needed of it.
    ///
    /// # Errors
    /// When it cannot be read or is damaged.
    pub fn read<T>(
        &mut self,
        read: impl FnOnce(&mut MapReader<BufReader<File>>) -> Result<T, FileError>,
    ) -> Result<T, MapFileError> {
        read(&mut self.reader).map_err(|problem| failed(&self.path, problem))
    }
}

/// Writes a stored map; an old file of that name is replaced. `sources` are the files that its scene
/// was read from.
///
/// # Errors
/// When it cannot be written; then nothing has changed.
pub fn write_map(path: &Path, seen: &SeenScene, sources: &[Source]) -> Result<(), MapFileError> {
    let write = || {
        let partial = PartialFile::create(path).map_err(io("cannot be written"))?;
        let partial = file::write_map(partial, seen, sources)?;
        partial.finish().map_err(io("cannot be written"))
    };
    write().map_err(|problem| failed(path, problem))
}

/// What a map says of a file that its scene was read from: its name as given, its length and checksum.
///
/// # Errors
/// When it cannot be read.
pub fn source_of(path: &Path) -> Result<Source, MapFileError> {
    let file = File::open(path).and_then(|file| Source::of(&path.to_string_lossy(), file));
    file.map_err(|error| failed(path, io("cannot be read")(error)))
}
