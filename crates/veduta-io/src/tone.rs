//! Scene-linear light -> light of a display: exposure, a tone curve, a background.
//!
//! Each step is a function on a [`Picture`], applied in the order in which they stand here. Pictures
//! stay linear and premultiplied; the transfer curve of sRGB is the PNG writer's.

use crate::scaled;
use rayon::prelude::*;
use veduta::accumulate::Picture;

/// How much light becomes how much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Doublings: light is multiplied by 2 to this power.
    Ev(f32),
    /// So that the median luminance of the covered pixels becomes [`MEDIAN_TARGET`].
    Auto,
}

/// How light that is too bright for a display is rolled off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// Not at all: what is brighter than 1 is cut off by formats that end there.
    #[default]
    None,
    /// By [`filmic`].
    Filmic,
}

/// Luminance that [`Exposure::Auto`] gives to the median pixel. Lighter than the photographer's
/// middle grey of 0.18, which is for whole scenes with sky and deep shade: a single model, of which
/// we see the lit surfaces, would look dull.
pub const MEDIAN_TARGET: f32 = 0.3;

/// Opacity above which a pixel counts as covered.
const COVERED: f32 = 0.5;

/// The exposure of a picture in EV, which [`expose`] takes.
///
/// That of a picture without covered pixels, or of which half is black, is 0.
pub fn exposure_of(picture: &Picture, exposure: Exposure) -> f32 {
    match exposure {
        Exposure::Ev(ev) => ev,
        Exposure::Auto => {
            let mut luminances: Vec<f32> = picture
                .pixels
                .iter()
                .filter(|pixel| pixel[3] > COVERED)
                .map(|&[r, g, b, alpha]| luminance([r, g, b]) / alpha)
                .collect();
            if luminances.is_empty() {
                return 0.0;
            }
            let middle = luminances.len() / 2;
            let (_, &mut median, _) = luminances.select_nth_unstable_by(middle, f32::total_cmp);
            let ev = (MEDIAN_TARGET / median).log2();
            if median > 0.0 && ev.is_finite() {
                ev
            } else {
                0.0
            }
        }
    }
}

/// Luminance of linear Rec.709.
fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Multiplies light by 2 to the power `ev`.
pub fn expose(picture: &mut Picture, ev: f32) {
    let factor = ev.exp2();
    picture.pixels.par_iter_mut().for_each(|pixel| {
        for channel in &mut pixel[..3] {
            *channel *= factor;
        }
    });
}

/// Rolls off highlights. Curves are applied to straight colour, so that a half covered pixel has the
/// tone of its surface.
pub fn apply_tone(picture: &mut Picture, tone: Tone) {
    if tone == Tone::None {
        return;
    }
    picture.pixels.par_iter_mut().for_each(|pixel| {
        let alpha = pixel[3];
        if alpha > 0.0 {
            for channel in &mut pixel[..3] {
                *channel = filmic(*channel / alpha) * alpha;
            }
        }
    });
}

/// Where the shoulder of [`filmic`] begins.
const SHOULDER: f32 = 0.6;

/// A tone curve: nothing changes up to 0.6; above, light `x` becomes `0.6 + 0.4 t / (1 + t)` with
/// `t = (x - 0.6) / 0.4`. 0.7 becomes 0.68, 1 becomes 0.8, 2 becomes 0.91; 1 is reached nowhere.
///
/// Value and slope are continuous at 0.6. The shoulder is that of Reinhard et al., "Photographic
/// tone reproduction for digital images" (2002), moved above the range that a material's colour
/// has under white light, so that it comes through unchanged. Channels are taken one by one: bright
/// colours turn to white, as on film.
pub fn filmic(x: f32) -> f32 {
    if x <= SHOULDER {
        return x;
    }
    let range = 1.0 - SHOULDER;
    let t = (x - SHOULDER) / range;
    // Written so that an infinite t gives 1.
    SHOULDER + range * (1.0 - 1.0 / (1.0 + t))
}

/// Lays the picture on a background of one linear colour; all pixels become opaque.
///
/// Where a filter with lobes below 0 made an opacity of more than 1, the background counts negative:
/// white on white stays white.
pub fn lay_on(picture: &mut Picture, background: [f32; 3]) {
    picture.pixels.par_iter_mut().for_each(|pixel| {
        let rest = 1.0 - pixel[3];
        for (channel, background) in pixel.iter_mut().zip(background) {
            *channel += rest * background;
        }
        pixel[3] = 1.0;
    });
}

/// Lays the picture on another one, scaled to the same size; what the other lets through stays open.
pub fn lay_on_picture(picture: &mut Picture, background: &Picture) {
    let background = scaled(background, picture.width, picture.height);
    let pairs = picture
        .pixels
        .par_iter_mut()
        .zip(background.pixels.par_iter());
    pairs.for_each(|(pixel, behind)| {
        let rest = 1.0 - pixel[3];
        for (channel, behind) in pixel.iter_mut().zip(behind) {
            *channel += rest * behind;
        }
    });
}

