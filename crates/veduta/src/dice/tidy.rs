//! Samples of other programs in one place -> samples that ascend in depth and do not overlap.
//!
//! The formulas are those of "Interpreting OpenEXR Deep Pixels" (openexr.com). A sample of opacity a that
//! reaches from z0 to z1 is a medium of constant density u / (z1 - z0), where u = -ln(1 - a), which gives
//! off c u / a of colour along its length; where samples overlap both add up, and n u of it has the opacity
//! 1 - exp(-n u). Samples at one depth add up as if they had one length.

/// A sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// Planar depths of its front and back; equal for a surface.
    pub depths: [f64; 2],
    /// 0 to 1.
    pub opacity: f64,
    /// Linear RGB, multiplied by the opacity.
    pub color: [f64; 3],
}

impl Sample {
    fn is_surface(&self) -> bool {
        self.depths[0] == self.depths[1]
    }

    /// `share` of the length of it, which lies between `depths`.
    fn part(&self, depths: [f64; 2], share: f64) -> Self {
        let mut sum = Medium::default();
        sum.add(self, share);
        sum.between(depths)
    }
}

/// What samples add up to.
#[derive(Clone, Copy, Debug, Default)]
struct Medium {
    /// The sum of -ln(1 - opacity).
    thickness: f64,
    glow: [f64; 3],
    /// Number and colours of those that let nothing through, which have no thickness.
    opaque: u32,
    opaque_color: [f64; 3],
}

impl Medium {
    fn add(&mut self, sample: &Sample, share: f64) {
        if sample.opacity >= 1.0 {
            self.opaque += 1;
            for (sum, color) in self.opaque_color.iter_mut().zip(sample.color) {
                *sum += color;
            }
            return;
        }
        let thickness = -(-sample.opacity).ln_1p();
        // u / a goes to 1 where a goes to 0.
        let ratio = if thickness > 0.0 {
            thickness / sample.opacity
        } else {
            1.0
        };
        self.thickness += share * thickness;
        for (sum, color) in self.glow.iter_mut().zip(sample.color) {
            *sum += share * color * ratio;
        }
    }

    /// The sample that all added up to.
    fn between(&self, depths: [f64; 2]) -> Sample {
        if self.opaque > 0 {
            return Sample {
                depths,
                opacity: 1.0,
                color: self
                    .opaque_color
                    .map(|color| color / f64::from(self.opaque)),
            };
        }
        let opacity = -(-self.thickness).exp_m1();
        let share = if self.thickness > 0.0 {
            opacity / self.thickness
        } else {
            1.0
        };
        Sample {
            depths,
            opacity,
            color: self.glow.map(|color| color * share),
        }
    }
}

/// Makes samples tidy, in buffers that it keeps.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tidier {
    untidy: Vec<Sample>,
    cuts: Vec<f64>,
}

impl Tidier {
    /// Makes `samples` tidy, in place. Those at equal depths are merged.
    pub fn make_tidy(&mut self, samples: &mut Vec<Sample>) {
        samples.sort_by(|a, b| {
            let [a, b] = [a.depths, b.depths];
            a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
        });
        if samples
            .windows(2)
            .all(|pair| are_apart(pair[0].depths, pair[1].depths))
        {
            return;
        }
        std::mem::swap(&mut self.untidy, samples);
        samples.clear();
        let mut first = 0;
        while first < self.untidy.len() {
            let mut end = first + 1;
            let mut reach = self.untidy[first].depths;
            while end < self.untidy.len() && !are_apart(reach, self.untidy[end].depths) {
                let next = self.untidy[end].depths;
                reach = [next[0], reach[1].max(next[1])];
                end += 1;
            }
            self.sweep(first..end, samples);
            first = end;
        }
    }

    /// Adds what samples that hang together add up to.
    fn sweep(&mut self, group: std::ops::Range<usize>, tidy: &mut Vec<Sample>) {
        let group = &self.untidy[group];
        if let [alone] = group {
            return tidy.push(*alone);
        }
        self.cuts.clear();
        self.cuts
            .extend(group.iter().flat_map(|sample| sample.depths));
        self.cuts.sort_by(f64::total_cmp);
        self.cuts.dedup();
        for (index, &cut) in self.cuts.iter().enumerate() {
            let mut surfaces = Medium::default();
            let mut count = 0;
            for sample in group.iter().filter(|sample| sample.depths == [cut, cut]) {
                surfaces.add(sample, 1.0);
                count += 1;
            }
            if count > 0 {
                tidy.push(surfaces.between([cut, cut]));
            }
            let Some(&next) = self.cuts.get(index + 1) else {
                continue;
            };
            let mut media = Medium::default();
            count = 0;
            for sample in group {
                let [front, back] = sample.depths;
                if front <= cut && next <= back {
                    media.add(sample, (next - cut) / (back - front));
                    count += 1;
                }
            }
            if count > 0 {
                tidy.push(media.between([cut, next]));
            }
        }
    }
}

