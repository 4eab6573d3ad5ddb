//! Pictures, and plain scenes -> files that other programs read.
//!
//! The suffix chooses the writer. A file is made without a name, or under a temporary one beside its
//! place, and then put there ([`partial_file`]), so that readers see the old file or the new one, and
//! a failure leaves nothing.
//!
//! Formats for displays (samples of 8 and 16 bits) hold sRGB, straight opacity, and light from 0 to
//! 1; what is darker or brighter is cut off. The others hold the picture as it is: linear Rec.709,
//! premultiplied.

#[cfg(any(feature = "png", feature = "jpeg", feature = "tiff", feature = "webp"))]
mod coded;
#[cfg(feature = "exr")]
mod exr;
#[cfg(feature = "hdr")]
mod hdr;
#[cfg(feature = "jpeg")]
mod jpeg;
mod model;
mod npy;
mod partial_file;
mod pfm;
#[cfg(feature = "png")]
mod png;
#[cfg(feature = "tiff")]
mod tiff;
#[cfg(any(feature = "svg", feature = "pdf", feature = "geojson"))]
mod vector;
#[cfg(feature = "webp")]
mod webp;

#[cfg(feature = "exr")]
pub use self::exr::Layers;
pub use model::{MODEL_SUFFIXES, write_model};
pub(crate) use partial_file::PartialFile;
pub use partial_file::remove_unfinished;
#[cfg(any(feature = "svg", feature = "pdf", feature = "geojson"))]
pub use vector::{
    MOST_DECIMALS, VECTOR_SUFFIXES, VectorFormat, VectorOptions, hidden_dash, stream_drawing,
    write_drawing,
};

use crate::sphere::Panorama;
use std::fmt;
use std::io::{self, Cursor, Seek, Write};
use std::path::{Path, PathBuf};
use veduta::accumulate::Picture;

/// What a picture is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// PNG, tagged as sRGB; 8 or 16 bits.
    #[cfg(feature = "png")]
    Png,
    /// JPEG, 8 bits. It has no opacity: what is not covered is white.
    #[cfg(feature = "jpeg")]
    Jpeg,
    /// TIFF with 8 bits, 16 bits or f32, compressed by Deflate.
    #[cfg(feature = "tiff")]
    Tiff,
    /// WebP without loss, 8 bits.
    #[cfg(feature = "webp")]
    WebP,
    /// OpenEXR, f16 or f32, in scanlines or tiles.
    #[cfg(feature = "exr")]
    Exr,
    /// Portable Float Map, f32. It has no opacity: what is not covered is black.
    Pfm,
    /// NumPy: an array of f32, height x width x 4.
    Npy,
    /// Radiance, 8 bits a channel and an exponent for all three. It has no opacity: what is not covered is
    /// black.
    #[cfg(feature = "hdr")]
    Hdr,
}

/// Suffixes of the files that [`write_picture`] writes and [`read_picture`](crate::read_picture)
/// reads. Each is also the name of its format.
pub const PICTURE_SUFFIXES: &[&str] = &[
    #[cfg(feature = "png")]
    "png",
    #[cfg(feature = "jpeg")]
    "jpg",
    #[cfg(feature = "jpeg")]
    "jpeg",
    #[cfg(feature = "tiff")]
    "tif",
    #[cfg(feature = "tiff")]
    "tiff",
    #[cfg(feature = "webp")]
    "webp",
    #[cfg(feature = "exr")]
    "exr",
    "pfm",
    "npy",
    #[cfg(feature = "hdr")]
    "hdr",
];

