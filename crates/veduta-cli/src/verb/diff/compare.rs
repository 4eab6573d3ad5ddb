//! The differences of two pictures of one size.

use veduta::accumulate::Picture;
use veduta_io::tone::{linear_from_srgb, srgb_from_linear};

/// The numbers that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// sRGB from 0 to 1, multiplied by opacity; what lies outside is cut off.
    Srgb,
    /// Linear light, multiplied by opacity.
    Linear,
}

impl Space {
    pub fn name(self) -> &'static str {
        match self {
            Self::Srgb => "sRGB",
            Self::Linear => "linear light",
        }
    }

    /// A pixel's numbers.
    fn of(self, pixel: [f32; 4]) -> [f64; 4] {
        let [r, g, b, alpha] = pixel;
        match self {
            Self::Linear => pixel.map(f64::from),
            Self::Srgb if alpha <= 0.0 => [0.0; 4],
            Self::Srgb => {
                let coded = |light: f32| {
                    f64::from(srgb_from_linear((light / alpha).clamp(0.0, 1.0))) * f64::from(alpha)
                };
                [coded(r), coded(g), coded(b), f64::from(alpha)]
            }
        }
    }
}

/// How much two pictures differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Differences {
    pub pixels: usize,
    /// Pixels with any difference.
    pub differing: usize,
    /// Pixels with a difference larger than the tolerance, or with a number that is not finite in
    /// one picture and another in the other.
    pub above: usize,
    /// Pixels of which a number is infinite or none at all in one picture and not the same in the
    /// other. They are left out of account in what follows.
    pub not_finite: usize,
    /// The largest difference; `None` if there is none.
    pub largest: Option<Largest>,
    /// Mean of the differences of all channels of all pixels.
    pub mean: f64,
    /// Root of the mean of their squares.
    pub rmse: f64,
}

/// The largest difference; of equal ones the first, from the top left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Largest {
    pub size: f64,
    /// Column and row.
    pub at: [usize; 2],
    pub channel: &'static str,
}

const CHANNELS: [&str; 4] = ["red", "green", "blue", "opacity"];

/// The differences of a pixel's channels; `None` where one is not finite.
fn differences(space: Space, a: [f32; 4], b: [f32; 4]) -> Option<[f64; 4]> {
    // Equal bits are equal, infinite or not.
    if a.map(f32::to_bits) == b.map(f32::to_bits) {
        return Some([0.0; 4]);
    }
    let finite = a.iter().chain(&b).all(|value| value.is_finite());
    let (a, b) = (space.of(a), space.of(b));
    finite.then(|| [0, 1, 2, 3].map(|k| (a[k] - b[k]).abs()))
}

impl Differences {
    /// Compares.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn of(a: &Picture, b: &Picture, space: Space, tolerance: f64) -> Self {
        let size = (a.width, a.height);
        assert_eq!(size, (b.width, b.height), "pictures of one size");
        let mut found = Self {
            pixels: a.pixels.len(),
            differing: 0,
            above: 0,
            not_finite: 0,
            largest: None,
            mean: 0.0,
            rmse: 0.0,
        };
        let (mut sum, mut squares) = (0.0, 0.0);
        for (index, (&a, &b)) in a.pixels.iter().zip(&b.pixels).enumerate() {
            let Some(differences) = differences(space, a, b) else {
                found.differing += 1;
                found.above += 1;
                found.not_finite += 1;
                continue;
            };
            let mut most = 0.0;
            for (difference, channel) in differences.into_iter().zip(CHANNELS) {
                sum += difference;
                squares += difference * difference;
                most = difference.max(most);
                if difference > found.largest.map_or(0.0, |largest| largest.size) {
                    let width = size.0 as usize;
                    found.largest = Some(Largest {
                        size: difference,
                        at: [index % width, index / width],
                        channel,
                    });
                }
            }
            found.differing += usize::from(most > 0.0);
            found.above += usize::from(most > tolerance);
        }
        let numbers = 4.0 * (found.pixels - found.not_finite).max(1) as f64;
        found.mean = sum / numbers;
        found.rmse = (squares / numbers).sqrt();
        found
    }
}

/// Colours of the heat picture in sRGB, from hardly any difference to the largest.
const HEAT: [[f32; 3]; 4] = [
    [0.35, 0.0, 0.05],
    [0.9, 0.2, 0.0],
    [1.0, 0.8, 0.1],
    [1.0, 1.0, 1.0],
];

/// Brightness of what is equal, of the first picture's.
const EQUAL_SHARE: f32 = 0.25;

