//! Picture files -> pictures: to compare them, to lay them behind others, to tell what they hold.
//!
//! The suffix chooses the reader. Numbers of 8 and 16 bits are taken as sRGB with straight opacity,
//! floating point as linear and premultiplied, which is how [`write_picture`](crate::write_picture)
//! stores them. Nothing is turned (EXIF), and no profile but sRGB is applied; who should know is
//! warned.

mod decoded;
#[cfg(feature = "exr")]
mod exr;
mod npy;
mod pfm;
#[cfg(any(feature = "png", feature = "jpeg", feature = "webp", feature = "hdr"))]
mod raster;
#[cfg(feature = "tiff")]
mod tiff;

#[cfg(feature = "exr")]
pub(crate) use exr::problem as exr_problem;

use crate::PictureFormat;
use crate::sphere::Panorama;
use crate::write::known_suffixes;
use decoded::Coding;
use std::path::{Path, PathBuf};
use veduta::accumulate::Picture;

/// A picture that was read.
#[derive(Clone, Debug)]
pub struct LoadedPicture {
    /// The picture, linear and premultiplied whatever the file holds.
    pub picture: Picture,
    /// Whether the file holds light as it is (floating point), rather than sRGB for a display.
    pub linear: bool,
    /// What the file tells of it as a picture of a sphere.
    pub panorama: Option<Panorama>,
    /// Names of the channels that the file has beside the picture's own, ascending: those of an EXR,
    /// which stay unread.
    pub further_channels: Vec<String>,
    /// What a user should know; sentences without the file's name.
    pub warnings: Vec<String>,
}

/// Why a picture could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", file.display())]
pub struct ReadPictureError {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it. Part of the message, therefore not also its `source`.
    pub problem: PictureProblem,
}

/// What is wrong with a picture's file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureProblem {
    /// The operating system's word.
    #[error("cannot be read: {}", crate::reason(.0))]
    Unreadable(#[from] std::io::Error),
    /// The suffix names no format that is read.
    #[error("has no suffix of a picture; pictures are read from {0}")]
    UnknownFormat(String),
    /// The bytes break the rules of the format.
    #[error("is damaged: {0}; make it anew")]
    Damaged(String),
    /// A kind of the format that is not read.
    #[error("is of a kind that is not read: {0}; convert it to .png or .exr")]
    Unsupported(String),
    /// What is wrong with a deep OpenEXR.
    #[cfg(feature = "exr")]
    #[error("{0}")]
    Deep(crate::deep_exr::DeepProblem),
    /// A picture that is read with its depths has none that can be used.
    #[cfg(feature = "exr")]
    #[error("{0}")]
    Depth(crate::depth_picture::DepthProblem),
    /// A picture that is read as a guest of a composite cannot be one.
    #[cfg(feature = "exr")]
    #[error("{0}")]
    Guest(crate::guest::GuestProblem),
    /// More pixels than a file of that length can honestly hold, or than fit in memory.
    #[error(
        "says that it has {width} x {height} pixels, too many for {input} bytes; it is damaged"
    )]
    TooLarge {
        /// Its width.
        width: u64,
        /// Its height.
        height: u64,
        /// Length of the file.
        input: usize,
    },
}

/// Reads a picture.
///
/// # Errors
/// When the file cannot be read, is damaged, or of a kind that is not read. Never panics.
pub fn read_picture(path: &Path) -> Result<LoadedPicture, ReadPictureError> {
    read(path, Coding::Srgb)
}

/// [`read_picture`], but that numbers of 8 and 16 bits are taken as light as it is, not as sRGB.
///
/// # Errors
/// As [`read_picture`].
pub fn read_linear_picture(path: &Path) -> Result<LoadedPicture, ReadPictureError> {
    read(path, Coding::Linear)
}

fn read(path: &Path, coding: Coding) -> Result<LoadedPicture, ReadPictureError> {
    let read = || {
        let Ok(format) = PictureFormat::of(path) else {
            return Err(PictureProblem::UnknownFormat(known_suffixes()));
        };
        let bytes = std::fs::read(path)?;
        let decoded = match format {
            #[cfg(feature = "png")]
            PictureFormat::Png => raster::read(&bytes, image::ImageFormat::Png),
            #[cfg(feature = "jpeg")]
            PictureFormat::Jpeg => raster::read(&bytes, image::ImageFormat::Jpeg),
            #[cfg(feature = "webp")]
            PictureFormat::WebP => raster::read(&bytes, image::ImageFormat::WebP),
            #[cfg(feature = "tiff")]
            PictureFormat::Tiff => tiff::read(&bytes),
            #[cfg(feature = "exr")]
            PictureFormat::Exr => exr::read(bytes),
            PictureFormat::Pfm => pfm::read(&bytes),
            PictureFormat::Npy => npy::read(&bytes),
            #[cfg(feature = "hdr")]
            PictureFormat::Hdr => raster::read(&bytes, image::ImageFormat::Hdr),
        };
        Ok(decoded?.finish(coding))
    };
    read().map_err(|problem| ReadPictureError {
        file: path.to_owned(),
        problem,
    })
}

/// Pixels that any file may ask for, however small: a blank picture of 3840 x 2160.
const FREE_PIXELS: u64 = 1 << 23;

/// Pixels that one byte of a file may become. Deflate makes at most 1032 bytes of one; larger
/// figures come from formats that repeat blank areas, and blank pictures are small.
const PIXELS_PER_BYTE: u64 = 1024;

/// The most pixels of a picture: 4 GiB as linear f32.
const MOST_PIXELS: u64 = 1 << 28;

/// Checks the size that a file of `input` bytes tells, before anything of that size is made.
pub(crate) fn check_size(
    width: u64,
    height: u64,
    input: usize,
) -> Result<(u32, u32), PictureProblem> {
    if width == 0 || height == 0 {
        return Err(PictureProblem::Damaged(format!(
            "it has {width} x {height} pixels"
        )));
    }
    let justified = FREE_PIXELS.saturating_add(PIXELS_PER_BYTE.saturating_mul(input as u64));
    let most = justified.min(MOST_PIXELS);
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(w), Ok(h)) if width * height <= most => Ok((w, h)),
        _ => Err(PictureProblem::TooLarge {
            width,
            height,
            input,
        }),
    }
}
