//! The files of a scene, and how messages quote them.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use veduta::map::Source;

/// Reads files and keeps what each was, so that it can be told later whether they are still the same.
#[derive(Debug, Default)]
pub(crate) struct ReadFiles {
    files: Vec<Source>,
    rows: HashMap<PathBuf, usize>,
}

impl ReadFiles {
    /// A file's bytes, if it is a file: devices and pipes might never end.
    pub fn read(&mut self, path: &Path) -> io::Result<Vec<u8>> {
        let mut file = File::open(path)?;
        let metadata = file.metadata()?;
        if !metadata.is_file() {
            return Err(io::Error::other("it is not a plain file"));
        }
        let mut bytes = Vec::with_capacity(usize::try_from(metadata.len()).unwrap_or(0));
        file.read_to_end(&mut bytes)?;
        self.add(path, &bytes);
        Ok(bytes)
    }

    /// Says that these bytes were read from a file.
    pub fn add(&mut self, path: &Path, bytes: &[u8]) {
        if !self.rows.contains_key(path) {
            let source = Source::of(&path.to_string_lossy(), bytes);
            self.append([source.expect("bytes in memory can be read")]);
        }
    }

    /// Adds files that others have read. Of those that are read twice the first is kept.
    pub fn append(&mut self, files: impl IntoIterator<Item = Source>) {
        for file in files {
            let row = self.files.len();
            let known = self.rows.entry(PathBuf::from(&file.path));
            if *known.or_insert(row) == row {
                self.files.push(file);
            }
        }
    }

    /// What was read, in the order in which it was.
    pub fn finish(self) -> Vec<Source> {
        self.files
    }
}

/// Start of a text, for messages.
pub(crate) fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    match text.char_indices().nth(MOST) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}…", &text[..end]),
    }
}
