//! Files whose checksums are right and whose contents are wrong: each is refused or holds a sound map, in
//! memory that its bytes justify.
//!
//! `VEDUTA_DAMAGE=20` makes twenty times as many cases.

use super::container::{ArchiveReader, ArchiveWriter};
use super::manifest::{MANIFEST, Manifest, Segment};
use super::tests::{casters, projected, seen, seen_spans, written_of, written_spans};
use super::*;
use crate::scene::ImageId;
use crate::{Lines, SeenScene};
use arrow_array::builder::ListBuilder;
use arrow_array::builder::UInt32Builder;
use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, UInt32Type};
use arrow_array::{
    Array, ArrayRef, BooleanArray, DictionaryArray, Float32Array, Float64Array, Int64Array,
    RecordBatch, StringArray, UInt32Array,
};
use arrow_ipc::CompressionType;
use arrow_ipc::reader::FileReader;
use arrow_ipc::writer::{FileWriter, IpcWriteOptions};
use arrow_schema::{DataType, Field, Schema};
use peak_alloc::PeakAlloc;
use std::io::{Cursor, Write};
use std::sync::Arc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What the tests of this crate may take together: the largest of their maps, and what a forged file of
/// some ten thousand bytes may ask for.
const MOST_MEMORY: usize = 1 << 30;

/// Numbers that repeat in every run (Knuth's multiplier).
struct Random(u64);

impl Random {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % most
    }

    fn of<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())]
    }
}

fn effort() -> usize {
    let asked = std::env::var("VEDUTA_DAMAGE").ok();
    asked.and_then(|number| number.parse().ok()).unwrap_or(1)
}

/// The members of a file, which can be changed and put together again with right checksums.
#[derive(Clone)]
pub(super) struct Parts {
    manifest: Manifest,
    tables: Vec<(String, Vec<u8>)>,
}

impl Parts {
    pub(super) fn of(bytes: &[u8]) -> Self {
        let mut archive = ArchiveReader::new(Cursor::new(bytes)).expect("sound");
        let mut parts = Vec::new();
        for member in archive.members().to_vec() {
            let contents = archive.bytes("a member", member.start(), member.length);
            parts.push((member.name, contents.expect("sound")));
        }
        let (name, manifest) = parts.pop().expect("the manifest");
        assert_eq!(name, MANIFEST);
        Self {
            manifest: Manifest::parse(&manifest).expect("sound"),
            tables: parts,
        }
    }

    /// The file, with the checksums of the segments that the manifest tells.
    fn bytes(&self) -> Vec<u8> {
        let mut manifest = self.manifest.clone();
        let mut writer = ArchiveWriter::new(Cursor::new(Vec::new()));
        for (name, contents) in &self.tables {
            if let Some(table) = manifest.tables.get_mut(name) {
                let mut rest = contents.as_slice();
                let batches = table.batches.iter_mut();
                for segment in [&mut table.head]
                    .into_iter()
                    .chain(batches)
                    .chain([&mut table.tail])
                {
                    let (part, after) = rest.split_at(rest.len().min(segment.length as usize));
                    *segment = Segment::of(part);
                    rest = after;
                }
            }
            writer.begin(name).expect("memory takes all");
            writer.write_all(contents).expect("memory takes all");
            writer.end().expect("memory takes all");
        }
        writer.begin(MANIFEST).expect("memory takes all");
        let json = serde_json::to_vec(&manifest).expect("JSON");
        writer.write_all(&json).expect("memory takes all");
        writer.end().expect("memory takes all");
        writer.finish().expect("memory takes all").into_inner()
    }

    /// The batches of a member.
    pub(super) fn rows(&self, member: &str) -> Vec<RecordBatch> {
        let table = self.tables.iter().position(|(name, _)| name == member);
        self.batches(table.expect("a table of the file"))
    }

    fn batches(&self, table: usize) -> Vec<RecordBatch> {
        let bytes = Cursor::new(&self.tables[table].1);
        let reader = FileReader::try_new(bytes, None).expect("sound");
        reader.map(|batch| batch.expect("sound")).collect()
    }

