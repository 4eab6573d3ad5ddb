//! Parts and their radiance -> pixels.
//!
//! The box filter: a pixel is the sum over its parts of area times radiance. It is exact wherever
//! radiance is constant over a part. [`KernelFilter`] does the same with kernels that reach farther.
//!
//! [`DeepFilter`] keeps of each face in a pixel a sample of its own, with its depth. Beside the light,
//! what a picture tells of its pixels otherwise ([`Aovs`]), of which the areas of things ([`rank`]) are
//! summed up here.

mod aovs;
mod deep;
mod kernel_filter;
mod matte;

pub use aovs::{AovSettings, Aovs};
pub use deep::{DeepFilter, DeepRows, DeepSample};
pub use kernel_filter::{KernelFilter, KernelSums};
pub use matte::{Matte, Rank, rank};

use crate::dice::{GuestLight, Parts};
use crate::shade::Radiance;

/// A picture in linear light: RGBA, colour premultiplied by opacity, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` pixels.
    pub pixels: Vec<[f32; 4]>,
}

/// Sums a band's parts into `pixels`, the band's rows, which are overwritten. `sums` is a buffer.
///
/// Sums are f64: a pixel may have thousands of parts (foliage, distant terrain), and the rounding of
/// as many f32 additions would add up to more than the 1e-5 that a colour may be off.
pub fn box_filter(
    parts: &Parts,
    radiance: &Radiance,
    sums: &mut Vec<[f64; 4]>,
    pixels: &mut [[f32; 4]],
) {
    sums.clear();
    sums.resize(pixels.len(), [0.0; 4]);
    add_parts(parts, radiance, sums);
    for (pixel, sum) in pixels.iter_mut().zip(sums) {
        *pixel = sum.map(|channel| channel as f32);
    }
}

/// Adds a band's parts to `sums`, one for each of its pixels: RGBA as in a [`Picture`].
pub fn add_parts(parts: &Parts, radiance: &Radiance, sums: &mut [[f64; 4]]) {
    for (part, &[r, g, b]) in parts.boundary.iter().zip(&radiance.boundary) {
        let area = f64::from(part.area);
        let value = [r, g, b, 1.0].map(|channel| area * f64::from(channel));
        add(&mut sums[part.pixel as usize], value);
    }
    add_runs(parts, radiance, sums);
}

/// Adds to each pixel what fills it.
fn add_runs(parts: &Parts, radiance: &Radiance, sums: &mut [[f64; 4]]) {
    for (index, run) in parts.runs.iter().enumerate() {
        let sums = &mut sums[run.pixels()];
        match radiance.of_run(index) {
            &[[r, g, b]] => {
                let value = [r, g, b, 1.0].map(f64::from);
                sums.iter_mut().for_each(|sum| add(sum, value));
            }
            of_pixels => {
                for (sum, &[r, g, b]) in sums.iter_mut().zip(of_pixels) {
                    add(sum, [r, g, b, 1.0].map(f64::from));
                }
            }
        }
    }
}

/// Adds what is seen of guests to `pixels`, a band's rows.
pub fn add_guests(light: &[GuestLight], pixels: &mut [[f32; 4]]) {
    for of_pixel in light {
        let pixel = &mut pixels[of_pixel.pixel as usize];
        for (channel, more) in pixel.iter_mut().zip(of_pixel.light) {
            *channel = (f64::from(*channel) + more) as f32;
        }
    }
}

#[inline(always)]
fn add(sum: &mut [f64; 4], value: [f64; 4]) {
    for (channel, value) in sum.iter_mut().zip(value) {
        *channel += value;
    }
}