/// A value of sRGB (0 to 1) -> linear light (IEC 61966-2-1).
pub fn linear_from_srgb(value: f32) -> f32 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear light (0 to 1) -> a value of sRGB (IEC 61966-2-1).
pub fn srgb_from_linear(light: f32) -> f32 {
    if light <= 0.003_130_8 {
        light * 12.92
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(pixels: Vec<[f32; 4]>) -> Picture {
        Picture {
            width: pixels.len() as u32,
            height: 1,
            pixels,
        }
    }

    #[test]
    fn automatic_exposure_puts_the_median_of_covered_pixels_at_its_target() {
        let grey = |value: f32, alpha: f32| [value * alpha, value * alpha, value * alpha, alpha];
        let mut shown = picture(vec![
            grey(0.0, 0.0),
            grey(90.0, 0.1),
            grey(1.0, 1.0),
            grey(2.0, 0.75),
            grey(1000.0, 1.0),
        ]);
        let ev = exposure_of(&shown, Exposure::Auto);
        expose(&mut shown, ev);
        let [r, .., alpha] = shown.pixels[3];
        assert!((r / alpha - MEDIAN_TARGET).abs() < 1e-6, "{r} {alpha}");
    }

    #[test]
    fn an_empty_or_black_picture_is_exposed_as_it_is() {
        for pixels in [vec![], vec![[0.0; 4]; 3], vec![[0.0, 0.0, 0.0, 1.0]; 3]] {
            assert_eq!(exposure_of(&picture(pixels), Exposure::Auto), 0.0);
        }
    }

    #[test]
    fn the_curve_ascends_smoothly_from_the_identity_to_one() {
        assert_eq!(filmic(0.25), 0.25);
        assert_eq!(filmic(SHOULDER), SHOULDER);
        assert!((filmic(0.7) - 0.7).abs() < 0.021);
        let step = 1e-3;
        let slope = (filmic(SHOULDER + step) - SHOULDER) / step;
        assert!((slope - 1.0).abs() < 5e-3, "slope {slope}");
        let mut last = 0.0;
        for i in 0..10_000 {
            let value = filmic(i as f32 * 1e-2);
            assert!(value >= last && value < 1.0);
            last = value;
        }
        assert_eq!(filmic(f32::INFINITY), 1.0);
    }

    #[test]
    fn tone_does_not_depend_on_opacity() {
        let mut shown = picture(vec![[2.0, 1.0, 0.5, 1.0], [1.0, 0.5, 0.25, 0.5]]);
        apply_tone(&mut shown, Tone::Filmic);
        for channel in 0..3 {
            let (whole, half) = (shown.pixels[0][channel], shown.pixels[1][channel]);
            assert!((whole - 2.0 * half).abs() < 1e-6);
        }
    }

    #[test]
    fn a_background_shows_as_much_as_the_picture_lets_through() {
        let mut shown = picture(vec![[0.0; 4], [0.5, 0.0, 0.0, 0.5], [0.2, 0.3, 0.4, 1.0]]);
        lay_on(&mut shown, [0.1, 0.2, 0.3]);
        assert_eq!(shown.pixels[0], [0.1, 0.2, 0.3, 1.0]);
        assert_eq!(shown.pixels[1], [0.55, 0.1, 0.15, 1.0]);
        assert_eq!(shown.pixels[2], [0.2, 0.3, 0.4, 1.0]);
    }

    #[test]
    fn a_picture_behind_shows_as_much_as_is_let_through_and_keeps_its_own_opacity() {
        let mut shown = picture(vec![[0.5, 0.0, 0.0, 0.5], [0.2, 0.3, 0.4, 1.0], [0.0; 4]]);
        let behind = picture(vec![[0.2, 0.4, 0.6, 1.0]]);
        lay_on_picture(&mut shown, &behind);
        assert_eq!(shown.pixels[0], [0.6, 0.2, 0.3, 1.0]);
        assert_eq!(shown.pixels[1], [0.2, 0.3, 0.4, 1.0]);
        assert_eq!(shown.pixels[2], [0.2, 0.4, 0.6, 1.0]);

        let mut open = picture(vec![[0.0; 4]]);
        lay_on_picture(&mut open, &picture(vec![[0.1, 0.1, 0.1, 0.5]]));
        assert_eq!(open.pixels[0][3], 0.5);
    }

    #[test]
    fn srgb_and_its_inverse_meet_at_every_8_bit_value() {
        for value in 0..=255u8 {
            let srgb = f32::from(value) / 255.0;
            let back = srgb_from_linear(linear_from_srgb(srgb));
            assert!((back - srgb).abs() < 1e-6, "{value}");
        }
    }
}