    /// Puts other batches into a table.
    fn set_batches(&mut self, table: usize, schema: &Schema, batches: &[RecordBatch]) {
        let (name, contents) = &mut self.tables[table];
        let told = self.manifest.tables.get_mut(name).expect("is told");
        let options = IpcWriteOptions::default();
        let options = options.try_with_compression(Some(CompressionType::ZSTD));
        let options = options.expect("Zstandard is there");
        let mut writer = FileWriter::try_new_with_options(Vec::new(), schema, options);
        let writer = writer.as_mut().expect("memory takes all");
        let mut ends = vec![writer.get_ref().len()];
        for batch in batches {
            writer.write(batch).expect("memory takes all");
            ends.push(writer.get_ref().len());
        }
        writer.finish().expect("memory takes all");
        contents.clone_from(writer.get_ref());
        ends.push(contents.len());
        let mut segments = ends
            .windows(2)
            .map(|pair| Segment::of(&contents[pair[0]..pair[1]]));
        told.head = Segment::of(&contents[..ends[0]]);
        told.batches = segments.by_ref().take(batches.len()).collect();
        told.tail = segments.next().expect("the tail is the last");
    }
}

/// Reads a forged file: whether it was taken for sound, in which case it must be.
fn reads(bytes: &[u8], case: &str) -> bool {
    let result = MapReader::new(Cursor::new(bytes)).and_then(|mut reader| {
        if reader.sub_scanlines_per_row().is_some() {
            return reader.check_spans().map(|_| ());
        }
        // As pictures are made, without a check.
        reader.read()?;
        let seen = reader.check()?;
        Lines::of(&seen.map.faces, &seen.map.opaque);
        let normal = SeenScene::of(&seen.scene, &seen.map, seen.size);
        let written = written_of(&normal, None);
        let again = MapReader::new(Cursor::new(written))?.check()?;
        assert!(
            again == normal || has_nan(&normal),
            "{case}: read(write(map)) = map"
        );
        Ok(())
    });
    if let Err(error) = &result {
        let message = error.to_string();
        assert!(
            message.len() < 1000 && message.contains(": "),
            "{case}: {message}"
        );
    }
    let peak = MEMORY.peak_usage();
    assert!(peak < MOST_MEMORY, "{case}: {peak} bytes");
    result.is_ok()
}

/// Attributes may hold anything, also what is not equal to itself.
fn has_nan(seen: &SeenScene) -> bool {
    seen.scene != seen.scene.clone()
}

fn sound_files() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        (
            "a map with casters",
            written_of(&seen(12), Some(casters(3))),
        ),
        ("a map of vertices", written_of(&projected(8), None)),
        ("spans", written_spans(&seen_spans())),
    ]
}

#[test]
fn forged_bytes_of_tables_are_refused_or_read() {
    for (name, sound) in sound_files() {
        let sound = Parts::of(&sound);
        assert!(reads(&sound.bytes(), name), "{name} is sound");
        let mut random = Random(1);
        let cases = 2000 * effort();
        let mut refused = 0;
        for case in 0..cases {
            let mut parts = sound.clone();
            let table = random.below(parts.tables.len());
            let contents = &mut parts.tables[table].1;
            for _ in 0..=random.below(3) {
                let at = random.below(contents.len());
                match random.below(4) {
                    0 => {
                        let number: &[u8] = random.of(&[
                            &[0xff; 8][..],
                            &[0; 8],
                            &[0xff, 0xff, 0xff, 0x7f],
                            &[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f],
                            &[0, 0, 0, 0x80],
                            &[0, 0, 0, 0, 0, 0x10, 0, 0],
                        ]);
                        // Where numbers stand.
                        let at = at & !3;
                        for (byte, &new) in contents[at..].iter_mut().zip(number) {
                            *byte = new;
                        }
                    }
                    _ => contents[at] ^= 1 << random.below(8),
                }
            }
            let case = format!("{name}, case {case}, {}", parts.tables[table].0);
            refused += usize::from(!reads(&parts.bytes(), &case));
        }
        assert!(refused > cases / 4, "{name}: {refused} of {cases}");
    }
}

