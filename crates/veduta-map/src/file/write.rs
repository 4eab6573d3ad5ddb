//! A seen scene -> a file.

use super::FileError;
use super::container::ArchiveWriter;
use super::guests;
use super::manifest::{FORMAT, MANIFEST, Manifest, Segment, Source, Table, VERSION};
use super::tables::{TableName, TileBatches, image_row, object_rows};
use super::tiles::tiles;
use crate::SeenScene;
use arrow_array::RecordBatch;
use arrow_ipc::writer::{FileWriter, IpcWriteOptions};
use arrow_ipc::{CompressionType, MetadataVersion};
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// Objects of a batch.
const OBJECTS_PER_BATCH: usize = 4096;

/// Columns begin at multiples of this in a batch, the least that Arrow allows: they are unpacked into
/// memory of their own, and its default of 64 would be a tenth of a tile.
const ALIGNMENT: usize = 8;

/// Writes `seen` to `out`, from its byte 0 on. `sources` are the files that its scene was read from.
///
/// # Errors
/// Those of `out`.
///
/// # Panics
/// If `seen` is not in normal form.
pub fn write_map<W: Write + Seek>(
    out: W,
    seen: &SeenScene,
    sources: &[Source],
) -> Result<W, FileError> {
    let (map, scene) = (&seen.map, &seen.scene);
    let mut archive = ArchiveWriter::new(out);
    let mut tables = BTreeMap::new();
    let mut write = |table: TableName, batches: &mut dyn Iterator<Item = RecordBatch>| {
        tables.insert(
            table.member().to_owned(),
            write_table(&mut archive, table, batches)?,
        );
        Ok::<(), FileError>(())
    };
    let tiles = tiles(map);
    for table in TableName::OF_TILES {
        // Made again for each table: the rows of all tiles together would be as large as the map.
        let batches = tiles
            .iter()
            .map(|tile| TileBatches::new(map, scene, tile).of(table).clone());
        write(table, &mut { batches })?;
    }
    let objects = scene.objects.chunks(OBJECTS_PER_BATCH);
    write(TableName::Objects, &mut objects.map(object_rows))?;
    write(TableName::Images, &mut scene.images.iter().map(image_row))?;
    if !seen.guests.is_empty() {
        for table in TableName::OF_GUESTS {
            let bands = seen.guests.iter().flat_map(|guest| {
                let bands = guests::bands(guest.grid());
                bands.map(move |rows| guests::batch(table, guest, rows))
            });
            write(table, &mut { bands })?;
        }
    }

    let manifest = Manifest {
        format: FORMAT.into(),
        version: VERSION,
        generator: concat!("veduta ", env!("CARGO_PKG_VERSION")).into(),
        size: seen.size,
        has_holes: seen.has_holes,
        camera: map.camera,
        world: scene.world.clone(),
        layers: scene.layers.clone(),
        lights: scene.lights.clone(),
        materials: scene.materials.clone(),
        sources: sources.to_vec(),
        guests: seen.guests.iter().map(guests::entry).collect(),
        tiles: tiles.iter().map(|tile| tile.bounds).collect(),
        tables,
    };
    let io = FileError::io(MANIFEST);
    archive.begin(MANIFEST).map_err(&io)?;
    serde_json::to_writer(&mut archive, &manifest).map_err(|error| io(error.into()))?;
    archive.end().map_err(&io)?;
    archive.finish().map_err(&io)
}

/// Writes a table as a member, batch by batch.
fn write_table<W: Write + Seek>(
    archive: &mut ArchiveWriter<W>,
    table: TableName,
    batches: &mut dyn Iterator<Item = RecordBatch>,
) -> Result<Table, FileError> {
    let io = FileError::io(table.member());
    let options = IpcWriteOptions::try_new(ALIGNMENT, false, MetadataVersion::V5)?
        .try_with_compression(Some(CompressionType::ZSTD))?;
    archive.begin(table.member()).map_err(&io)?;
    // Arrow's writer fills a buffer that is emptied after each batch.
    let mut writer = FileWriter::try_new_with_options(Vec::new(), &table.schema(), options)?;
    let mut empty = |buffer: &mut Vec<u8>| -> Result<Segment, FileError> {
        archive.write_all(buffer).map_err(&io)?;
        let segment = Segment::of(buffer);
        buffer.clear();
        Ok(segment)
    };
    let head = empty(writer.get_mut())?;
    let mut segments = Vec::new();
    for batch in batches {
        writer.write(&batch)?;
        segments.push(empty(writer.get_mut())?);
    }
    writer.finish()?;
    let tail = empty(writer.get_mut())?;
    archive.end().map_err(&io)?;
    Ok(Table {
        head,
        batches: segments,
        tail,
    })
}
