use super::file_from_world;
use crate::write::WriteProblem;
use serde_json::{Value, json};
use veduta::map::{Camera, Projection};
use veduta::scene::{AlphaMode, Bounds, Material, Mesh, Scene};
use veduta_geometry::{DMat4, DVec2, DVec4};

// Constants of glTF 2.0.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;

/// A binary glTF file: a JSON chunk and a binary one.
pub fn encode(scene: &Scene) -> Result<Vec<u8>, WriteProblem> {
    let mut buffer = Buffer::default();
    let meshes: Vec<Value> = scene
        .meshes
        .iter()
        .map(|mesh| json!({ "primitives": primitives(mesh, &mut buffer) }))
        .collect();
    let objects = scene.objects.iter().map(|object| {
        json!({
            "name": object.name,
            "mesh": object.mesh.0,
            "matrix": columns(file_from_world() * object.world_from_object),
        })
    });
    let depth = depth_of(scene);
    let mut cameras = Vec::new();
    let mut nodes: Vec<Value> = objects.collect();
    for (name, camera) in &scene.cameras {
        // A camera of the format looks along -Z, with +Y up.
        let eye_from_node = DMat4::from_cols(DVec4::X, -DVec4::Y, -DVec4::Z, DVec4::W);
        let world_from_node = camera.eye_from_world.inverse() * eye_from_node;
        nodes.push(json!({
            "name": name,
            "camera": cameras.len(),
            "matrix": columns(file_from_world() * world_from_node),
        }));
        cameras.push(lens(name, camera, depth)?);
    }
    let mut document = json!({
        "asset": { "version": "2.0", "generator": "veduta" },
        "scene": 0,
        "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": scene.materials.iter().map(material).collect::<Vec<_>>(),
        "cameras": cameras,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{ "byteLength": buffer.bytes.len() }],
    });
    if scene.materials.iter().any(|material| material.unlit) {
        document["extensionsUsed"] = json!(["KHR_materials_unlit"]);
    }
    if let Value::Object(fields) = &mut document {
        // The format has no empty tables.
        fields.retain(|_, value| value.as_array().is_none_or(|rows| !rows.is_empty()));
    }

    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = buffer.bytes;
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = 12 + 8 + text.len() + 8 + binary.len();
    let length = u32::try_from(length).map_err(|_| {
        WriteProblem::Model(format!("a .glb ends at 4 GiB, and it needs {length} bytes"))
    })?;
    let mut file = Vec::with_capacity(length as usize);
    file.extend(b"glTF");
    file.extend(2u32.to_le_bytes());
    file.extend(length.to_le_bytes());
    for (kind, chunk) in [(b"JSON", text), (b"BIN\0", binary)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    Ok(file)
}

/// The binary chunk as it grows, with the tables that say what lies where.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Adds rows of `N` floats.
    fn floats<const N: usize>(&mut self, rows: impl ExactSizeIterator<Item = [f32; N]>) -> usize {
        let (count, offset) = (rows.len(), self.bytes.len());
        let (mut low, mut high) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N]);
        for row in rows {
            for (k, value) in row.into_iter().enumerate() {
                low[k] = low[k].min(value);
                high[k] = high[k].max(value);
                self.bytes.extend(value.to_le_bytes());
            }
        }
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let mut accessor = json!({ "componentType": FLOAT, "count": count, "type": kind });
        // Only positions must have them, and they are useful to no one else.
        if N == 3 {
            accessor["min"] = json!(low.as_slice());
            accessor["max"] = json!(high.as_slice());
        }
        self.add(offset, ARRAY_BUFFER, accessor)
    }

    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let offset = self.bytes.len();
        for index in triangles.as_flattened() {
            self.bytes.extend(index.to_le_bytes());
        }
        let count = 3 * triangles.len();
        let accessor = json!({ "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR" });
        self.add(offset, ELEMENT_ARRAY_BUFFER, accessor)
    }

    fn add(&mut self, offset: usize, target: u32, mut accessor: Value) -> usize {
        accessor["bufferView"] = self.views.len().into();
        self.views.push(json!({
            "buffer": 0,
            "byteOffset": offset,
            "byteLength": self.bytes.len() - offset,
            "target": target,
        }));
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}

