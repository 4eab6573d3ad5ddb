//! A seen scene -> a file.

use super::FileError;
use super::casters::write_casters;
use super::container::ArchiveWriter;
use super::guests;
use super::manifest::{FORMAT, MANIFEST, Manifest, SPANS_FORMAT, Segment, Table, VERSION};
use super::spans::write_span_table;
use super::tables::{TableName, TileRows, image_row, object_rows};
use super::tiles::tiles;
use crate::scene::Scene;
use crate::{Guest, Origin, SeenScene, SeenSpans, Spans, VisibilityMap};
use arrow_array::RecordBatch;
use arrow_ipc::writer::{FileWriter, IpcWriteOptions};
use arrow_ipc::{CompressionType, MetadataVersion};
use arrow_schema::Schema;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// Objects of a batch.
const OBJECTS_PER_BATCH: usize = 4096;

/// Columns begin at multiples of this in a batch, the least that Arrow allows: they are unpacked into
/// memory of their own, and its default of 64 would be a tenth of a tile.
const ALIGNMENT: usize = 8;

/// Writes `seen` to `out`, from its byte 0 on, and what `origin` tells of it.
///
/// # Errors
/// Those of `out`.
///
/// # Panics
/// If `seen` is not in normal form, or a mesh that casts is unsound.
pub fn write_map<W: Write + Seek>(
    out: W,
    seen: &SeenScene,
    origin: &Origin,
) -> Result<W, FileError> {
    let regions = Regions::Fragments {
        guests: &seen.guests,
        has_holes: seen.has_holes,
    };
    write_seen(out, &seen.map, &seen.scene, seen.size, &regions, origin)
}

/// Writes what multiscan found to `out`, from its byte 0 on, and what `origin` tells of it.
///
/// # Errors
/// Those of `out`.
///
/// # Panics
/// If `seen` is not in normal form or scaled, or a mesh that casts is unsound.
pub fn write_spans<W: Write + Seek>(
    out: W,
    seen: &SeenSpans,
    origin: &Origin,
) -> Result<W, FileError> {
    let size = [seen.spans.width(), seen.spans.height()];
    let regions = Regions::Spans(&seen.spans);
    write_seen(out, &seen.as_map(), &seen.scene, size, &regions, origin)
}

/// How a file tells where faces are seen.
enum Regions<'a> {
    /// By the fragments of the map, and guests between them.
    Fragments {
        guests: &'a [Guest],
        has_holes: bool,
    },
    /// By spans; of the map only the faces count.
    Spans(&'a Spans),
}

fn write_seen<W: Write + Seek>(
    out: W,
    map: &VisibilityMap,
    scene: &Scene,
    size: [u32; 2],
    regions: &Regions,
    origin: &Origin,
) -> Result<W, FileError> {
    let mut writer = TableWriter::new(out);
    let mut write = |table: TableName, batches: &mut dyn Iterator<Item = RecordBatch>| {
        writer.write(table.member(), &table.schema(), batches)
    };
    let tiles = tiles(map);
    let (guests, has_holes) = match *regions {
        Regions::Fragments { guests, has_holes } => (guests, has_holes),
        Regions::Spans(_) => (&[][..], false),
    };
    let (format, of_tiles, sub_scanlines) = match regions {
        Regions::Fragments { .. } => (FORMAT, &TableName::OF_TILES[..], None),
        Regions::Spans(spans) => {
            let per_row = spans.sub_scanlines_per_row();
            (SPANS_FORMAT, &TableName::OF_FACES[..], Some(per_row))
        }
    };
    for &table in of_tiles {
        // Made again for each table: the rows of all tiles together would be as large as the map.
        let batches = tiles
            .iter()
            .map(|tile| TileRows::new(map, scene, tile).batch(table));
        write(table, &mut { batches })?;
    }
    let objects = scene.objects.chunks(OBJECTS_PER_BATCH);
    write(TableName::Objects, &mut objects.map(object_rows))?;
    write(TableName::Images, &mut scene.images.iter().map(image_row))?;
    if !guests.is_empty() {
        for table in TableName::OF_GUESTS {
            let bands = guests.iter().flat_map(|guest| {
                let bands = guests::bands(guest.grid());
                bands.map(move |rows| guests::batch(table, guest, rows))
            });
            write(table, &mut { bands })?;
        }
    }
    if let Regions::Spans(spans) = regions {
        write_span_table(&mut writer, spans)?;
    }
    let casters = match &origin.casters {
        Some(casters) => Some(write_casters(&mut writer, casters, &scene.images)?),
        None => None,
    };
    writer.finish(|tables| Manifest {
        format: format.into(),
        version: VERSION,
        generator: concat!("veduta ", env!("CARGO_PKG_VERSION")).into(),
        size,
        has_holes,
        camera: map.camera,
        world: scene.world.clone(),
        layers: scene.layers.clone(),
        lights: scene.lights.clone(),
        materials: scene.materials.clone(),
        sources: origin.sources.clone(),
        guests: guests.iter().map(guests::entry).collect(),
        sub_scanlines,
        casters,
        tiles: tiles.iter().map(|tile| tile.bounds).collect(),
        tables,
    })
}

/// Writes tables as members of an archive, one after the other, and the manifest last.
pub struct TableWriter<W> {
    archive: ArchiveWriter<W>,
    tables: BTreeMap<String, Table>,
}

impl<W: Write + Seek> TableWriter<W> {
    fn new(out: W) -> Self {
        Self {
            archive: ArchiveWriter::new(out),
            tables: BTreeMap::new(),
        }
    }

    /// Writes a table as a member, batch by batch.
    pub fn write(
        &mut self,
        member: &'static str,
        schema: &Schema,
        batches: &mut dyn Iterator<Item = RecordBatch>,
    ) -> Result<(), FileError> {
        let io = FileError::io(member);
        let options = IpcWriteOptions::try_new(ALIGNMENT, false, MetadataVersion::V5)?
            .try_with_compression(Some(CompressionType::ZSTD))?;
        self.archive.begin(member).map_err(&io)?;
        // Arrow's writer fills a buffer that is emptied after each batch.
        let mut writer = FileWriter::try_new_with_options(Vec::new(), schema, options)?;
        let mut empty = |buffer: &mut Vec<u8>| -> Result<Segment, FileError> {
            self.archive.write_all(buffer).map_err(&io)?;
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
        self.archive.end().map_err(&io)?;
        let table = Table {
            head,
            batches: segments,
            tail,
        };
        self.tables.insert(member.to_owned(), table);
        Ok(())
    }

    /// Writes the manifest that is made of what is told of the tables.
    fn finish(
        mut self,
        manifest: impl FnOnce(BTreeMap<String, Table>) -> Manifest,
    ) -> Result<W, FileError> {
        let io = FileError::io(MANIFEST);
        self.archive.begin(MANIFEST).map_err(&io)?;
        let manifest = manifest(self.tables);
        serde_json::to_writer(&mut self.archive, &manifest).map_err(|error| io(error.into()))?;
        self.archive.end().map_err(&io)?;
        self.archive.finish().map_err(&io)
    }
}
