//! A file -> a seen scene, whole or a window of it.

use super::FileError;
use super::assemble::SeenRows;
use super::casters;
use super::container::{ArchiveReader, Member};
use super::guests;
use super::manifest::{MANIFEST, Manifest, SPANS_FORMAT, Segment, Table};
use super::message;
use super::projected::Projected;
use super::rows::Rows;
use super::spans;
use super::tables::TableName;
use crate::scene::{Material, MeshId, Object, Scene};
use crate::{Camera, Guest, GuestSamples, Reading, SeenScene, SeenSpans, Source};
use arrow_array::RecordBatch;
use arrow_ipc::MetadataVersion;
use arrow_ipc::reader::FileDecoder;
use arrow_schema::SchemaRef;
use std::io::{Read, Seek};
use std::sync::Arc;
use veduta_geometry::DVec2;

/// All heights of the image plane.
const EVERYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Reads a file, all of it or what a window needs.
#[derive(Debug)]
pub struct MapReader<R> {
    archive: ArchiveReader<R>,
    manifest: Manifest,
}

impl<R: Read + Seek> MapReader<R> {
    /// Reads what is in the file and where; checks all but the tables.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn new(input: R) -> Result<Self, FileError> {
        let mut archive = ArchiveReader::new(input)?;
        let Some(member) = archive.member(MANIFEST).cloned() else {
            return Err(FileError::unsound(
                "the archive",
                format!("no {MANIFEST} is in it"),
            ));
        };
        let manifest = Manifest::parse(&archive.checked_bytes(&member)?)?;
        let reader = Self { archive, manifest };
        reader.check_manifest()?;
        Ok(reader)
    }

    fn check_manifest(&self) -> Result<(), FileError> {
        let unsound = |what: String| Err(FileError::unsound(MANIFEST, what));
        for member in self.archive.members() {
            let Some(table) = self.manifest.tables.get(&member.name) else {
                if member.name == MANIFEST {
                    continue;
                }
                return unsound(format!("does not tell of the member {}", member.name));
            };
            let lengths = table.segments().map(|segment| segment.length);
            let sum = lengths.fold(0, u64::saturating_add);
            if sum != member.length {
                return unsound(format!("the parts of {} are not all of it", member.name));
            }
        }
        for name in self.known_tables() {
            let (Some(_), Some(found)) =
                (self.archive.member(name), self.manifest.tables.get(name))
            else {
                return unsound(format!("{name} is missing"));
            };
            let is_of_tiles = self.of_tiles().iter().any(|table| table.member() == name);
            if is_of_tiles && found.batches.len() != self.manifest.tiles.len() {
                return unsound(format!("{name} does not have a batch for each tile"));
            }
            let of_guests = TableName::OF_GUESTS.map(TableName::member).contains(&name);
            let bands = self
                .manifest
                .guests
                .iter()
                .map(|guest| guests::band_count(&guest.grid));
            if of_guests && found.batches.len() as u64 != bands.sum::<u64>() {
                return unsound(format!("{name} does not have a batch for each band"));
            }
        }
        if self.manifest.sub_scanlines.is_some() != (self.manifest.format == SPANS_FORMAT) {
            return unsound("it is of spans and not of spans".into());
        }
        if !self.manifest.camera.is_sound() {
            return unsound("the camera shows nothing: a number of it is 0 or negative".into());
        }
        if self.manifest.size.contains(&0) {
            return unsound("the picture has no pixels".into());
        }
        Ok(())
    }

    /// The members whose tables this program knows of, all of which must be there.
    fn known_tables(&self) -> Vec<&'static str> {
        let is_of_spans = self.sub_scanlines_per_row().is_some();
        let mut names = self.of_tiles().to_vec();
        names.extend([TableName::Objects, TableName::Images]);
        let mut names: Vec<_> = names.into_iter().map(TableName::member).collect();
        names.extend(is_of_spans.then_some(spans::MEMBER));
        if !self.manifest.guests.is_empty() {
            names.extend(TableName::OF_GUESTS.map(TableName::member));
        }
        if self.has_embedded_casters() {
            names.extend(casters::members());
        }
        names
    }

    /// The tables whose batches are tiles.
    fn of_tiles(&self) -> &'static [TableName] {
        match self.sub_scanlines_per_row() {
            None => &TableName::OF_TILES,
            Some(_) => &TableName::OF_FACES,
        }
    }

    /// What is in the file and where.
    pub(super) fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Pixels of the picture that the map was made for.
    pub fn size(&self) -> [u32; 2] {
        self.manifest.size
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.manifest.camera
    }

    /// The materials of all that is seen.
    pub fn materials(&self) -> &[Material] {
        &self.manifest.materials
    }

    /// The program that wrote the file.
    pub fn generator(&self) -> &str {
        &self.manifest.generator
    }

    /// The files that the scene was read from.
    pub fn sources(&self) -> &[Source] {
        &self.manifest.sources
    }

    /// Sub-scanlines of a row of pixels, if the file holds spans of multiscan in place of regions.
    pub fn sub_scanlines_per_row(&self) -> Option<u32> {
        self.manifest.sub_scanlines
    }

    /// Whether the file tells what casts, itself or by naming files.
    pub fn tells_casters(&self) -> bool {
        self.manifest.casters.is_some()
    }

    /// Whether casters are kept in the file itself.
    pub fn has_embedded_casters(&self) -> bool {
        let casters = self.manifest.casters.as_ref();
        casters.is_some_and(|casters| casters.embedded.is_some())
    }

    /// How casters are read again that the file does not hold itself.
    pub fn readings(&self) -> &[Reading] {
        let casters = self.manifest.casters.as_ref();
        casters.map_or(&[], |casters| &casters.readings)
    }

    /// Bytes read so far.
    pub fn bytes_read(&self) -> u64 {
        self.archive.bytes_read()
    }

    /// Reads all that is seen.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn read(&mut self) -> Result<SeenScene, FileError> {
        self.refuse_spans()?;
        self.read_tiles(0..self.manifest.tiles.len(), EVERYWHERE)
    }

    /// Reads the faces of a file of spans, as a map of which nothing is seen.
    pub(super) fn read_faces(&mut self) -> Result<SeenScene, FileError> {
        self.read_tiles(0..self.manifest.tiles.len(), EVERYWHERE)
    }

    fn refuse_spans(&self) -> Result<(), FileError> {
        match self.sub_scanlines_per_row() {
            None => Ok(()),
            Some(_) => Err(FileError::OtherContents {
                found: "spans of multiscan",
                expected: "regions, found exactly",
            }),
        }
    }

    /// Reads what is seen in a window of the image plane, from its left top corner to its right bottom
    /// one, and some of what is seen around it.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn read_window(&mut self, [min, max]: [DVec2; 2]) -> Result<SeenScene, FileError> {
        self.refuse_spans()?;
        let touches = |&[left, top, right, bottom]: &[f64; 4]| {
            left <= max.x && right >= min.x && top <= max.y && bottom >= min.y
        };
        let tiles: Vec<usize> = (0..self.manifest.tiles.len())
            .filter(|&tile| touches(&self.manifest.tiles[tile]))
            .collect();
        let seen = self.read_tiles(tiles.into_iter(), [min.y, max.y])?;
        // Objects and materials of which nothing was read are left out. In the window the map has the
        // holes that the whole has.
        Ok(SeenScene {
            has_holes: seen.has_holes,
            guests: seen.guests,
            ..SeenScene::of(&seen.scene, &seen.map, seen.size)
        })
    }

    /// Reads every byte and checks the invariants of what is read.
    ///
    /// # Errors
    /// [`FileError`], or what the map itself has against it.
    pub fn check(&mut self) -> Result<SeenScene, FileError> {
        self.refuse_spans()?;
        self.check_tables()?;
        let seen = self.read()?;
        let sound = seen.map.check();
        sound.map_err(|invariant| FileError::unsound("the map", invariant.to_string()))?;
        Ok(seen)
    }

    /// [`MapReader::check`] of a file that holds what multiscan found.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn check_spans(&mut self) -> Result<SeenSpans, FileError> {
        self.check_tables()?;
        self.read_spans()
    }

    /// Compares every byte with its checksum, and reads what casts.
    fn check_tables(&mut self) -> Result<(), FileError> {
        for member in self.archive.members().to_vec() {
            self.archive.check(&member)?;
        }
        for table in self.known_tables() {
            let (member, found) = self.table(table)?;
            let (start, head) = (member.start(), found.head.clone());
            self.segment(table, start, &head)?;
        }
        self.read_casters()?;
        Ok(())
    }

    /// Reads tiles, and guests between two heights of the image plane.
    fn read_tiles(
        &mut self,
        tiles: impl Iterator<Item = usize>,
        heights: [f64; 2],
    ) -> Result<SeenScene, FileError> {
        let scene = self.scene_without_meshes()?;
        let mut rows = SeenRows::default();
        let mut of_tiles = Vec::new();
        for &table in self.of_tiles() {
            of_tiles.push(TableReader::new(self, table.member())?);
        }
        let camera = self.manifest.camera;
        for tile in tiles {
            let mut batches = Vec::with_capacity(of_tiles.len());
            for table in &of_tiles {
                batches.push(table.batch(self, tile)?);
            }
            let of = |table: TableName| Rows {
                batch: &batches[table as usize],
                member: table.member(),
                index: tile,
            };
            let vertices = of(TableName::Vertices).vertices()?;
            if let Some(astray) = vertices
                .iter()
                .find(|row| row.object as usize >= scene.objects.len())
            {
                let what = format!("object {} is not there", astray.object);
                return Err(of(TableName::Vertices).unsound(what));
            }
            let places = vertices
                .iter()
                .map(|row| ((row.object, row.vertex), row.at.position));
            let projected = Projected::new(&camera, places, |object| {
                &scene.objects[object as usize].world_from_object
            });
            let points = of(TableName::Points).points(&projected)?;
            of(TableName::Faces).faces(&points, &projected, &mut rows.faces)?;
            rows.vertices.extend(vertices);
            if of_tiles.len() == TableName::OF_TILES.len() {
                of(TableName::Opaque).fragments(&points, &mut rows.opaque)?;
                of(TableName::Veils).fragments(&points, &mut rows.veils)?;
            }
        }
        let guests = self.read_guests(heights)?;
        Ok(SeenScene {
            guests,
            ..rows.into_seen(scene, &self.manifest)?
        })
    }

    /// Reads all of the scene but its meshes.
    fn scene_without_meshes(&mut self) -> Result<Scene, FileError> {
        let mut scene = Scene {
            materials: self.manifest.materials.clone(),
            lights: self.manifest.lights.clone(),
            layers: self.manifest.layers.clone(),
            world: self.manifest.world.clone(),
            ..Scene::default()
        };
        self.read_all(TableName::Images.member(), |batch| {
            scene.images.push(batch.image()?);
            Ok(())
        })?;
        self.read_all(TableName::Objects.member(), |batch| {
            for (name, world_from_object) in batch.objects()? {
                let mesh = MeshId(scene.objects.len() as u32);
                scene.objects.push(Object {
                    name,
                    mesh,
                    world_from_object,
                });
            }
            Ok(())
        })?;
        check_scene(&scene)?;
        Ok(scene)
    }

    /// Reads the bands of guests between two heights of the image plane. Guests of which that is nothing
    /// are left out.
    fn read_guests(&mut self, heights: [f64; 2]) -> Result<Vec<Guest>, FileError> {
        let entries = self.manifest.guests.clone();
        if entries.is_empty() {
            return Ok(Vec::new());
        }
        let [of_pixels, of_samples] = [
            TableReader::new(self, TableName::GuestPixels.member())?,
            TableReader::new(self, TableName::GuestSamples.member())?,
        ];
        let mut guests = Vec::new();
        let mut first_band = 0;
        for entry in entries {
            let bands = guests::band_count(&entry.grid) as usize;
            if let Some((rows, of_guest)) = guests::bands_between(&entry.grid, heights) {
                let mut samples = GuestSamples::default();
                for band in of_guest {
                    let index = first_band + band;
                    let batches = [
                        of_pixels.batch(self, index)?,
                        of_samples.batch(self, index)?,
                    ];
                    let rows = [0, 1].map(|table| Rows {
                        batch: &batches[table],
                        member: TableName::OF_GUESTS[table].member(),
                        index,
                    });
                    guests::add_band(&mut samples, &entry.grid, band, &rows)?;
                }
                guests.push(guests::guest(entry, rows, samples)?);
            }
            first_band += bands;
        }
        Ok(guests)
    }

    /// Reads a table, batch by batch.
    pub(super) fn read_all(
        &mut self,
        member: &'static str,
        mut take: impl FnMut(Rows) -> Result<(), FileError>,
    ) -> Result<(), FileError> {
        let reader = TableReader::new(self, member)?;
        for index in 0..reader.starts.len() {
            take(Rows {
                batch: &reader.batch(self, index)?,
                member,
                index,
            })?;
        }
        Ok(())
    }

    /// A table's member and where its batches lie. That it is there was checked.
    fn table(&self, name: &'static str) -> Result<(&Member, &Table), FileError> {
        let both = self
            .archive
            .member(name)
            .zip(self.manifest.tables.get(name));
        both.ok_or_else(|| FileError::unsound(name, "is missing"))
    }

    /// The bytes of a part of a table, which are those that were written.
    fn segment(
        &mut self,
        table: &'static str,
        start: u64,
        segment: &Segment,
    ) -> Result<Vec<u8>, FileError> {
        let bytes = self.archive.bytes(table, start, segment.length)?;
        if Segment::of(&bytes) == *segment {
            Ok(bytes)
        } else {
            Err(FileError::Damaged {
                what: table.into(),
                offset: start,
            })
        }
    }
}

