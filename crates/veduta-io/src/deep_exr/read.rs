//! Bytes of a file -> rows of deep pixels.
//!
//! The header tells where each chunk stands; each is read on its own, so that a picture larger than
//! memory can be flattened, and rows can be read by several threads.
//!
//! A chunk tells three sizes. None of them is believed: the table of counts must unpack to four bytes
//! for each pixel, the counts must ascend, and the samples must unpack to what the counts sum up to.

use super::bytes::Bytes;
use super::header::{Layout, PartHeader, read_part};
use super::image::{DeepImage, DeepPixels};
use super::packing::{expand, unpack};
use super::{DeepCompression, DeepError, DeepHeader, DeepProblem};
use std::ops::Range;
use std::path::Path;

/// A deep file in memory, packed as it is on disk, with its headers read.
#[derive(Clone, Debug)]
pub struct DeepFile {
    bytes: Vec<u8>,
    /// Whether each chunk tells the part that it is of.
    several: bool,
    parts: Vec<Part>,
}

/// A deep part.
#[derive(Clone, Debug)]
struct Part {
    /// Its number among all parts of the file, flat ones too.
    number: usize,
    header: DeepHeader,
    layout: Layout,
    /// Where its table of chunks starts.
    table: usize,
}

/// The file's first four bytes.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Bits of the version field.
mod flags {
    pub const VERSION: u32 = 0xff;
    pub const TILED: u32 = 1 << 9;
    pub const LONG_NAMES: u32 = 1 << 10;
    pub const DEEP: u32 = 1 << 11;
    pub const SEVERAL_PARTS: u32 = 1 << 12;
    pub const KNOWN: u32 = VERSION | TILED | LONG_NAMES | DEEP | SEVERAL_PARTS;
}

/// Reads the first deep part of a file.
///
/// # Errors
/// When the file cannot be read, holds no deep part, is damaged, or of a kind that is not read.
pub fn read_deep(path: &Path) -> Result<DeepImage, DeepError> {
    DeepFile::open(path)?.read(0).map_err(|problem| DeepError {
        file: path.to_owned(),
        problem,
    })
}

/// Whether the bytes are those of an OpenEXR file with deep parts.
pub fn is_deep(bytes: &[u8]) -> bool {
    match bytes.split_first_chunk::<8>() {
        Some((&[a, b, c, d, version @ ..], _)) => {
            [a, b, c, d] == MAGIC && u32::from_le_bytes(version) & flags::DEEP != 0
        }
        None => false,
    }
}

impl DeepFile {
    /// Reads the headers of a file.
    ///
    /// # Errors
    /// As for [`read_deep`].
    pub fn open(path: &Path) -> Result<Self, DeepError> {
        let read = || Self::from_bytes(std::fs::read(path)?);
        read().map_err(|problem| DeepError {
            file: path.to_owned(),
            problem,
        })
    }

    /// Reads the headers of a file in memory.
    ///
    /// # Errors
    /// When it holds no deep part, is damaged, or of a kind that is not read.
    pub fn from_bytes(all: Vec<u8>) -> Result<Self, DeepProblem> {
        let mut bytes = Bytes::new(&all);
        if !all.starts_with(&MAGIC) {
            return Err(DeepProblem::NotOpenExr {
                found: all.iter().take(4).copied().collect(),
            });
        }
        bytes.go_to(MAGIC.len());
        let version = bytes.u32("the version")?;
        if version & flags::VERSION != 2 || version & !flags::KNOWN != 0 {
            let what = format!("an OpenEXR file of version {version:#x}");
            return Err(bytes.unsupported(what, "write it anew with a program of this version"));
        }
        if version & flags::DEEP == 0 {
            return Err(DeepProblem::NotDeep);
        }
        let most_name = match version & flags::LONG_NAMES {
            0 => 31,
            _ => 255,
        };
        let several = version & flags::SEVERAL_PARTS != 0;
        let mut headers = Vec::new();
        loop {
            bytes.part = Some(headers.len());
            match read_part(&mut bytes, most_name, several)? {
                Some(header) => headers.push(header),
                None if headers.is_empty() => {
                    return Err(bytes.damaged("the header has no attributes"));
                }
                None => break,
            }
            if !several {
                break;
            }
        }

        let mut parts = Vec::new();
        for (number, part) in headers.into_iter().enumerate() {
            bytes.part = Some(number);
            let table = bytes.at();
            let size = usize::try_from(part.chunk_count().saturating_mul(8));
            bytes.take(size.unwrap_or(usize::MAX), "a table of chunks")?;
            if let PartHeader::Deep { header, layout } = part {
                parts.push(Part {
                    number,
                    header,
                    layout,
                    table,
                });
            }
        }
        if parts.is_empty() {
            return Err(DeepProblem::NotDeep);
        }
        Ok(Self {
            bytes: all,
            several,
            parts,
        })
    }

    /// Length of the file in bytes.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// Whether the file has no bytes. It always has.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// The headers of the deep parts; flat parts beside them are passed over. There is at least one.
    pub fn headers(&self) -> impl ExactSizeIterator<Item = &DeepHeader> {
        self.parts.iter().map(|part| &part.header)
    }

