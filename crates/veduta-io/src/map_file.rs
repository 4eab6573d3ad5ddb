//! Stored maps: `.veduta` files by their names.
//!
//! The format itself is [`veduta::map::file`]; here are the places, as of all other files.

use crate::write::{PartialFile, is_stream};
use std::collections::HashSet;
use std::fs::File;
use std::io::BufReader;
use std::path::{Component, Path, PathBuf};
use veduta::map::file::{self, FileError, MapReader};
use veduta::map::{Origin, Reading, SeenScene, SeenSpans, Source};

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
    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the map is made of, with paths that lead there from here; embedded casters are read.
    ///
    /// # Errors
    /// When it cannot be read or is damaged.
    pub fn origin(&mut self) -> Result<Origin, MapFileError> {
        let casters = self.read(|reader| reader.read_casters())?;
        let mut origin = Origin {
            sources: self.reader.sources().to_vec(),
            casters,
        };
        let readings = origin.casters.iter_mut().flat_map(|c| &mut c.readings);
        let of_readings = readings.flat_map(|reading| &mut reading.files);
        for source in origin.sources.iter_mut().chain(of_readings) {
            source.path = self.located(&source.path);
        }
        Ok(origin)
    }

    /// The files that the map was made of, with paths that lead there from here.
    pub fn sources(&self) -> Vec<Source> {
        let located = |source: &Source| Source {
            path: self.located(&source.path),
            ..source.clone()
        };
        self.reader.sources().iter().map(located).collect()
    }

    fn located(&self, path: &str) -> String {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        folder.join(path).to_string_lossy().into_owned()
    }

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

/// Writes a stored map; an old file of that name is replaced. The paths of `origin` are told relative
/// to it, where both have more in common than the root.
///
/// # Errors
/// When it cannot be written; then nothing has changed.
pub fn write_map(path: &Path, seen: &SeenScene, origin: &Origin) -> Result<(), MapFileError> {
    write_file(path, origin, |file, origin| {
        file::write_map(file, seen, origin)
    })
}

/// [`write_map`] for what multiscan found.
///
/// # Errors
/// As for [`write_map`].
pub fn write_spans(path: &Path, seen: &SeenSpans, origin: &Origin) -> Result<(), MapFileError> {
    write_file(path, origin, |file, origin| {
        file::write_spans(file, seen, origin)
    })
}

fn write_file(
    path: &Path,
    origin: &Origin,
    write: impl FnOnce(PartialFile, &Origin) -> Result<PartialFile, FileError>,
) -> Result<(), MapFileError> {
    let origin = seen_from(path, origin.clone());
    let write = || {
        if is_stream(path) {
            // It would be put in the place of the device.
            let message = "a map is written into a plain file, not into a device or a pipe";
            return Err(io("cannot be written")(std::io::Error::other(message)));
        }
        let partial = PartialFile::create(path).map_err(io("cannot be written"))?;
        let partial = write(partial, &origin)?;
        partial.finish().map_err(io("cannot be written"))
    };
    write().map_err(|problem| failed(path, problem))
}

/// The origin with paths as they are told in a map that stands at `map`, each source once.
fn seen_from(map: &Path, mut origin: Origin) -> Origin {
    let folder = in_full(map)
        .parent()
        .map(Path::to_owned)
        .unwrap_or_default();
    let tell = |sources: &mut Vec<Source>| {
        let mut told: Vec<Source> = Vec::with_capacity(sources.len());
        let mut known = HashSet::new();
        for mut source in std::mem::take(sources) {
            source.path = relative(&folder, &in_full(Path::new(&source.path)));
            if known.insert(source.path.clone()) {
                told.push(source);
            }
        }
        *sources = told;
    };
    tell(&mut origin.sources);
    if let Some(casters) = &mut origin.casters {
        let mut readings: Vec<Reading> = Vec::new();
        for mut reading in std::mem::take(&mut casters.readings) {
            tell(&mut reading.files);
            if !readings.contains(&reading) {
                readings.push(reading);
            }
        }
        casters.readings = readings;
    }
    origin
}

/// The path of a file from the root on, in one way only. The file itself may be a link, and need not be
/// there.
fn in_full(path: &Path) -> PathBuf {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new(".")).canonicalize();
    match (folder, path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
    }
}

/// `path` seen from `folder`, with `/` between names; as it is if they share nothing but the root.
fn relative(folder: &Path, path: &Path) -> String {
    let from: Vec<Component> = folder.components().collect();
    let to: Vec<Component> = path.components().collect();
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let is_name = |component: &Component| matches!(component, Component::Normal(_));
    if !from[..shared].iter().any(is_name) {
        return path.to_string_lossy().into_owned();
    }
    let up = from[shared..].iter().map(|_| "..".into());
    let down = to[shared..]
        .iter()
        .map(|name| name.as_os_str().to_string_lossy());
    up.chain(down).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_told_from_where_the_map_stands() {
        for (folder, path, told) in [
            ("/town", "/town/a.obj", "a.obj"),
            ("/town", "/town/tex/a.png", "tex/a.png"),
            ("/town/maps/old", "/town/a.obj", "../../a.obj"),
            ("/tmp", "/town/a.obj", "/town/a.obj"),
            ("/", "/a.obj", "/a.obj"),
        ] {
            assert_eq!(relative(Path::new(folder), Path::new(path)), told);
        }
    }
}
