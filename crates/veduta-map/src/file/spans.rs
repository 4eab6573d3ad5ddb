//! Spans of multiscan, as a table of their own in place of fragments.

use super::FileError;
use super::read::MapReader;
use super::rows::Rows;
use super::tables;
use super::write::TableWriter;
use crate::{FaceId, SeenScene, SeenSpans, Span, SpanBand, Spans};
use arrow_array::{ArrayRef, Float64Array, RecordBatch};
use arrow_schema::{DataType, Field, Schema};
use std::io::{Read, Seek, Write};
use std::sync::Arc;

/// Name of the member. Its rows ascend with their sub-scanlines, and along these in x.
pub const MEMBER: &str = "spans.arrow";

/// Sub-scanlines that a file may have at most. Those on which nothing is seen take no bytes in it, but four
/// in memory.
const MOST_LINES: u64 = 1 << 24;

fn schema() -> Schema {
    let number = |name: &str| Field::new(name, DataType::UInt32, false);
    let real = |name: &str| Field::new(name, DataType::Float64, false);
    Schema::new(vec![
        number("line"),
        number("face"),
        real("left"),
        real("right"),
    ])
}

/// Writes the table, a band in each batch.
pub fn write_span_table<W: Write + Seek>(
    writer: &mut TableWriter<W>,
    spans: &Spans,
) -> Result<(), FileError> {
    if u64::from(spans.line_count()) > MOST_LINES {
        let what = format!(
            "{} sub-scanlines, more than {MOST_LINES}",
            spans.line_count()
        );
        return Err(FileError::unsound(MEMBER, what));
    }
    writer.write(MEMBER, &schema(), &mut spans.bands().iter().map(band_rows))
}

fn band_rows(band: &SpanBand) -> RecordBatch {
    let lines = (band.first..band.end())
        .flat_map(|line| std::iter::repeat_n(line, band.sub_scanline(line).len()));
    let real = |of: fn(&Span) -> f64| -> ArrayRef {
        Arc::new(Float64Array::from_iter_values(band.spans.iter().map(of)))
    };
    let columns = vec![
        tables::numbers(lines),
        tables::numbers(band.spans.iter().map(|span| span.face.0)),
        real(|span| span.left),
        real(|span| span.right),
    ];
    let batch = RecordBatch::try_new(Arc::new(schema()), columns);
    batch.expect("columns are as the schema says")
}

impl<R: Read + Seek> MapReader<R> {
    /// Reads what multiscan found.
    ///
    /// # Errors
    /// [`FileError`]; [`FileError::OtherContents`] where the file holds regions.
    pub fn read_spans(&mut self) -> Result<SeenSpans, FileError> {
        let Some(per_row) = self.sub_scanlines_per_row() else {
            return Err(FileError::OtherContents {
                found: "regions, found exactly",
                expected: "spans of multiscan",
            });
        };
        let SeenScene {
            map, scene, size, ..
        } = self.read_faces()?;
        let [width, height] = size;
        let unsound = |what: String| FileError::unsound(MEMBER, what);
        let lines = u64::from(per_row) * u64::from(height) + 1;
        if per_row == 0 || lines > MOST_LINES {
            return Err(unsound(format!("{per_row} sub-scanlines in {height} rows")));
        }
        let mut bands: Vec<SpanBand> = Vec::new();
        let mut next = 0;
        self.read_all(MEMBER, |rows| {
            let band = rows.band(next, lines as u32, f64::from(width), map.faces.len())?;
            next = band.end();
            bands.push(band);
            Ok(())
        })?;
        if let Some(last) = bands.last_mut() {
            let count = last.spans.len() as u32;
            last.ends
                .resize((lines as u32 - last.first) as usize, count);
        } else {
            bands.push(SpanBand {
                first: 0,
                spans: Vec::new(),
                ends: vec![0; lines as usize],
            });
        }
        Ok(SeenSpans {
            camera: map.camera,
            spans: Spans::new(width, height, per_row, bands),
            faces: map.faces,
            scene,
        })
    }
}

impl Rows<'_> {
    /// A band of sub-scanlines from `first` on, of `lines` that there are.
    fn band(
        &self,
        first: u32,
        lines: u32,
        width: f64,
        faces: usize,
    ) -> Result<SpanBand, FileError> {
        let (line, face) = (self.numbers("line")?, self.numbers("face")?);
        let (left, right) = (self.reals("left")?, self.reals("right")?);
        let mut band = SpanBand {
            first,
            ..SpanBand::default()
        };
        let mut end = 0.0;
        for row in 0..line.len() {
            let unsound = |what: &str| Err(self.unsound(format_args!("row {row}: {what}")));
            let Some(place) = line[row].checked_sub(first).filter(|_| line[row] < lines) else {
                return unsound("its sub-scanline is not the next");
            };
            let place = place as usize;
            if place + 1 < band.ends.len() {
                return unsound("its sub-scanline is not the next");
            }
            if place >= band.ends.len() {
                band.ends.resize(place + 1, band.spans.len() as u32);
                end = 0.0;
            }
            if !(end <= left[row] && left[row] < right[row] && right[row] <= width) {
                return unsound("it does not lie right of the one before, or not in the picture");
            }
            if face[row] as usize >= faces {
                return unsound("its face is not there");
            }
            end = right[row];
            band.spans.push(Span {
                face: FaceId(face[row]),
                left: left[row],
                right: right[row],
            });
            band.ends[place] = band.spans.len() as u32;
        }
        Ok(band)
    }
}