    /// Number of bands of a deep part: scanlines, or rows of tiles.
    ///
    /// # Panics
    /// If there is no such part; so for all methods below.
    pub fn band_count(&self, part: usize) -> usize {
        let part = &self.parts[part];
        let height = part.header.data_window.height();
        let bands = match part.layout {
            Layout::Scanlines => height,
            Layout::Tiles { height: tile, .. } => height.div_ceil(u64::from(tile)),
        };
        // No more than there are chunks, whose table is in memory.
        bands as usize
    }

    /// Rows of the data window in a band, counted from its top.
    pub fn rows_of_band(&self, part: usize, band: usize) -> Range<u64> {
        let part = &self.parts[part];
        let rows = match part.layout {
            Layout::Scanlines => 1,
            Layout::Tiles { height, .. } => u64::from(height),
        };
        let first = band as u64 * rows;
        first..(first + rows).min(part.header.data_window.height())
    }

    /// Reads a deep part whole.
    ///
    /// # Errors
    /// When it is damaged, or larger than an honest file of that length can be.
    pub fn read(&self, part: usize) -> Result<DeepImage, DeepProblem> {
        let header = self.parts[part].header.clone();
        let mut budget = Budget::of_input(self.bytes.len());
        let width = header.data_window.width() as usize;
        let mut pixels = DeepPixels::new(width, header.sample_types());
        for band in 0..self.band_count(part) {
            let rows = self.read_band_within(part, band, &mut budget)?;
            pixels.extend_from(&rows, 0..rows.rows() * width);
        }
        Ok(DeepImage { header, pixels })
    }

    /// Reads the rows of a band, in memory that is bounded as if the file had no other.
    ///
    /// # Errors
    /// As for [`DeepFile::read`].
    pub fn read_band(&self, part: usize, band: usize) -> Result<DeepPixels, DeepProblem> {
        self.read_band_within(part, band, &mut Budget::of_input(self.bytes.len()))
    }

    fn read_band_within(
        &self,
        part: usize,
        band: usize,
        budget: &mut Budget,
    ) -> Result<DeepPixels, DeepProblem> {
        let part = &self.parts[part];
        let window = &part.header.data_window;
        let Layout::Tiles { width, height, .. } = part.layout else {
            let y = i64::from(window.min[1]) + band as i64;
            return self.chunk(part, band, &[y], [window.width(), 1], budget);
        };
        let across = window.width().div_ceil(u64::from(width));
        let first_row = band as u64 * u64::from(height);
        let rows = u64::from(height).min(window.height() - first_row);
        let mut tiles = Vec::new();
        for column in 0..across {
            let left = column * u64::from(width);
            let size = [u64::from(width).min(window.width() - left), rows];
            let chunk = band as u64 * across + column;
            let coordinates = [column as i64, band as i64, 0, 0];
            tiles.push(self.chunk(part, chunk as usize, &coordinates, size, budget)?);
        }
        let mut pixels = DeepPixels::new(window.width() as usize, part.header.sample_types());
        for row in 0..rows as usize {
            for tile in &tiles {
                pixels.extend_from(tile, row * tile.width()..(row + 1) * tile.width());
            }
        }
        Ok(pixels)
    }

    /// Reads a chunk: its number in the part's table, the coordinates that it must tell, and its
    /// width and height in pixels.
    fn chunk(
        &self,
        part: &Part,
        chunk: usize,
        coordinates: &[i64],
        [width, rows]: [u64; 2],
        budget: &mut Budget,
    ) -> Result<DeepPixels, DeepProblem> {
        let mut bytes = Bytes::new(&self.bytes);
        bytes.part = Some(part.number);
        bytes.chunk = Some(chunk);
        bytes.go_to(part.table + 8 * chunk);
        let offset = bytes.u64("the chunk's place")?;
        if offset == 0 {
            return Err(bytes.damaged("the chunk was never written"));
        }
        bytes.go_to(usize::try_from(offset).unwrap_or(usize::MAX));
        if self.several {
            let found = bytes.i32("the chunk's part")?;
            if i64::from(found) != part.number as i64 {
                return Err(bytes.damaged(format!("the chunk says that it is of part {found}")));
            }
        }
        for &due in coordinates {
            let found = bytes.i32("the chunk's coordinates")?;
            if i64::from(found) != due {
                let what = format!("the chunk tells coordinate {found} in place of {due}");
                return Err(bytes.damaged(what));
            }
        }
        let mut size = |what: &str| -> Result<usize, DeepProblem> {
            let size = bytes.u64(what)?;
            usize::try_from(size).map_err(|_| bytes.damaged(format!("{what} is {size} bytes")))
        };
        let packed_counts = size("the packed size of the counts")?;
        let packed_samples = size("the packed size of the samples")?;
        let samples_size = size("the size of the samples")?;

        let compression = part.header.compression;
        let bytes_of_sample = part.header.bytes_of_sample();
        let pixel_count = usize::try_from(width.saturating_mul(rows)).unwrap_or(usize::MAX);
        let packed = bytes.take(packed_counts, "the table of counts")?;
        let table = TableOfCounts {
            width: width as usize,
            pixel_count,
            bytes_of_sample,
            samples_size,
        };
        let ends = pixel_count.saturating_mul(size_of::<usize>());
        let mut pixels = DeepPixels::new(width as usize, part.header.sample_types());
        if packed.is_empty() {
            // A chunk without samples need not have a table; then the budget alone bounds its pixels.
            table.check_total(0).map_err(|what| bytes.damaged(what))?;
            budget.charge(ends)?;
            pixels.extend_counts(std::iter::repeat_n(0, pixel_count));
        } else {
            let counts = table.unpack(compression, packed, part.layout);
            let counts = counts.map_err(|what| bytes.damaged(what))?;
            budget.charge(ends)?;
            pixels.extend_counts(counts);
        }
        let packed = bytes.take(packed_samples, "the samples")?;
        let samples = unpack(compression, packed, samples_size)
            .map_err(|what| bytes.damaged(format!("the samples: {what}")))?;
        // Twice: as bytes, and as samples.
        budget.charge(samples_size)?;
        pixels.fill_from_bytes(&samples);
        Ok(pixels)
    }
}

