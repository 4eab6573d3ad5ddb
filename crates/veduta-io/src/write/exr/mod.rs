//! OpenEXR: channels of a picture, in one part, in scanlines or tiles.

mod cryptomatte;
mod header;
mod layers;

pub use layers::Layers;

use super::{ExrCompression, PictureOptions, Samples, WriteProblem};
use crate::deep_exr::{DeepCompression, pack};
use crate::sphere::Panorama;
use exr::block::chunk::{
    Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock, TileCoordinates,
};
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock, enumerate_ordered_header_block_indices};
use exr::math::RoundingMode;
use exr::meta::BlockDescription;
use exr::meta::attribute::{
    ChannelDescription, EnvironmentMap, LevelMode, LineOrder, SampleType, Text, TileDescription,
};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::{Compression, Vec2, f16};
use half::slice::HalfFloatSliceExt;
use header::RecordHead;
use rayon::prelude::*;
use std::io::{Seek, Write};
use std::ops::Range;
use veduta::accumulate::Picture;
use veduta::reproject::Orientation;

/// Blocks that are packed side by side before they are written.
const BLOCKS_AT_ONCE: usize = 64;

/// A channel: its name, how its samples are stored, and those of a range of pixels, counted along rows from the top,
/// as bytes in the machine's order.
struct Channel<'a> {
    name: String,
    sample_type: SampleType,
    append: Box<Append<'a>>,
}

/// Appends the samples of pixels to bytes.
type Append<'a> = dyn Fn(Range<usize>, &mut Vec<u8>) + Sync + 'a;

impl<'a> Channel<'a> {
    /// A channel that is stored like the picture's light.
    fn of_light(
        name: impl Into<String>,
        samples: Samples,
        value: impl Fn(usize) -> f32 + Sync + 'a,
    ) -> Self {
        match samples {
            Samples::F16 => Self {
                name: name.into(),
                sample_type: SampleType::F16,
                append: Box::new(move |pixels, bytes| {
                    let halves = halves(pixels.map(&value));
                    append(halves.into_iter().map(f16::to_ne_bytes), bytes);
                }),
            },
            _ => Self::of_floats(name, value),
        }
    }

    /// A channel that half floats could not hold.
    fn of_floats(name: impl Into<String>, value: impl Fn(usize) -> f32 + Sync + 'a) -> Self {
        Self {
            name: name.into(),
            sample_type: SampleType::F32,
            append: Box::new(move |pixels, bytes| {
                append(pixels.map(|pixel| value(pixel).to_ne_bytes()), bytes);
            }),
        }
    }

    /// A channel of whole numbers.
    fn of_numbers(name: impl Into<String>, value: impl Fn(usize) -> u32 + Sync + 'a) -> Self {
        Self {
            name: name.into(),
            sample_type: SampleType::U32,
            append: Box::new(move |pixels, bytes| {
                append(pixels.map(|pixel| value(pixel).to_ne_bytes()), bytes);
            }),
        }
    }
}