impl Table {
    fn segments(&self) -> impl Iterator<Item = &Segment> {
        [&self.head]
            .into_iter()
            .chain(&self.batches)
            .chain([&self.tail])
    }
}

/// A table whose tail was read, in which its schema stands.
struct TableReader {
    name: &'static str,
    schema: SchemaRef,
    decoder: FileDecoder,
    /// Where each batch begins, and what its bytes are.
    starts: Vec<(u64, Segment)>,
}

impl TableReader {
    fn new<R: Read + Seek>(
        reader: &mut MapReader<R>,
        name: &'static str,
    ) -> Result<Self, FileError> {
        let (member, table) = reader.table(name)?;
        let (start, end, table) = (member.start(), member.end(), table.clone());
        let tail = reader.segment(name, end - table.tail.length, &table.tail)?;
        let schema = schema_of(&tail)
            .ok_or_else(|| FileError::unsound(name, "does not end with a schema"))?;
        message::check_schema(&schema).map_err(|what| FileError::unsound(name, what))?;
        let mut next = start + table.head.length;
        let starts = table.batches.into_iter().map(|segment| {
            let start = next;
            next += segment.length;
            (start, segment)
        });
        Ok(Self {
            name,
            starts: starts.collect(),
            decoder: FileDecoder::new(Arc::clone(&schema), MetadataVersion::V5),
            schema,
        })
    }

