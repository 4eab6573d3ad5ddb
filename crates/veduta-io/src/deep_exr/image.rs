use super::DeepHeader;
use half::f16;
use std::ops::Range;

/// A rectangle of pixels; both corners are in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Column and row of the top left pixel.
    pub min: [i32; 2],
    /// Column and row of the bottom right pixel.
    pub max: [i32; 2],
}

impl Window {
    /// `width` x `height` pixels from (0, 0) on.
    ///
    /// # Panics
    /// If either is 0, or larger than OpenEXR can tell (2³¹ - 1).
    pub fn of_size(width: u32, height: u32) -> Self {
        let last = |count: u32| {
            let last = count.checked_sub(1).expect("a picture has pixels");
            i32::try_from(last).expect("OpenEXR counts pixels up to 2^31")
        };
        Self {
            min: [0, 0],
            max: [last(width), last(height)],
        }
    }

    /// Width in pixels; 0 if there are none.
    pub fn width(&self) -> u64 {
        extent(self.min[0], self.max[0])
    }

    /// Height in pixels; 0 if there are none.
    pub fn height(&self) -> u64 {
        extent(self.min[1], self.max[1])
    }

    /// The smallest window that holds both.
    pub fn with(&self, other: &Self) -> Self {
        Self {
            min: [0, 1].map(|axis| self.min[axis].min(other.min[axis])),
            max: [0, 1].map(|axis| self.max[axis].max(other.max[axis])),
        }
    }
}

fn extent(first: i32, last: i32) -> u64 {
    u64::try_from(i64::from(last) - i64::from(first) + 1).unwrap_or(0)
}

/// What a channel holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleType {
    /// Whole numbers of 32 bits, such as ids.
    Uint,
    /// Floating point of 16 bits.
    Half,
    /// Floating point of 32 bits.
    Float,
}

impl SampleType {
    /// Bytes of a sample.
    pub fn bytes(self) -> usize {
        match self {
            Self::Half => 2,
            Self::Uint | Self::Float => 4,
        }
    }
}

/// The samples of a channel, pixel after pixel.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Whole numbers.
    Uint(Vec<u32>),
    /// Floating point of 16 bits.
    Half(Vec<f16>),
    /// Floating point of 32 bits.
    Float(Vec<f32>),
}

/// `$body` with `$vec` bound to the vector, whatever it holds.
macro_rules! each_type {
    ($samples:expr, $vec:ident => $body:expr) => {
        match $samples {
            Samples::Uint($vec) => $body,
            Samples::Half($vec) => $body,
            Samples::Float($vec) => $body,
        }
    };
}

impl Samples {
    /// No samples.
    pub fn new(sample_type: SampleType) -> Self {
        match sample_type {
            SampleType::Uint => Self::Uint(Vec::new()),
            SampleType::Half => Self::Half(Vec::new()),
            SampleType::Float => Self::Float(Vec::new()),
        }
    }

