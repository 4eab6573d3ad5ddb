//! The elliptical weighted average filter: a pixel's round footprint, mapped into a texture, becomes an ellipse, and the
//! pixel the weighted mean of the texels inside.
//!
//! After Ned Greene & Paul Heckbert, "Creating raster Omnimax images from multiple perspective views using the elliptical
//! weighted average filter" (1986). Comes in: a texture as [`Texels`], and of a pixel where its centre lies in it and
//! the derivatives of the mapping. Goes out: the mean. In order:
//!
//! 1. `footprint`: from the derivatives to the ellipse, of eight pixels at once;
//! 2. `scan`: the texels of one ellipse, eight of a row at once, weighed by a `profile`;
//! 3. footprints larger than [`Ewa::pyramid`] says go to two levels of a pyramid instead (this file), whose own blur is
//!    taken off the ellipse; those that reach over the apron, to `plain`.
//!
//! `plain` is the scan as the paper prints it. It serves footprints that wrap far around a panorama, and is what tests
//! hold the quick one to. The departures from the paper are in `docs/papers.md`.
//!
//! `lanes` is written so that the compiler makes vector instructions of it: AVX2 ones where the machine has them,
//! found out when the program runs, with the same results as without ([`vectorized`]).

mod footprint;
mod lanes;
pub mod plain;
mod profile;
mod scan;

pub use profile::Profile;

pub(crate) use footprint::Footprints;
pub(crate) use lanes::{LANES, Vector, Work, vectorized};
use scan::{MOST_OF_EIGHT, mean, means};

use super::Texels;

/// How the elliptical filter filters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ewa {
    /// How texels are weighed.
    pub profile: Profile,
    /// Variance of what one texel stands for, in square texels: 1/12 for the mean over its area, as renderers and
    /// cameras give it, 0 for a sample at its centre. The pixel's own ellipse is made smaller by it, else the picture
    /// would be filtered twice.
    pub variance: f32,
    /// Radius in texels, of the smaller kind, that footprints have in the finer of two levels of a pyramid; those
    /// larger than twice that use one. Smaller is quicker and less exact: 3 is good, 4 for masters. `None`: never,
    /// so that the cost of a pixel grows with its area in the texture.
    pub pyramid: Option<f32>,
    /// Whether a mean is kept between the darkest and the lightest of its texels. Those of radius 2 have lobes below
    /// 0, which ring around lights far brighter than what is beside them. It costs as much again as the filter.
    pub clamp: bool,
}

impl Default for Ewa {
    fn default() -> Self {
        Self {
            profile: Profile::Auto,
            variance: 1.0 / 12.0,
            pyramid: Some(3.0),
            clamp: false,
        }
    }
}

/// What footprints leave free of the apron: pixels whose centre is a little outside of the picture.
const MARGIN: f32 = 2.5;

/// Narrowest apron that the filter works with.
pub const LEAST_APRON: u32 = 8;

impl Ewa {
    /// The mean of a footprint with its centre at (`u`, `v`), in texels with centres at whole numbers, and derivatives
    /// `[ux, vx, uy, vy]` by the pixel's x and y.
    ///
    /// `levels` is a pyramid with filled aprons, finest first ([`Texels::halved`]); one level will do where
    /// [`pyramid`](Self::pyramid) is `None`. The centre lies in the picture, or not more than a texel outside.
    ///
    /// # Panics
    /// If the apron is narrower than [`LEAST_APRON`], or the centre lies farther outside.
    pub fn sample(&self, levels: &[Texels], [u, v]: [f64; 2], derivatives: [f32; 4]) -> [f32; 4] {
        let base = [u.floor(), v.floor()];
        vectorized(Sampling {
            ewa: self,
            levels,
            base: base.map(|x| x as i32),
            part: [(u - base[0]) as f32, (v - base[1]) as f32],
            derivatives,
        })
    }

