//! Files with damage of every small kind: each is read or refused, in bounded memory, without panic.

use crate::support::{Folder, Glb, small_png};
use crate::{cityjson, ply, stl};
use peak_alloc::PeakAlloc;
use serde_json::{Value, json};
use veduta::scene::Scene;
use veduta_io::{Loaded, ReadError};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// What all tests together may take: the readers' free 64 MiB for each thread that runs a test, and
/// the tests' own.
const MOST_MEMORY: usize = 1 << 30;

/// A sound scene, or an error that names the file.
pub fn check(name: &str, read: Result<Loaded, ReadError>, case: impl std::fmt::Display) -> bool {
    match read {
        Ok(loaded) => {
            assert_sound(&loaded.scene, case);
            true
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.contains(name), "{case}: {message}");
            assert!(
                message.len() < 1000 && !message.contains('\n'),
                "{case}: {message}"
            );
            false
        }
    }
}

fn assert_sound(scene: &Scene, case: impl std::fmt::Display) {
    for mesh in &scene.meshes {
        mesh.check()
            .unwrap_or_else(|fault| panic!("{case}: {fault}"));
        let known =
            |&(_, material): &(u32, _)| scene.materials.get(material_index(material)).is_some();
        assert!(mesh.materials.iter().all(known), "{case}: materials");
        assert!(
            mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-3),
            "{case}: normals"
        );
    }
    for object in &scene.objects {
        assert!(
            (object.mesh.0 as usize) < scene.meshes.len(),
            "{case}: meshes"
        );
        assert!(object.world_from_object.is_finite(), "{case}: transforms");
    }
    let textures = scene
        .materials
        .iter()
        .flat_map(|m| [m.base_color_texture, m.emissive_texture]);
    for texture in textures.flatten() {
        assert!(
            (texture.image.0 as usize) < scene.images.len(),
            "{case}: images"
        );
    }
    for image in &scene.images {
        assert_eq!(
            image.pixels.len(),
            image.width as usize * image.height as usize,
            "{case}"
        );
    }
    for (_, camera) in &scene.cameras {
        assert!(
            camera.eye_from_world.is_finite() && camera.near.is_finite(),
            "{case}: cameras"
        );
    }
    for light in &scene.lights {
        assert!(
            light.world_from_light.is_finite()
                && (light.world_from_light.determinant() - 1.0).abs() < 1e-6,
            "{case}: lights"
        );
    }
}

fn material_index(id: veduta::map::MaterialId) -> usize {
    id.index()
}

/// A GLB with a bit of everything that is read.
fn rich_glb() -> Glb {
    let mut glb = Glb::triangle();
    let normal = glb.accessor(&[0, 0, 127, 0, 0, 127, 0, 0, 127], 5120, "VEC3", 3);
    glb.json["accessors"][normal]["normalized"] = json!(true);
    let texcoord = glb.f32s("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let picture = glb.view(&small_png());
    glb.add("images", json!({ "bufferView": picture }));
    glb.add("samplers", json!({ "wrapS": 33071 }));
    glb.add("textures", json!({ "source": 0, "sampler": 0 }));
    glb.add(
        "materials",
        json!({
            "alphaMode": "BLEND", "emissiveFactor": [1, 0, 0],
            "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.5], "baseColorTexture": {
                "index": 0, "extensions": { "KHR_texture_transform": { "scale": [2, 2] } } } },
        }),
    );
    let sparse_at = glb.view(&[2]);
    let sparse_values = glb.view(&[0, 0, 128, 63]);
    let color = glb.add(
        "accessors",
        json!({
            "componentType": 5121, "type": "VEC4", "count": 3, "normalized": true,
            "sparse": { "count": 1,
                "indices": { "bufferView": sparse_at, "componentType": 5121 },
                "values": { "bufferView": sparse_values } },
        }),
    );
    glb.json["meshes"][0]["primitives"] = json!([
        { "attributes": { "POSITION": 0, "NORMAL": normal, "TEXCOORD_0": texcoord, "COLOR_0": color },
          "indices": 1, "material": 0, "mode": 4 },
        { "attributes": { "POSITION": 0 }, "mode": 5 },
    ]);
    glb.json["nodes"] = json!([
        { "name": "root", "children": [1, 2], "scale": [2, 2, 2] },
        { "name": "a", "mesh": 0, "rotation": [0, 0, 1, 0] },
        { "camera": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1], "children": [3] },
        { "mesh": 0 },
    ]);
    glb.json["cameras"] = json!([
        { "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }
    ]);
    glb
}

