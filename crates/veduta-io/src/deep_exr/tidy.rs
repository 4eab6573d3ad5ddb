//! Making a pixel tidy: samples that overlap are split, those that coincide are merged, all are sorted.
//!
//! The formulas are those of "Interpreting OpenEXR Deep Pixels". There, pairs of samples are split and
//! merged until nothing overlaps, which takes the square of their number and more. Here one sweep from
//! front to back does the same: a sample of opacity a that reaches from z0 to z1 is a medium of constant
//! density -ln(1 - a) / (z1 - z0), which gives off c/a of that as colour, and both add up where samples
//! overlap. (That is what the formula for merging says, and why it may be used for any number.)
//!
//! Densities are summed in a tree, so that a sample can be taken out of the sum without the rounding that
//! subtracting it would leave; a pixel of n samples costs n log n, whatever overlaps.

use super::header::Channel;
use super::image::{SampleType, Samples};
use std::ops::Range;

/// How channels go together.
#[derive(Clone, Debug)]
pub struct Roles {
    pub z: usize,
    pub z_back: Option<usize>,
    roles: Vec<Role>,
}

/// What a channel is, for merging.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    /// Opacity.
    Opacity,
    /// Premultiplied by the opacity in that channel.
    Of(usize),
    /// Neither mixes nor splits: that of the first of two is kept. Ids, depths, and whatever has no
    /// opacity.
    Carried,
}

/// The part of a name before its last dot, and the part after it.
pub fn layer_and_base(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

/// The opacity that belongs to a channel: of its own layer, else of the next that encloses it; of red
/// AR before A, and so on.
pub fn opacity_of(channels: &[Channel], name: &str) -> Option<usize> {
    let (mut layer, base) = layer_and_base(name);
    let own = match base {
        "R" | "G" | "B" => format!("A{base}"),
        _ => "A".to_owned(),
    };
    loop {
        for wanted in [own.as_str(), "A"] {
            let found = channels
                .iter()
                .position(|channel| layer_and_base(&channel.name) == (layer, wanted));
            if found.is_some() {
                return found;
            }
        }
        if layer.is_empty() {
            return None;
        }
        layer = layer_and_base(layer).0;
    }
}

impl Roles {
    /// `None` if there is no channel Z.
    pub fn of(channels: &[Channel]) -> Option<Self> {
        let named = |name| channels.iter().position(|channel| channel.name == name);
        let z = named("Z")?;
        let z_back = named("ZBack");
        let roles = channels.iter().enumerate().map(|(index, channel)| {
            let is_depth = index == z || Some(index) == z_back;
            if is_depth || channel.sample_type == SampleType::Uint {
                return Role::Carried;
            }
            match layer_and_base(&channel.name).1 {
                "A" | "AR" | "AG" | "AB" => Role::Opacity,
                _ => opacity_of(channels, &channel.name).map_or(Role::Carried, Role::Of),
            }
        });
        Some(Self {
            z,
            z_back,
            roles: roles.collect(),
        })
    }
}

/// Samples of one pixel: depths, and the values of all channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PixelSamples {
    /// Front and back of each; equal for a point sample.
    pub depths: Vec<[f64; 2]>,
    /// Sample after sample, as many as there are channels. Those of depth channels are not kept up to
    /// date.
    pub values: Vec<f64>,
}

impl PixelSamples {
    pub fn clear(&mut self) {
        self.depths.clear();
        self.values.clear();
    }

    /// Adds samples of a picture.
    pub fn extend(&mut self, roles: &Roles, channels: &[&Samples], samples: Range<usize>) {
        let depth = |channel: usize, sample| {
            let depth = channels[channel].value(sample);
            // What has no depth lies behind all. Adding 0 leaves of two zeros one.
            if depth.is_nan() {
                f64::INFINITY
            } else {
                depth + 0.0
            }
        };
        for sample in samples {
            let front = depth(roles.z, sample);
            let back = roles.z_back.map_or(front, |z| depth(z, sample));
            // One that reaches backwards, or for ever, is a point: a medium has a finite density.
            let is_volume = back > front && (back - front).is_finite();
            self.depths
                .push([front, if is_volume { back } else { front }]);
            let values = channels.iter().map(|channel| channel.value(sample));
            self.values.extend(values);
        }
    }

    fn copy(&mut self, from: &Self, sample: usize, channels: usize) {
        self.depths.push(from.depths[sample]);
        let values = sample * channels..(sample + 1) * channels;
        self.values.extend_from_slice(&from.values[values]);
    }
}

/// Makes pixels tidy, in buffers that it keeps.
#[derive(Clone, Debug, Default)]
pub struct Tidier {
    order: Vec<usize>,
    sorted: PixelSamples,
    /// Depths at which a volume begins or ends, ascending.
    cuts: Vec<f64>,
    ends: Vec<(f64, usize)>,
    sums: SumTree,
    tidy: PixelSamples,
}