#[test]
fn forged_rows_are_refused_or_read() {
    for (name, sound) in sound_files() {
        let sound = Parts::of(&sound);
        let mut random = Random(2);
        let cases = 1500 * effort();
        let mut refused = 0;
        for case in 0..cases {
            let mut parts = sound.clone();
            let mut forged = String::new();
            for _ in 0..=random.below(2) {
                let table = random.below(parts.tables.len());
                let mut batches = parts.batches(table);
                if batches.is_empty() {
                    continue;
                }
                let place = random.below(batches.len());
                let (batch, what) = forge(&batches[place], &mut random);
                forged += &format!(" {}: {what}", parts.tables[table].0);
                let schema = batch.schema();
                if schema == batches[place].schema() {
                    batches[place] = batch;
                } else {
                    batches = vec![batch; batches.len()];
                }
                match random.below(20) {
                    0 => batches.push(batches[place].clone()),
                    1 => drop(batches.remove(place)),
                    2 => batches[place] = batches[place].slice(0, 0),
                    _ => {}
                }
                parts.set_batches(table, &schema, &batches);
            }
            let case = format!("{name}, case {case},{forged}");
            refused += usize::from(!reads(&parts.bytes(), &case));
        }
        assert!(refused > cases / 3, "{name}: {refused} of {cases}");
    }
}

/// A batch with a row, a value or a column that is wrong, or might be.
fn forge(batch: &RecordBatch, random: &mut Random) -> (RecordBatch, String) {
    let column = random.below(batch.num_columns());
    let name = batch.schema().field(column).name().clone();
    let rows = batch.num_rows();
    match random.below(10) {
        0 if rows > 0 => {
            // Rows twice, in another order, or not at all.
            let mut order: Vec<Option<u32>> = (0..rows as u32).map(Some).collect();
            for _ in 0..=random.below(3) {
                let [from, to] = [(); 2].map(|()| random.below(order.len()));
                match random.below(3) {
                    0 => order.swap(from, to),
                    1 => order.insert(to, order[from]),
                    _ if order.len() > 1 => drop(order.remove(from)),
                    _ => {}
                }
            }
            let order = UInt32Array::from(order);
            let taken = arrow_select::take::take_record_batch(batch, &order);
            (taken.expect("rows that are there"), "rows".into())
        }
        1 => with_column(batch, column, None),
        2 => {
            // Another type, of as many rows.
            let array: ArrayRef = match random.below(5) {
                0 => Arc::new(Int64Array::from(vec![1; rows])),
                1 => Arc::new(Float64Array::from(vec![0.5; rows])),
                2 => Arc::new(StringArray::from(vec!["word"; rows])),
                3 => {
                    let keys = UInt32Array::from(vec![0; rows]);
                    let values = Arc::new(UInt32Array::from(vec![7]));
                    Arc::new(DictionaryArray::new(keys, values))
                }
                _ => Arc::new(arrow_array::NullArray::new(rows)),
            };
            with_column(batch, column, Some(array))
        }
        _ if rows == 0 => (batch.clone(), "nothing".into()),
        _ => {
            let row = random.below(rows);
            match forge_value(batch.column(column), row, random) {
                Some(array) => {
                    let (batch, _) = with_column(batch, column, Some(array));
                    (batch, format!("{name} of row {row}"))
                }
                None => (batch.clone(), "nothing".into()),
            }
        }
    }
}

/// The batch with another column, or without it.
fn with_column(
    batch: &RecordBatch,
    column: usize,
    array: Option<ArrayRef>,
) -> (RecordBatch, String) {
    let schema = batch.schema();
    let mut fields: Vec<Field> = schema.fields().iter().map(|f| (**f).clone()).collect();
    let mut columns = batch.columns().to_vec();
    let what = format!("column {}", fields[column].name());
    match array {
        Some(array) => {
            let is_gappy = fields[column].is_nullable() || array.null_count() > 0;
            if *array.data_type() != *fields[column].data_type() || array.null_count() > 0 {
                let name = fields[column].name().clone();
                fields[column] = Field::new(
                    name,
                    array.data_type().clone(),
                    is_gappy || *array.data_type() == DataType::Null,
                );
            }
            columns[column] = array;
        }
        None => {
            fields.remove(column);
            columns.remove(column);
        }
    }
    if columns.is_empty() {
        return (batch.clone(), "nothing".into());
    }
    let forged = RecordBatch::try_new(Arc::new(Schema::new(fields)), columns);
    (forged.expect("columns fit their types"), what)
}

