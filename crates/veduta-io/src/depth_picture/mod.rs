//! Flat pictures of other renderers that tell a depth in each pixel.
//!
//! 1. `channels` finds colours and depth by the names that common programs give them.
//! 2. `kind` knows what their numbers mean (distance along the line of sight or along the ray, its
//!    inverse, what a graphics card keeps) and makes planar depth of each.
//! 3. [`read_depth_picture`] does both, and fits the data windows of all parts into the frame.
//!
//! What is guessed is told, among the warnings: depths of a wrong kind look right and composite wrong.

mod channels;
mod kind;

pub use kind::DepthKind;

use crate::deep_exr::camera_from_matrices;
use crate::read_picture::{PictureProblem, ReadPictureError, check_size};
use channels::{Found, FullName};
use exr::image::{AnyChannels, FlatSamples, Image, Layer, Layers};
use exr::meta::MetaData;
use exr::meta::attribute::AttributeValue;
use exr::prelude::{ReadChannels, ReadLayers};
use rayon::prelude::*;
use std::io::Cursor;
use std::path::Path;
use veduta::accumulate::Picture;
use veduta::map::Camera;
use veduta_geometry::DVec2;

/// How the depths of a file are to be understood, where it does not tell or tells wrongly.
#[derive(Clone, Debug)]
pub struct DepthOptions {
    /// What the numbers mean; `None` for what the program that wrote the file is known to write.
    pub kind: Option<DepthKind>,
    /// The channel, by its full name; `None` for the one whose name says so.
    pub channel: Option<String>,
    /// Metres in the file's unit of length.
    pub metres_per_unit: f64,
    /// The camera; `None` for that of the file's attributes, if it has them.
    pub camera: Option<Camera>,
}

impl Default for DepthOptions {
    /// All as the file has it, in metres.
    fn default() -> Self {
        Self {
            kind: None,
            channel: None,
            metres_per_unit: 1.0,
            camera: None,
        }
    }
}

/// A flat picture with a depth in each pixel.
#[derive(Clone, Debug)]
pub struct DepthPicture {
    /// The frame, linear and premultiplied.
    pub picture: Picture,
    /// Planar depth of each pixel in metres, rows from the top; infinite where nothing is.
    pub depth: Vec<f32>,
    /// What the file's numbers were taken for.
    pub kind: DepthKind,
    /// The channel that they were in.
    pub channel: String,
    /// The camera that was given, or that of the file.
    pub camera: Option<Camera>,
    /// That of the file, if it tells one.
    pub file_camera: Option<Camera>,
    /// What a user should know; sentences without the file's name.
    pub warnings: Vec<String>,
}

/// Why a picture has no depths that can be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DepthProblem {
    /// No channel is named as one of depth.
    #[error("has no channel of depth among {found}; name the one that holds it")]
    NoDepth {
        /// The channels that it has.
        found: String,
    },
    /// The channel asked for is not there.
    #[error("has no channel {asked:?}; it has {found}")]
    NoSuchChannel {
        /// The channel asked for.
        asked: String,
        /// The channels that it has.
        found: String,
    },
    /// Several are, equally well.
    #[error("has several channels of depth, {found}; name one")]
    SeveralDepths {
        /// Their names.
        found: String,
    },
    /// Distances along rays need to know the rays.
    #[error("has distances along rays but tells no camera; give the camera that it was taken with")]
    NoCamera,
    /// A graphics card's depths need both planes.
    #[error(
        "cannot have device depths from {near} to {far}; give near above 0 and far beyond it (in \
         parallel projection finite)"
    )]
    NoRange {
        /// The near plane asked for.
        near: String,
        /// The far plane asked for.
        far: String,
    },
    /// It has no colours.
    #[error("has no colours beside its depths: none of {found} is red, green, blue or grey")]
    NoColor {
        /// The channels that it has.
        found: String,
    },
}

/// An OpenEXR file with all that it holds.
type Read = Image<Layers<AnyChannels<FlatSamples>>>;