impl Tidier {
    /// Makes the samples of a pixel tidy, in place. Samples at equal depths stay in their order.
    pub fn make_tidy(&mut self, roles: &Roles, pixel: &mut PixelSamples) {
        let channels = roles.roles.len();
        let depths = &pixel.depths;
        let ascends = |a: usize, b: usize| {
            let front = depths[a][0].total_cmp(&depths[b][0]);
            front.then(depths[a][1].total_cmp(&depths[b][1]))
        };
        let is_sorted = (1..depths.len()).all(|k| ascends(k - 1, k).is_le());
        if is_sorted && depths.windows(2).all(|pair| are_apart(pair[0], pair[1])) {
            return;
        }
        self.order.clear();
        self.order.extend(0..depths.len());
        self.order.sort_by(|&a, &b| ascends(a, b));
        self.sorted.clear();
        for &sample in &self.order {
            self.sorted.copy(pixel, sample, channels);
        }
        self.tidy.clear();
        let mut next = 0;
        while next < self.sorted.depths.len() {
            next = self.sweep_group(roles, next);
        }
        std::mem::swap(pixel, &mut self.tidy);
    }

    /// Sweeps the samples from `first` on that hang together, and tells where the next begin.
    fn sweep_group(&mut self, roles: &Roles, first: usize) -> usize {
        let channels = roles.roles.len();
        let depths = &self.sorted.depths;
        let mut last = first;
        let mut reach = depths[first];
        while last + 1 < depths.len() && !are_apart(reach, depths[last + 1]) {
            last += 1;
            reach = [depths[last][0], reach[1].max(depths[last][1])];
        }
        if last == first {
            self.tidy.copy(&self.sorted, first, channels);
            return first + 1;
        }
        let group = first..last + 1;
        let count = group.len();
        self.sums.reset(count, 2 * channels);
        self.cuts.clear();
        self.ends.clear();
        for sample in group.clone() {
            let [front, back] = depths[sample];
            self.cuts.push(front);
            if back > front {
                self.cuts.push(back);
                self.ends.push((back, sample - first));
            }
        }
        self.cuts.sort_by(f64::total_cmp);
        self.cuts.dedup();
        self.ends
            .sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));

        let (mut begun, mut ended) = (first, 0);
        for cut in 0..self.cuts.len() {
            let z = self.cuts[cut];
            while ended < self.ends.len() && self.ends[ended].0 <= z {
                self.sums.set(self.ends[ended].1, None);
                ended += 1;
            }
            // Points are sorted before volumes that begin where they are.
            let points = begun;
            while begun < group.end && self.sorted.depths[begun] == [z, z] {
                begun += 1;
            }
            self.push_points(roles, points..begun);
            while begun < group.end && self.sorted.depths[begun][0] == z {
                let values = &self.sorted.values[begun * channels..(begun + 1) * channels];
                let length = self.sorted.depths[begun][1] - z;
                let medium = Medium {
                    values,
                    roles,
                    length,
                };
                self.sums.set(begun - first, Some(&medium));
                begun += 1;
            }
            if let (Some(&end), Some(front)) = (self.cuts.get(cut + 1), self.sums.first()) {
                let front = first + front;
                self.push_interval(roles, front, [z, end]);
            }
        }
        last + 1
    }

    /// Adds points at one depth, merged to one.
    fn push_points(&mut self, roles: &Roles, points: Range<usize>) {
        let channels = roles.roles.len();
        match points.len() {
            0 => {}
            1 => self.tidy.copy(&self.sorted, points.start, channels),
            count => {
                let mut sums = std::mem::take(&mut self.sums);
                let mut own = SumTree::default();
                own.reset(count, 2 * channels);
                for point in points.clone() {
                    let medium = Medium {
                        values: &self.sorted.values[point * channels..(point + 1) * channels],
                        roles,
                        length: 1.0,
                    };
                    own.set(point - points.start, Some(&medium));
                }
                std::mem::swap(&mut self.sums, &mut own);
                self.push_mixed(roles, points.start, self.sorted.depths[points.start], 1.0);
                std::mem::swap(&mut self.sums, &mut sums);
            }
        }
    }

    /// Adds what all open volumes are between two depths. `front` is the first of them.
    fn push_interval(&mut self, roles: &Roles, front: usize, between: [f64; 2]) {
        if self.sums.is_one() && self.sorted.depths[front] == between {
            self.tidy.copy(&self.sorted, front, roles.roles.len());
        } else {
            self.push_mixed(roles, front, between, between[1] - between[0]);
        }
    }

    /// Adds a sample that is `length` of the medium in the sums. `first` tells what does not mix.
    fn push_mixed(&mut self, roles: &Roles, first: usize, depths: [f64; 2], length: f64) {
        let channels = roles.roles.len();
        self.tidy.depths.push(depths);
        let total = self.sums.total();
        let (thin, opaque) = total.split_at(channels);
        let opacity = |channel: usize| {
            if opaque[channel] > 0.0 {
                1.0
            } else {
                -(-thin[channel] * length).exp_m1()
            }
        };
        for (channel, &role) in roles.roles.iter().enumerate() {
            let value = match role {
                Role::Carried => self.sorted.values[first * channels + channel],
                Role::Opacity => opacity(channel),
                Role::Of(alpha) if opaque[alpha] > 0.0 => opaque[channel] / opaque[alpha],
                Role::Of(alpha) => {
                    let depth = thin[alpha] * length;
                    let share = if depth > 0.0 {
                        opacity(alpha) / depth
                    } else {
                        1.0
                    };
                    thin[channel] * length * share
                }
            };
            self.tidy.values.push(value);
        }
    }
}

