//! Linear pixels -> the numbers that formats for displays hold.

use crate::tone::srgb_from_linear;
use rayon::prelude::*;

/// Straight sRGB with opacity, 8 bits a channel.
#[cfg(any(feature = "png", feature = "tiff", feature = "webp"))]
pub fn rgba8(pixels: &[[f32; 4]]) -> Vec<u8> {
    let coded = |&pixel: &[f32; 4]| straight_srgb(pixel).map(|value| round(value, 255.0) as u8);
    pixels.par_iter().flat_map_iter(coded).collect()
}

/// Straight sRGB with opacity, 16 bits a channel.
#[cfg(any(feature = "png", feature = "tiff"))]
pub fn rgba16(pixels: &[[f32; 4]]) -> Vec<u16> {
    let coded = |&pixel: &[f32; 4]| straight_srgb(pixel).map(|value| round(value, 65_535.0) as u16);
    pixels.par_iter().flat_map_iter(coded).collect()
}

/// sRGB on white, 8 bits a channel.
#[cfg(feature = "jpeg")]
pub fn rgb8_on_white(pixels: &[[f32; 4]]) -> Vec<u8> {
    let coded = |&[r, g, b, alpha]: &[f32; 4]| {
        let white = 1.0 - alpha;
        [r, g, b].map(|light| round(srgb_from_linear((light + white).clamp(0.0, 1.0)), 255.0) as u8)
    };
    pixels.par_iter().flat_map_iter(coded).collect()
}

/// Premultiplied linear RGBA -> straight sRGB with opacity, all from 0 to 1.
#[cfg(any(feature = "png", feature = "tiff", feature = "webp"))]
fn straight_srgb([r, g, b, alpha]: [f32; 4]) -> [f32; 4] {
    if alpha <= 0.0 {
        return [0.0; 4];
    }
    let [r, g, b] = [r, g, b].map(|channel| srgb_from_linear((channel / alpha).clamp(0.0, 1.0)));
    [r, g, b, alpha.min(1.0)]
}

/// A value from 0 to 1 -> the nearest of the whole numbers up to `most`.
fn round(value: f32, most: f32) -> f32 {
    (value * most).round()
}

#[cfg(all(test, feature = "png", feature = "jpeg"))]
mod tests {
    use super::*;

    #[test]
    fn half_covered_pixels_keep_the_colour_of_their_surface() {
        let pixels = [
            [0.25, 1.0, 0.0, 1.0],
            [0.125, 0.5, 0.0, 0.5],
            [0.0; 4],
            [9.0; 4],
        ];
        // sRGB of 0.25 is 0.5371.
        let eight: [u8; 16] = [
            137, 255, 0, 255, 137, 255, 0, 128, 0, 0, 0, 0, 255, 255, 255, 255,
        ];
        assert_eq!(rgba8(&pixels), eight);
        let sixteen: [u16; 16] = [
            35_199, 65_535, 0, 65_535, 35_199, 65_535, 0, 32_768, 0, 0, 0, 0, 65_535, 65_535,
            65_535, 65_535,
        ];
        assert_eq!(rgba16(&pixels), sixteen);
    }

    #[test]
    fn without_opacity_what_is_not_covered_is_white() {
        let pixels = [[0.0; 4], [0.25, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.75]];
        assert_eq!(
            rgb8_on_white(&pixels),
            [255, 255, 255, 137, 0, 0, 137, 137, 137]
        );
    }
}
