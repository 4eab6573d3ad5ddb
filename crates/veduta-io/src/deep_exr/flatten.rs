//! Deep pixels -> a flat picture, as "Interpreting OpenEXR Deep Pixels" says: make tidy, then over.

use super::header::Channel;
use super::image::{DeepPixels, Samples};
use super::read::Budget;
use super::tidy::{PixelSamples, Roles, Tidier, layer_and_base, opacity_of, within_0_and_1};
use super::{DeepFile, DeepHeader, DeepImage, DeepProblem};
use rayon::prelude::*;
use veduta::accumulate::Picture;

/// Makes rows of one picture flat.
#[derive(Clone, Debug)]
pub struct Flattener {
    /// Channels of the picture that matter; what follows counts within these.
    used: Vec<usize>,
    roles: Roles,
    /// Red, green, blue.
    colors: [Option<usize>; 3],
    /// The opacities that they are premultiplied by.
    opacities: [usize; 3],
    /// The opacity of the pixel; if there is none, the mean of those of the colours.
    opacity: Option<usize>,
}

/// What a thread keeps from pixel to pixel.
#[derive(Default)]
struct Buffers {
    tidier: Tidier,
    pixel: PixelSamples,
}

impl Flattener {
    /// Chooses the channels: R, G and B, or Y, of the base layer; if it has no colour, of the first layer
    /// that has.
    ///
    /// # Errors
    /// Without depth or opacity.
    pub fn new(header: &DeepHeader) -> Result<Self, DeepProblem> {
        let channels = &header.channels;
        let is = |channel: &Channel, layer: &str, base: &str| {
            layer_and_base(&channel.name) == (layer, base)
        };
        let has_color = |layer: &&str| {
            let mut bases = ["R", "G", "B", "Y"].into_iter();
            bases.any(|base| channels.iter().any(|channel| is(channel, layer, base)))
        };
        let layers = channels.iter().map(|c| layer_and_base(&c.name).0);
        let layer = std::iter::once("").chain(layers).find(has_color);
        let layer = layer.unwrap_or_default();
        let named = |base: &str| channels.iter().position(|channel| is(channel, layer, base));
        let opacity_of_base = |base: &str| match layer {
            "" => opacity_of(channels, base),
            _ => opacity_of(channels, &format!("{layer}.{base}")),
        };
        let colors = ["R", "G", "B"].map(|base| named(base).or(named("Y")));
        let mut opacities = [0; 3];
        for (opacity, base) in opacities.iter_mut().zip(["R", "G", "B"]) {
            *opacity = opacity_of_base(base).ok_or(DeepProblem::NoChannel("A"))?;
        }
        let opacity = opacity_of_base("Y");

        let mut used: Vec<usize> = ["Z", "ZBack"]
            .iter()
            .filter_map(|name| header.channel(name))
            .chain(colors.into_iter().flatten())
            .chain(opacities)
            .chain(opacity)
            .collect();
        used.sort_unstable();
        used.dedup();
        let own: Vec<Channel> = used.iter().map(|&k| channels[k].clone()).collect();
        let within = |channel: usize| used.partition_point(|&other| other < channel);
        Ok(Self {
            roles: Roles::of(&own).ok_or(DeepProblem::NoChannel("Z"))?,
            colors: colors.map(|color| color.map(within)),
            opacities: opacities.map(within),
            opacity: opacity.map(within),
            used,
        })
    }

    /// Whether the picture has colours; if not, what is flat is black.
    pub fn has_color(&self) -> bool {
        self.colors.iter().any(Option::is_some)
    }