    /// What they are.
    pub fn sample_type(&self) -> SampleType {
        match self {
            Self::Uint(_) => SampleType::Uint,
            Self::Half(_) => SampleType::Half,
            Self::Float(_) => SampleType::Float,
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        each_type!(self, samples => samples.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sample `index` as a number. f64 holds each of the types without loss.
    pub fn value(&self, index: usize) -> f64 {
        match self {
            Self::Uint(samples) => f64::from(samples[index]),
            Self::Half(samples) => samples[index].to_f64(),
            Self::Float(samples) => f64::from(samples[index]),
        }
    }

    /// Adds a number, rounded to the type. What is finite and brighter than half floats can tell becomes
    /// the brightest they can, since infinities would spread through all that follows.
    pub fn push(&mut self, value: f64) {
        match self {
            Self::Uint(samples) => samples.push(value as u32),
            Self::Half(samples) => samples.push(nearest_half(value as f32)),
            Self::Float(samples) => samples.push(value as f32),
        }
    }

    /// Adds the bytes of samples as they are in files.
    pub(super) fn extend_from_bytes(&mut self, bytes: &[u8]) {
        fn of<const N: usize>(bytes: &[u8]) -> impl Iterator<Item = [u8; N]> {
            bytes.as_chunks::<N>().0.iter().copied()
        }
        match self {
            Self::Uint(samples) => samples.extend(of(bytes).map(u32::from_le_bytes)),
            Self::Half(samples) => samples.extend(of(bytes).map(f16::from_le_bytes)),
            Self::Float(samples) => samples.extend(of(bytes).map(f32::from_le_bytes)),
        }
    }

    /// Appends the bytes of the samples in `range` as they are in files.
    pub(super) fn append_bytes(&self, range: Range<usize>, bytes: &mut Vec<u8>) {
        each_type!(self, samples => {
            bytes.extend(samples[range].iter().flat_map(|sample| sample.to_le_bytes()));
        });
    }

    /// Adds what `other`, of the same type, holds in `range`.
    ///
    /// # Panics
    /// If the types differ.
    fn extend_from(&mut self, other: &Self, range: Range<usize>) {
        match (self, other) {
            (Self::Uint(samples), Self::Uint(other)) => samples.extend_from_slice(&other[range]),
            (Self::Half(samples), Self::Half(other)) => samples.extend_from_slice(&other[range]),
            (Self::Float(samples), Self::Float(other)) => samples.extend_from_slice(&other[range]),
            _ => panic!("samples of one channel are of one type"),
        }
    }
}

/// The nearest half float that is finite, if `value` is.
pub fn nearest_half(value: f32) -> f16 {
    let most = f16::MAX.to_f32();
    f16::from_f32(if value.is_finite() {
        value.clamp(-most, most)
    } else {
        value
    })
}

/// The samples of some rows of pixels.
///
/// Invariants, kept by its methods: `ends` ascends and has an entry for each pixel of whole rows; all
/// channels have as many samples as the last entry tells.
#[derive(Clone, Debug, PartialEq)]
pub struct DeepPixels {
    width: usize,
    /// Of each pixel, where its samples end and those of the next begin.
    ends: Vec<usize>,
    channels: Vec<Samples>,
}

impl DeepPixels {
    /// No rows of `width` pixels, with channels of these types.
    pub fn new(width: usize, types: impl IntoIterator<Item = SampleType>) -> Self {
        Self {
            width,
            ends: Vec::new(),
            channels: types.into_iter().map(Samples::new).collect(),
        }
    }

    /// Rows of `width` pixels with `counts` samples each; `channels` hold the samples pixel by pixel.
    ///
    /// # Panics
    /// If the counts fill no whole rows, or a channel has other than their sum of samples.
    pub fn from_counts(
        width: usize,
        counts: impl IntoIterator<Item = u32>,
        channels: Vec<Samples>,
    ) -> Self {
        let mut end = 0;
        let ends = counts.into_iter().map(|count| {
            end += count as usize;
            end
        });
        let pixels = Self {
            width,
            ends: ends.collect(),
            channels,
        };
        assert!(
            pixels.ends.len().is_multiple_of(width),
            "counts fill whole rows"
        );
        assert!(
            pixels.channels.iter().all(|channel| channel.len() == end),
            "each channel has all samples"
        );
        pixels
    }

    /// Pixels of a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.ends.len() / self.width
    }

    /// Number of samples of all pixels.
    pub fn sample_count(&self) -> usize {
        self.ends.last().copied().unwrap_or(0)
    }

    /// The channels, in the order of [`DeepHeader::channels`].
    pub fn channels(&self) -> &[Samples] {
        &self.channels
    }

    /// Where the samples of a pixel (row * width + column) are in each channel.
    pub fn samples_of(&self, pixel: usize) -> Range<usize> {
        let start = pixel.checked_sub(1).map_or(0, |before| self.ends[before]);
        start..self.ends[pixel]
    }

    /// Where the samples of a row are in each channel.
    pub fn samples_of_row(&self, row: usize) -> Range<usize> {
        let first = row * self.width;
        let last = first + self.width - 1;
        self.samples_of(first).start..self.ends[last]
    }

    /// Adds the pixels `range` of `other`. The last row may be left unfinished, if it is finished by
    /// the next call.
    ///
    /// # Panics
    /// If the channels differ.
    pub(super) fn extend_from(&mut self, other: &Self, range: Range<usize>) {
        if range.is_empty() {
            return;
        }
        let samples = other.samples_of(range.start).start..other.ends[range.end - 1];
        let shift = self.sample_count();
        let ends = other.ends[range].iter();
        self.ends
            .extend(ends.map(|end| end - samples.start + shift));
        for (channel, other) in self.channels.iter_mut().zip(&other.channels) {
            channel.extend_from(other, samples.clone());
        }
    }

    /// Adds pixels with these counts. Their samples are to be filled in by
    /// [`DeepPixels::fill_from_bytes`].
    pub(super) fn extend_counts(&mut self, counts: impl IntoIterator<Item = u32>) {
        let mut end = self.sample_count();
        self.ends.extend(counts.into_iter().map(|count| {
            end += count as usize;
            end
        }));
    }

    /// Fills in the samples as files have them: row by row, in each row channel after channel.
    ///
    /// # Panics
    /// If there are other than that many bytes.
    pub(super) fn fill_from_bytes(&mut self, mut bytes: &[u8]) {
        for row in 0..self.rows() {
            let count = self.samples_of_row(row).len();
            for channel in &mut self.channels {
                let (own, rest) = bytes.split_at(count * channel.sample_type().bytes());
                channel.extend_from_bytes(own);
                bytes = rest;
            }
        }
        assert!(bytes.is_empty(), "as many bytes as the counts tell");
    }

    /// Adds a pixel whose samples have just been pushed to each channel.
    pub(super) fn push_pixel(&mut self, push: impl FnOnce(&mut [Samples])) {
        push(&mut self.channels);
        let end = self.channels.first().map_or(0, Samples::len);
        debug_assert!(self.channels.iter().all(|channel| channel.len() == end));
        self.ends.push(end);
    }
}

/// A deep picture: its header, and the samples of all pixels of its data window.
#[derive(Clone, Debug, PartialEq)]
pub struct DeepImage {
    /// What it says of itself.
    pub header: DeepHeader,
    /// Its samples, rows from the top.
    pub pixels: DeepPixels,
}
