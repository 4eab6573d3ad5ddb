//! Several deep pictures of one frame -> one that holds the samples of all, tidy.

use super::DeepHeader;
use super::header::Channel;
use super::image::{DeepImage, DeepPixels, SampleType, Samples, Window};
use super::tidy::{PixelSamples, Roles, Tidier};
use rayon::prelude::*;
use std::ops::Range;

/// Why deep pictures cannot be merged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MergeError {
    /// They are not of one frame.
    #[error(
        "picture {index} shows the frame {found:?}, the first {first:?}; render both in one size"
    )]
    Frames {
        /// The picture, counted from 0.
        index: usize,
        /// Its display window.
        found: Window,
        /// That of the first picture.
        first: Window,
    },
    /// They have not the same channels.
    #[error("picture {index} has the channels {found}, the first {first}; leave out what differs")]
    Channels {
        /// The picture, counted from 0.
        index: usize,
        /// Its channels.
        found: String,
        /// Those of the first picture.
        first: String,
    },
    /// They tell no depths.
    #[error("the pictures have no channel \"Z\", without which nothing has a depth")]
    NoDepth,
}

/// Merges deep pictures: samples that overlap are split, those that coincide are merged, by OpenEXR's
/// formulas, so that the result is tidy. Whole numbers (ids) are those of the earlier picture where
/// samples were merged.
///
/// The data window is that around all. Channels that are half floats in one picture and floats in
/// another become floats. Attributes are kept if all pictures have them alike.
///
/// # Errors
/// When the pictures are of different frames, or have different channels, or no channel Z.
///
/// # Panics
/// If there are no pictures.
pub fn merge(images: &[&DeepImage]) -> Result<DeepImage, MergeError> {
    let header = merged_header(images)?;
    let roles = Roles::of(&header.channels).ok_or(MergeError::NoDepth)?;
    let window = header.data_window;
    let rows: Vec<DeepPixels> = (0..window.height())
        .into_par_iter()
        .map_init(Default::default, |buffers, row| {
            merged_row(images, &header, &roles, row, buffers)
        })
        .collect();
    let mut pixels = DeepPixels::new(window.width() as usize, header.sample_types());
    for row in &rows {
        pixels.extend_from(row, 0..row.width());
    }
    Ok(DeepImage { header, pixels })
}

fn merged_header(images: &[&DeepImage]) -> Result<DeepHeader, MergeError> {
    let (first, others) = images.split_first().expect("at least one picture");
    let mut header = first.header.clone();
    for (index, other) in (1..).zip(others) {
        let other = &other.header;
        if other.display_window != header.display_window {
            return Err(MergeError::Frames {
                index,
                found: other.display_window,
                first: header.display_window,
            });
        }
        header.data_window = header.data_window.with(&other.data_window);
        let channels = || MergeError::Channels {
            index,
            found: told(&other.channels),
            first: told(&header.channels),
        };
        if other.channels.len() != header.channels.len() {
            return Err(channels());
        }
        let mut merged = Vec::new();
        for (own, other) in header.channels.iter().zip(&other.channels) {
            let sample_type = match (own.sample_type, other.sample_type) {
                (a, b) if a == b => a,
                (SampleType::Uint, _) | (_, SampleType::Uint) => return Err(channels()),
                _ => SampleType::Float,
            };
            if own.name != other.name {
                return Err(channels());
            }
            let name = own.name.clone();
            merged.push(Channel { name, sample_type });
        }
        header.channels = merged;
        header
            .attributes
            .retain(|own| other.attribute(&own.name) == Some(own));
    }
    Ok(header)
}

fn told(channels: &[Channel]) -> String {
    let told: Vec<_> = channels
        .iter()
        .map(|channel| format!("{} ({:?})", channel.name, channel.sample_type))
        .collect();
    told.join(", ")
}

/// What of a row of the whole lies in one picture: where it starts there, and its columns in the whole.
fn part_of_row(whole: &Window, own: &Window, row: u64) -> Option<(usize, Range<u64>)> {
    let offset = |axis: usize| (i64::from(own.min[axis]) - i64::from(whole.min[axis])) as u64;
    let own_row = row
        .checked_sub(offset(1))
        .filter(|&row| row < own.height())?;
    let columns = offset(0)..offset(0) + own.width();
    Some(((own_row * own.width()) as usize, columns))
}

fn merged_row(
    images: &[&DeepImage],
    header: &DeepHeader,
    roles: &Roles,
    row: u64,
    (tidier, pixel): &mut (Tidier, PixelSamples),
) -> DeepPixels {
    let window = &header.data_window;
    let mut merged = DeepPixels::new(window.width() as usize, header.sample_types());
    let parts: Vec<_> = images
        .iter()
        .filter_map(|image| {
            let part = part_of_row(window, &image.header.data_window, row)?;
            let channels: Vec<&Samples> = image.pixels.channels().iter().collect();
            Some((image, part, channels))
        })
        .collect();
    for column in 0..window.width() {
        pixel.clear();
        for (image, (start, columns), channels) in &parts {
            if columns.contains(&column) {
                let index = start + (column - columns.start) as usize;
                pixel.extend(roles, channels, image.pixels.samples_of(index));
            }
        }
        tidier.make_tidy(roles, pixel);
        merged.push_pixel(|channels| {
            let samples = pixel.values.chunks_exact(channels.len());
            for (sample, &[front, back]) in samples.zip(&pixel.depths) {
                for (index, (channel, &value)) in channels.iter_mut().zip(sample).enumerate() {
                    channel.push(match index {
                        _ if index == roles.z => front,
                        _ if Some(index) == roles.z_back => back,
                        _ => value,
                    });
                }
            }
        });
    }
    merged
}
