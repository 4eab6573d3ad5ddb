//! What the pipeline makes of a scene -> a deep file.

use super::image::{DeepPixels, SampleType, Samples as Column};
use super::{Channel, DeepCompression, DeepHeader, DeepWriter, ObjectIds};
use crate::write::{PartialFile, is_stream};
use crate::{Samples, WriteError, WriteProblem};
use std::io::{Cursor, Seek, Write};
use std::path::Path;
use veduta::accumulate::{DeepRows, DeepSample};
use veduta::map::Camera;

/// What a deep file tells beside its samples, and how they are stored.
#[derive(Clone, Debug)]
pub struct DeepPicture {
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// Told in `worldToCamera` and `worldToNDC`.
    pub camera: Camera,
    /// Ids of the objects of the scene; told in `idManifest`.
    pub objects: ObjectIds,
    /// How colours and opacity are stored. Depths are floats always.
    pub samples: Samples,
    /// How the file is packed.
    pub compression: DeepCompression,
}

/// A place that can be written to and gone back in.
trait Place: Write + Seek {}
impl<T: Write + Seek> Place for T {}

/// Where the rows of a deep picture go.
pub struct DeepSink<'a> {
    writer: DeepWriter<&'a mut (dyn Place + 'a)>,
    objects: &'a ObjectIds,
    samples_written: u64,
}

/// Writes a deep picture with the channels A, B, G, R, Z, ZBack and id, tidy; an old file of that name is
/// replaced. `make` hands over the rows.
///
/// # Errors
/// When the samples are neither half floats nor floats, the file cannot be written, or `make` fails;
/// then nothing has changed.
///
/// # Panics
/// If a size is 0, or `make` hands over other rows than the picture has.
pub fn write_deep_picture<T>(
    path: &Path,
    picture: &DeepPicture,
    make: impl FnOnce(&mut DeepSink) -> Result<T, WriteProblem>,
) -> Result<T, WriteError> {
    let write = || -> Result<T, WriteProblem> {
        if is_stream(path) {
            let mut stream = std::fs::File::options().write(true).open(path)?;
            return stream_deep_picture(&mut stream, picture, make);
        }
        let mut file = PartialFile::create(path)?;
        let made = encode(&mut file, picture, make)?;
        file.finish()?;
        Ok(made)
    };
    write().map_err(|problem| WriteError {
        file: path.to_owned(),
        problem,
    })
}

/// Writes a deep picture to where there is no going back, such as a pipe. It is encoded in memory
/// first.
///
/// # Errors
/// As for [`write_deep_picture`].
///
/// # Panics
/// As for [`write_deep_picture`].
pub fn stream_deep_picture<T>(
    writer: &mut impl Write,
    picture: &DeepPicture,
    make: impl FnOnce(&mut DeepSink) -> Result<T, WriteProblem>,
) -> Result<T, WriteProblem> {
    let mut bytes = Cursor::new(Vec::new());
    let made = encode(&mut bytes, picture, make)?;
    writer.write_all(bytes.get_ref())?;
    writer.flush()?;
    Ok(made)
}

fn encode<'a, T>(
    place: &'a mut (dyn Place + 'a),
    picture: &'a DeepPicture,
    make: impl FnOnce(&mut DeepSink) -> Result<T, WriteProblem>,
) -> Result<T, WriteProblem> {
    let color = match picture.samples {
        Samples::F16 => SampleType::Half,
        Samples::F32 => SampleType::Float,
        asked => {
            let possible = format!("{} or {}", Samples::F32, Samples::F16);
            return Err(WriteProblem::NoSuchSamples { asked, possible });
        }
    };
    let mut sink = DeepSink {
        writer: DeepWriter::new(place, header(picture, color))?,
        objects: &picture.objects,
        samples_written: 0,
    };
    let made = make(&mut sink)?;
    sink.writer.finish()?;
    Ok(made)
}

fn header(picture: &DeepPicture, color: SampleType) -> DeepHeader {
    let channel = |(name, sample_type): (&str, SampleType)| Channel {
        name: name.to_owned(),
        sample_type,
    };
    let channels = [
        ("A", color),
        ("B", color),
        ("G", color),
        ("R", color),
        ("Z", SampleType::Float),
        ("ZBack", SampleType::Float),
        ("id", SampleType::Uint),
    ];
    let mut header = DeepHeader::new(
        picture.width,
        picture.height,
        channels.map(channel).to_vec(),
    );
    header.compression = picture.compression;
    // Not told: deepImageState, though samples are tidy. OpenEXR's own Python module refuses files that have it.
    header.set_camera(&picture.camera);
    header.set_attribute(picture.objects.attribute());
    let software = super::Attribute::new("software", "string", b"veduta".to_vec());
    header.set_attribute(software);
    header
}

impl DeepSink<'_> {
    /// Writes the next rows.
    ///
    /// # Errors
    /// When they cannot be written.
    ///
    /// # Panics
    /// If they are wider than the picture, or more than it has left.
    pub fn write(&mut self, rows: &DeepRows) -> Result<(), WriteProblem> {
        self.samples_written += rows.samples.len() as u64;
        let mut channels: Vec<Column> = self
            .writer
            .header()
            .sample_types()
            .map(Column::new)
            .collect();
        let [a, b, g, r, z, z_back, id] = &mut channels[..] else {
            unreachable!("the channels are those of the header");
        };
        let Column::Uint(id) = id else {
            unreachable!("ids are whole numbers");
        };
        for sample in &rows.samples {
            let &DeepSample { color, opacity, .. } = sample;
            let columns = [&mut *a, &mut *r, &mut *g, &mut *b, &mut *z, &mut *z_back];
            let [red, green, blue] = color;
            let values = [opacity, red, green, blue, sample.front, sample.back];
            for (column, value) in columns.into_iter().zip(values) {
                column.push(f64::from(value));
            }
            id.push(self.objects.of(sample.object.index()));
        }
        let width = rows.width as usize;
        let pixels = DeepPixels::from_counts(width, rows.counts.iter().copied(), channels);
        Ok(self.writer.write(&pixels)?)
    }

    /// Samples written so far.
    pub fn samples_written(&self) -> u64 {
        self.samples_written
    }
}