    /// The means of eight footprints; `None` where one of them asks for more than the quick way gives.
    #[inline(always)]
    pub(crate) fn of_eight<V: Vector>(
        &self,
        token: V::Token,
        finest: &Texels,
        base: [i32; 2],
        footprints: &Footprints,
    ) -> Option<[[f32; 4]; LANES]> {
        let (reach, minor) = (
            V::of(token, footprints.reach),
            V::of(token, footprints.minor),
        );
        // No closures here: what the compiler does not inline has no vector instructions.
        if self.clamp
            || !reach.all_at_most(V::all(token, MOST_OF_EIGHT))
            || !minor.all_at_most(V::all(token, self.most_squared()))
        {
            return None;
        }
        Some(means::<V>(token, self, finest, base, footprints))
    }

    /// The mean of one of eight footprints, whose derivatives are told again.
    #[inline(always)]
    pub(crate) fn of_lane<V: Vector>(
        &self,
        token: V::Token,
        levels: &[Texels],
        base: [i32; 2],
        footprints: &Footprints,
        derivatives: [f32; 4],
        lane: usize,
    ) -> [f32; 4] {
        let texels = &levels[0];
        let near = footprints.reach[lane] <= texels.apron() as f32 - MARGIN;
        let small = footprints.minor[lane] <= self.most_squared();
        if near && small {
            return mean::<V>(token, self, texels, base, footprints, lane);
        }
        let part = footprints.centre.map(|centre| centre[lane]);
        self.large::<V>(token, levels, base, part, derivatives)
    }

    /// Squared minor radius above which a pyramid is used.
    #[inline(always)]
    fn most_squared(&self) -> f32 {
        self.pyramid
            .map_or(f32::INFINITY, |least| 4.0 * least * least)
    }

    /// The level, as a real number, for a footprint of this squared minor radius.
    pub(crate) fn level(&self, minor_squared: f32) -> f32 {
        match self.pyramid {
            Some(least) if minor_squared > self.most_squared() => {
                0.5 * (minor_squared / (least * least)).log2()
            }
            _ => 0.0,
        }
    }

    /// A footprint that is too large for the finest level or its apron.
    #[inline(always)]
    fn large<V: Vector>(
        &self,
        token: V::Token,
        levels: &[Texels],
        base: [i32; 2],
        part: [f32; 2],
        derivatives: [f32; 4],
    ) -> [f32; 4] {
        // At a pole or a rim they may be without bound; nothing is larger than all of the picture.
        let most = 2.0 * levels[0].width().max(levels[0].height()) as f32;
        let derivatives = derivatives.map(|d| {
            if d.is_nan() {
                most
            } else {
                d.clamp(-most, most)
            }
        });
        let centre = [0, 1].map(|k| f64::from(base[k]) + f64::from(part[k]));
        let last = levels.len() - 1;
        let level = self.level(minor_squared(derivatives)).min(last as f32);
        let (finer, share) = (level.floor() as usize, level.fract());
        let count = if share > 0.0 { 2 } else { 1 };
        let mut result = [0.0; 4];
        for index in 0..count {
            let mean: [f32; 4] =
                self.at_level::<V>(token, levels, finer + index, centre, derivatives);
            // The second by its difference to the first, so that equal values stay what they are.
            let part = if index == 0 { 1.0 } else { share };
            result = std::array::from_fn(|k| part.mul_add(mean[k] - result[k], result[k]));
        }
        result
    }

    /// The mean at one level, or at the first coarser one in which the footprint stays within the apron.
    #[inline(always)]
    fn at_level<V: Vector>(
        &self,
        token: V::Token,
        levels: &[Texels],
        level: usize,
        centre: [f64; 2],
        derivatives: [f32; 4],
    ) -> [f32; 4] {
        let mut level = level;
        loop {
            let texels = &levels[level];
            let scale = 1.0 / f64::from(1_u32 << level);
            let centre = centre.map(|x| (x + 0.5) * scale - 0.5);
            let base = centre.map(f64::floor);
            let part = [0, 1].map(|k| V::all(token, (centre[k] - base[k]) as f32));
            let variance = (0..level).fold(self.variance, |finer, _| 0.25 * (finer + 0.75));
            let limit = texels.apron() as f32 - MARGIN;
            let mut scaled = derivatives.map(|d| d * scale as f32);
            let all = |derivatives: [f32; 4]| derivatives.map(|d| V::all(token, d));
            let mut footprints = Footprints::new(token, self, variance, part, all(scaled));
            let reach = footprints.reach[0];
            if reach > limit && texels.repeats() {
                return plain::around(self, texels, centre, &footprints);
            }
            if reach > limit && level + 1 < levels.len() {
                level += 1;
                continue;
            }
            if reach > limit {
                // Larger than all there is, at the coarsest level: what the apron shows of it.
                scaled = scaled.map(|d| d * (limit / reach));
                footprints = Footprints::new(token, self, variance, part, all(scaled));
            }
            let base = base.map(|x| x as i32);
            return mean::<V>(token, self, texels, base, &footprints, 0);
        }
    }
}