/// Reads the colours and depths of an OpenEXR file.
///
/// # Errors
/// When the file cannot be read, is damaged, has no colours or no depths, or distances along rays
/// without a camera. Never panics.
pub fn read_depth_picture(
    path: &Path,
    options: &DepthOptions,
) -> Result<DepthPicture, ReadPictureError> {
    let read = || {
        let bytes = std::fs::read(path)?;
        let image = read_all(&bytes)?;
        depth_picture(&image, options, bytes.len())
    };
    read().map_err(|problem| ReadPictureError {
        file: path.to_owned(),
        problem,
    })
}

fn read_all(bytes: &[u8]) -> Result<Read, PictureProblem> {
    let problem = crate::read_picture::exr_problem;
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(problem)?;
    // All channels of all parts are held at once.
    let mut samples = 0_u64;
    for header in &meta.headers {
        let size = header.layer_size;
        check_size(size.width() as u64, size.height() as u64, bytes.len())?;
        let pixels = size.width() as u64 * size.height() as u64;
        samples = samples.saturating_add(pixels.saturating_mul(header.channels.list.len() as u64));
    }
    check_size(samples.max(1), 1, bytes.len())?;
    exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(problem)
}

/// A channel of the file, to be looked up at places of the frame.
struct Lookup<'a> {
    samples: &'a FlatSamples,
    /// Where the frame's first pixel is in the channel's window.
    offset: [i64; 2],
    size: [i64; 2],
}

impl<'a> Lookup<'a> {
    fn new(image: &'a Read, [layer, channel]: [usize; 2]) -> Self {
        let layer: &Layer<_> = &image.layer_data[layer];
        let frame = image.attributes.display_window.position;
        let own = layer.attributes.layer_position;
        let offset = |frame: i32, own: i32| i64::from(frame) - i64::from(own);
        Self {
            samples: &layer.channel_data.list[channel].sample_data,
            offset: [offset(frame.x(), own.x()), offset(frame.y(), own.y())],
            size: [layer.size.x() as i64, layer.size.y() as i64],
        }
    }

    /// The value at a pixel of the frame; `None` outside of the channel's window.
    fn at(&self, column: u32, row: u32) -> Option<f32> {
        let x = i64::from(column) + self.offset[0];
        let y = i64::from(row) + self.offset[1];
        let is_inside = (0..self.size[0]).contains(&x) && (0..self.size[1]).contains(&y);
        let index = is_inside.then(|| (y * self.size[0] + x) as usize)?;
        Some(self.samples.value_by_flat_index(index).to_f32())
    }
}

fn depth_picture(
    image: &Read,
    options: &DepthOptions,
    input: usize,
) -> Result<DepthPicture, PictureProblem> {
    let size = image.attributes.display_window.size;
    let (width, height) = check_size(size.x() as u64, size.y() as u64, input)?;
    let found = Found::of(&names(image), options.channel.as_deref())?;
    let mut warnings = Vec::new();
    let file_camera = camera_of(image);
    let camera = options.camera.or(file_camera);
    let kind = options.kind.unwrap_or_else(|| {
        let (kind, sentence) = guess(image, &found.depth_name);
        warnings.push(sentence);
        kind
    });
    if kind == DepthKind::Ray && camera.is_none() {
        return Err(DepthProblem::NoCamera.into());
    }
    kind.check(camera.as_ref())?;

    let depth = Lookup::new(image, found.depth);
    let colors = found.colors.map(|color| Lookup::new(image, color));
    let opacity = found.opacity.map(|opacity| Lookup::new(image, opacity));
    let middle = |column: u32, row: u32| {
        let size = DVec2::new(f64::from(width), f64::from(height));
        (DVec2::new(f64::from(column), f64::from(row)) + 0.5) / size
    };
    let (pixels, depth): (Vec<[f32; 4]>, Vec<f32>) = (0..height)
        .into_par_iter()
        .flat_map_iter(|row| (0..width).map(move |column| (column, row)))
        .map(|(column, row)| {
            let [r, g, b] = [0, 1, 2].map(|k| colors[k].at(column, row));
            let alpha = match &opacity {
                Some(opacity) => opacity.at(column, row),
                // What is in its window is opaque.
                None => r.map(|_| 1.0),
            };
            let pixel = [r, g, b, alpha].map(|value| value.unwrap_or(0.0));
            let depth = depth.at(column, row).map_or(f64::INFINITY, |value| {
                let planar = kind.planar(f64::from(value), camera.as_ref(), middle(column, row));
                planar * options.metres_per_unit
            });
            (pixel, depth as f32)
        })
        .unzip();
    if depth.iter().all(|depth| depth.is_infinite()) {
        warnings.push("nothing in it has a depth".to_owned());
    }
    Ok(DepthPicture {
        picture: Picture {
            width,
            height,
            pixels,
        },
        depth,
        kind,
        channel: found.depth_name,
        camera,
        file_camera,
        warnings,
    })
}

