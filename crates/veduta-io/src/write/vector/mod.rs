//! Drawings -> SVG, PDF and GeoJSON.

#[cfg(feature = "geojson")]
mod geojson;
mod outline;
#[cfg(feature = "pdf")]
mod pdf;
#[cfg(feature = "svg")]
mod svg;

use super::partial_file::PartialFile;
use super::{WriteError, WriteProblem, is_stream};
use crate::tone::srgb_from_linear;
use std::io::Write;
use std::path::Path;
use veduta::drawing::{Drawing, LineKind};

/// What a drawing is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VectorFormat {
    /// SVG 1.1: a group with id and title for each object, a path for each shape, the underpainting first,
    /// and a mask, the outline of all that is covered.
    #[cfg(feature = "svg")]
    Svg,
    /// PDF 1.7: an optional content group (a layer in viewers) for each object.
    #[cfg(feature = "pdf")]
    Pdf,
    /// GeoJSON (RFC 7946): a feature for each shape, in pixels with y upwards; no lines.
    #[cfg(feature = "geojson")]
    GeoJson,
}

/// Suffixes of the files that [`write_drawing`] writes. Each is also the name of its format.
pub const VECTOR_SUFFIXES: &[&str] = &[
    #[cfg(feature = "svg")]
    "svg",
    #[cfg(feature = "pdf")]
    "pdf",
    #[cfg(feature = "geojson")]
    "geojson",
];

impl VectorFormat {
    /// The format of that suffix, without its dot, in small or capital letters.
    pub fn of_suffix(suffix: &str) -> Option<Self> {
        match suffix.to_ascii_lowercase().as_str() {
            #[cfg(feature = "svg")]
            "svg" => Some(Self::Svg),
            #[cfg(feature = "pdf")]
            "pdf" => Some(Self::Pdf),
            #[cfg(feature = "geojson")]
            "geojson" => Some(Self::GeoJson),
            _ => None,
        }
    }

    /// The format that the suffix of `path` names, if it names one.
    pub fn of(path: &Path) -> Option<Self> {
        Self::of_suffix(path.extension()?.to_str()?)
    }

    /// Whether the format holds lines ([`Drawing::strokes`]).
    pub fn has_lines(self) -> bool {
        match self {
            #[cfg(feature = "geojson")]
            Self::GeoJson => false,
            #[cfg(any(feature = "svg", feature = "pdf"))]
            _ => true,
        }
    }
}

/// How to write a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct VectorOptions {
    /// Decimals of coordinates in pixels, at most [`MOST_DECIMALS`].
    pub decimals: u8,
    /// What lies behind everything, if anything: linear Rec.709 from 0 to 1.
    pub background: Option<[f32; 3]>,
    /// Width of lines in pixels.
    pub line_width: f64,
    /// Colour of lines: linear Rec.709 from 0 to 1.
    pub line_color: [f32; 3],
    /// Title of the document.
    pub title: String,
}

/// The most decimals of coordinates: those of a double at 65,535 pixels.
pub const MOST_DECIMALS: u8 = 9;

impl Default for VectorOptions {
    /// Hundredths of a pixel, no background, black lines of one pixel.
    fn default() -> Self {
        Self {
            decimals: 2,
            background: None,
            line_width: 1.0,
            line_color: [0.0; 3],
            title: String::new(),
        }
    }
}

/// Writes a drawing whose radiances are what a display shows (exposed and toned, 0 to 1, linear); an old
/// file of that name is replaced.
///
/// Shapes that vanish when their coordinates are rounded to [`VectorOptions::decimals`] are left out.
///
/// # Errors
/// When the file cannot be written; then nothing has changed.
pub fn write_drawing(
    path: &Path,
    format: VectorFormat,
    drawing: &Drawing,
    options: &VectorOptions,
) -> Result<(), WriteError> {
    let write = || -> Result<(), WriteProblem> {
        if is_stream(path) {
            let mut stream = std::fs::File::options().write(true).open(path)?;
            return stream_drawing(&mut stream, format, drawing, options);
        }
        let bytes = encode(format, drawing, options);
        let mut file = PartialFile::create(path)?;
        file.write_all(&bytes)?;
        Ok(file.finish()?)
    };
    write().map_err(|problem| WriteError {
        file: path.to_owned(),
        problem,
    })
}

/// [`write_drawing`] to where there is no going back, such as a pipe.
///
/// # Errors
/// When it cannot be written.
pub fn stream_drawing(
    writer: &mut impl Write,
    format: VectorFormat,
    drawing: &Drawing,
    options: &VectorOptions,
) -> Result<(), WriteProblem> {
    writer.write_all(&encode(format, drawing, options))?;
    Ok(writer.flush()?)
}

fn encode(format: VectorFormat, drawing: &Drawing, options: &VectorOptions) -> Vec<u8> {
    match format {
        #[cfg(feature = "svg")]
        VectorFormat::Svg => svg::encode(drawing, options).into_bytes(),
        #[cfg(feature = "pdf")]
        VectorFormat::Pdf => pdf::encode(drawing, options),
        #[cfg(feature = "geojson")]
        VectorFormat::GeoJson => geojson::encode(drawing, options).into_bytes(),
    }
}

/// 8-bit sRGB of linear light, as in the PNG of the same picture.
fn srgb8(light: [f32; 3]) -> [u8; 3] {
    light.map(|channel| (srgb_from_linear(channel.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

/// An opacity in thousandths.
fn thousandths(opacity: f32) -> i64 {
    (f64::from(opacity) * 1000.0).round() as i64
}

/// The name of a kind of lines, for groups.
#[cfg(any(feature = "svg", feature = "pdf"))]
fn name_of_lines(kind: LineKind) -> &'static str {
    match kind {
        LineKind::Silhouette => "silhouettes",
        LineKind::Boundary => "boundaries",
        LineKind::Crease => "creases",
        LineKind::Hidden => "hidden",
    }
}

/// The length of a dash of hidden lines beside others of `width`, in the same unit.
pub fn hidden_dash(width: f64) -> f64 {
    hidden_line(width)[1]
}

/// Width, dash and gap of hidden lines beside others of `width`: narrow and dashed, in the proportions of
/// ISO 128 (a dash of twelve widths, a gap of three).
fn hidden_line(width: f64) -> [f64; 3] {
    let narrow = 0.5 * width;
    [narrow, 12.0 * narrow, 3.0 * narrow]
}
