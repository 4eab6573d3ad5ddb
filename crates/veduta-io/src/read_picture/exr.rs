use super::decoded::{Channels, Decoded, Samples};
use super::{PictureProblem, check_size};
use crate::deep_exr::{self, DeepFile, DeepProblem};
use crate::sphere::Panorama;
use exr::error::Error;
use exr::meta::MetaData;
use exr::meta::attribute::EnvironmentMap;
use exr::prelude::{ReadChannels, ReadLayers};
use std::io::Cursor;
use veduta::reproject::Orientation;

/// Reads the first layer that has R, G and B, with A if it has it; of a deep file the first deep part,
/// made flat.
pub fn read(bytes: Vec<u8>) -> Result<Decoded, PictureProblem> {
    if deep_exr::is_deep(&bytes) {
        return read_deep(bytes);
    }
    let bytes = &bytes[..];
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(problem)?;
    for header in &meta.headers {
        let size = header.layer_size;
        check_size(size.width() as u64, size.height() as u64, bytes.len())?;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size, _| (size, vec![[0.0f32; 4]; size.area()]),
            |(size, pixels), at, (r, g, b, a): (f32, f32, f32, f32)| {
                pixels[at.1 * size.0 + at.0] = [r, g, b, a];
            },
        )
        .first_valid_layer()
        .all_attributes()
        // The same order of work in every run; and what is read is small beside what is made.
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(problem)?;
    let of_picture = ["R", "G", "B", "A"];
    let channels = meta.headers.iter().flat_map(|header| &header.channels.list);
    let mut further: Vec<String> = channels
        .map(|channel| channel.name.to_string())
        .filter(|name| !of_picture.contains(&name.as_str()))
        .collect();
    further.sort();
    further.dedup();
    let environment = image.layer_data.attributes.environment_map;
    let (size, pixels) = image.layer_data.channel_data.pixels;
    let (width, height) = check_size(size.0 as u64, size.1 as u64, bytes.len())?;
    Ok(Decoded {
        width,
        height,
        channels: Channels::ColorOpacity,
        samples: Samples::F32(pixels.into_flattened()),
        premultiplied: true,
        panorama: environment.map(|kind| match kind {
            EnvironmentMap::LatitudeLongitude => Panorama::ExrLatLong {
                orientation: Orientation::default(),
            },
            EnvironmentMap::Cube => Panorama::ExrCube,
        }),
        further_channels: further,
        warnings: Vec::new(),
    })
}

fn read_deep(bytes: Vec<u8>) -> Result<Decoded, PictureProblem> {
    let input = bytes.len();
    let file = DeepFile::from_bytes(bytes)?;
    let window = file.headers().next().map(|header| header.data_window);
    let window = window.expect("there is at least one deep part");
    let (width, height) = check_size(window.width(), window.height(), input)?;
    let (picture, has_color) = file.flatten(0)?;
    let mut warnings = Vec::new();
    if !has_color {
        warnings.push("it has no colours, so that it is black where it is not clear".to_owned());
    }
    Ok(Decoded {
        width,
        height,
        channels: Channels::ColorOpacity,
        samples: Samples::F32(picture.pixels.into_flattened()),
        premultiplied: true,
        panorama: None,
        further_channels: Vec::new(),
        warnings,
    })
}

impl From<DeepProblem> for PictureProblem {
    fn from(problem: DeepProblem) -> Self {
        match problem {
            DeepProblem::Unreadable(error) => Self::Unreadable(error),
            problem => Self::Deep(problem),
        }
    }
}

pub fn problem(error: Error) -> PictureProblem {
    match error {
        Error::NotSupported(message) => PictureProblem::Unsupported(message.into_owned()),
        other => PictureProblem::Damaged(other.to_string().replace('\n', " ")),
    }
}