/// A GLB of what stands otherwise than its vertices say: a skin of two joints, morph targets, one of
/// them sparse, instances, a light, and a second set of texture coordinates.
fn posed_glb() -> Glb {
    let mut glb = Glb::triangle();
    let joints = glb.accessor(&[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0], 5121, "VEC4", 3);
    let weights = glb.accessor(&[9, 9, 0, 0, 255, 0, 0, 0, 1, 0, 0, 0], 5121, "VEC4", 3);
    glb.json["accessors"][weights]["normalized"] = json!(true);
    let identity = |k: usize| if k.is_multiple_of(5) { 1.0f32 } else { 0.0 };
    let matrices: Vec<u8> = (0..32)
        .flat_map(|k| identity(k % 16).to_le_bytes())
        .collect();
    let matrices = glb.accessor(&matrices, 5126, "MAT4", 2);
    let sparse_at = glb.view(&[1]);
    let sparse_value = glb.view(&[0, 0, 128, 63, 0, 0, 0, 0, 0, 0, 0, 64]);
    let target = glb.add(
        "accessors",
        json!({
            "componentType": 5126, "type": "VEC3", "count": 3,
            "sparse": { "count": 1,
                "indices": { "bufferView": sparse_at, "componentType": 5121 },
                "values": { "bufferView": sparse_value } },
        }),
    );
    let places = glb.f32s("VEC3", &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    let turns = glb.accessor(&[0, 0, 0, 127, 0, 127, 0, 0], 5120, "VEC4", 2);
    glb.json["accessors"][turns]["normalized"] = json!(true);
    let texcoord = glb.f32s("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let picture = glb.view(&small_png());
    glb.add("images", json!({ "bufferView": picture }));
    glb.add(
        "textures",
        json!({ "source": 0, "extensions": { "EXT_texture_webp": { "source": 0 } } }),
    );
    glb.add(
        "materials",
        json!({
            "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0, "texCoord": 1 },
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } },
        }),
    );
    glb.json["meshes"][0] = json!({
        "weights": [0.5, 0.25],
        "primitives": [{
            "attributes": { "POSITION": 0, "JOINTS_0": joints, "WEIGHTS_0": weights,
                "TEXCOORD_0": texcoord, "TEXCOORD_1": texcoord },
            "targets": [{ "POSITION": target }, { "POSITION": 0, "NORMAL": 0 }],
            "indices": 1, "material": 0,
        }],
    });
    glb.json["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": matrices }]);
    glb.json["nodes"] = json!([
        { "mesh": 0, "skin": 0, "children": [1, 2, 3] },
        { "translation": [0, 1, 0] },
        { "rotation": [0, 0, 1, 0], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "mesh": 0, "weights": [1, 0], "extensions": { "EXT_mesh_gpu_instancing": {
            "attributes": { "TRANSLATION": places, "ROTATION": turns } } } },
    ]);
    glb.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "spot", "intensity": 3, "range": 9, "spot": { "outerConeAngle": 0.5 } }
    ] } });
    glb
}

const RICH_OBJ: &str = "mtllib none.mtl\no one\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1e-3\n\
    vt 0 0\nvt 1 1\nvn 0 0 1\ng part\nusemtl red\nf 1/1/1 2/2/1 3//1 4\nf -4 -3 \\\n-2\nl 1 2\n\
    s off\no two\nf 1 2 3\nf 4 3 2 1 2 3\n";

/// Numbers that repeat in every run (Knuth's multiplier).
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, most: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % most
    }
}

fn read_damaged(name: &str, sound: &[u8]) {
    let folder = Folder::new();
    assert!(check(name, folder.read(name, sound), "undamaged"));
    let mut read = 0;
    let mut cases = 0;
    for end in 0..sound.len() {
        cases += 1;
        read += usize::from(check(
            name,
            folder.read(name, &sound[..end]),
            format!("cut at {end}"),
        ));
    }
    for bit in 0..8 * sound.len() {
        let mut bytes = sound.to_vec();
        bytes[bit / 8] ^= 1 << (bit % 8);
        cases += 1;
        read += usize::from(check(name, folder.read(name, &bytes), format!("bit {bit}")));
    }
    // Damage that nobody notices, and damage that is all refused, would both mean a blind test.
    assert!(
        read > 0 && read < cases,
        "{read} of {cases} damaged files were read"
    );
    let peak = MEMORY.peak_usage();
    assert!(peak < MOST_MEMORY, "{peak} bytes");
}