/// Cuts tidy samples that reach through one of `depths` there.
pub(crate) fn cut_at(samples: &mut Vec<Sample>, depths: &[f64], buffer: &mut Vec<Sample>) {
    let is_through = |sample: &Sample| {
        let [front, back] = sample.depths;
        depths.iter().any(|&depth| front < depth && depth < back)
    };
    if !samples.iter().any(is_through) {
        return;
    }
    buffer.clear();
    for sample in &*samples {
        let [front, back] = sample.depths;
        if sample.is_surface() || !is_through(sample) {
            buffer.push(*sample);
            continue;
        }
        let mut within: Vec<f64> = depths.to_vec();
        within.retain(|&depth| front < depth && depth < back);
        within.sort_by(f64::total_cmp);
        within.dedup();
        within.push(back);
        let mut from = front;
        for to in within {
            buffer.push(sample.part([from, to], (to - from) / (back - front)));
            from = to;
        }
    }
    std::mem::swap(samples, buffer);
}

/// Whether two samples, sorted, neither overlap nor coincide.
fn are_apart(near: [f64; 2], far: [f64; 2]) -> bool {
    // A surface and a medium that begins where it is are apart; two surfaces at one depth are not.
    near[1] <= far[0] && (near[0] < far[0] || (near[0] == near[1] && far[0] < far[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(depths: [f64; 2], opacity: f64, color: f64) -> Sample {
        Sample {
            depths,
            opacity,
            color: [color, 0.5 * color, 0.0],
        }
    }

    fn tidied(samples: &[Sample]) -> Vec<Sample> {
        let mut samples = samples.to_vec();
        Tidier::default().make_tidy(&mut samples);
        samples
    }

    /// Colour and transmittance of tidy samples.
    fn over(samples: &[Sample]) -> [f64; 2] {
        let (mut color, mut through) = (0.0, 1.0);
        for sample in samples {
            color += through * sample.color[0];
            through *= 1.0 - sample.opacity;
        }
        [color, through]
    }

    #[test]
    fn a_medium_cut_anywhere_stays_what_it_was() {
        let whole = sample([2.0, 6.0], 0.8, 0.3);
        let mut cut = vec![whole, sample([7.0, 7.0], 0.5, 0.2)];
        cut_at(&mut cut, &[3.0, 1.0, 5.5, 3.0, 7.0], &mut Vec::new());
        let depths: Vec<_> = cut.iter().map(|sample| sample.depths).collect();
        assert_eq!(depths, [[2.0, 3.0], [3.0, 5.5], [5.5, 6.0], [7.0, 7.0]]);
        // 1 - (1 - a)^(1/4) for a quarter of it.
        assert!((cut[0].opacity - (1.0 - 0.2_f64.powf(0.25))).abs() < 1e-15);
        let [a, b] = [over(&cut[..3]), over(&[whole])];
        assert!((a[0] - b[0]).abs() < 1e-15 && (a[1] - b[1]).abs() < 1e-15);
    }

    #[test]
    fn surfaces_at_one_depth_mix_whatever_their_order() {
        let (red, blue) = (sample([1.0; 2], 0.5, 0.5), sample([1.0; 2], 0.25, 0.1));
        let [a, b] = [tidied(&[red, blue]), tidied(&[blue, red])];
        assert_eq!(a.len(), 1);
        assert!((a[0].opacity - b[0].opacity).abs() < 1e-15);
        assert!((a[0].opacity - (1.0 - 0.5 * 0.75)).abs() < 1e-15);
        // Opaque ones give the mean of their colours.
        let both = tidied(&[sample([1.0; 2], 1.0, 0.2), sample([1.0; 2], 1.0, 0.6), red]);
        assert_eq!((both.len(), both[0].opacity), (1, 1.0));
        assert!((both[0].color[0] - 0.4).abs() < 1e-15);
    }

    #[test]
    fn a_surface_within_a_medium_lies_between_its_parts() {
        let found = tidied(&[sample([1.0, 3.0], 0.75, 0.75), sample([2.0; 2], 1.0, 0.1)]);
        let depths: Vec<_> = found.iter().map(|sample| sample.depths).collect();
        assert_eq!(depths, [[1.0, 2.0], [2.0, 2.0], [2.0, 3.0]]);
        let [color, through] = over(&found);
        assert_eq!(through, 0.0);
        // Half of the medium has the opacity 1/2, as its square root has.
        assert!((color - (0.5 + 0.5 * 0.1)).abs() < 1e-15, "{color}");
    }

    #[test]
    fn what_is_apart_stays_as_it_is() {
        let samples = [
            sample([1.0; 2], 0.5, 0.1),
            sample([1.0, 2.0], 0.5, 0.2),
            sample([2.0, 4.0], 0.0, 0.3),
            sample([5.0; 2], 0.25, 0.4),
        ];
        let mut turned = samples;
        turned.reverse();
        assert_eq!(tidied(&turned), samples);
    }
}