impl PictureFormat {
    /// The format of that suffix, without its dot, in small or capital letters.
    pub fn of_suffix(suffix: &str) -> Option<Self> {
        match suffix.to_ascii_lowercase().as_str() {
            #[cfg(feature = "png")]
            "png" => Some(Self::Png),
            #[cfg(feature = "jpeg")]
            "jpg" | "jpeg" => Some(Self::Jpeg),
            #[cfg(feature = "tiff")]
            "tif" | "tiff" => Some(Self::Tiff),
            #[cfg(feature = "webp")]
            "webp" => Some(Self::WebP),
            #[cfg(feature = "exr")]
            "exr" => Some(Self::Exr),
            "pfm" => Some(Self::Pfm),
            "npy" => Some(Self::Npy),
            #[cfg(feature = "hdr")]
            "hdr" => Some(Self::Hdr),
            _ => None,
        }
    }

    /// The format that the suffix of `path` names.
    ///
    /// # Errors
    /// When it names none.
    pub fn of(path: &Path) -> Result<Self, WriteError> {
        let suffix = path.extension().unwrap_or_default();
        suffix
            .to_str()
            .and_then(Self::of_suffix)
            .ok_or_else(|| WriteError {
                file: path.to_owned(),
                problem: WriteProblem::UnknownSuffix(known_suffixes()),
            })
    }

    /// The widest and highest picture of the format, in pixels; `None` for one without such limit.
    pub fn most_side(self) -> Option<u32> {
        match self {
            #[cfg(feature = "jpeg")]
            Self::Jpeg => Some(65_535),
            #[cfg(feature = "webp")]
            Self::WebP => Some(16_384),
            _ => None,
        }
    }

    /// The samples that the format can hold; the first is its habit.
    pub fn samples(self) -> &'static [Samples] {
        match self {
            #[cfg(feature = "png")]
            Self::Png => &[Samples::U8, Samples::U16],
            #[cfg(feature = "jpeg")]
            Self::Jpeg => &[Samples::U8],
            #[cfg(feature = "tiff")]
            Self::Tiff => &[Samples::U8, Samples::U16, Samples::F32],
            #[cfg(feature = "webp")]
            Self::WebP => &[Samples::U8],
            #[cfg(feature = "exr")]
            Self::Exr => &[Samples::F32, Samples::F16],
            Self::Pfm | Self::Npy => &[Samples::F32],
            #[cfg(feature = "hdr")]
            Self::Hdr => &[Samples::F32],
        }
    }
}

/// The suffixes of pictures, for messages.
pub(crate) fn known_suffixes() -> String {
    let known: Vec<_> = PICTURE_SUFFIXES.iter().map(|s| format!(".{s}")).collect();
    known.join(", ")
}

/// How a channel of a pixel is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// 8 bits of sRGB.
    U8,
    /// 16 bits of sRGB.
    U16,
    /// Floating point of 16 bits, linear. What is brighter than 65504 becomes that.
    F16,
    /// Floating point of 32 bits, linear.
    F32,
}

impl fmt::Display for Samples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::U8 => "8 bits",
            Self::U16 => "16 bits",
            Self::F16 => "half floats",
            Self::F32 => "floats",
        })
    }
}

impl Samples {
    /// Whether light is stored as it is, for further work, rather than as a display shows it.
    pub fn are_linear(self) -> bool {
        matches!(self, Self::F16 | Self::F32)
    }
}

/// How to write a picture.
#[derive(Clone, Copy, Debug)]
pub struct PictureOptions {
    /// How channels are stored; `None` for the format's habit.
    pub samples: Option<Samples>,
    /// Quality of a JPEG, 1 to 100.
    pub jpeg_quality: u8,
    /// How an EXR is compressed.
    pub exr_compression: ExrCompression,
    /// Side of the tiles of an EXR in pixels, at least 1; `None` for scanlines.
    pub exr_tile: Option<u32>,
    /// What part of which sphere the picture shows, which PNG, JPEG and EXR tell.
    pub panorama: Option<Panorama>,
}

impl Default for PictureOptions {
    /// The format's habit; JPEG of quality 92; EXR in scanlines, compressed by `zip`.
    fn default() -> Self {
        Self {
            samples: None,
            jpeg_quality: 92,
            exr_compression: ExrCompression::Zip,
            exr_tile: None,
            panorama: None,
        }
    }
}

