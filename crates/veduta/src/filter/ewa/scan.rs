use super::footprint::Footprints;
use super::lanes::{LANES, Vector};
use super::profile::{Gaussian, Mixture, Round, Weigh};
use super::{Ewa, Profile};
use crate::filter::Planes;

/// The weighted mean of the texels in one footprint, lane `lane` of `footprints`, whose base is texel `base`.
///
/// The box around it, enlarged to whole vectors, must lie within the planes and their apron.
#[inline(always)]
pub(crate) fn mean<V: Vector, const C: usize>(
    token: V::Token,
    ewa: &Ewa,
    planes: &Planes,
    base: [i32; 2],
    footprints: &Footprints,
    lane: usize,
) -> [f32; C] {
    let share = footprints.round[lane];
    // The Gaussian goes beyond no texel.
    if share <= 0.0 {
        return scan::<V, _, C>(token, &Gaussian, planes, base, footprints, lane);
    }
    let mean = if share < 1.0 {
        scan::<V, _, C>(token, &Mixture::new(share), planes, base, footprints, lane)
    } else {
        let round = match ewa.profile {
            Profile::Sharp => &Round::SHARP,
            Profile::Mitchell => &Round::MITCHELL,
            _ => &Round::ROBIDOUX,
        };
        scan::<V, _, C>(token, round, planes, base, footprints, lane)
    };
    if ewa.clamp {
        clamped(mean, planes, base, footprints, lane)
    } else {
        mean
    }
}

#[inline(always)]
fn scan<V: Vector, W: Weigh, const C: usize>(
    token: V::Token,
    weigh: &W,
    planes: &Planes,
    base: [i32; 2],
    of: &Footprints,
    lane: usize,
) -> [f32; C] {
    let (u, v) = (of.centre[0][lane], of.centre[1][lane]);
    let (a, b, c) = (
        of.equation[0][lane],
        of.equation[1][lane],
        of.equation[2][lane],
    );
    let all = |value: f32| V::all(token, value);
    let (first_column, first_row) = (of.first[0][lane], of.first[1][lane]);
    let (columns, rows) = (of.count[0][lane], of.count[1][lane]);
    let (stride, pitch) = (planes.stride(), planes.stride() * planes.channels());
    let corner = planes
        .start(base[1] + first_row)
        .wrapping_add_signed((base[0] + first_column) as isize);
    let (mut sum, mut weight) = ([all(0.0); C], all(0.0));
    let mut done = 0;
    while done < columns {
        let across = V::count(token) + all((first_column + done) as f32 - u);
        let (square, product) = (across * across * all(a), across * all(b));
        let mut at = corner + done as usize;
        let mut down = first_row as f32 - v;
        for _ in 0..rows {
            // a U^2 + V (b U + c V).
            let q = (product + all(c * down)).mul_add(all(down), square);
            let weights = weigh.weights(token, q);
            weight = weight + weights;
            for (channel, sum) in sum.iter_mut().enumerate() {
                let texels = V::load(token, &planes.samples()[at + channel * stride..]);
                *sum = weights.mul_add(texels, *sum);
            }
            at += pitch;
            down += 1.0;
        }
        done += LANES as i32;
    }
    let mut mean: [f32; C] = quotients(token, &sum, weight);
    // Equal texels shall give just that value, which rounded sums do not.
    let middle = planes
        .start(base[1] + v.round() as i32)
        .wrapping_add_signed((base[0] + u.round() as i32) as isize);
    for (channel, mean) in mean.iter_mut().enumerate() {
        let texel = planes.samples()[middle + channel * stride];
        if (*mean - texel).abs() <= ROUNDING * texel.abs() {
            *mean = texel;
        }
    }
    mean
}

/// What rounding may add to a mean of a hundred texels, relative; a mean nearer than this to the texel in its middle is
/// taken to be that texel.
const ROUNDING: f32 = 1e-6;

#[inline(always)]
fn quotients<V: Vector, const C: usize>(token: V::Token, sum: &[V; C], weight: V) -> [f32; C] {
    let mut four = [V::all(token, 0.0); 4];
    let weight = if C <= 3 {
        four[..C].copy_from_slice(sum);
        four[3] = weight;
        None
    } else {
        four.copy_from_slice(&sum[..4]);
        Some(V::sums([weight, weight, weight, weight])[0])
    };
    let totals = V::sums(four);
    let inverse = 1.0 / weight.unwrap_or(totals[3]);
    let mut means = [0.0; C];
    for (mean, total) in means.iter_mut().zip(totals) {
        *mean = total * inverse;
    }
    means
}

/// A mean between the darkest and the lightest of the texels in its footprint.
fn clamped<const C: usize>(
    mut mean: [f32; C],
    planes: &Planes,
    base: [i32; 2],
    of: &Footprints,
    lane: usize,
) -> [f32; C] {
    let [u, v] = of.centre.map(|centre| centre[lane]);
    let [a, b, c] = of.equation.map(|coefficient| coefficient[lane]);
    let [first_column, first_row] = of.first.map(|first| first[lane]);
    let [columns, rows] = of.count.map(|count| count[lane]);
    let (mut low, mut high) = ([f32::INFINITY; 4], [f32::NEG_INFINITY; 4]);
    for row in first_row..first_row + rows {
        for column in first_column..first_column + columns {
            let (x, y) = (column as f32 - u, row as f32 - v);
            if a * x * x + y * (b * x + c * y) < 1.0 {
                let texel = planes.texel(base[0] + column, base[1] + row);
                for k in 0..C {
                    low[k] = low[k].min(texel[k]);
                    high[k] = high[k].max(texel[k]);
                }
            }
        }
    }
    for (k, mean) in mean.iter_mut().enumerate() {
        *mean = mean.max(low[k]).min(high[k]);
    }
    mean
}
