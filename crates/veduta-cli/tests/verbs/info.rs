use crate::{FACING, Folder};
use serde_json::{Value, json};

#[test]
fn a_pick_tells_object_face_material_and_place() {
    let folder = Folder::new();
    let pick = |at: &str| folder.json(&format!("info town.obj {FACING} --pick {at}"));
    // The blue box covers [-1, 0] x [-1, 0] of the picture's plane, one metre before the wall.
    let found = pick("3,5");
    let seen = &found["seen"];
    assert_eq!(seen["material"], "blue");
    assert!(
        seen["object"].as_str().expect("a name").ends_with("box"),
        "{found}"
    );
    assert_eq!(seen["face"], 0);
    assert_eq!(seen["position"], json!([-0.25, -1.0, -0.75]));
    assert_eq!(seen["normal"], json!([0.0, -1.0, 0.0]));
    assert_eq!(seen["depth"], 4.0);
    assert_eq!(found["pixel"], json!([3, 5]));
    assert_eq!(found["background"], 0.0);

    // A point rather than a pixel.
    let found = pick("4.25,2.75");
    assert_eq!(found["seen"]["material"], "red");
    assert_eq!(found["seen"]["position"], json!([0.125, 0.0, 0.625]));
    assert_eq!(found["pixel"], json!([4, 2]));

    let found = pick("0,0");
    assert_eq!(found["seen"], json!(null));
    assert_eq!(found["background"], 1.0);
    assert_eq!(found["light"], json!([0.0, 0.0, 0.0, 0.0]));
}

#[test]
fn a_pick_tells_what_is_looked_through_nearest_first() {
    let folder = Folder::new();
    let materials =
        "newmtl red\nKd 1 0 0\nnewmtl smoke\nKd 0 0 0\nd 0.5\nnewmtl glass\nKd 1 1 1\nd 0.25\n";
    folder.write("panes.mtl", materials);
    let square = |material: &str, z: u32, first: u32| {
        let corners: Vec<u32> = (first..first + 4).collect();
        format!(
            "o {material}\nusemtl {material}\nv -1 -1 {z}\nv 1 -1 {z}\nv 1 1 {z}\nv -1 1 {z}\nf {} {} {} {}\n",
            corners[0], corners[1], corners[2], corners[3]
        )
    };
    let model = [("red", 0), ("smoke", 1), ("glass", 2)];
    let model = (0..)
        .zip(model)
        .map(|(k, (name, z))| square(name, z, 4 * k + 1));
    let model = format!("mtllib panes.mtl\n{}", model.collect::<String>());
    folder.write("panes.obj", model);
    let found = folder.json(&format!("info panes.obj {FACING} --pick 3,3"));
    assert_eq!(found["seen"]["material"], "red");
    let through = found["through"].as_array().expect("a list");
    let told: Vec<_> = through
        .iter()
        .map(|veil| (veil["material"].as_str(), veil["depth"].as_f64()))
        .collect();
    assert_eq!(
        told,
        [(Some("glass"), Some(3.0)), (Some("smoke"), Some(4.0))]
    );
    // Half of what a quarter leaves of the wall.
    let light = &found["light"];
    assert!(
        (light[3].as_f64().expect("opacity") - 1.0).abs() < 1e-6,
        "{light}"
    );
    let text = folder.told(&format!("info panes.obj {FACING} --pick 3,3"));
    let place = |name: &str| text.find(&format!("through   {name}")).expect(name);
    assert!(place("glass") < place("smoke"), "{text}");

    let found = folder.json(&format!("info panes.obj {FACING} --pick 0,0"));
    assert_eq!(found["through"], json!([]));
}