#[test]
fn a_glb_cut_anywhere_or_with_any_bit_flipped_is_read_or_refused() {
    read_damaged("m.glb", &rich_glb().bytes());
}

#[test]
fn a_posed_glb_cut_anywhere_or_with_any_bit_flipped_is_read_or_refused() {
    read_damaged("m.glb", &posed_glb().bytes());
}

/// How many damaged variants of a compressed file are read. `VEDUTA_DAMAGE` asks for another number.
fn compressed_cases() -> usize {
    let asked = std::env::var("VEDUTA_DAMAGE").ok();
    asked.map_or(4000, |asked| asked.parse().expect("a number of variants"))
}

/// Reads variants of a compressed file: its stream cut, bits of it flipped, bytes of it replaced.
#[cfg(feature = "meshopt")]
fn read_damaged_streams(sound: &[u8]) {
    let folder = Folder::new();
    assert!(check("m.glb", folder.read("m.glb", sound), "undamaged"));
    let json = u32::from_le_bytes(sound[12..16].try_into().expect("four bytes"));
    let start = 12 + 8 + json as usize + 8;
    let (mut read, cases) = (0, compressed_cases());
    for seed in 0..cases {
        let mut random = Random(seed as u64);
        let mut bytes = sound.to_vec();
        for _ in 0..=random.below(3) {
            let place = start + random.below(bytes.len() - start);
            match random.below(4) {
                // The zeros stand for what is cut off, so that the container stays sound.
                0 => bytes[place..].fill(0),
                1 => bytes[place] = random.below(256) as u8,
                2 => bytes[place] = 255,
                _ => bytes[place] ^= 1 << random.below(8),
            }
        }
        let loaded = folder.read("m.glb", &bytes);
        read += usize::from(check("m.glb", loaded, format!("seed {seed}")));
    }
    assert!(
        0 < read && read < cases,
        "{read} of {cases} damaged files were read"
    );
    let peak = MEMORY.peak_usage();
    assert!(peak < MOST_MEMORY, "{peak} bytes");
}

#[cfg(feature = "meshopt")]
#[test]
fn damaged_meshopt_streams_are_read_or_refused() {
    read_damaged_streams(crate::compressed::MESHOPT_EXT);
    read_damaged_streams(crate::compressed::MESHOPT_KHR);
}

#[cfg(feature = "draco")]
#[test]
fn damaged_draco_streams_are_read_or_refused() {
    read_damaged_streams(crate::compressed::EDGEBREAKER);
    read_damaged_streams(crate::compressed::SEQUENTIAL);
}

#[test]
fn an_obj_cut_anywhere_or_with_any_bit_flipped_is_read_or_refused() {
    read_damaged("m.obj", RICH_OBJ.as_bytes());
}

#[test]
fn an_stl_cut_anywhere_or_with_any_bit_flipped_is_read_or_refused() {
    read_damaged(
        "m.stl",
        &stl::binary(b"COLOR=\x00\xff\x00\xff", [1, 0x8000, 3, 4]),
    );
    read_damaged("m.stl", stl::text("part").as_bytes());
}

#[test]
fn a_ply_cut_anywhere_or_with_any_bit_flipped_is_read_or_refused() {
    for file in ply::rich() {
        read_damaged("m.ply", &file);
    }
}

#[test]
fn cityjson_cut_anywhere_or_with_any_bit_flipped_is_read_or_refused() {
    read_damaged("m.city.json", cityjson::house().to_string().as_bytes());
    read_damaged("m.city.jsonl", cityjson::sequence().as_bytes());
}

#[test]
fn json_with_wrong_values_anywhere_is_read_or_refused() {
    read_wrong_values(&rich_glb());
}

#[test]
fn json_of_poses_with_wrong_values_anywhere_is_read_or_refused() {
    read_wrong_values(&posed_glb());
}

#[cfg(feature = "meshopt")]
#[test]
fn json_of_compressed_views_with_wrong_values_anywhere_is_read_or_refused() {
    read_wrong_values(&Glb::from_bytes(crate::compressed::MESHOPT_KHR));
}

#[cfg(feature = "draco")]
#[test]
fn json_of_compressed_primitives_with_wrong_values_anywhere_is_read_or_refused() {
    read_wrong_values(&Glb::from_bytes(crate::compressed::EDGEBREAKER));
}

