use super::footprint::Footprints;
use super::lanes::{LANES, Lanes, sums};
use super::profile::{Gaussian, Mixture, Round, Weigh};
use super::{Ewa, Profile};
use crate::filter::Planes;

/// The weighted mean of the texels in one footprint, lane `lane` of `footprints`, whose base is texel `base`.
///
/// The box around it, enlarged to whole vectors, must lie within the planes and their apron.
#[inline(always)]
pub(crate) fn mean<const C: usize>(
    ewa: &Ewa,
    planes: &Planes,
    base: [i32; 2],
    footprints: &Footprints,
    lane: usize,
) -> [f32; C] {
    let sharp = footprints.sharp.0[lane];
    if sharp <= 0.0 {
        return scan(&Gaussian, planes, base, footprints, lane);
    }
    if sharp < 1.0 {
        return scan(&Mixture::new(sharp), planes, base, footprints, lane);
    }
    let round = match ewa.profile {
        Profile::Robidoux => &Round::ROBIDOUX,
        Profile::Mitchell => &Round::MITCHELL,
        _ => &Round::SHARP,
    };
    scan(round, planes, base, footprints, lane)
}

#[inline(always)]
fn scan<W: Weigh, const C: usize>(
    weigh: &W,
    planes: &Planes,
    base: [i32; 2],
    of: &Footprints,
    lane: usize,
) -> [f32; C] {
    let (u, v) = (of.u.0[lane], of.v.0[lane]);
    let (a, b, c) = (of.a.0[lane], of.b.0[lane], of.c.0[lane]);
    let [first_column, first_row] = of.first.map(|first| first[lane]);
    let [columns, rows] = of.count.map(|count| count[lane]);
    let (stride, pitch) = (planes.stride(), planes.stride() * planes.channels());
    let corner = planes
        .start(base[1] + first_row)
        .wrapping_add_signed((base[0] + first_column) as isize);
    let (mut sum, mut weight) = ([Lanes::all(0.0); C], Lanes::all(0.0));
    let mut done = 0;
    while done < columns {
        let across = Lanes::COUNT + Lanes::all((first_column + done) as f32 - u);
        let (square, product) = (across * across * Lanes::all(a), across * Lanes::all(b));
        let mut at = corner + done as usize;
        let mut down = first_row as f32 - v;
        for _ in 0..rows {
            // a U^2 + V (b U + c V).
            let q = (product + Lanes::all(c * down)).mul_add(Lanes::all(down), square);
            let weights = weigh.weights(q);
            weight = weight + weights;
            for (channel, sum) in sum.iter_mut().enumerate() {
                let texels = Lanes::load(&planes.samples()[at + channel * stride..]);
                *sum = weights.mul_add(texels, *sum);
            }
            at += pitch;
            down += 1.0;
        }
        done += LANES as i32;
    }
    finish(&sum, weight)
}

#[inline(always)]
fn finish<const C: usize>(sum: &[Lanes; C], weight: Lanes) -> [f32; C] {
    let zero = Lanes::all(0.0);
    let of = |k: usize| if k < C { sum[k] } else { zero };
    if C <= 3 {
        let [x, y, z, weight] = sums([of(0), of(1), of(2), weight]);
        return std::array::from_fn(|k| [x, y, z][k] / weight);
    }
    let totals = sums([of(0), of(1), of(2), of(3)]);
    let [weight, ..] = sums([weight, zero, zero, zero]);
    std::array::from_fn(|k| totals[k] / weight)
}
