//! Files that belong to a scene's file, and how messages quote them.

#[cfg(any(
    feature = "gltf",
    feature = "obj",
    feature = "ply",
    feature = "cityjson"
))]
use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

/// A file's bytes, if it is a file: devices and pipes might never end.
#[cfg(any(
    feature = "gltf",
    feature = "obj",
    feature = "ply",
    feature = "cityjson"
))]
pub(crate) fn read_whole(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let metadata = file.metadata()?;
    if !metadata.is_file() {
        return Err(io::Error::other("it is not a plain file"));
    }
    let mut bytes = Vec::with_capacity(usize::try_from(metadata.len()).unwrap_or(0));
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Start of a text, for messages.
pub(crate) fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    match text.char_indices().nth(MOST) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}…", &text[..end]),
    }
}