impl From<DepthProblem> for PictureProblem {
    fn from(problem: DepthProblem) -> Self {
        Self::Depth(problem)
    }
}

/// The names of all channels that have a sample in each pixel. Where there are several parts, a channel's
/// name begins with that of its part, as it does in files of one part.
fn names(image: &Read) -> Vec<FullName> {
    let several = image.layer_data.len() > 1;
    let mut names = Vec::new();
    for (index, layer) in image.layer_data.iter().enumerate() {
        let part = layer.attributes.layer_name.as_ref().map(|n| n.to_string());
        for (channel_index, channel) in layer.channel_data.list.iter().enumerate() {
            let own = channel.name.to_string();
            let name = match &part {
                Some(part)
                    if several && !part.is_empty() && !own.starts_with(&format!("{part}.")) =>
                {
                    format!("{part}.{own}")
                }
                _ => own,
            };
            if channel.sampling.x() == 1 && channel.sampling.y() == 1 {
                names.push(FullName {
                    name,
                    place: [index, channel_index],
                });
            }
        }
    }
    names
}

/// The camera of the first part that tells one.
fn camera_of(image: &Read) -> Option<Camera> {
    image.layer_data.iter().find_map(|layer| {
        let attributes = &layer.attributes;
        let to_camera = attributes.world_to_camera.as_ref()?;
        let to_ndc = attributes.world_to_normalized_device.as_ref()?;
        camera_from_matrices(to_camera, to_ndc)
    })
}

/// What the program that wrote the file is known to write, with a sentence that says so.
fn guess(image: &Read, channel: &str) -> (DepthKind, String) {
    let writer = known_writer(image);
    let (kind, reason) = match writer {
        Some("Nuke") => (DepthKind::Inverse, "Nuke writes 1/z"),
        Some("Mitsuba") => (DepthKind::Ray, "Mitsuba writes distances from the eye"),
        Some("Blender") => (DepthKind::Planar, "Blender writes it so"),
        _ => (
            DepthKind::Planar,
            "OpenEXR means it so, and the file does not tell its program",
        ),
    };
    let sentence = format!(
        "channel {channel:?} is taken for {}: {reason}; say so if it is another",
        kind.name()
    );
    (kind, sentence)
}

/// The program that wrote the file, if it is one whose depths are known.
fn known_writer(image: &Read) -> Option<&'static str> {
    const MARKS: [(&str, &str); 7] = [
        ("blendermultichannel", "Blender"),
        ("blender", "Blender"),
        ("cycles.", "Blender"),
        ("nuke/", "Nuke"),
        ("nuke", "Nuke"),
        ("generatedby", "Mitsuba"),
        ("mitsuba", "Mitsuba"),
    ];
    // Names of attributes, and the program's name where one tells it.
    let mut marks = Vec::new();
    for layer in &image.layer_data {
        let software = layer.attributes.software_name.as_ref();
        marks.extend(software.map(|name| name.to_string()));
        let others = layer.attributes.other.iter().chain(&image.attributes.other);
        for (name, value) in others {
            let name = name.to_string();
            if let (AttributeValue::Text(text), true) =
                (value, name.eq_ignore_ascii_case("software"))
            {
                marks.push(text.to_string());
            }
            marks.push(name);
        }
    }
    let marks: Vec<String> = marks.iter().map(|mark| mark.to_ascii_lowercase()).collect();
    let found = MARKS
        .iter()
        .find(|(start, _)| marks.iter().any(|mark| mark.starts_with(start)));
    found.map(|&(_, program)| program)
}