/// An opacity as it may be: what is no number hides nothing.
pub fn within_0_and_1(opacity: f64) -> f64 {
    if opacity > 0.0 { opacity.min(1.0) } else { 0.0 }
}

/// Whether two samples, sorted, neither overlap nor coincide.
fn are_apart(near: [f64; 2], far: [f64; 2]) -> bool {
    // A point and a volume that begins where it is are apart; two points at one depth are not.
    near[1] <= far[0] && (near[0] < far[0] || (near[0] == near[1] && far[0] < far[1]))
}

/// A sample as a medium.
struct Medium<'a> {
    values: &'a [f64],
    roles: &'a Roles,
    length: f64,
}

impl Medium<'_> {
    fn opacity(&self, channel: usize) -> f64 {
        within_0_and_1(self.values[channel])
    }

    /// Writes what it adds to the sums: for each channel the density or the colour given off on a unit
    /// of length; then for each, if it is opaque there, 1 or its colour.
    fn add_to(&self, sums: &mut [f64]) {
        let (thin, opaque) = sums.split_at_mut(self.values.len());
        for (channel, role) in self.roles.roles.iter().enumerate() {
            match *role {
                Role::Carried => {}
                Role::Opacity => match self.opacity(channel) {
                    1.0 => opaque[channel] = 1.0,
                    alpha => thin[channel] = -(-alpha).ln_1p() / self.length,
                },
                Role::Of(channel_of_alpha) => match self.opacity(channel_of_alpha) {
                    1.0 => opaque[channel] = self.values[channel],
                    alpha => {
                        // -ln(1 - a) / a goes to 1 where a goes to 0.
                        let density = -(-alpha).ln_1p();
                        let ratio = if density > 0.0 { density / alpha } else { 1.0 };
                        thin[channel] = self.values[channel] * ratio / self.length;
                    }
                },
            }
        }
    }
}

/// Sums over samples that come and go: a binary tree whose nodes hold the sums of what is below them.
#[derive(Clone, Debug, Default)]
struct SumTree {
    /// Leaves, a power of two.
    leaves: usize,
    stride: usize,
    /// Node 1 is the root; the nodes below node k are 2k and 2k + 1; leaves come last.
    sums: Vec<f64>,
    /// How many samples are below each node.
    counts: Vec<u32>,
}

impl SumTree {
    fn reset(&mut self, samples: usize, stride: usize) {
        self.leaves = samples.next_power_of_two();
        self.stride = stride;
        self.sums.clear();
        self.sums.resize(2 * self.leaves * stride, 0.0);
        self.counts.clear();
        self.counts.resize(2 * self.leaves, 0);
    }

    /// Puts a sample in, or takes it out.
    fn set(&mut self, sample: usize, medium: Option<&Medium>) {
        let stride = self.stride;
        let mut node = self.leaves + sample;
        let leaf = &mut self.sums[node * stride..(node + 1) * stride];
        leaf.fill(0.0);
        self.counts[node] = u32::from(medium.is_some());
        if let Some(medium) = medium {
            medium.add_to(leaf);
        }
        while node > 1 {
            node /= 2;
            let (above, below) = self.sums.split_at_mut(2 * node * stride);
            let own = &mut above[node * stride..(node + 1) * stride];
            let (left, right) = below[..2 * stride].split_at(stride);
            for ((sum, left), right) in own.iter_mut().zip(left).zip(right) {
                *sum = left + right;
            }
            self.counts[node] = self.counts[2 * node] + self.counts[2 * node + 1];
        }
    }

    fn total(&self) -> &[f64] {
        &self.sums[self.stride..2 * self.stride]
    }

    fn is_one(&self) -> bool {
        self.counts[1] == 1
    }

    /// The first sample that is in.
    fn first(&self) -> Option<usize> {
        if self.counts[1] == 0 {
            return None;
        }
        let mut node = 1;
        while node < self.leaves {
            node *= 2;
            if self.counts[node] == 0 {
                node += 1;
            }
        }
        Some(node - self.leaves)
    }
}