/// [`Ewa::sample`], to be inlined where the vector instructions are known.
struct Sampling<'a> {
    ewa: &'a Ewa,
    levels: &'a [Texels],
    base: [i32; 2],
    part: [f32; 2],
    derivatives: [f32; 4],
}

impl Work for Sampling<'_> {
    type Output = [f32; 4];

    #[inline(always)]
    fn run<V: Vector>(self, token: V::Token) -> [f32; 4] {
        let all = |value: f32| V::all(token, value);
        let (ewa, steps) = (self.ewa, self.derivatives);
        let centre = self.part.map(all);
        let footprints = Footprints::new(token, ewa, ewa.variance, centre, steps.map(all));
        ewa.of_lane::<V>(token, self.levels, self.base, &footprints, steps, 0)
    }
}

/// Of footprints with these derivatives, the largest half extent and the squared minor radius of each, texels.
pub(crate) struct Measuring<'a> {
    pub ewa: &'a Ewa,
    pub derivatives: [[f32; LANES]; 4],
}

impl Work for Measuring<'_> {
    type Output = [[f32; LANES]; 2];

    #[inline(always)]
    fn run<V: Vector>(self, token: V::Token) -> Self::Output {
        let centre = [V::all(token, 0.0); 2];
        let steps = self.derivatives.map(|lanes| V::of(token, lanes));
        let of = Footprints::new(token, self.ewa, self.ewa.variance, centre, steps);
        [of.reach, of.minor]
    }
}