/// What the table of counts of a chunk must come to.
struct TableOfCounts {
    /// Pixels of a row.
    width: usize,
    pixel_count: usize,
    bytes_of_sample: usize,
    /// Bytes of all samples.
    samples_size: usize,
}

impl TableOfCounts {
    /// Unpacks the table: the samples of each pixel. Errors say what is wrong, as a clause.
    fn unpack(
        &self,
        compression: DeepCompression,
        packed: &[u8],
        layout: Layout,
    ) -> Result<Vec<u32>, String> {
        let size = self.pixel_count.saturating_mul(4);
        let counts = unpack(compression, packed, size)
            .map_err(|what| format!("the table of counts: {what}"))
            .and_then(|table| self.counts(&table));
        let Layout::Tiles { width, height, .. } = layout else {
            return counts;
        };
        counts.or_else(|problem| {
            // OpenEXR's writer (`ImfDeepTiledOutputFile.cpp`, 2.0 to 3.5) asks of tiles cut off by the
            // border whether their table shrinks below that of a whole one. So it may be packed and yet
            // as long as if it were not; or not packed, and as long as that of a whole tile.
            let whole = 4 * width as usize * height as usize;
            let counts = if packed.len() == size {
                expand(compression, packed, size).and_then(|table| self.counts(&table))
            } else if packed.len() == whole && size < whole {
                self.counts(&packed[..size])
            } else {
                return Err(problem);
            };
            counts.map_err(|_| problem)
        })
    }

    /// The counts of a table, which tells of each pixel those of all before it in its row too.
    fn counts(&self, table: &[u8]) -> Result<Vec<u32>, String> {
        let mut counts = Vec::with_capacity(self.pixel_count);
        let mut total = 0_u64;
        for row in table.as_chunks::<4>().0.chunks(self.width) {
            let mut before = 0;
            for (column, &count) in row.iter().enumerate() {
                let count = i32::from_le_bytes(count);
                if count < before {
                    return Err(format!(
                        "the table of counts: {count} samples up to column {column}, after {before}"
                    ));
                }
                counts.push((count - before) as u32);
                before = count;
            }
            total += u64::from(before.unsigned_abs());
        }
        self.check_total(total)?;
        Ok(counts)
    }

    fn check_total(&self, samples: u64) -> Result<(), String> {
        let due = samples.saturating_mul(self.bytes_of_sample as u64);
        let told = self.samples_size;
        if due != told as u64 {
            return Err(format!(
                "{told} bytes of samples, but the counts tell {due}"
            ));
        }
        Ok(())
    }
}

/// How many bytes the file can justify once it is unpacked.
///
/// Deflate makes up to 1032 bytes of one, but no honest picture is that dull throughout: blank ones,
/// and those of one colour at one depth, come to about 400.
#[derive(Debug)]
pub struct Budget {
    input: u64,
    left: u64,
}

/// Bytes that any file may unpack to, however small: a blank picture of 7680 x 4320.
const FREE: u64 = 256 << 20;

/// Bytes that a byte of a file may unpack to beyond that.
const PER_INPUT_BYTE: u64 = 256;

impl Budget {
    pub fn of_input(input: usize) -> Self {
        let input = input as u64;
        Self {
            input,
            left: FREE.saturating_add(PER_INPUT_BYTE.saturating_mul(input)),
        }
    }

    pub fn charge(&mut self, bytes: usize) -> Result<(), DeepProblem> {
        let refusal = DeepProblem::TooLarge {
            asked: bytes as u64,
            input: self.input,
        };
        self.left = self.left.checked_sub(bytes as u64).ok_or(refusal)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_may_unpack_to_what_its_length_can_justify_and_no_more() {
        let mut budget = Budget::of_input(1000);
        budget.charge(256 << 20).expect("free");
        budget.charge(256_000).expect("justified");
        let error = budget.charge(1).expect_err("too much");
        assert!(error.to_string().contains("for 1000 bytes"), "{error}");
    }
}
