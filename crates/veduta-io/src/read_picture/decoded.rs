//! What all picture readers end in: a table of samples, made one kind of picture.

use super::LoadedPicture;
use crate::sphere::Panorama;
use crate::tone::linear_from_srgb;
use rayon::prelude::*;
use veduta::accumulate::Picture;

/// A decoded picture, as its file has it.
#[derive(Debug)]
pub struct Decoded {
    pub width: u32,
    pub height: u32,
    /// Samples of a pixel: grey, grey and opacity, colour, colour and opacity.
    pub channels: Channels,
    /// `width * height * channels` samples, rows from the top.
    pub samples: Samples,
    /// Whether colour is multiplied by opacity.
    pub premultiplied: bool,
    /// See [`LoadedPicture::panorama`].
    pub panorama: Option<Panorama>,
    /// See [`LoadedPicture::further_channels`].
    pub further_channels: Vec<String>,
    pub warnings: Vec<String>,
}

/// Samples of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    Grey = 1,
    GreyOpacity = 2,
    Color = 3,
    ColorOpacity = 4,
}

impl Channels {
    /// By their number.
    pub fn of_count(count: u64) -> Option<Self> {
        match count {
            1 => Some(Self::Grey),
            2 => Some(Self::GreyOpacity),
            3 => Some(Self::Color),
            4 => Some(Self::ColorOpacity),
            _ => None,
        }
    }
}

/// What numbers of 8 and 16 bits are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    Srgb,
    /// Light as it is.
    Linear,
}

impl Coding {
    fn light(self, value: f32) -> f32 {
        match self {
            Self::Srgb => linear_from_srgb(value),
            Self::Linear => value,
        }
    }
}

/// The table.
#[derive(Debug)]
pub enum Samples {
    /// Of a [`Coding`].
    U8(Vec<u8>),
    /// Of a [`Coding`].
    U16(Vec<u16>),
    /// Linear.
    F32(Vec<f32>),
}

impl Decoded {
    /// Makes it linear and premultiplied.
    pub fn finish(self, coding: Coding) -> LoadedPicture {
        let linear = matches!(self.samples, Samples::F32(_)) || coding == Coding::Linear;
        let pixels = match &self.samples {
            Samples::U8(samples) => {
                let table: Vec<f32> = (0..=255u8)
                    .map(|value| coding.light(f32::from(value) / 255.0))
                    .collect();
                let light = |value: u8| table[usize::from(value)];
                self.pixels(samples, light, |value| f32::from(value) / 255.0)
            }
            Samples::U16(samples) => {
                let unit = |value: u16| f32::from(value) / 65_535.0;
                self.pixels(samples, |value| coding.light(unit(value)), unit)
            }
            Samples::F32(samples) => self.pixels(samples, |value| value, |value| value),
        };
        LoadedPicture {
            picture: Picture {
                width: self.width,
                height: self.height,
                pixels,
            },
            linear,
            panorama: self.panorama,
            further_channels: self.further_channels,
            warnings: self.warnings,
        }
    }

    /// `light` makes a sample light, `opacity` makes it opacity.
    fn pixels<T: Copy + Sync>(
        &self,
        samples: &[T],
        light: impl Fn(T) -> f32 + Sync,
        opacity: impl Fn(T) -> f32 + Sync,
    ) -> Vec<[f32; 4]> {
        let pixel = |samples: &[T]| {
            let (color, alpha) = match *samples {
                [grey] => ([light(grey); 3], 1.0),
                [grey, alpha] => ([light(grey); 3], opacity(alpha)),
                [r, g, b] => ([light(r), light(g), light(b)], 1.0),
                [r, g, b, alpha] => ([light(r), light(g), light(b)], opacity(alpha)),
                _ => unreachable!("a pixel has one to four channels"),
            };
            let factor = if self.premultiplied { 1.0 } else { alpha };
            let [r, g, b] = color.map(|channel| channel * factor);
            [r, g, b, alpha]
        };
        samples
            .par_chunks_exact(self.channels as usize)
            .map(pixel)
            .collect()
    }
}