    fn batch<R: Read + Seek>(
        &self,
        reader: &mut MapReader<R>,
        index: usize,
    ) -> Result<RecordBatch, FileError> {
        let (start, segment) = &self.starts[index];
        let bytes = reader.segment(self.name, *start, segment)?;
        let no_batch = |why: &str| {
            let what = format!("batch {index} cannot be read: {why}");
            FileError::unsound(self.name, what)
        };
        let block = message::check_batch(&bytes, &self.schema).map_err(no_batch)?;
        let batch = self.decoder.read_record_batch(&block, &bytes.into());
        let batch = batch.map_err(|error| no_batch(&error.to_string()))?;
        batch.ok_or_else(|| no_batch("it is none"))
    }
}

/// The schema in the tail of an Arrow IPC file.
fn schema_of(tail: &[u8]) -> Option<SchemaRef> {
    let (rest, end) = tail.split_last_chunk::<10>()?;
    let length = arrow_ipc::reader::read_footer_length(*end).ok()?;
    let footer = &rest[rest.len().checked_sub(length)?..];
    let schema = arrow_ipc::root_as_footer(footer).ok()?.schema()?;
    arrow_ipc::convert::try_fb_to_schema(schema)
        .ok()
        .map(Arc::new)
}

/// What the manifest and the small tables name must be there.
pub(super) fn check_scene(scene: &Scene) -> Result<(), FileError> {
    let unsound = |what: String| Err(FileError::unsound(MANIFEST, what));
    let objects = scene.objects.len() as u32;
    for layer in &scene.layers {
        if layer.objects.start > layer.objects.end || layer.objects.end > objects {
            return unsound(format!(
                "the layer {:?} has objects that are not there",
                layer.name
            ));
        }
    }
    for material in &scene.materials {
        let textures = [material.base_color_texture, material.emissive_texture];
        for texture in textures.into_iter().flatten() {
            if texture.image.0 as usize >= scene.images.len() {
                let name = &material.name;
                return unsound(format!(
                    "the material {name:?} has an image that is not there"
                ));
            }
        }
    }
    Ok(())
}