impl PictureOptions {
    /// How the channels of a picture in `format` will be stored.
    ///
    /// # Errors
    /// When the format cannot hold the samples asked for.
    pub fn samples_in(&self, format: PictureFormat) -> Result<Samples, WriteProblem> {
        let possible = format.samples();
        match self.samples {
            None => Ok(possible[0]),
            Some(asked) if possible.contains(&asked) => Ok(asked),
            Some(asked) => {
                let possible: Vec<_> = possible.iter().map(Samples::to_string).collect();
                Err(WriteProblem::NoSuchSamples {
                    asked,
                    possible: possible.join(" or "),
                })
            }
        }
    }
}

/// How an EXR is compressed; all ways are without loss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrCompression {
    /// Not at all.
    None,
    /// Runs of equal bytes.
    Rle,
    /// Deflate, each scanline alone: quick to read in parts.
    Zips,
    /// Deflate, 16 scanlines together.
    #[default]
    Zip,
    /// Wavelets; small for noisy pictures.
    Piz,
}

/// Why a picture or a scene could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", file.display())]
pub struct WriteError {
    /// The file.
    pub file: PathBuf,
    /// What went wrong. Part of the message, therefore not also its `source`.
    pub problem: WriteProblem,
}

/// What went wrong when a picture or a scene was written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteProblem {
    /// The suffix names no format that is written.
    #[error("is of no format that is written; pictures are written as {0}")]
    UnknownSuffix(String),
    /// The suffix names no format of models that is written.
    #[error("is of no format that is written; models are written as {0}")]
    UnknownModelSuffix(String),
    /// The format has no such samples.
    #[error("a picture of that format is stored as {possible}, not as {asked}")]
    NoSuchSamples {
        /// The samples asked for.
        asked: Samples,
        /// Those that it can hold.
        possible: String,
    },
    /// The operating system's word.
    #[error("cannot be written: {}", crate::reason(.0))]
    Io(#[from] io::Error),
    /// The format cannot hold the picture.
    #[error("cannot hold the picture: {0}")]
    Encode(String),
    /// The scene has what is not written.
    #[error("cannot hold the scene: {0}")]
    Model(String),
}

/// Writes a picture; an old file of that name is replaced. What is no file (a device, a named pipe)
/// is written to and stays what it is.
///
/// # Errors
/// When the suffix is unknown or the file cannot be written; then nothing has changed.
pub fn write_picture(
    path: &Path,
    picture: &Picture,
    options: &PictureOptions,
) -> Result<(), WriteError> {
    write_picture_as(path, PictureFormat::of(path)?, picture, options)
}

/// [`write_picture`] in a given format, whatever the suffix says.
///
/// # Errors
/// When the file cannot be written; then nothing has changed.
pub fn write_picture_as(
    path: &Path,
    format: PictureFormat,
    picture: &Picture,
    options: &PictureOptions,
) -> Result<(), WriteError> {
    write_to(path, |writer| encode(writer, format, picture, options))
}

/// Writes a picture as an EXR with layers beside it, whatever the suffix says.
///
/// # Errors
/// When the file cannot be written; then nothing has changed.
#[cfg(feature = "exr")]
pub fn write_layers(
    path: &Path,
    picture: &Picture,
    layers: &Layers,
    options: &PictureOptions,
) -> Result<(), WriteError> {
    write_to(path, |writer| {
        encode_layers(writer, picture, layers, options)
    })
}

/// What is written to, to be encoded into.
trait Target: Write + Seek {}

impl<T: Write + Seek> Target for T {}

