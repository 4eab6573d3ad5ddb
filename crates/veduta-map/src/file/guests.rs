//! Guests in a file: `guest_pixels.arrow` and `guest_samples.arrow`, of which batch i is band i: some rows of
//! a guest. Bands of a guest follow one another, guests are in the order of the manifest. A file without
//! guests has neither table.

use super::FileError;
use super::manifest::GuestEntry;
use super::rows::Rows;
use super::tables::TableName;
use crate::{Guest, GuestGrid, GuestSamples};
use arrow_array::{ArrayRef, Float32Array, Float64Array, RecordBatch, UInt32Array};
use std::ops::Range;
use std::sync::Arc;

/// Rows of a band: more would make a window read much beyond its border, fewer would compress worse.
const ROWS_PER_BAND: u32 = 64;

/// Number of bands of a guest.
pub fn band_count(grid: &GuestGrid) -> u64 {
    u64::from(grid.size[1].div_ceil(ROWS_PER_BAND))
}

/// The rows of each band of a guest.
pub fn bands(grid: &GuestGrid) -> impl Iterator<Item = Range<u32>> + use<> {
    let grid = *grid;
    (0..band_count(&grid) as usize).map(move |band| rows_of(&grid, band))
}

fn rows_of(grid: &GuestGrid, band: usize) -> Range<u32> {
    let first = band as u32 * ROWS_PER_BAND;
    first..first.saturating_add(ROWS_PER_BAND).min(grid.size[1])
}

/// What the manifest says of a guest.
pub fn entry(guest: &Guest) -> GuestEntry {
    GuestEntry {
        name: guest.name().to_owned(),
        kind: guest.kind(),
        grid: *guest.grid(),
        objects: guest.objects().to_vec(),
    }
}

/// The batch of a band.
pub fn batch(table: TableName, guest: &Guest, rows: Range<u32>) -> RecordBatch {
    let columns = guest.grid().size[0] as usize;
    let pixels = rows.start as usize * columns..rows.end as usize * columns;
    if table == TableName::GuestPixels {
        let counts = pixels.map(|pixel| guest.samples_of(pixel).len() as u32);
        return table.batch(vec![Arc::new(UInt32Array::from_iter_values(counts))]);
    }
    let all = guest.samples();
    let samples = guest.samples_of(pixels.start).start..guest.samples_of(pixels.end - 1).end;
    let real = |column: &[f64]| -> ArrayRef {
        Arc::new(Float64Array::from(column[samples.clone()].to_vec()))
    };
    let short = |value: &dyn Fn(usize) -> f32| -> ArrayRef {
        Arc::new(Float32Array::from_iter_values(samples.clone().map(value)))
    };
    table.batch(vec![
        real(&all.near),
        real(&all.far),
        short(&|sample| all.opacity[sample]),
        short(&|sample| all.color[sample][0]),
        short(&|sample| all.color[sample][1]),
        short(&|sample| all.color[sample][2]),
        Arc::new(UInt32Array::from(all.object[samples.clone()].to_vec())),
    ])
}

/// Adds the samples of band `band` of a guest, which was read.
pub fn add_band(
    samples: &mut GuestSamples,
    grid: &GuestGrid,
    band: usize,
    [of_pixels, of_samples]: &[Rows; 2],
) -> Result<(), FileError> {
    let counts = of_pixels.numbers("samples")?;
    let pixels = rows_of(grid, band).len() as u64 * u64::from(grid.size[0]);
    if counts.len() as u64 != pixels {
        return Err(of_pixels.unsound(format_args!("{} pixels, not {pixels}", counts.len())));
    }
    let mut end = samples.len() as u64;
    for &count in counts {
        end += u64::from(count);
        let end = u32::try_from(end);
        samples
            .ends
            .push(end.map_err(|_| of_pixels.unsound("too many samples"))?);
    }
    samples.near.extend(of_samples.reals("near")?);
    samples.far.extend(of_samples.reals("far")?);
    samples.opacity.extend(of_samples.floats("opacity")?);
    let [r, g, b] = ["r", "g", "b"].map(|name| of_samples.floats(name));
    let (r, g, b) = (r?, g?, b?);
    samples
        .color
        .extend(r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]));
    samples.object.extend(of_samples.numbers("object")?);
    if samples.len() as u64 != end {
        return Err(of_samples.unsound("not the samples that the pixels have"));
    }
    Ok(())
}

/// The rows, and the bands, that hold all between two heights of the image plane; `None` if that is
/// nothing.
pub fn bands_between(grid: &GuestGrid, heights: [f64; 2]) -> Option<(Range<u32>, Range<usize>)> {
    let rows = grid.between(1, heights);
    if rows.is_empty() {
        return None;
    }
    let bands = (rows.start / ROWS_PER_BAND) as usize..rows.end.div_ceil(ROWS_PER_BAND) as usize;
    let rows = rows_of(grid, bands.start).start..rows_of(grid, bands.end - 1).end;
    Some((rows, bands))
}

/// The rows `rows` of the guest that the manifest tells of.
pub fn guest(
    entry: GuestEntry,
    rows: Range<u32>,
    samples: GuestSamples,
) -> Result<Guest, FileError> {
    let GuestGrid { frame, first, size } = entry.grid;
    let unsound = |what: String| FileError::unsound(TableName::GuestSamples.member(), what);
    let top = i64::from(first[1]) + i64::from(rows.start);
    let top = i32::try_from(top).map_err(|_| unsound("a guest lies too far off".into()))?;
    let grid = GuestGrid {
        frame,
        first: [first[0], top],
        size: [size[0], rows.end - rows.start],
    };
    let name = entry.name.clone();
    let guest = Guest::new(entry.name, entry.kind, grid, samples, entry.objects);
    guest.map_err(|error| unsound(format!("{name:?}: {error}")))
}
