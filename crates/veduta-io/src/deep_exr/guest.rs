//! Deep pixels -> the samples of a guest.

use super::flatten::Flattener;
use super::image::Samples;
use super::read::Budget;
use super::tidy::{PixelSamples, within_0_and_1};
use super::{DeepFile, DeepProblem, IdNames};
use veduta::map::{Guest, GuestSamples};

impl DeepFile {
    /// All samples of a part, as they stand. `nearness` is given a depth of the file and the column and row
    /// of its pixel, counted from the data window's corner. Samples belong to the objects that `names` tells, in the
    /// order of their ids.
    ///
    /// # Errors
    /// As for [`DeepFile::flatten`].
    ///
    /// # Panics
    /// If there is no such part.
    pub fn guest_samples(
        &self,
        part: usize,
        names: Option<&IdNames>,
        nearness: impl Fn(f64, [u64; 2]) -> f64,
    ) -> Result<GuestSamples, DeepProblem> {
        let header = self.headers().nth(part).expect("a part of the file");
        let flattener = Flattener::new(header)?;
        let objects: Vec<u32> = names.iter().flat_map(|n| n.names.keys()).copied().collect();
        let mut samples = GuestSamples::default();
        let mut pixel = PixelSamples::default();
        let mut budget = Budget::of_input(self.len());
        for band in 0..self.band_count(part) {
            let rows = self.read_band(part, band)?;
            budget.charge(
                rows.sample_count()
                    .saturating_mul(Self::BYTES_OF_GUEST_SAMPLE),
            )?;
            budget.charge((rows.rows() * rows.width()).saturating_mul(size_of::<u32>()))?;
            let channels: Vec<&Samples> = flattener.channels(&rows);
            let ids = match names.map(|names| &rows.channels()[names.channel]) {
                Some(Samples::Uint(ids)) => Some(&ids[..]),
                _ => None,
            };
            let first_row = self.rows_of_band(part, band).start;
            for index in 0..rows.rows() * rows.width() {
                pixel.clear();
                let of_pixel = rows.samples_of(index);
                pixel.extend(flattener.roles(), &channels, of_pixel.clone());
                let object_of = |sample: usize| {
                    let id = ids?[of_pixel.start + sample];
                    objects.binary_search(&id).ok().map(|row| row as u32)
                };
                let place = [
                    (index % rows.width()) as u64,
                    first_row + (index / rows.width()) as u64,
                ];
                for (sample, &[front, back]) in pixel.depths.iter().enumerate() {
                    let (color, opacity) = flattener.color_and_opacity(&pixel.values, sample);
                    let near = nearness(front, place);
                    let far = if back > front {
                        nearness(back, place)
                    } else {
                        near
                    };
                    let color = color.map(|channel| {
                        let channel = channel as f32;
                        if channel.is_finite() { channel } else { 0.0 }
                    });
                    let opacity = within_0_and_1(opacity) as f32;
                    let object = object_of(sample).unwrap_or(Guest::NO_OBJECT);
                    samples.push([near, far.min(near)], opacity, color, object);
                }
                samples.end_pixel();
            }
        }
        Ok(samples)
    }

    /// Two f64, four f32 and a number.
    const BYTES_OF_GUEST_SAMPLE: usize = 36;
}