/// Appends the bytes of samples.
fn append<const N: usize>(samples: impl ExactSizeIterator<Item = [u8; N]>, bytes: &mut Vec<u8>) {
    let first = bytes.len();
    bytes.resize(first + N * samples.len(), 0);
    let (places, _) = bytes[first..].as_chunks_mut::<N>();
    for (place, sample) in places.iter_mut().zip(samples) {
        *place = sample;
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
    let header = header(size, &channels, options).with_attributes(attributes);
    let mut recorder = RecordHead::new(writer);
    exr::block::write(
        &mut recorder,
        [header].into_iter().collect(),
        true,
        |meta, chunks| {
            let blocks = enumerate_ordered_header_block_indices(&meta.headers);
            let blocks: Vec<(usize, BlockIndex)> = blocks.collect();
            for blocks in blocks.chunks(BLOCKS_AT_ONCE) {
                let packed: Vec<exr::error::Result<Chunk>> = blocks
                    .par_iter()
                    .map(|&(_, block)| chunk(&meta.headers, block, &channels))
                    .collect();
                for (&(index, _), chunk) in blocks.iter().zip(packed) {
                    chunks.write_chunk(index, chunk?)?;
                }
            }
            Ok(())
        },
    )
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

fn header(size: Vec2<usize>, channels: &[Channel], options: &PictureOptions) -> Header {
    let describe =
        |channel: &Channel| ChannelDescription::named(channel.name.as_str(), channel.sample_type);
    let compression = match options.exr_compression {
        ExrCompression::None => Compression::Uncompressed,
        ExrCompression::Rle => Compression::RLE,
        ExrCompression::Zips => Compression::ZIP1,
        ExrCompression::Zip => Compression::ZIP16,
        ExrCompression::Piz => Compression::PIZ,
    };
    let blocks = match options.exr_tile {
        None => BlockDescription::ScanLines,
        Some(side) => BlockDescription::Tiles(TileDescription {
            tile_size: Vec2(side as usize, side as usize),
            level_mode: LevelMode::Singular,
            rounding_mode: RoundingMode::Down,
        }),
    };
    let channels = channels.iter().map(describe).collect();
    // The order is named so that the bytes do not depend on the number of threads.
    Header::new(Text::default(), size, channels).with_encoding(
        compression,
        blocks,
        LineOrder::Increasing,
    )
}

/// A block of the picture, packed. Deflate is our own, which is quicker than the encoder's.
fn chunk(headers: &[Header], block: BlockIndex, channels: &[Channel]) -> exr::error::Result<Chunk> {
    let header = &headers[block.layer];
    let data = samples(header, block, channels);
    let is_deflated = matches!(header.compression, Compression::ZIP1 | Compression::ZIP16);
    // The encoder puts bytes in the file's order where the machine's is another.
    if !is_deflated || cfg!(target_endian = "big") {
        return UncompressedBlock { index: block, data }.compress_to_chunk(headers);
    }
    let compressed_pixels_le = pack(DeepCompression::Zips, &data).into_owned();
    let compressed_block = match header.blocks {
        BlockDescription::ScanLines => CompressedBlock::ScanLine(CompressedScanLineBlock {
            y_coordinate: block.pixel_position.y() as i32,
            compressed_pixels_le,
        }),
        BlockDescription::Tiles(tiles) => CompressedBlock::Tile(CompressedTileBlock {
            coordinates: TileCoordinates {
                tile_index: block.pixel_position / tiles.tile_size,
                level_index: block.level,
            },
            compressed_pixels_le,
        }),
    };
    Ok(Chunk {
        layer_index: block.layer,
        compressed_block,
    })
}

/// The samples of a block, line by line, and of each line channel by channel.
fn samples(header: &Header, block: BlockIndex, channels: &[Channel]) -> Vec<u8> {
    let (position, size) = (block.pixel_position, block.pixel_size);
    let of_pixel: usize = channels
        .iter()
        .map(|channel| channel.sample_type.bytes_per_sample())
        .sum();
    let mut bytes = Vec::with_capacity(size.area() * of_pixel);
    for row in position.y()..position.y() + size.height() {
        let first = row * header.layer_size.width() + position.x();
        for channel in channels {
            (channel.append)(first..first + size.width(), &mut bytes);
        }
    }
    bytes
}

/// The nearest f16 of each. What is too bright becomes the brightest there is: infinities would spread
/// through every filter that follows. A line at a time, which is several times as quick as one by one.
fn halves(values: impl Iterator<Item = f32>) -> Vec<f16> {
    let most = f16::MAX.to_f32();
    let clamped: Vec<f32> = values
        .map(|value| match value.is_finite() {
            true => value.clamp(-most, most),
            false => value,
        })
        .collect();
    let mut halves = vec![f16::ZERO; clamped.len()];
    halves.convert_from_f32_slice(&clamped);
    halves
}
