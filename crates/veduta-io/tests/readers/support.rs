//! Small files, made by the tests.

use serde_json::{Value, json};
use std::path::PathBuf;
use tempfile::TempDir;
use veduta_io::{Loaded, ReadError, ReadOptions, UpAxis, read_scene};

/// A folder that is gone after the test.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(TempDir::new().expect("a folder for the test"))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        // Cutting off an old file makes some file systems write to the disk at once, which tests with
        // thousands of files would wait for.
        let _ = std::fs::remove_file(&path);
        std::fs::write(&path, bytes).expect("may write in the test's folder");
        path
    }

    /// Writes a file and reads it as a scene, in the file's own axes.
    pub fn read(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<Loaded, ReadError> {
        let options = ReadOptions {
            up_axis: Some(UpAxis::Z),
            ..ReadOptions::default()
        };
        read_scene(&self.write(name, bytes), &options)
    }
}

/// A GLB in the making.
#[derive(Clone)]
pub struct Glb {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl Glb {
    /// With a scene of one node, but nothing in it.
    pub fn new() -> Self {
        Self {
            json: json!({
                "asset": { "version": "2.0" },
                "scene": 0,
                "scenes": [{ "nodes": [0] }],
                "nodes": [{ "name": "root", "mesh": 0 }],
                "meshes": [],
                "accessors": [],
                "bufferViews": [],
            }),
            bin: Vec::new(),
        }
    }

    /// With one triangle in its root: (0, 0, 0), (1, 0, 0), (0, 1, 0).
    pub fn triangle() -> Self {
        let mut glb = Self::new();
        let position = glb.f32s("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let indices = glb.accessor(&[0, 1, 2], 5121, "SCALAR", 3);
        glb.add(
            "meshes",
            json!({ "primitives": [
            { "attributes": { "POSITION": position }, "indices": indices }
        ] }),
        );
        glb
    }

    /// Takes a sound file apart.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four"));
        let json = 20 + word(12) as usize;
        Self {
            json: serde_json::from_slice(&bytes[20..json]).expect("sound JSON"),
            bin: bytes[json + 8..].to_vec(),
        }
    }

    /// Adds a row to a table; its index.
    pub fn add(&mut self, table: &str, row: Value) -> usize {
        let table = &mut self.json[table];
        if table.is_null() {
            *table = json!([]);
        }
        let rows = table.as_array_mut().expect("tables are arrays");
        rows.push(row);
        rows.len() - 1
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bin.len().next_multiple_of(4);
        self.bin.resize(offset, 0);
        self.bin.extend(bytes);
        self.add(
            "bufferViews",
            json!({
                "buffer": 0, "byteOffset": offset, "byteLength": bytes.len()
            }),
        )
    }

    pub fn accessor(&mut self, bytes: &[u8], component: u32, shape: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.add(
            "accessors",
            json!({
                "bufferView": view, "componentType": component, "type": shape, "count": count
            }),
        )
    }

    pub fn f32s(&mut self, shape: &str, values: &[f32]) -> usize {
        let components = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes: Vec<u8> = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        self.accessor(&bytes, 5126, shape, values.len() / components)
    }

    /// The file. The buffer's length is set if it was not.
    pub fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if json.is_object() && json["buffers"].is_null() {
            json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let word = |number: usize| {
            u32::try_from(number)
                .expect("tests are small")
                .to_le_bytes()
        };
        let length = 12 + 8 + text.len() + 8 + bin.len();
        [
            b"glTF".as_slice(),
            &word(2),
            &word(length),
            &word(text.len()),
            b"JSON",
            &text,
            &word(bin.len()),
            b"BIN\0",
            &bin,
        ]
        .concat()
    }
}

/// A PNG of 2 x 1 pixels: red, and blue of half opacity.
pub fn small_png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("memory takes all");
    writer
        .write_image_data(&[255, 0, 0, 255, 0, 0, 255, 128])
        .expect("memory takes all");
    writer.finish().expect("memory takes all");
    bytes
}
