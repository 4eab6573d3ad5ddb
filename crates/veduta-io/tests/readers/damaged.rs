//! Files with damage of every small kind: each is read or refused, in bounded memory, without panic.

use crate::support::{Folder, Glb, small_png};
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
    for texture in scene.materials.iter().filter_map(|m| m.base_color_texture) {
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
fn an_obj_cut_anywhere_or_with_any_bit_flipped_is_read_or_refused() {
    read_damaged("m.obj", RICH_OBJ.as_bytes());
}

#[test]
fn json_with_wrong_values_anywhere_is_read_or_refused() {
    let sound = rich_glb();
    let folder = Folder::new();
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
    let mut read = 0;
    const CASES: usize = 6000;
    for seed in 0..CASES {
        let mut random = Random(seed as u64);
        let mut glb = sound.clone();
        for _ in 0..=random.below(3) {
            damage(&mut glb.json, &values, &mut random);
        }
        let json = &glb.json;
        let case = format!("seed {seed}: {json}");
        read += usize::from(check("m.glb", folder.read("m.glb", glb.bytes()), case));
    }
    assert!(
        read > 0 && read < CASES,
        "{read} of {CASES} damaged files were read"
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