/// The column with another value in a row.
fn forge_value(array: &ArrayRef, row: usize, random: &mut Random) -> Option<ArrayRef> {
    fn with<T: Clone>(values: &[T], row: usize, value: T) -> Vec<T> {
        let mut values = values.to_vec();
        values[row] = value;
        values
    }
    let number = |old: u32, random: &mut Random| {
        let far = random.below(1 << 30) as u32;
        random.of(&[
            0,
            1,
            2,
            3,
            old ^ 1,
            old.wrapping_add(1),
            u32::MAX,
            u32::MAX - 1,
            far,
        ])
    };
    Some(match array.data_type() {
        DataType::UInt32 => {
            let values = array.as_primitive::<UInt32Type>().values();
            if random.below(8) == 0 {
                let gap = (0..values.len()).map(|k| (k != row).then_some(values[k]));
                return Some(Arc::new(gap.collect::<UInt32Array>()));
            }
            let value = number(values[row], random);
            Arc::new(UInt32Array::from(with(values, row, value)))
        }
        DataType::Float64 => {
            let array = array.as_primitive::<Float64Type>();
            let old = array.value(row);
            if random.below(8) == 0 {
                let gap = array
                    .iter()
                    .enumerate()
                    .map(|(k, value)| value.filter(|_| k != row));
                return Some(Arc::new(gap.collect::<Float64Array>()));
            }
            let value = random.of(&[
                f64::NAN,
                f64::INFINITY,
                -1.0,
                -0.0,
                0.0,
                1.0,
                1e-300,
                1e300,
                -old,
                2.0 * old,
                1.0 - old,
                old.next_up(),
            ]);
            let values: Vec<Option<f64>> = array.iter().collect();
            Arc::new(Float64Array::from(with(&values, row, Some(value))))
        }
        DataType::Float32 => {
            let array = array.as_primitive::<Float32Type>();
            let values: Vec<Option<f32>> = array.iter().collect();
            let value = random.of(&[
                None,
                Some(f32::NAN),
                Some(f32::INFINITY),
                Some(-1.0),
                Some(0.0),
                Some(1e30),
            ]);
            Arc::new(Float32Array::from(with(&values, row, value)))
        }
        DataType::Boolean => {
            let values: Vec<bool> = array.as_boolean().iter().flatten().collect();
            Arc::new(BooleanArray::from(with(&values, row, !values[row])))
        }
        DataType::Utf8 => {
            let values: Vec<&str> = array.as_string::<i32>().iter().flatten().collect();
            let value = random.of(&["", "a", "\u{0}", "../../x"]);
            Arc::new(StringArray::from(with(&values, row, value)))
        }
        DataType::List(field) => {
            let lists = array.as_list::<i32>();
            let mut builder = ListBuilder::new(UInt32Builder::new()).with_field(field.clone());
            for (k, list) in lists.iter().enumerate() {
                let list = list.expect("no gaps");
                let mut values = list.as_primitive::<UInt32Type>().values().to_vec();
                if k == row {
                    let place = random.below(values.len().max(1));
                    match random.below(6) {
                        0 => values.reverse(),
                        1 => values.truncate(place),
                        2 => values.insert(place.min(values.len()), number(0, random)),
                        3 => values = vec![number(0, random); 70],
                        _ if !values.is_empty() => values[place] = number(values[place], random),
                        _ => values.push(0),
                    }
                }
                builder.append_value(values.into_iter().map(Some));
            }
            Arc::new(builder.finish())
        }
        _ => return None,
    })
}

/// What a forger does to a manifest.
type Forgery = fn(&mut Manifest);

