//! The scan as the paper prints it: row by row over the box around the ellipse, with differences of its equation, and a
//! table of weights. The reference for the quick scan, and what filters footprints that wrap far around.

use super::lanes::{Plain, Vector};
use super::profile::{Gaussian, Mixture, Round, Weigh};
use super::{Ewa, Footprints, Profile};
use crate::filter::Texels;
use std::sync::OnceLock;

/// Weights by the squared distance from the centre, 0 to 1 (the paper's WTAB).
///
/// Departure: entries are interpolated. To take the one below, as printed, is to shift all by half an entry.
#[derive(Clone, Debug)]
pub struct WeightTable {
    entries: Vec<f32>,
}

impl WeightTable {
    /// Entries between the centre and the end.
    const LENGTH: usize = 4096;

    /// A table of any function of the squared distance.
    pub fn new(weight: impl Fn(f32) -> f32) -> Self {
        let steps = 0..=Self::LENGTH;
        Self {
            entries: steps
                .map(|k| weight(k as f32 / Self::LENGTH as f32))
                .collect(),
        }
    }

    /// The weight at a squared distance of 0 to 1.
    pub fn at(&self, q: f64) -> f64 {
        let place = q.max(0.0) * Self::LENGTH as f64;
        let index = (place as usize).min(Self::LENGTH - 1);
        let [low, high] = [index, index + 1].map(|k| f64::from(self.entries[k]));
        low + (place - index as f64) * (high - low)
    }
}

/// The weights of a profile by the squared distance in radii of the filter, with the share `share` of the round profile
/// where it mixes.
pub fn weights(profile: Profile, share: f32) -> impl Fn(f64) -> f64 {
    static GAUSSIAN: OnceLock<WeightTable> = OnceLock::new();
    static SHARP: OnceLock<WeightTable> = OnceLock::new();
    static ROBIDOUX: OnceLock<WeightTable> = OnceLock::new();
    static MITCHELL: OnceLock<WeightTable> = OnceLock::new();
    fn table(cell: &'static OnceLock<WeightTable>, weigh: impl Weigh) -> &'static WeightTable {
        // Up to the end, where a Gaussian falls to 0 at once.
        let weight = |q: f32| weigh.weights((), Plain::all((), q.min(1.0 - 1e-6))).0[0];
        cell.get_or_init(|| WeightTable::new(weight))
    }
    let round = match profile {
        Profile::Sharp => table(&SHARP, Round::SHARP),
        Profile::Mitchell => table(&MITCHELL, Round::MITCHELL),
        _ => table(&ROBIDOUX, Round::ROBIDOUX),
    };
    let gaussian = table(&GAUSSIAN, Gaussian);
    let [of_round, of_gaussian] = Mixture::new(share).shares().map(f64::from);
    // Of a mixture, the Gaussian ends at half of the radius.
    let squeezed = if share > 0.0 { 4.0 } else { 1.0 };
    move |q| {
        let near = squeezed * q;
        let bell = if near < 1.0 { gaussian.at(near) } else { 0.0 };
        of_round * round.at(q) + of_gaussian * bell
    }
}

/// The ellipse `a U^2 + b U V + c V^2 < 1` around a point of a texture, texels' centres being at whole numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Its centre.
    pub centre: [f64; 2],
    /// `a`, `b` and `c`.
    pub equation: [f64; 3],
}

/// The weighted mean of the texels in an ellipse; `None` if it holds the centre of none.
pub fn mean<const C: usize>(
    texel: impl Fn(i32, i32) -> [f32; C],
    ellipse: &Ellipse,
    weights: impl Fn(f64) -> f64,
) -> Option<[f32; C]> {
    let [u0, v0] = ellipse.centre;
    let [a, b, c] = ellipse.equation;
    // Half the sides of the box around it.
    let determinant = a * c - 0.25 * b * b;
    let (du, dv) = ((c / determinant).sqrt(), (a / determinant).sqrt());
    let (u1, u2) = ((u0 - du).ceil() as i32, (u0 + du).floor() as i32);
    let (v1, v2) = ((v0 - dv).ceil() as i32, (v0 + dv).floor() as i32);
    let (mut numerator, mut denominator) = ([0.0; C], 0.0);
    let ddq = 2.0 * a;
    let u = f64::from(u1) - u0;
    for row in v1..=v2 {
        let v = f64::from(row) - v0;
        let mut dq = a * (2.0 * u + 1.0) + b * v;
        let mut q = (c * v + b * u) * v + a * u * u;
        for column in u1..=u2 {
            if q < 1.0 {
                let weight = weights(q);
                let texel = texel(column, row);
                for (sum, value) in numerator.iter_mut().zip(texel) {
                    *sum += weight * f64::from(value);
                }
                denominator += weight;
            }
            q += dq;
            dq += ddq;
        }
    }
    (denominator != 0.0).then(|| numerator.map(|sum| (sum / denominator) as f32))
}

/// The mean of a footprint that reaches far around a texture whose columns repeat.
pub(super) fn around(
    ewa: &Ewa,
    texels: &Texels,
    centre: [f64; 2],
    footprints: &Footprints,
) -> [f32; 4] {
    let equation = footprints.equation.map(|lanes| f64::from(lanes[0]));
    let ellipse = Ellipse { centre, equation };
    let weights = weights(ewa.profile, footprints.round[0]);
    let (width, rows) = (texels.width() as i32, texels.rows());
    let texel = |column: i32, row: i32| {
        let row = row.clamp(rows.start, rows.end - 1);
        texels.texel(column.rem_euclid(width), row)
    };
    mean(texel, &ellipse, weights).expect("a footprint holds the centre of a texel")
}