#[test]
fn a_pick_tells_the_exact_shares_of_a_pixel() {
    let folder = Folder::new();
    // Pixels of 0.8 m: the middle one of 5 x 5 shows a quarter of the box, the rest of the wall; the
    // one to the left of it has the wall's edge in it.
    let pick = |at: &str| {
        let view = "--eye 0,-5,0 --look-at 0,0,0 --parallel 4 --size 5x5";
        folder.json(&format!("info town.obj {view} --pick {at}"))
    };
    let shares = |found: &serde_json::Value| -> Vec<f64> {
        let rows = found["faces"].as_array().expect("rows");
        rows.iter()
            .map(|row| row["area"].as_f64().expect("an area"))
            .collect()
    };
    let found = pick("2,2");
    // The wall may be two triangles; what is of one object adds up.
    let wall: f64 = found["faces"]
        .as_array()
        .expect("rows")
        .iter()
        .filter(|row| !row["object"].as_str().expect("a name").ends_with("box"))
        .map(|row| row["area"].as_f64().expect("an area"))
        .sum();
    assert!((wall - 0.75).abs() < 1e-12, "{found}");
    assert!((shares(&found).iter().sum::<f64>() - 1.0).abs() < 1e-12);
    let found = pick("1,1");
    let background = found["background"].as_f64().expect("an area");
    // Of [-1.2, -0.4] the wall covers [-1, -0.4], each way.
    assert!((background - (1.0 - 0.5625)).abs() < 1e-12, "{found}");
}

#[test]
fn text_tells_the_tree_and_what_is_picked() {
    let folder = Folder::new();
    let told = folder.told("info town.obj");
    for expected in [
        "size      2.000000 x 1.000000 x 2.000000 m",
        "objects   2",
        "wall",
        "box",
        "materials 2",
    ] {
        assert!(told.contains(expected), "{expected}: {told}");
    }
    let told = folder.told(&format!("info town.obj {FACING} --pick 3,5"));
    for expected in [
        "material  blue",
        "position  -0.250000, -1.000000, -0.750000 m",
        "1.000000",
    ] {
        assert!(told.contains(expected), "{expected}: {told}");
    }
}

#[test]
fn picks_that_make_no_sense_are_refused() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o a.png"));
    for (arguments, message) in [
        (
            "info town.obj --size 8x8 --pick 8,0",
            "lies outside the picture of 8 x 8 pixels",
        ),
        ("info town.obj --pick -1,0", "--pick"),
        (
            "info town.obj --eye 0,-5,0",
            "options of the view are for --pick",
        ),
        (
            "info a.png --pick 1,1",
            "a picture does not know what it shows",
        ),
    ] {
        let refused = folder.veduta(arguments).assert().code(2);
        let stderr = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(stderr.contains(message), "{arguments}: {stderr}");
    }
}

#[test]
fn of_pictures_their_size_and_light_is_told() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} --unlit -o a.npy"));
    let found = folder.json("info a.npy");
    assert_eq!(found["size"], json!([8, 8]));
    assert_eq!(found["stored"], "linear");
    // A quarter is covered, a quarter of that blue.
    assert_eq!(found["mean"], json!([0.1875, 0.0, 0.0625, 0.25]));
    assert!(folder.told("info a.npy").contains("8 x 8 pixels"));
}

