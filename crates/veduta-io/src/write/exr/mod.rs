//! OpenEXR: channels of a picture, in one part, in scanlines or tiles.

mod cryptomatte;
mod header;
mod layers;

pub use layers::Layers;

use super::{ExrCompression, PictureOptions, Samples, WriteProblem};
use crate::sphere::Panorama;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::image::write::channels::{ChannelsWriter, WritableChannels};
use exr::math::RoundingMode;
use exr::meta::attribute::{
    ChannelDescription, ChannelList, EnvironmentMap, LevelMode, LineOrder, SampleType, Text,
};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::{Blocks, Compression, Encoding, Image, Vec2, WritableImage, f16};
use half::slice::HalfFloatSliceExt;
use header::RecordHead;
use std::io::{Seek, Write};
use veduta::accumulate::Picture;
use veduta::reproject::Orientation;

/// A channel: its name, and its value at each pixel, counted along rows from the top.
struct Channel<'a> {
    name: String,
    values: Values<'a>,
}

/// How a channel is stored, and what.
enum Values<'a> {
    F16(Box<dyn Fn(usize) -> f32 + Sync + 'a>),
    F32(Box<dyn Fn(usize) -> f32 + Sync + 'a>),
    U32(Box<dyn Fn(usize) -> u32 + Sync + 'a>),
}

impl<'a> Channel<'a> {
    /// A channel that is stored like the picture's light.
    fn of_light(
        name: impl Into<String>,
        samples: Samples,
        value: impl Fn(usize) -> f32 + Sync + 'a,
    ) -> Self {
        let value = Box::new(value);
        Self {
            name: name.into(),
            values: match samples {
                Samples::F16 => Values::F16(value),
                _ => Values::F32(value),
            },
        }
    }

    /// A channel that half floats could not hold.
    fn of_floats(name: impl Into<String>, value: impl Fn(usize) -> f32 + Sync + 'a) -> Self {
        let (name, values) = (name.into(), Values::F32(Box::new(value)));
        Self { name, values }
    }

    /// A channel of whole numbers.
    fn of_numbers(name: impl Into<String>, value: impl Fn(usize) -> u32 + Sync + 'a) -> Self {
        let (name, values) = (name.into(), Values::U32(Box::new(value)));
        Self { name, values }
    }
}

/// Writes linear premultiplied RGBA, as f32 without loss or as f16, and the `layers` beside it.
pub fn write(
    writer: &mut (impl Write + Seek),
    picture: &Picture,
    layers: Option<&Layers>,
    samples: Samples,
    options: &PictureOptions,
) -> Result<(), WriteProblem> {
    let mut channels: Vec<Channel> = ["R", "G", "B", "A"]
        .into_iter()
        .enumerate()
        .map(|(k, name)| Channel::of_light(name, samples, move |pixel| picture.pixels[pixel][k]))
        .collect();
    let mut attributes = LayerAttributes {
        software_name: Some(Text::from("veduta")),
        ..LayerAttributes::default()
    };
    match options.panorama {
        Some(Panorama::ExrLatLong { orientation }) => {
            attributes.environment_map = Some(EnvironmentMap::LatitudeLongitude);
            attributes.world_to_camera = Some(world_to_camera(&orientation));
        }
        Some(Panorama::ExrCube) => attributes.environment_map = Some(EnvironmentMap::Cube),
        _ => {}
    }
    if let Some(layers) = layers {
        layers.check(picture)?;
        layers.add_channels(samples, &mut channels);
        layers.add_attributes(&mut attributes);
    }
    // The order that the format asks for.
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    let size = Vec2(picture.width as usize, picture.height as usize);
    let channels = Channels {
        width: size.0,
        list: channels,
    };
    let mut image = Image::from_encoded_channels(size, encoding(options), channels);
    image.layer_data.attributes = attributes;
    let mut recorder = RecordHead::new(writer);
    image
        .write()
        .to_buffered(&mut recorder)
        .map_err(|error| match error {
            exr::error::Error::Io(error) => WriteProblem::Io(error),
            other => WriteProblem::Encode(other.to_string()),
        })?;
    Ok(recorder.put_in_order()?)
}

/// For vectors that stand to the left of the matrix; in both spaces x is right, y up and z forward.
fn world_to_camera(orientation: &Orientation) -> [f32; 16] {
    // The inverse of a rotation is its transpose, and row vectors transpose once more.
    let axes = [orientation.right(), orientation.up(), orientation.forward()];
    let [right, up, forward] = axes.map(|axis| [axis.x, axis.y, -axis.z].map(|v| v as f32));
    let row = |k: usize| [right[k], up[k], forward[k], 0.0];
    let rows = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
    std::array::from_fn(|k| rows[k / 4][k % 4])
}

fn encoding(options: &PictureOptions) -> Encoding {
    Encoding {
        compression: match options.exr_compression {
            ExrCompression::None => Compression::Uncompressed,
            ExrCompression::Rle => Compression::RLE,
            ExrCompression::Zips => Compression::ZIP1,
            ExrCompression::Zip => Compression::ZIP16,
            ExrCompression::Piz => Compression::PIZ,
        },
        blocks: match options.exr_tile {
            None => Blocks::ScanLines,
            Some(side) => Blocks::Tiles(Vec2(side as usize, side as usize)),
        },
        // The same bytes whatever the number of threads.
        line_order: LineOrder::Increasing,
    }
}

/// All channels, ascending by name, as the encoder asks for them: line by line.
struct Channels<'a> {
    /// Of the picture, in pixels.
    width: usize,
    list: Vec<Channel<'a>>,
}

impl<'a, 'slf> WritableChannels<'slf> for Channels<'a>
where
    'a: 'slf,
{
    type Writer = &'slf Self;

    fn infer_channel_list(&self) -> ChannelList {
        let describe = |channel: &Channel| {
            let sample_type = match channel.values {
                Values::F16(_) => SampleType::F16,
                Values::F32(_) => SampleType::F32,
                Values::U32(_) => SampleType::U32,
            };
            ChannelDescription::named(channel.name.as_str(), sample_type)
        };
        ChannelList::new(self.list.iter().map(describe).collect())
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_writer(&'slf self, _: &Header) -> &'slf Self {
        self
    }
}

impl ChannelsWriter for &Channels<'_> {
    fn extract_uncompressed_block(&self, header: &Header, block: BlockIndex) -> Vec<u8> {
        UncompressedBlock::collect_block_data_from_lines(&header.channels, block, |line| {
            let at = line.location.position;
            let first = at.1 * self.width + at.0;
            let written = match &self.list[line.location.channel].values {
                Values::F16(value) => {
                    let values = (first..first + line.location.sample_count).map(value);
                    let halves = halves(&values.collect::<Vec<f32>>());
                    line.write_samples(|k| halves[k])
                }
                Values::F32(value) => line.write_samples(|k| value(first + k)),
                Values::U32(value) => line.write_samples(|k| value(first + k)),
            };
            written.expect("a line has room for its samples");
        })
    }
}

/// The nearest f16 of each. What is too bright becomes the brightest there is: infinities would spread
/// through every filter that follows. A line at a time, which is several times as quick as one by one.
fn halves(values: &[f32]) -> Vec<f16> {
    let most = f16::MAX.to_f32();
    let clamped: Vec<f32> = values
        .iter()
        .map(|&value| match value.is_finite() {
            true => value.clamp(-most, most),
            false => value,
        })
        .collect();
    let mut halves = vec![f16::ZERO; clamped.len()];
    halves.convert_from_f32_slice(&clamped);
    halves
}