    /// The channels of rows that matter.
    pub fn channels<'r>(&self, rows: &'r DeepPixels) -> Vec<&'r Samples> {
        self.used.iter().map(|&k| &rows.channels()[k]).collect()
    }

    /// How these go together.
    pub fn roles(&self) -> &Roles {
        &self.roles
    }

    /// Colour and opacity of a sample of a pixel with these values.
    pub fn color_and_opacity(&self, values: &[f64], sample: usize) -> ([f64; 3], f64) {
        let values = &values[sample * self.used.len()..(sample + 1) * self.used.len()];
        let color = self
            .colors
            .map(|color| color.map_or(0.0, |channel| values[channel]));
        let mean = || {
            self.opacities
                .iter()
                .map(|&k| within_0_and_1(values[k]))
                .sum::<f64>()
                / 3.0
        };
        (
            color,
            self.opacity.map_or_else(mean, |channel| values[channel]),
        )
    }

    /// Makes rows flat: linear, premultiplied.
    pub fn flatten(&self, rows: &DeepPixels) -> Vec<[f32; 4]> {
        let channels = self.channels(rows);
        (0..rows.rows() * rows.width())
            .into_par_iter()
            .with_min_len(1024)
            .map_init(Buffers::default, |Buffers { tidier, pixel }, index| {
                pixel.clear();
                pixel.extend(&self.roles, &channels, rows.samples_of(index));
                tidier.make_tidy(&self.roles, pixel);
                self.over(&pixel.values)
            })
            .collect()
    }

    /// Lays tidy samples one over the other.
    fn over(&self, values: &[f64]) -> [f32; 4] {
        let mut color = [0.0; 3];
        // What each colour lets through, and the pixel.
        let mut through = [1.0; 3];
        let mut whole_through = 1.0;
        for sample in values.chunks_exact(self.used.len()) {
            for k in 0..3 {
                color[k] += through[k] * self.colors[k].map_or(0.0, |channel| sample[channel]);
                through[k] *= 1.0 - within_0_and_1(sample[self.opacities[k]]);
            }
            if let Some(channel) = self.opacity {
                whole_through *= 1.0 - within_0_and_1(sample[channel]);
            }
        }
        let opacity = match self.opacity {
            Some(_) => 1.0 - whole_through,
            None => 1.0 - through.iter().sum::<f64>() / 3.0,
        };
        [color[0], color[1], color[2], opacity].map(|value| value as f32)
    }
}

impl DeepImage {
    /// The flat picture of the data window: linear, premultiplied.
    ///
    /// Samples may be in any order and overlap. Opaque ones that coincide give the mean of their
    /// colours.
    ///
    /// # Errors
    /// Without channel Z, or without opacity.
    ///
    /// # Panics
    /// If the data window has more than 2³² - 1 columns or rows.
    pub fn flatten(&self) -> Result<Picture, DeepProblem> {
        let flattener = Flattener::new(&self.header)?;
        let size =
            |count: u64| u32::try_from(count).expect("a picture of at most 2^32 pixels a side");
        Ok(Picture {
            width: size(self.header.data_window.width()),
            height: size(self.header.data_window.height()),
            pixels: flattener.flatten(&self.pixels),
        })
    }
}

impl DeepFile {
    /// [`DeepImage::flatten`] of a part, band by band, so that its samples are never all in memory. Also
    /// whether it has colours; without, the picture is black.
    ///
    /// # Errors
    /// As for [`DeepFile::read`] and [`DeepImage::flatten`].
    ///
    /// # Panics
    /// If there is no such part, or the data window has more than 2³² - 1 columns or rows.
    pub fn flatten(&self, part: usize) -> Result<(Picture, bool), DeepProblem> {
        let header = self.headers().nth(part).expect("a part of the file");
        let flattener = Flattener::new(header)?;
        let size =
            |count: u64| u32::try_from(count).expect("a picture of at most 2^32 pixels a side");
        let mut pixels = Vec::new();
        let mut budget = Budget::of_input(self.len());
        for band in 0..self.band_count(part) {
            // Samples are dropped after each band, pixels are not.
            let rows = self.read_band(part, band)?;
            budget.charge((rows.rows() * rows.width()).saturating_mul(size_of::<[f32; 4]>()))?;
            pixels.extend(flattener.flatten(&rows));
        }
        let picture = Picture {
            width: size(header.data_window.width()),
            height: size(header.data_window.height()),
            pixels,
        };
        Ok((picture, flattener.has_color()))
    }
}
