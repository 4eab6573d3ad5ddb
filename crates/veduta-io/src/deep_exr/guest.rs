//! Deep pixels -> the samples of a guest.

use super::flatten::Flattener;
use super::image::Samples;
use super::read::Budget;
use super::tidy::{PixelSamples, within_0_and_1};
use super::{DeepFile, DeepProblem};
use veduta::map::{Guest, GuestSamples};

impl DeepFile {
    /// All samples of a part, as they stand. `nearness` is given a depth of the file and the column and row
    /// of its pixel, counted from the data window's corner.
    ///
    /// # Errors
    /// As for [`DeepFile::flatten`].
    ///
    /// # Panics
    /// If there is no such part.
    pub fn guest_samples(
        &self,
        part: usize,
        nearness: impl Fn(f64, [u64; 2]) -> f64,
    ) -> Result<GuestSamples, DeepProblem> {
        let header = self.headers().nth(part).expect("a part of the file");
        let flattener = Flattener::new(header)?;
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
            let first_row = self.rows_of_band(part, band).start;
            for index in 0..rows.rows() * rows.width() {
                pixel.clear();
                pixel.extend(flattener.roles(), &channels, rows.samples_of(index));
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
                    samples.push([near, far.min(near)], opacity, color, Guest::NO_OBJECT);
                }
                samples.end_pixel();
            }
        }
        Ok(samples)
    }

    /// Two f64, four f32 and a number.
    const BYTES_OF_GUEST_SAMPLE: usize = 36;
}