/// Squared minor radius of the ellipse with these derivatives.
pub(crate) fn minor_squared([ux, vx, uy, vy]: [f32; 4]) -> f32 {
    let (s11, s12, s22) = (ux * ux + uy * uy, ux * vx + uy * vy, vx * vx + vy * vy);
    let half = 0.5 * (s11 - s22);
    (0.5 * (s11 + s22) - (half * half + s12 * s12).sqrt()).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers without a pattern, a pyramid of one level.
    fn noise() -> Vec<Texels> {
        let mut texels = Texels::new(40, 40, 24);
        let mut seed = 7_u32;
        for row in texels.rows() {
            for column in texels.columns() {
                let texel = [0; 4].map(|_| {
                    seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (seed >> 8) as f32 / 16_777_216.0
                });
                texels.set(column, row, texel);
            }
        }
        vec![texels]
    }

    /// Derivatives of footprints from much smaller than a texel to some twenty across, turned and skewed.
    fn footprints() -> Vec<[f32; 4]> {
        let mut all = Vec::new();
        for size in [0.0, 0.3, 0.8, 1.3, 1.6, 2.5, 5.0] {
            for squeeze in [0.2, 0.7, 1.0] {
                for turn in 0..5 {
                    let (sin, cos) = (0.7 * turn as f32).sin_cos();
                    all.push([
                        size * cos,
                        size * sin,
                        -squeeze * size * sin,
                        squeeze * size * cos,
                    ]);
                }
            }
        }
        all
    }

    #[test]
    fn the_quick_scan_is_the_printed_one() {
        let levels = noise();
        for profile in [
            Profile::Auto,
            Profile::Gaussian,
            Profile::Sharp,
            Profile::Robidoux,
            Profile::Mitchell,
        ] {
            let ewa = Ewa {
                profile,
                pyramid: None,
                ..Ewa::default()
            };
            for (k, steps) in footprints().into_iter().enumerate() {
                let centre = [20.0 + 0.137 * k as f64, 19.0 + 0.311 * (k % 17) as f64];
                let base = centre.map(f64::floor);
                let part = [0, 1].map(|k| [(centre[k] - base[k]) as f32; LANES]);
                let part = part.map(lanes::Plain);
                let of = Footprints::new(
                    (),
                    &ewa,
                    ewa.variance,
                    part,
                    steps.map(|d| lanes::Plain([d; LANES])),
                );
                let ellipse = plain::Ellipse {
                    centre,
                    equation: of.equation.map(|lanes| f64::from(lanes[0])),
                };
                let texel = |column: i32, row: i32| levels[0].texel(column, row);
                let printed = plain::mean(texel, &ellipse, plain::weights(profile, of.round[0]));
                let printed = printed.expect("a texel inside");
                let quick = ewa.sample(&levels, centre, steps);
                for (quick, printed) in quick.into_iter().zip(printed) {
                    let off = (quick - printed).abs();
                    // A texel at the very end of a Gaussian may count in one and not in the other.
                    assert!(off < 2e-4, "{profile:?} {steps:?}: {quick} and {printed}");
                }
            }
        }
    }

    /// Eight footprints at once, with the same base.
    struct Eight<'a> {
        ewa: &'a Ewa,
        finest: &'a Texels,
        centre: [[f32; LANES]; 2],
        derivatives: [[f32; LANES]; 4],
    }

    impl Work for Eight<'_> {
        type Output = Option<[[f32; 4]; LANES]>;

        #[inline(always)]
        fn run<V: Vector>(self, token: V::Token) -> Self::Output {
            let centre = self.centre.map(|lanes| V::of(token, lanes));
            let steps = self.derivatives.map(|lanes| V::of(token, lanes));
            let footprints = Footprints::new(token, self.ewa, self.ewa.variance, centre, steps);
            self.ewa
                .of_eight::<V>(token, self.finest, [20, 19], &footprints)
        }
    }

    #[test]
    fn eight_at_once_are_each_alone_with_any_instructions() {
        let levels = noise();
        let all = footprints();
        let mut quick = 0;
        for profile in [Profile::Auto, Profile::Gaussian, Profile::Sharp] {
            let ewa = Ewa {
                profile,
                ..Ewa::default()
            };
            // Of about one size, as in a picture, and of all sizes.
            for (first, step) in (0..all.len()).flat_map(|first| [(first, 1), (first, 15)]) {
                let steps: [[f32; 4]; LANES] =
                    std::array::from_fn(|k| all[(first + step * k) % all.len()]);
                let centre = |k: usize| [0.7 * k as f32 - 2.0, 0.3 * k as f32];
                let eight = || Eight {
                    ewa: &ewa,
                    finest: &levels[0],
                    centre: [0, 1].map(|axis| std::array::from_fn(|k| centre(k)[axis])),
                    derivatives: [0, 1, 2, 3].map(|d| steps.map(|steps| steps[d])),
                };
                let found = vectorized(eight());
                assert_eq!(found, eight().run::<lanes::Plain>(()));
                let Some(means) = found else { continue };
                quick += 1;
                for (k, mean) in means.into_iter().enumerate() {
                    let [u, v] = centre(k).map(f64::from);
                    let alone = ewa.sample(&levels, [20.0 + u, 19.0 + v], steps[k]);
                    for (mean, alone) in mean.into_iter().zip(alone) {
                        // Sums in another order.
                        let off = (mean - alone).abs();
                        assert!(off < 1e-5, "{:?}: {mean} and {alone}", steps[k]);
                    }
                }
            }
        }
        assert!(quick > 100, "{quick}");
    }

    #[test]
    fn clamped_means_do_not_ring() {
        let mut texels = Texels::new(16, 16, 24);
        texels.set(8, 8, [1000.0; 4]);
        let levels = [texels];
        let mut below = [false; 2];
        for (clamp, below) in [false, true].into_iter().zip(&mut below) {
            let ewa = Ewa {
                clamp,
                ..Ewa::default()
            };
            for k in 0..64 {
                let centre = [6.0 + f64::from(k % 8) * 0.5, 6.0 + f64::from(k / 8) * 0.5];
                let mean = ewa.sample(&levels, centre, [0.8, 0.0, 0.0, 0.8]);
                *below |= mean[0] < 0.0;
            }
        }
        assert_eq!(below, [true, false]);
    }
}
