//! A pixel's kernel as the sum of smaller ones, where the mapping bends too much for one ellipse.

use std::sync::OnceLock;
use veduta_geometry::DVec2;

/// Variance along an axis, in square pixels, of the kernel exp(-2 r^2) that ends at r = 1:
/// (1 - 3 e^-2) / (4 (1 - e^-2)).
pub(super) const VARIANCE: f64 = 0.171_741_2;

/// How many times narrower parts may be than the whole: along the first axis, and along the second. Twice is worse than
/// not at all, since the sum then has too little of the kernel's end; more than these would take megabytes along the
/// rim of a mirror ball.
const COUNTS: [&[usize]; 2] = [&[1, 4, 8, 16], &[1, 4]];

/// Parts along a diameter, to one of the parts' radii: any farther apart, and their sum goes up and down between them.
const OVERLAP: usize = 3;

/// A part of a pixel's kernel: a smaller kernel.
pub(super) struct Part {
    /// Its centre from the pixel's, along the two axes in which it was split, pixels.
    pub away: DVec2,
    /// Its radii along them, pixels; those of the whole are 1.
    pub radii: DVec2,
    /// Those of all parts sum to 1.
    pub weight: f64,
}

/// How many times narrower parts are to be along an axis, where derivatives change by `change` times what one part
/// bears. Not more than `most`, about: what is narrower than a texel is as wide as a texel, and would only blur.
pub(super) fn count(axis: usize, change: f64, most: f64) -> usize {
    let (counts, change) = (COUNTS[axis], change.min(most));
    let enough = counts.iter().find(|&&count| count as f64 >= change);
    // The largest also where the change is not a number.
    *enough.unwrap_or(&counts[counts.len() - 1])
}

/// The parts that are that many times narrower along each axis, as [`count`] gives it; along one of them at least.
pub(super) fn parts(counts: [usize; 2]) -> &'static [Part] {
    static TABLES: [[OnceLock<Vec<Part>>; COUNTS[1].len()]; COUNTS[0].len()] =
        [const { [const { OnceLock::new() }; COUNTS[1].len()] }; COUNTS[0].len()];
    let index = |axis: usize| {
        let known = COUNTS[axis].iter().position(|&count| count == counts[axis]);
        known.expect("a count of this axis")
    };
    TABLES[index(0)][index(1)].get_or_init(|| made(counts))
}

fn made(counts: [usize; 2]) -> Vec<Part> {
    let along = |count: usize| -> Vec<f64> {
        let places = if count > 1 { OVERLAP * count } else { 1 };
        (0..places)
            .map(|k| (2 * k + 1) as f64 / places as f64 - 1.0)
            .collect()
    };
    let mut parts = Vec::new();
    for y in along(counts[1]) {
        for x in along(counts[0]) {
            let away = DVec2::new(x, y);
            if away.length_squared() >= 1.0 {
                continue;
            }
            let mut weight = (-2.0 * away.length_squared()).exp();
            let mut radii = DVec2::ONE / DVec2::from(counts.map(|count| count as f64));
            for k in 0..2 {
                if counts[k] == 1 {
                    // All of the chord, in one part.
                    let (share, variance) = chord((1.0 - away[1 - k] * away[1 - k]).sqrt());
                    weight *= share;
                    radii[k] = (variance / VARIANCE).sqrt();
                }
            }
            parts.push(Part {
                away,
                radii,
                weight,
            });
        }
    }
    let sum: f64 = parts.iter().map(|part| part.weight).sum();
    // Nearer to the middle by so much that with the parts' own variance that of all is right.
    let found = parts
        .iter()
        .map(|part| part.weight / sum * part.away * part.away);
    let found: DVec2 = found.sum();
    let wanted = counts.map(|count| VARIANCE * (1.0 - 1.0 / (count * count) as f64));
    let nearer = (DVec2::from(wanted) / found.max(DVec2::splat(1e-9))).powf(0.5);
    for part in &mut parts {
        part.weight /= sum;
        part.away *= nearer;
    }
    parts
}

/// Integral and variance of exp(-2 x^2) from `-half` to `half`.
fn chord(half: f64) -> (f64, f64) {
    const STEPS: u32 = 64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for k in 0..STEPS {
        let x = half * (f64::from(2 * k + 1) / f64::from(STEPS) - 1.0);
        let weight = (-2.0 * x * x).exp() * 2.0 * half / f64::from(STEPS);
        sum += weight;
        squares += weight * x * x;
    }
    (sum, squares / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_is_the_kernels() {
        let e = (-2.0_f64).exp();
        assert!((VARIANCE - (1.0 - 3.0 * e) / (4.0 * (1.0 - e))).abs() < 1e-7);
    }

    #[test]
    fn parts_have_the_weight_and_the_variance_of_the_whole() {
        for &first in COUNTS[0] {
            for &second in COUNTS[1] {
                let counts = [first, second];
                if counts == [1, 1] {
                    continue;
                }
                let parts = parts(counts);
                let sum: f64 = parts.iter().map(|part| part.weight).sum();
                assert!((sum - 1.0).abs() < 1e-12);
                let middle: DVec2 = parts.iter().map(|part| part.away * part.weight).sum();
                assert!(middle.length() < 1e-12);
                let variance = |part: &Part| {
                    part.weight * (part.away * part.away + VARIANCE * part.radii * part.radii)
                };
                let variance: DVec2 = parts.iter().map(variance).sum();
                // Of a disc made of few chords, a little is missing.
                let off = (variance - VARIANCE).abs().max_element();
                assert!(off < 0.02 * VARIANCE, "{counts:?}: {variance}");
            }
        }
    }

    #[test]
    fn counts_follow_the_change_but_not_below_a_texel() {
        let counts = |most: f64| [0.3, 1.0, 1.1, 3.0, 100.0, f64::NAN].map(|x| count(0, x, most));
        assert_eq!(counts(f64::INFINITY), [1, 1, 4, 4, 16, 16]);
        assert_eq!(counts(3.5), [1, 1, 4, 4, 4, 4]);
        assert_eq!(counts(0.9), [1; 6]);
    }
}
