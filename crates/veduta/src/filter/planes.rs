use std::ops::Range;

/// Samples that vector loads may read beyond a row: [`Planes::row`] ends with them.
const PADDING: usize = 8;

/// A picture as the elliptical filter reads it: a plane for each channel, with an *apron* of further texels around.
///
/// Texels are counted from the picture's left top corner, so that those of the apron have negative numbers, or numbers
/// beyond the size. Who makes the planes fills the apron; then a footprint that reaches over the border needs no case
/// of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    width: u32,
    height: u32,
    channels: usize,
    apron: u32,
    repeats: bool,
    /// From a row to the next of the same channel's, and from a channel's to the next channel's, samples.
    stride: usize,
    /// Row by row, in a row channel by channel: the rows of one footprint lie near one another.
    samples: Vec<f32>,
}

impl Planes {
    /// Planes of 0 for a picture of `width` by `height` texels, in linear light and premultiplied by opacity where
    /// there are 4 channels.
    ///
    /// # Panics
    /// If a side is 0 or there are not 1 to 4 channels.
    pub fn new(width: u32, height: u32, channels: usize, apron: u32) -> Self {
        assert!(width > 0 && height > 0, "a picture has texels");
        assert!((1..=4).contains(&channels), "1 to 4 channels");
        let stride = (width + 2 * apron) as usize + PADDING;
        let rows = (height + 2 * apron) as usize;
        Self {
            width,
            height,
            channels,
            apron,
            repeats: false,
            stride,
            samples: vec![0.0; rows * channels * stride],
        }
    }

    /// Planes whose columns repeat: right of the last comes the first again, as in a panorama all around.
    pub fn repeating(mut self) -> Self {
        self.repeats = true;
        self
    }

    /// Whether columns repeat.
    pub fn repeats(&self) -> bool {
        self.repeats
    }

    /// Width without the apron.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height without the apron.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// How many channels there are.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// How far the apron reaches, texels.
    pub fn apron(&self) -> u32 {
        self.apron
    }

    /// Columns of the picture and its apron.
    pub fn columns(&self) -> Range<i32> {
        let apron = self.apron as i32;
        -apron..self.width as i32 + apron
    }

    /// Rows of the picture and its apron.
    pub fn rows(&self) -> Range<i32> {
        let apron = self.apron as i32;
        -apron..self.height as i32 + apron
    }

    /// Where column 0 of a row's first channel lies in [`samples`](Self::samples); further channels and rows follow
    /// in steps of [`stride`](Self::stride).
    #[inline(always)]
    pub(crate) fn start(&self, row: i32) -> usize {
        let row = (row + self.apron as i32) as usize;
        row * self.channels * self.stride + self.apron as usize
    }

    #[inline(always)]
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    #[inline(always)]
    pub(crate) fn samples(&self) -> &[f32] {
        &self.samples
    }

    /// A texel, channels beyond the planes' being 0.
    #[inline]
    pub fn texel(&self, column: i32, row: i32) -> [f32; 4] {
        let start = self.start(row).wrapping_add_signed(column as isize);
        let mut texel = [0.0; 4];
        for (channel, value) in texel.iter_mut().take(self.channels).enumerate() {
            *value = self.samples[start + channel * self.stride];
        }
        texel
    }

    /// Sets a texel; channels that the planes lack are dropped.
    #[inline]
    pub fn set(&mut self, column: i32, row: i32, texel: [f32; 4]) {
        let start = self.start(row).wrapping_add_signed(column as isize);
        for (channel, &value) in texel.iter().take(self.channels).enumerate() {
            self.samples[start + channel * self.stride] = value;
        }
    }

    /// Sets the row of the picture with that number, from `width` texels.
    ///
    /// # Panics
    /// If there is no such row or the number of texels is another.
    pub fn set_row(&mut self, row: u32, texels: &[[f32; 4]]) {
        assert!(row < self.height, "a row of the picture");
        assert_eq!(texels.len(), self.width as usize, "a texel for each column");
        let start = self.start(row as i32);
        for channel in 0..self.channels {
            let from = start + channel * self.stride;
            let samples = &mut self.samples[from..from + texels.len()];
            for (sample, texel) in samples.iter_mut().zip(texels) {
                *sample = texel[channel];
            }
        }
    }

    /// The planes' rows from `row` on as separate slices, all channels and the apron's columns included, for filling in
    /// parallel.
    pub fn rows_mut(&mut self) -> impl Iterator<Item = RowMut<'_>> {
        let (channels, stride, apron) = (self.channels, self.stride, self.apron);
        self.samples
            .chunks_exact_mut(channels * stride)
            .enumerate()
            .map(move |(index, samples)| RowMut {
                row: index as i32 - apron as i32,
                apron,
                stride,
                samples,
            })
    }

    /// Fills the apron of a texture that goes on beyond its borders by rules of its own, along columns and along rows.
    pub fn continue_by(&mut self, [across, down]: [Wrap; 2]) {
        let (columns, rows) = (self.columns(), self.rows());
        let (width, height) = (self.width as i32, self.height as i32);
        for row in rows {
            for column in columns.clone() {
                if (0..width).contains(&column) && (0..height).contains(&row) {
                    continue;
                }
                let texel = match (across.texel(column, width), down.texel(row, height)) {
                    (Some(column), Some(row)) => self.texel(column, row),
                    _ => [0.0; 4],
                };
                self.set(column, row, texel);
            }
        }
    }

    /// The picture at half the size: each texel the mean of 4 x 4 with weights 1 3 3 1, which is smooth enough
    /// that footprints of a few texels tell no difference.
    ///
    /// Of an odd side, the last texel lies half in the apron. The apron of the result is not filled.
    ///
    /// # Panics
    /// If the apron is narrower than 2 texels, which the weights reach.
    pub fn halved(&self, apron: u32) -> Self {
        assert!(self.apron >= 2, "an apron for the weights");
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut half = Self::new(width, height, self.channels, apron);
        // An odd number of columns does not repeat after half of them.
        half.repeats = self.repeats && self.width.is_multiple_of(2);
        for row in 0..height as i32 {
            for channel in 0..self.channels {
                let of_row = |offset: i32| {
                    let start = self.start(2 * row + offset) + channel * self.stride;
                    // From column -1 on.
                    &self.samples[start - 1..]
                };
                let [a, b, c, d] = [-1, 0, 1, 2].map(of_row);
                let start = half.start(row) + channel * half.stride;
                let results = &mut half.samples[start..start + width as usize];
                for (column, result) in results.iter_mut().enumerate() {
                    let along = [0, 1, 2, 3].map(|k| binomial(a, b, c, d, 2 * column + k));
                    *result = weighted(along);
                }
            }
        }
        half
    }
}