/// A triangle that glows, and a light of each kind: a sun that shines downwards, a bulb, and a spot
/// with cones of 20 and 45 degrees.
const LIGHTS: &str = r#"{
    "asset": { "version": "2.0" },
    "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"],
    "extensions": { "KHR_lights_punctual": { "lights": [
        { "name": "sun", "type": "directional", "intensity": 80000 },
        { "name": "bulb", "type": "point", "intensity": 120, "color": [1, 0.5, 0.25], "range": 9 },
        { "name": "lamp", "type": "spot", "intensity": 900, "spot": {
            "innerConeAngle": 0.3490658503988659, "outerConeAngle": 0.7853981633974483 } }
    ] } },
    "scenes": [{ "nodes": [0, 1, 2, 3] }],
    "nodes": [
        { "mesh": 0 },
        { "rotation": [-0.7071067811865476, 0, 0, 0.7071067811865476],
            "extensions": { "KHR_lights_punctual": { "light": 0 } } },
        { "translation": [1, 2, 3], "extensions": { "KHR_lights_punctual": { "light": 1 } } },
        { "translation": [0, 2.5, 0], "extensions": { "KHR_lights_punctual": { "light": 2 } } }
    ],
    "materials": [{ "name": "neon", "emissiveFactor": [1, 0.5, 0], "emissiveTexture": { "index": 0 },
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 4 } } }],
    "textures": [{ "source": 0 }],
    "images": [{ "name": "tube", "uri": "tube.png" }],
    "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "material": 0 }] }],
    "accessors": [
        { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0, 0, 0], "max": [1, 1, 0] },
        { "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2" }
    ],
    "bufferViews": [{ "buffer": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": 24 }],
    "buffers": [{ "uri": "lights.bin", "byteLength": 60 }]
}"#;

fn folder_with_lights() -> Folder {
    let folder = Folder::new();
    folder.write("lights.gltf", LIGHTS);
    let positions = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let texcoords = [0.0f32, 0.0, 1.0, 0.0, 0.0, 1.0];
    let numbers = positions.into_iter().chain(texcoords);
    folder.write(
        "lights.bin",
        numbers.flat_map(f32::to_le_bytes).collect::<Vec<u8>>(),
    );
    folder.told("render town.obj --size 4x2 -o tube.png");
    folder
}

#[test]
fn lights_are_told_with_place_strength_and_cones() {
    let folder = folder_with_lights();
    let told = folder.json("info lights.gltf");
    let lights = told["lights"].as_array().expect("a list");
    // Y up becomes Z up, and what shone along -Z of the file shines along +Y.
    let expected = [
        json!({ "name": "sun", "kind": "directional", "illuminance": 80000.0,
            "color": [1.0, 1.0, 1.0], "direction": [0.0, 0.0, -1.0] }),
        json!({ "name": "bulb", "kind": "point", "intensity": 120.0, "color": [1.0, 0.5, 0.25],
            "range": 9.0, "position": [1.0, -3.0, 2.0] }),
        json!({ "name": "lamp", "kind": "spot", "intensity": 900.0, "color": [1.0, 1.0, 1.0],
            "range": null, "position": [0.0, 0.0, 2.5], "direction": [0.0, 1.0, 0.0],
            "innerAngle": 20.0, "outerAngle": 45.0 }),
    ];
    assert_eq!(lights.len(), expected.len());
    for (found, expected) in lights.iter().zip(&expected) {
        let keys = |value: &Value| -> Vec<String> {
            value
                .as_object()
                .expect("an object")
                .keys()
                .cloned()
                .collect()
        };
        assert_eq!(keys(found), keys(expected));
        for key in keys(expected) {
            assert!(about_equal(&found[&key], &expected[&key]), "{key}: {found}");
        }
    }
    let text = folder.told("info lights.gltf");
    for line in [
        "lights    3",
        "sun  directional, 80000 lx, colour 1.000 1.000 1.000, shines along 0, 0, -1\n",
        "bulb  point, 120 cd, colour 1.000 0.500 0.250, at 1, -3, 2 m, reaches 9 m\n",
        "lamp  spot, 900 cd, colour 1.000 1.000 1.000, at 0, 0, 2.5 m, shines along 0, 1, 0, \
            full to 20.0deg from its axis, none from 45.0deg\n",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
}

/// Whether two values are the same but for the last bits of single precision.
fn about_equal(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| about_equal(a, b))
        }
        (Value::Number(a), Value::Number(b)) => {
            let [a, b] = [a, b].map(|number| number.as_f64().expect("a number"));
            (a - b).abs() <= 1e-5
        }
        _ => a == b,
    }
}

#[test]
fn what_materials_emit_is_told() {
    let folder = folder_with_lights();
    let told = folder.json("info lights.gltf");
    let neon = &told["materials"][0];
    assert_eq!(neon["emissive"], json!([4.0, 2.0, 0.0]));
    assert_eq!(neon["emissiveTexture"], "tube");
    assert_eq!(neon["texture"], json!(null));
    let text = folder.told("info lights.gltf");
    let expected = "neon  colour 1.000 1.000 1.000 1.000, opaque; emits 4.000 2.000 0.000, \
        texture tube (4 x 2)\n";
    assert!(text.contains(expected), "{text}");
    // Of what does not glow nothing is said.
    assert!(!folder.told("info town.obj").contains("emits"));
}