/// A picture of where two differ. The heat grows by the square root of the difference, so that small
/// ones beside large ones are seen; what is not finite is as hot as can be.
pub fn heat(a: &Picture, b: &Picture, space: Space) -> Picture {
    let sizes: Vec<Option<f64>> = a
        .pixels
        .iter()
        .zip(&b.pixels)
        .map(|(&a, &b)| {
            let differences = differences(space, a, b)?;
            Some(differences.into_iter().fold(0.0, f64::max))
        })
        .collect();
    let largest = sizes.iter().flatten().fold(0.0, |a: f64, &b| a.max(b));
    let pixels = a.pixels.iter().zip(&sizes).map(|(pixel, size)| {
        let [r, g, b] = match *size {
            Some(0.0) => {
                let [r, g, b, _] = pixel.map(|value| if value.is_finite() { value } else { 0.0 });
                let luminance = (0.2126 * r + 0.7152 * g + 0.0722 * b).clamp(0.0, 1.0);
                [EQUAL_SHARE * srgb_from_linear(luminance); 3]
            }
            size => hot(size.map_or(1.0, |size| (size / largest).sqrt() as f32)),
        };
        let [r, g, b] = [r, g, b].map(linear_from_srgb);
        [r, g, b, 1.0]
    });
    Picture {
        width: a.width,
        height: a.height,
        pixels: pixels.collect(),
    }
}

/// The colour at `share` (0 to 1) of the way through [`HEAT`], sRGB.
fn hot(share: f32) -> [f32; 3] {
    let place = share * (HEAT.len() - 1) as f32;
    let row = (place as usize).min(HEAT.len() - 2);
    let rest = place - row as f32;
    [0, 1, 2].map(|k| HEAT[row][k] + rest * (HEAT[row + 1][k] - HEAT[row][k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(pixels: &[[f32; 4]]) -> Picture {
        Picture {
            width: 2,
            height: pixels.len() as u32 / 2,
            pixels: pixels.to_vec(),
        }
    }

    #[test]
    fn counts_and_sizes_are_as_worked_out_by_hand() {
        let a = picture(&[
            [0.5, 0.5, 0.5, 1.0],
            [0.0; 4],
            [0.25, 0.0, 0.0, 1.0],
            [0.0; 4],
        ]);
        let mut b = a.clone();
        b.pixels[0][1] = 0.75;
        b.pixels[2][0] = 0.375;
        let found = Differences::of(&a, &b, Space::Linear, 0.2);
        assert_eq!((found.pixels, found.differing, found.above), (4, 2, 1));
        let largest = found.largest.expect("they differ");
        assert_eq!(
            (largest.size, largest.at, largest.channel),
            (0.25, [0, 0], "green")
        );
        assert_eq!(found.mean, (0.25 + 0.125) / 16.0);
        assert_eq!(found.rmse, ((0.0625 + 0.015625) / 16.0_f64).sqrt());
    }

    #[test]
    fn what_is_not_finite_is_equal_to_itself_only() {
        let a = picture(&[[f32::INFINITY, 0.0, 0.0, 1.0], [f32::NAN, 0.0, 0.0, 1.0]]);
        assert_eq!(Differences::of(&a, &a, Space::Linear, 0.0).differing, 0);
        let b = picture(&[[1.0, 0.0, 0.0, 1.0], [f32::NAN, 0.0, 0.0, 1.0]]);
        let found = Differences::of(&a, &b, Space::Linear, 1e9);
        assert_eq!((found.above, found.not_finite), (1, 1));
        assert_eq!((found.mean, found.largest), (0.0, None));
    }

    #[test]
    fn in_srgb_a_step_is_as_large_in_the_dark_as_in_the_light() {
        let light = |step: f32| linear_from_srgb(step / 255.0);
        for step in [1.0, 100.0, 253.0] {
            let a = picture(&[[light(step), 0.0, 0.0, 1.0], [0.0; 4]]);
            let b = picture(&[[light(step + 1.0), 0.0, 0.0, 1.0], [0.0; 4]]);
            let found = Differences::of(&a, &b, Space::Srgb, 0.0);
            let size = found.largest.expect("they differ").size;
            assert!((255.0 * size - 1.0).abs() < 1e-3, "{size}");
        }
    }

    #[test]
    fn heat_is_grey_where_equal_and_white_where_most() {
        let a = picture(&[[1.0; 4], [0.5, 0.5, 0.5, 1.0], [0.0; 4], [1.0; 4]]);
        let mut b = a.clone();
        b.pixels[1][0] = 0.51;
        b.pixels[3][0] = 0.0;
        let made = heat(&a, &b, Space::Linear);
        let [grey, faint, black, white] = made.pixels[..] else {
            panic!("four pixels");
        };
        assert!(grey[0] == grey[1] && grey[1] == grey[2] && grey[0] > 0.0);
        assert!(faint[0] > 0.1 && faint[2] < 0.05, "{faint:?}");
        assert_eq!(black, [0.0, 0.0, 0.0, 1.0]);
        assert!(white.iter().all(|value| *value > 0.999), "{white:?}");
    }
}
