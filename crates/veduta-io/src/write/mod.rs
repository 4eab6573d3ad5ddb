//! Pictures -> files that other programs read.
//!
//! The suffix chooses the writer. A file is written under a temporary name beside its place and
//! then renamed, so that readers see the old file or the new one, and a failure leaves nothing.

#[cfg(feature = "exr")]
mod exr;
mod npy;
mod partial_file;
#[cfg(feature = "png")]
mod png;

pub use partial_file::remove_unfinished;

use partial_file::PartialFile;
use std::io;
use std::path::{Path, PathBuf};
use veduta::accumulate::Picture;

/// What a picture is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// PNG: sRGB with straight opacity, 8 or 16 bits; light below 0 or above 1 is cut off.
    #[cfg(feature = "png")]
    Png,
    /// OpenEXR: the picture as it is (linear Rec.709, premultiplied, f32), compressed.
    #[cfg(feature = "exr")]
    Exr,
    /// NumPy: the picture as it is, an array of f32, height x width x 4.
    Npy,
}

/// Suffixes of the files that [`write_picture`] writes.
pub const PICTURE_SUFFIXES: &[&str] = &[
    #[cfg(feature = "png")]
    "png",
    #[cfg(feature = "exr")]
    "exr",
    "npy",
];

impl PictureFormat {
    /// The format that the suffix of `path` names.
    ///
    /// # Errors
    /// When it names none.
    pub fn of(path: &Path) -> Result<Self, WriteError> {
        let suffix = path.extension().unwrap_or_default().to_ascii_lowercase();
        match suffix.to_str() {
            #[cfg(feature = "png")]
            Some("png") => Ok(Self::Png),
            #[cfg(feature = "exr")]
            Some("exr") => Ok(Self::Exr),
            Some("npy") => Ok(Self::Npy),
            _ => {
                let known: Vec<_> = PICTURE_SUFFIXES.iter().map(|s| format!(".{s}")).collect();
                Err(WriteError {
                    file: path.to_owned(),
                    problem: WriteProblem::UnknownSuffix(known.join(", ")),
                })
            }
        }
    }
}

/// How to write a picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct PictureOptions {
    /// Bits of a channel of a PNG.
    pub depth: PngDepth,
}

/// Bits of a channel of a PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PngDepth {
    /// 8 bits.
    #[default]
    Eight,
    /// 16 bits.
    Sixteen,
}

/// Why a picture could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", file.display())]
pub struct WriteError {
    /// The file.
    pub file: PathBuf,
    /// What went wrong. Part of the message, therefore not also its `source`.
    pub problem: WriteProblem,
}

/// What went wrong when a picture was written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteProblem {
    /// The suffix names no format that is written.
    #[error("has no suffix of a picture; pictures are written as {0}")]
    UnknownSuffix(String),
    /// The operating system's word.
    #[error("cannot be written: {0}")]
    Io(#[from] io::Error),
    /// The format cannot hold the picture.
    #[error("cannot hold the picture: {0}")]
    Encode(String),
}

/// Writes a picture; an old file of that name is replaced.
///
/// # Errors
/// When the suffix is unknown or the file cannot be written; then nothing has changed.
pub fn write_picture(
    path: &Path,
    picture: &Picture,
    options: &PictureOptions,
) -> Result<(), WriteError> {
    let format = PictureFormat::of(path)?;
    let write = || -> Result<(), WriteProblem> {
        let mut file = PartialFile::create(path)?;
        match format {
            #[cfg(feature = "png")]
            PictureFormat::Png => png::write(&mut file, picture, options.depth)?,
            #[cfg(feature = "exr")]
            PictureFormat::Exr => exr::write(&mut file, picture)?,
            PictureFormat::Npy => npy::write(&mut file, picture)?,
        }
        Ok(file.finish()?)
    };
    #[cfg(not(feature = "png"))]
    let _ = options;
    write().map_err(|problem| WriteError {
        file: path.to_owned(),
        problem,
    })
}
