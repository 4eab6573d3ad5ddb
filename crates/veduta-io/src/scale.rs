use rayon::prelude::*;
use veduta::accumulate::Picture;

/// The picture in another size, filtered in linear light.
///
/// Each direction by a triangle that reaches one pixel of the coarser of the two grids to each side.
/// So enlarging interpolates linearly between the centres of pixels, reducing averages
/// all pixels there are, and the same size changes nothing. At the border the weights inside it
/// are brought to a sum of one.
///
/// # Panics
/// If a size is 0.
pub fn scaled(picture: &Picture, width: u32, height: u32) -> Picture {
    let sides = [picture.width, picture.height, width, height];
    assert!(!sides.contains(&0), "pictures have pixels");
    let rows = weights(picture.height, height);
    let columns = weights(picture.width, width);
    let source_width = picture.width as usize;
    let mut pixels = vec![[0.0; 4]; width as usize * height as usize];
    pixels
        .par_chunks_mut(width as usize)
        .zip(&rows)
        .for_each(|(row, vertical)| {
            let mut mixed = vec![[0.0; 4]; source_width];
            for (index, &weight) in vertical.weights.iter().enumerate() {
                let start = (vertical.first + index) * source_width;
                let source = &picture.pixels[start..start + source_width];
                mixed.iter_mut().zip(source).for_each(|(sum, pixel)| {
                    add(sum, pixel, weight);
                });
            }
            for (pixel, horizontal) in row.iter_mut().zip(&columns) {
                let source = &mixed[horizontal.first..];
                for (source, &weight) in source.iter().zip(&horizontal.weights) {
                    add(pixel, source, weight);
                }
            }
        });
    Picture {
        width,
        height,
        pixels,
    }
}

fn add(sum: &mut [f32; 4], pixel: &[f32; 4], weight: f32) {
    for (sum, channel) in sum.iter_mut().zip(pixel) {
        *sum += weight * channel;
    }
}

/// What a row or column is mixed from.
struct Weights {
    /// The first source row or column.
    first: usize,
    /// Of it and those after it; their sum is 1.
    weights: Vec<f32>,
}

fn weights(source: u32, target: u32) -> Vec<Weights> {
    let step = f64::from(source) / f64::from(target);
    let reach = step.max(1.0);
    (0..target)
        .map(|index| {
            let centre = (f64::from(index) + 0.5) * step;
            let first = (centre - reach - 0.5).ceil().max(0.0);
            let last = (centre + reach - 0.5).floor().min(f64::from(source) - 1.0);
            let weights: Vec<f64> = (first as u32..=last as u32)
                .map(|at| 1.0 - (f64::from(at) + 0.5 - centre).abs() / reach)
                .collect();
            let sum: f64 = weights.iter().sum();
            Weights {
                first: first as usize,
                weights: weights.iter().map(|weight| (weight / sum) as f32).collect(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Picture {
        let pixels = (0..width * height)
            .map(|k| [value(k % width, k / width), 0.5, 0.25, 1.0])
            .collect();
        Picture {
            width,
            height,
            pixels,
        }
    }

    #[test]
    fn the_same_size_changes_nothing() {
        let original = picture(7, 5, |x, y| (x * y) as f32);
        assert_eq!(scaled(&original, 7, 5), original);
    }

    #[test]
    fn one_colour_stays_that_colour_in_any_size() {
        let original = picture(13, 7, |_, _| 0.75);
        for (width, height) in [(1, 1), (4, 29), (13, 70), (100, 3)] {
            for pixel in scaled(&original, width, height).pixels {
                for (found, expected) in pixel.iter().zip([0.75, 0.5, 0.25, 1.0]) {
                    assert!(
                        (found - expected).abs() < 1e-6,
                        "{width} x {height}: {pixel:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_slope_stays_a_slope() {
        // Away from the border, where weights end, filtering keeps what is linear.
        let original = picture(40, 3, |x, _| x as f32 + 0.5);
        for width in [20, 60, 97] {
            let made = scaled(&original, width, 3);
            let step = 40.0 / width as f32;
            for x in 3..width - 3 {
                let expected = (x as f32 + 0.5) * step;
                let found = made.pixels[(width + x) as usize][0];
                assert!(
                    (found - expected).abs() < 0.02 * step,
                    "{width}: {found} at {expected}"
                );
            }
        }
    }
}