#[test]
fn cityjson_with_wrong_values_anywhere_is_read_or_refused() {
    let to_bytes = |json: &Value| json.to_string().into_bytes();
    read_with_wrong_values("m.city.json", &cityjson::rich(), to_bytes);
}

fn read_wrong_values(sound: &Glb) {
    read_with_wrong_values("m.glb", &sound.json, |json| {
        let bin = sound.bin.clone();
        let json = json.clone();
        Glb { json, bin }.bytes()
    });
}

/// Reads files that are sound but for up to four values. `VEDUTA_DAMAGE` asks for another number of
/// them.
fn read_with_wrong_values(name: &str, sound: &Value, bytes_of: impl Fn(&Value) -> Vec<u8>) {
    let folder = Folder::new();
    assert!(check(name, folder.read(name, bytes_of(sound)), "undamaged"));
    let values = [
        json!(0),
        json!(1),
        json!(-1),
        json!(2),
        json!(3),
        json!(0.5),
        json!(255),
        json!(65_536),
        json!(u32::MAX),
        json!(1u64 << 53),
        json!(u64::MAX),
        json!(1e308),
        json!(-1e308),
        json!(null),
        json!("x"),
        json!(""),
        json!([]),
        json!({}),
        json!(true),
        json!([0, 0, 0, 0]),
    ];
    let asked = std::env::var("VEDUTA_DAMAGE").ok();
    let cases = asked.map_or(6000, |asked| asked.parse().expect("a number of variants"));
    let mut read = 0;
    for seed in 0..cases {
        let mut random = Random(seed as u64);
        let mut json = sound.clone();
        for _ in 0..=random.below(3) {
            damage(&mut json, &values, &mut random);
        }
        let case = format!("seed {seed}: {json}");
        read += usize::from(check(name, folder.read(name, bytes_of(&json)), case));
    }
    assert!(
        read > 0 && read < cases,
        "{read} of {cases} damaged files were read"
    );
    let peak = MEMORY.peak_usage();
    assert!(peak < MOST_MEMORY, "{peak} bytes");
}

/// Changes, removes or doubles one value somewhere in the document.
pub fn damage(document: &mut Value, values: &[Value], random: &mut Random) {
    let mut place = document;
    loop {
        let count = match &*place {
            Value::Array(rows) => rows.len(),
            Value::Object(fields) => fields.len(),
            _ => 0,
        };
        // Down, or stay here one time in six.
        if count == 0 || random.below(6) == 0 {
            break;
        }
        let chosen = random.below(count);
        place = match place {
            Value::Array(rows) => &mut rows[chosen],
            Value::Object(fields) => fields.values_mut().nth(chosen).expect("is below the count"),
            _ => return,
        };
    }
    match (random.below(4), &mut *place) {
        (0, Value::Array(rows)) if !rows.is_empty() => {
            let row = rows[random.below(rows.len())].clone();
            rows.push(row);
        }
        (1, Value::Array(rows)) if !rows.is_empty() => {
            rows.remove(random.below(rows.len()));
        }
        (1, Value::Object(fields)) if !fields.is_empty() => {
            let name = fields.keys().nth(random.below(fields.len())).cloned();
            name.and_then(|name| fields.remove(&name));
        }
        _ => *place = values[random.below(values.len())].clone(),
    }
}

#[test]
fn obj_lines_of_random_words_are_read_or_refused() {
    let words = [
        "v", "vt", "vn", "f", "o", "g", "usemtl", "mtllib", "l", "s", "#", "\\", "\n", "\n", "\n",
        "1", "2", "3", "-1", "-2", "1/1", "1//1", "1/1/1", "0.5", "1e3", "nan", "/", "//", "x",
        "\u{e9}",
    ];
    let folder = Folder::new();
    let mut read = 0;
    const CASES: usize = 3000;
    for seed in 0..CASES {
        let mut random = Random(seed as u64);
        let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nvt 0 0\nvn 0 0 1\n");
        for _ in 0..random.below(40) {
            text.push_str(words[random.below(words.len())]);
            text.push(' ');
        }
        let loaded = folder.read("m.obj", &text);
        read += usize::from(check("m.obj", loaded, format!("seed {seed}: {text:?}")));
    }
    assert!(
        read > 0 && read < CASES,
        "{read} of {CASES} files were read"
    );
}