#[test]
fn forged_manifests_are_refused_or_read() {
    for (name, sound) in sound_files() {
        let sound = Parts::of(&sound);
        let forgeries: [(&str, Forgery); 22] = [
            ("no materials", |m| m.materials.clear()),
            ("an image beyond", |m| {
                for texture in m
                    .materials
                    .iter_mut()
                    .flat_map(|m| &mut m.base_color_texture)
                {
                    texture.image = ImageId(u32::MAX);
                }
            }),
            ("objects beyond", |m| m.layers[0].objects = 0..u32::MAX),
            ("objects backwards", |m| {
                m.layers[0].objects = std::ops::Range { start: 1, end: 0 };
            }),
            ("no tiles", |m| m.tiles.clear()),
            ("a tile more", |m| m.tiles.push([0.0; 4])),
            ("no pixels", |m| m.size = [0, 7]),
            ("all pixels", |m| m.size = [u32::MAX; 2]),
            ("spans or not", |m| {
                m.sub_scanlines = m.sub_scanlines.xor(Some(3))
            }),
            ("no sub-scanlines", |m| {
                m.sub_scanlines = m.sub_scanlines.map(|_| 0)
            }),
            ("all sub-scanlines", |m| {
                m.sub_scanlines = m.sub_scanlines.map(|_| u32::MAX)
            }),
            ("another kind", |m| {
                m.format = if m.format == manifest::FORMAT {
                    manifest::SPANS_FORMAT
                } else {
                    manifest::FORMAT
                }
                .into();
            }),
            ("no table", |m| drop(m.tables.remove("faces.arrow"))),
            ("a table more", |m| {
                drop(m.tables.insert("x".into(), Default::default()))
            }),
            ("a long part", |m| {
                for table in m.tables.values_mut() {
                    table.head.length = u64::MAX;
                }
            }),
            ("parts of all lengths", |m| {
                for table in m.tables.values_mut() {
                    table.head.length += table.tail.length;
                    table.tail.length = 0;
                }
            }),
            ("a flat frame", |m| m.camera = m.camera.with_aspect(0.0)),
            ("a mirrored frame", |m| {
                m.camera = m.camera.with_aspect(-1.0)
            }),
            ("no room", |m| m.camera.eye_from_world *= 0.0),
            ("casters of no image", |m| {
                if let Some(scene) = m.casters.as_mut().and_then(|c| c.embedded.as_mut()) {
                    scene.images = vec![u32::MAX];
                }
            }),
            ("casters of no material", |m| {
                if let Some(scene) = m.casters.as_mut().and_then(|c| c.embedded.as_mut()) {
                    scene.materials.clear();
                }
            }),
            ("casters not told", |m| m.casters = None),
        ];
        let mut refused = Vec::new();
        for (what, forge) in forgeries {
            let mut parts = sound.clone();
            forge(&mut parts.manifest);
            if parts.manifest == sound.manifest {
                continue;
            }
            let bytes = forged_with(&parts, &sound);
            if !reads(&bytes, &format!("{name}, {what}")) {
                refused.push(what);
            }
        }
        for what in [
            "no materials",
            "no tiles",
            "no pixels",
            "another kind",
            "no table",
            "a flat frame",
            "no room",
        ] {
            assert!(refused.contains(&what), "{name}: {what} is refused");
        }
    }
}

/// The tables of `sound` as they are, beside a forged manifest.
fn forged_with(forged: &Parts, sound: &Parts) -> Vec<u8> {
    let mut writer = ArchiveWriter::new(Cursor::new(Vec::new()));
    for (name, contents) in &sound.tables {
        writer.begin(name).expect("memory takes all");
        writer.write_all(contents).expect("memory takes all");
        writer.end().expect("memory takes all");
    }
    writer.begin(MANIFEST).expect("memory takes all");
    let json = serde_json::to_vec(&forged.manifest).expect("JSON");
    writer.write_all(&json).expect("memory takes all");
    writer.end().expect("memory takes all");
    writer.finish().expect("memory takes all").into_inner()
}

#[test]
fn a_column_that_says_it_becomes_huge_is_refused_before_it_is_made() {
    let sound = Parts::of(&written_of(&seen(12), None));
    let table = sound
        .tables
        .iter()
        .position(|(name, _)| name == "points.arrow");
    let table = table.expect("is there");
    // The first column stands right behind what the batch says of itself, and begins with its length.
    let rows = sound.batches(table)[0].num_rows();
    let contents = &sound.tables[table].1;
    let start = sound.manifest.tables["points.arrow"].head.length as usize;
    let metadata = contents[start + 4..start + 8]
        .try_into()
        .expect("four bytes");
    let at = start + 8 + i32::from_le_bytes(metadata) as usize;
    assert_eq!(contents[at..at + 8], (8 * rows as u64).to_le_bytes());
    for claim in [1_u64 << 40, (1 << 62) + 1, u64::MAX - 1] {
        let mut parts = sound.clone();
        parts.tables[table].1[at..at + 8].copy_from_slice(&claim.to_le_bytes());
        let read = MapReader::new(Cursor::new(parts.bytes())).and_then(|mut reader| reader.check());
        let message = read.expect_err("is too large").to_string();
        assert!(
            message.starts_with("points.arrow: batch 0") && message.contains("larger than it can"),
            "{message}"
        );
    }
}
