//! Rows of deep pixels -> a file of deep scanlines.
//!
//! The table of where the rows stand comes before them in the file and is known after them: a blank
//! one is written first, and filled in at the end, as is the largest number of samples of a pixel. A
//! file that was not finished has zeros there, which every reader notices.

use super::header::DeepHeader;
use super::image::{DeepPixels, Window};
use super::packing::pack;
use rayon::prelude::*;
use std::io::{self, Seek, SeekFrom, Write};

/// Writes a deep picture row by row; of rows that are written nothing is kept but their place.
#[derive(Debug)]
pub struct DeepWriter<W> {
    writer: W,
    header: DeepHeader,
    /// Where the writer stands.
    at: u64,
    /// Where the number of samples of the fullest pixel is told.
    fullest_at: u64,
    fullest: usize,
    /// Where the table of rows starts.
    table_at: u64,
    /// Where each row written so far stands.
    table: Vec<u64>,
}

/// A row that is packed.
struct PackedRow {
    counts: Vec<u8>,
    samples: Vec<u8>,
    /// Bytes of the samples before they were packed.
    samples_size: usize,
    fullest: usize,
}

impl<W: Write + Seek> DeepWriter<W> {
    /// Begins a file at the writer's place, which must be its beginning.
    ///
    /// # Errors
    /// When it cannot be written, or a name is longer than OpenEXR allows (255 bytes).
    pub fn new(mut writer: W, header: DeepHeader) -> io::Result<Self> {
        let (bytes, fullest_at) = encode(&header)?;
        writer.write_all(&bytes)?;
        let height = header.data_window.height();
        let blank = [0; 4096];
        let mut left = 8 * height;
        while left > 0 {
            let part = left.min(blank.len() as u64);
            writer.write_all(&blank[..part as usize])?;
            left -= part;
        }
        let table_at = bytes.len() as u64;
        Ok(Self {
            writer,
            header,
            at: table_at + 8 * height,
            fullest_at,
            fullest: 0,
            table_at,
            table: Vec::new(),
        })
    }

    /// The header of the file.
    pub fn header(&self) -> &DeepHeader {
        &self.header
    }

    /// Writes the next rows.
    ///
    /// # Errors
    /// When they cannot be written, or a row has 2³¹ bytes of samples or more, which readers refuse.
    ///
    /// # Panics
    /// If they are wider than the data window, more than it has left, or of other channels.
    pub fn write(&mut self, rows: &DeepPixels) -> io::Result<()> {
        let window = &self.header.data_window;
        assert_eq!(
            rows.width() as u64,
            window.width(),
            "rows are as wide as told"
        );
        assert!(
            (self.table.len() + rows.rows()) as u64 <= window.height(),
            "there are no more rows than told"
        );
        let types = rows.channels().iter().map(|channel| channel.sample_type());
        assert!(
            types.eq(self.header.sample_types()),
            "rows have the channels of the header"
        );
        let compression = self.header.compression;
        let packed: Vec<PackedRow> = (0..rows.rows())
            .into_par_iter()
            .map(|row| {
                let (counts, fullest) = bytes_of_counts(rows, row);
                let samples = bytes_of_samples(rows, row);
                PackedRow {
                    counts: pack(compression, &counts).into_owned(),
                    samples_size: samples.len(),
                    samples: pack(compression, &samples).into_owned(),
                    fullest,
                }
            })
            .collect();
        for row in &packed {
            self.write_row(row)?;
        }
        Ok(())
    }