/// Writes what `encode` makes, in one step or, where a stream stands, as [`stream_picture`] does.
fn write_to(
    path: &Path,
    encode: impl Fn(&mut dyn Target) -> Result<(), WriteProblem>,
) -> Result<(), WriteError> {
    let write = || -> Result<(), WriteProblem> {
        if is_stream(path) {
            let mut stream = std::fs::File::options().write(true).open(path)?;
            return stream_to(&mut stream, encode);
        }
        let mut file = PartialFile::create(path)?;
        encode(&mut file)?;
        Ok(file.finish()?)
    };
    write().map_err(|problem| WriteError {
        file: path.to_owned(),
        problem,
    })
}

/// Writes a picture to where there is no going back, such as a pipe. It is encoded in memory first,
/// so that a picture that cannot be encoded sends nothing.
///
/// # Errors
/// When it cannot be encoded or written.
pub fn stream_picture(
    writer: &mut impl Write,
    format: PictureFormat,
    picture: &Picture,
    options: &PictureOptions,
) -> Result<(), WriteProblem> {
    stream_to(writer, |bytes| encode(bytes, format, picture, options))
}

/// [`write_layers`] to where there is no going back.
///
/// # Errors
/// When it cannot be encoded or written.
#[cfg(feature = "exr")]
pub fn stream_layers(
    writer: &mut impl Write,
    picture: &Picture,
    layers: &Layers,
    options: &PictureOptions,
) -> Result<(), WriteProblem> {
    stream_to(writer, |bytes| {
        encode_layers(bytes, picture, layers, options)
    })
}

fn stream_to(
    writer: &mut impl Write,
    encode: impl Fn(&mut dyn Target) -> Result<(), WriteProblem>,
) -> Result<(), WriteProblem> {
    let mut bytes = Cursor::new(Vec::new());
    encode(&mut bytes)?;
    writer.write_all(bytes.get_ref())?;
    Ok(writer.flush()?)
}

/// Whether something stands at `path` that is written to rather than replaced.
pub(crate) fn is_stream(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

#[cfg(feature = "exr")]
fn encode_layers(
    mut writer: &mut dyn Target,
    picture: &Picture,
    layers: &Layers,
    options: &PictureOptions,
) -> Result<(), WriteProblem> {
    let samples = options.samples_in(PictureFormat::Exr)?;
    exr::write(&mut writer, picture, Some(layers), samples, options)
}

fn encode(
    mut writer: &mut dyn Target,
    format: PictureFormat,
    picture: &Picture,
    options: &PictureOptions,
) -> Result<(), WriteProblem> {
    let samples = options.samples_in(format)?;
    #[cfg(not(any(feature = "png", feature = "tiff", feature = "exr")))]
    let _ = samples;
    let (width, height) = (picture.width, picture.height);
    if let Some(most) = format.most_side()
        && width.max(height) > most
    {
        return Err(WriteProblem::Encode(format!(
            "its format ends at {most} pixels a side, and it has {width} x {height}; write .png"
        )));
    }
    let writer = &mut writer;
    match format {
        #[cfg(feature = "png")]
        PictureFormat::Png => png::write(writer, picture, samples, options.panorama),
        #[cfg(feature = "jpeg")]
        PictureFormat::Jpeg => jpeg::write(writer, picture, options),
        #[cfg(feature = "tiff")]
        PictureFormat::Tiff => tiff::write(writer, picture, samples),
        #[cfg(feature = "webp")]
        PictureFormat::WebP => webp::write(writer, picture),
        #[cfg(feature = "exr")]
        PictureFormat::Exr => exr::write(writer, picture, None, samples, options),
        PictureFormat::Pfm => pfm::write(writer, picture),
        PictureFormat::Npy => npy::write(writer, picture),
        #[cfg(feature = "hdr")]
        PictureFormat::Hdr => hdr::write(writer, picture),
    }
}

#[cfg(any(feature = "jpeg", feature = "webp", feature = "hdr"))]
fn image_problem(error: image::ImageError) -> WriteProblem {
    match error {
        image::ImageError::IoError(error) => WriteProblem::Io(error),
        other => WriteProblem::Encode(other.to_string()),
    }
}