/// What a texture shows beyond its border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    Repeat,
    /// The texture again, every other time turned over.
    Mirror,
    /// The texels of the border.
    Clamp,
    /// Nothing: black, and transparent where there is opacity.
    Black,
}

impl Wrap {
    /// The texel, of `size`, that is shown at a number beyond them.
    fn texel(self, k: i32, size: i32) -> Option<i32> {
        match self {
            Self::Repeat => Some(k.rem_euclid(size)),
            Self::Mirror => {
                let k = k.rem_euclid(2 * size);
                Some(k.min(2 * size - 1 - k))
            }
            Self::Clamp => Some(k.clamp(0, size - 1)),
            Self::Black => (0..size).contains(&k).then_some(k),
        }
    }
}

/// A row of planes that is being filled.
pub struct RowMut<'a> {
    row: i32,
    apron: u32,
    stride: usize,
    samples: &'a mut [f32],
}

impl RowMut<'_> {
    /// Its number; that of the picture's first row is 0.
    pub fn number(&self) -> i32 {
        self.row
    }

    /// The samples of a channel from column 0 of the picture on.
    pub fn channel(&mut self, channel: usize) -> &mut [f32] {
        let from = channel * self.stride + self.apron as usize;
        &mut self.samples[from..(channel + 1) * self.stride]
    }
}

#[inline(always)]
fn binomial(a: &[f32], b: &[f32], c: &[f32], d: &[f32], column: usize) -> f32 {
    weighted([a[column], b[column], c[column], d[column]])
}

/// `(a + 3 b + 3 c + d) / 8`, rounded so that four equal values give that value.
#[inline(always)]
fn weighted([a, b, c, d]: [f32; 4]) -> f32 {
    // In this order the sums of equal values are 2, 4 and 8 times one of them, and nothing is rounded.
    ((a + d) + (b + c) + 2.0 * (b + c)) * 0.125
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_where_they_were_set_and_rows_are_set_whole() {
        let mut planes = Planes::new(3, 2, 4, 2);
        for row in planes.rows() {
            for column in planes.columns() {
                planes.set(column, row, [column as f32, row as f32, 1.0, 0.5]);
            }
        }
        let texels = [[7.0; 4]; 3];
        planes.set_row(1, &texels);
        for row in planes.rows() {
            for column in planes.columns() {
                let set = row == 1 && (0..3).contains(&column);
                let expected = if set {
                    [7.0; 4]
                } else {
                    [column as f32, row as f32, 1.0, 0.5]
                };
                assert_eq!(planes.texel(column, row), expected, "{column} {row}");
            }
        }
    }

    #[test]
    fn textures_go_on_as_they_are_told() {
        for (wrap, expected) in [
            (Wrap::Repeat, [2.0, 3.0, 1.0, 2.0, 3.0, 1.0, 2.0]),
            (Wrap::Mirror, [2.0, 1.0, 1.0, 2.0, 3.0, 3.0, 2.0]),
            (Wrap::Clamp, [1.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0]),
            (Wrap::Black, [0.0, 0.0, 1.0, 2.0, 3.0, 0.0, 0.0]),
        ] {
            let mut planes = Planes::new(3, 1, 1, 2);
            planes.set_row(0, &[1.0, 2.0, 3.0].map(|x| [x; 4]));
            planes.continue_by([wrap, Wrap::Clamp]);
            for row in planes.rows() {
                let found: Vec<f32> = planes.columns().map(|k| planes.texel(k, row)[0]).collect();
                assert_eq!(found, expected, "{wrap:?}");
            }
        }
    }

    #[test]
    fn halving_keeps_constants_and_slopes() {
        for value in [0.1_f32, 1.0 / 3.0, 0.7, 123.456, 5e-5] {
            let mut planes = Planes::new(5, 4, 1, 3);
            for row in planes.rows() {
                for column in planes.columns() {
                    planes.set(column, row, [value, 0.0, 0.0, 0.0]);
                }
            }
            let half = planes.halved(1);
            assert_eq!((half.width(), half.height()), (3, 2));
            assert_eq!(half.texel(2, 1)[0], value);
        }
        let mut slope = Planes::new(8, 8, 1, 3);
        for row in slope.rows() {
            for column in slope.columns() {
                slope.set(column, row, [(3 * column + row) as f32, 0.0, 0.0, 0.0]);
            }
        }
        // The centre of texel (1, 2) is at (2.5, 4.5) in the finer picture.
        assert_eq!(slope.halved(1).texel(1, 2)[0], 12.0);
    }
}