    fn write_row(&mut self, row: &PackedRow) -> io::Result<()> {
        if i32::try_from(row.samples_size).is_err() {
            let message = "a row of 2^31 bytes of samples or more, which readers refuse";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        // Within i32, as the window's last row is.
        let y = i64::from(self.header.data_window.min[1]) + self.table.len() as i64;
        self.table.push(self.at);
        let mut head = Vec::with_capacity(28);
        head.extend((y as i32).to_le_bytes());
        for size in [row.counts.len(), row.samples.len(), row.samples_size] {
            head.extend((size as u64).to_le_bytes());
        }
        for bytes in [&head, &row.counts, &row.samples] {
            self.writer.write_all(bytes)?;
            self.at += bytes.len() as u64;
        }
        self.fullest = self.fullest.max(row.fullest);
        Ok(())
    }

    /// Fills in what was left blank, and gives the writer back.
    ///
    /// # Errors
    /// When it cannot be written.
    ///
    /// # Panics
    /// If rows are missing.
    pub fn finish(mut self) -> io::Result<W> {
        let height = self.header.data_window.height();
        assert_eq!(self.table.len() as u64, height, "all rows are written");
        self.writer.seek(SeekFrom::Start(self.fullest_at))?;
        let fullest = i32::try_from(self.fullest).unwrap_or(i32::MAX);
        self.writer.write_all(&fullest.to_le_bytes())?;
        self.writer.seek(SeekFrom::Start(self.table_at))?;
        let table = self.table.iter().flat_map(|place| place.to_le_bytes());
        self.writer.write_all(&table.collect::<Vec<u8>>())?;
        self.writer.seek(SeekFrom::Start(self.at))?;
        self.writer.flush()?;
        Ok(self.writer)
    }
}

/// How many samples the pixels of a row have, each with all before it; and the most of one pixel.
fn bytes_of_counts(rows: &DeepPixels, row: usize) -> (Vec<u8>, usize) {
    let start = rows.samples_of_row(row).start;
    let mut counts = Vec::with_capacity(4 * rows.width());
    let mut fullest = 0;
    for pixel in row * rows.width()..(row + 1) * rows.width() {
        let samples = rows.samples_of(pixel);
        fullest = fullest.max(samples.len());
        // Too many for 32 bits are more than 2^31 bytes, which is refused.
        counts.extend(((samples.end - start) as u32).to_le_bytes());
    }
    (counts, fullest)
}

/// The samples of a row, channel after channel.
fn bytes_of_samples(rows: &DeepPixels, row: usize) -> Vec<u8> {
    let range = rows.samples_of_row(row);
    let mut bytes = Vec::new();
    for channel in rows.channels() {
        channel.append_bytes(range.clone(), &mut bytes);
    }
    bytes
}

/// Magic number, version and header, and where in it the fullest pixel is told.
fn encode(header: &DeepHeader) -> io::Result<(Vec<u8>, u64)> {
    let mut attributes: Vec<(&str, &str, Vec<u8>)> = header
        .attributes
        .iter()
        .map(|a| (a.name.as_str(), a.kind.as_str(), a.value.clone()))
        .collect();
    // What every file must have, whatever else it tells.
    let mut usual = |name, kind, value: Vec<u8>| {
        if header.attribute(name).is_none() {
            attributes.push((name, kind, value));
        }
    };
    usual("screenWindowCenter", "v2f", vec![0; 8]);
    usual("screenWindowWidth", "float", 1_f32.to_le_bytes().to_vec());
    let chunks = header.data_window.height() as i32;
    let name = match header.name.as_str() {
        "" => "deep",
        name => name,
    };
    attributes.extend([
        ("channels", "chlist", bytes_of_channels(header)),
        ("chunkCount", "int", chunks.to_le_bytes().to_vec()),
        (
            "compression",
            "compression",
            vec![header.compression.code()],
        ),
        ("dataWindow", "box2i", bytes_of_window(&header.data_window)),
        (
            "displayWindow",
            "box2i",
            bytes_of_window(&header.display_window),
        ),
        ("lineOrder", "lineOrder", vec![0]),
        (FULLEST, "int", (-1_i32).to_le_bytes().to_vec()),
        ("name", "string", name.as_bytes().to_vec()),
        (
            "pixelAspectRatio",
            "float",
            header.pixel_aspect_ratio.to_le_bytes().to_vec(),
        ),
        ("type", "string", b"deepscanline".to_vec()),
        ("version", "int", 1_i32.to_le_bytes().to_vec()),
    ]);
    attributes.sort_by(|a, b| a.0.cmp(b.0));

    let names = attributes.iter().flat_map(|&(name, kind, _)| [name, kind]);
    let channels = header.channels.iter().map(|channel| channel.name.as_str());
    let longest = names.chain(channels).map(str::len).max().unwrap_or(0);
    if longest > 255 {
        let message = format!("a name of {longest} bytes; OpenEXR allows 255");
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    const DEEP: u32 = 1 << 11;
    const LONG_NAMES: u32 = 1 << 10;
    let version = 2 | DEEP | if longest > 31 { LONG_NAMES } else { 0 };
    let mut bytes = vec![0x76, 0x2f, 0x31, 0x01];
    bytes.extend(version.to_le_bytes());
    let mut fullest_at = 0;
    for (name, kind, value) in attributes {
        for text in [name, kind] {
            bytes.extend(text.as_bytes());
            bytes.push(0);
        }
        let Ok(size) = i32::try_from(value.len()) else {
            let message = format!("attribute {name} of {} bytes", value.len());
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        };
        bytes.extend(size.to_le_bytes());
        if name == FULLEST {
            fullest_at = bytes.len() as u64;
        }
        bytes.extend(value);
    }
    bytes.push(0);
    Ok((bytes, fullest_at))
}

const FULLEST: &str = "maxSamplesPerPixel";

fn bytes_of_window(window: &Window) -> Vec<u8> {
    let numbers = window.min.into_iter().chain(window.max);
    numbers.flat_map(i32::to_le_bytes).collect()
}

fn bytes_of_channels(header: &DeepHeader) -> Vec<u8> {
    use super::SampleType;
    let mut bytes = Vec::new();
    for channel in &header.channels {
        bytes.extend(channel.name.as_bytes());
        bytes.push(0);
        let code: i32 = match channel.sample_type {
            SampleType::Uint => 0,
            SampleType::Half => 1,
            SampleType::Float => 2,
        };
        bytes.extend(code.to_le_bytes());
        // No hint for lossy compression; three bytes without meaning.
        bytes.extend([0; 4]);
        bytes.extend(1_i32.to_le_bytes());
        bytes.extend(1_i32.to_le_bytes());
    }
    bytes.push(0);
    bytes
}