/// A primitive for each run of faces of one material; they share their vertices.
fn primitives(mesh: &Mesh, buffer: &mut Buffer) -> Vec<Value> {
    let positions = mesh.positions.iter();
    let mut attributes =
        json!({ "POSITION": buffer.floats(positions.map(|p| p.as_vec3().to_array())) });
    if !mesh.normals.is_empty() {
        let normals = mesh.normals.iter().map(|normal| normal.to_array());
        attributes["NORMAL"] = buffer.floats(normals).into();
    }
    if !mesh.colors.is_empty() || !mesh.opacities.is_empty() {
        let colors = (0..mesh.positions.len()).map(|vertex| {
            let [r, g, b] = mesh.colors.get(vertex).copied().unwrap_or([1.0; 3]);
            [r, g, b, mesh.opacities.get(vertex).copied().unwrap_or(1.0)]
        });
        attributes["COLOR_0"] = buffer.floats(colors).into();
    }
    let faces = mesh.face_count() as u32;
    let ends = mesh.materials.iter().skip(1).map(|row| row.0);
    let ends = ends.chain([faces]);
    mesh.materials
        .iter()
        .zip(ends)
        .filter(|((first, _), end)| *first < (*end).min(faces))
        .map(|(&(first, material), end)| {
            let start = mesh.triangles_of(first).start;
            let end = mesh.triangles_of(end.min(faces) - 1).end;
            json!({
                "attributes": attributes,
                "indices": buffer.indices(&mesh.triangles[start..end]),
                "material": material.0,
            })
        })
        .collect()
}

fn material(material: &Material) -> Value {
    let mut row = json!({
        "name": material.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": material.base_color,
            "metallicFactor": 0,
        },
        "doubleSided": material.double_sided,
    });
    if material.emissive != [0.0; 3] {
        row["emissiveFactor"] = json!(material.emissive);
    }
    match material.alpha_mode {
        AlphaMode::Opaque => {}
        AlphaMode::Mask(cutoff) => {
            row["alphaMode"] = "MASK".into();
            row["alphaCutoff"] = cutoff.into();
        }
        AlphaMode::Blend => row["alphaMode"] = "BLEND".into(),
    }
    if material.unlit {
        row["extensions"] = json!({ "KHR_materials_unlit": {} });
    }
    row
}

/// A camera without its place. `depth` is how deep the scene may reach before it.
fn lens(name: &str, camera: &Camera, depth: f64) -> Result<Value, WriteProblem> {
    if camera.shift != DVec2::ZERO {
        return Err(WriteProblem::Model(format!(
            "the frame of the camera {name:?} is shifted, which glTF knows not"
        )));
    }
    Ok(match camera.projection {
        Projection::Perspective {
            tan_half_height,
            aspect,
        } => json!({
            "name": name,
            "type": "perspective",
            "perspective": {
                "yfov": 2.0 * tan_half_height.atan(),
                "aspectRatio": aspect,
                "znear": camera.near,
            },
        }),
        Projection::Parallel { height, aspect } => {
            if camera.near < 0.0 {
                return Err(WriteProblem::Model(format!(
                    "the camera {name:?} sees what is behind it, which glTF knows not"
                )));
            }
            json!({
                "name": name,
                "type": "orthographic",
                "orthographic": {
                    "xmag": 0.5 * height * aspect,
                    "ymag": 0.5 * height,
                    "znear": camera.near,
                    "zfar": camera.near + depth,
                },
            })
        }
    })
}

/// No point of the scene, and no camera, is further from another than this.
fn depth_of(scene: &Scene) -> f64 {
    let Some(bounds) = Bounds::of_scene(scene) else {
        return 1.0;
    };
    let eyes = scene.cameras.iter().map(|(_, camera)| {
        let eye = camera.eye_from_world.inverse().w_axis.truncate();
        (bounds.min - eye)
            .abs()
            .max((bounds.max - eye).abs())
            .length()
    });
    let size = (bounds.max - bounds.min).length();
    eyes.fold(size, f64::max).max(1e-3)
}

fn columns(matrix: DMat4) -> [f64; 16] {
    // Adding 0 leaves no "-0.0".
    matrix.to_cols_array().map(|value| value + 0.0)
}
