use crate::support::{Folder, Glb, small_png};
use serde_json::json;
use veduta::map::Projection;
use veduta::scene::{AlphaMode, Wrap};
use veduta_geometry::{DVec3, Vec2, Vec3};
use veduta_io::ErrorKind;

/// Reads a GLB that must be sound; no warnings.
fn scene(glb: &Glb) -> veduta::scene::Scene {
    let loaded = Folder::new().read("m.glb", glb.bytes());
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

/// Reads a GLB that must be refused; the message without the file's name.
fn refusal(glb: &Glb) -> (ErrorKind, String) {
    let error = Folder::new()
        .read("m.glb", glb.bytes())
        .expect_err("a wrong file");
    let message = error.to_string();
    let (_, rest) = message.split_once("m.glb").expect("errors name the file");
    (error.kind(), rest.to_owned())
}

#[test]
fn nodes_place_their_meshes_and_name_them_by_their_path() {
    let mut glb = Glb::triangle();
    glb.json["nodes"] = json!([
        { "name": "car", "children": [1, 2, 3], "translation": [10, 0, 0] },
        { "name": "wheel", "mesh": 0, "rotation": [0, 0, 0.5, 0.5] },
        { "name": "wheel", "mesh": 0, "scale": [2, 2, 2] },
        { "mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 84900.123456789, 447700.987654321, 0, 1] },
    ]);
    let scene = scene(&glb);
    let names: Vec<_> = scene
        .objects
        .iter()
        .map(|object| object.name.as_str())
        .collect();
    assert_eq!(names, ["car/wheel", "car/wheel#2", "car/node3"]);
    assert_eq!(scene.meshes.len(), 1, "the mesh is shared");
    let at = |index: usize| {
        scene.objects[index]
            .world_from_object
            .transform_point3(DVec3::X)
    };
    assert!((at(0) - DVec3::new(10.0, 1.0, 0.0)).length() < 1e-15);
    assert_eq!(at(1), DVec3::new(12.0, 0.0, 0.0));
    // Not rounded to f32, which would be a centimetre.
    assert_eq!(
        at(2),
        DVec3::new(84_911.123_456_789, 447_700.987_654_321, 0.0)
    );
}

#[test]
fn integer_attributes_are_scaled_and_sparse_ones_replaced() {
    let mut glb = Glb::new();
    glb.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    // Normalised i16 positions, in a view with stride 8.
    let position: Vec<u8> = [[0i16, 0, 0, 9], [32_767, 0, 0, 9], [0, -32_768, 0, 9]]
        .iter()
        .flatten()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let position = glb.accessor(&position, 5122, "VEC3", 3);
    glb.json["bufferViews"][0]["byteStride"] = json!(8);
    glb.json["accessors"][position]["normalized"] = json!(true);
    let normal = glb.accessor(&[0, 0, 127, 0, 0, 127, 0, 0, 127], 5120, "VEC3", 3);
    glb.json["accessors"][normal]["normalized"] = json!(true);
    let texcoord = glb.accessor(&[0, 0, 255, 0, 0, 255], 5121, "VEC2", 3);
    glb.json["accessors"][texcoord]["normalized"] = json!(true);
    // Colours: all zero but for the vertex that is given.
    let indices = glb.view(&[1]);
    let values = glb.view(
        &[65_535u16, 0, 32_768, 65_535]
            .map(u16::to_le_bytes)
            .concat(),
    );
    let color = glb.add(
        "accessors",
        json!({
            "componentType": 5123, "type": "VEC4", "count": 3, "normalized": true,
            "sparse": {
                "count": 1,
                "indices": { "bufferView": indices, "componentType": 5121 },
                "values": { "bufferView": values },
            },
        }),
    );
    glb.add(
        "meshes",
        json!({ "primitives": [{ "attributes": {
        "POSITION": position, "NORMAL": normal, "TEXCOORD_0": texcoord, "COLOR_0": color
    } }] }),
    );
    let scene = scene(&glb);
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, -DVec3::Y]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!(mesh.texcoords, [Vec2::ZERO, Vec2::X, Vec2::Y]);
    assert_eq!(
        mesh.colors,
        [[0.0; 3], [1.0, 0.0, 32_768.0 / 65_535.0], [0.0; 3]]
    );
}

#[test]
fn sparse_values_find_their_vertices_among_those_in_use() {
    let mut glb = Glb::new();
    let position = glb.f32s("VEC3", &[7.0; 3 * 100]);
    let indices = glb.view(&[3, 50, 99]);
    let values: Vec<u8> = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let values = glb.view(&values);
    glb.json["accessors"][position]["sparse"] = json!({
        "count": 3,
        "indices": { "bufferView": indices, "componentType": 5121 },
        "values": { "bufferView": values },
    });
    let corners = glb.accessor(&[99, 50, 4], 5121, "SCALAR", 3);
    glb.add(
        "meshes",
        json!({ "primitives": [
        { "attributes": { "POSITION": position }, "indices": corners }
    ] }),
    );
    let mesh = &scene(&glb).meshes[0];
    assert_eq!(mesh.positions, [DVec3::splat(7.0), DVec3::X, DVec3::Y]);
    assert_eq!(mesh.triangles, [[2, 1, 0]]);
}

#[test]
fn materials_bring_colour_texture_opacity_and_emission() {
    let mut glb = Glb::triangle();
    let view = glb.view(&small_png());
    glb.add(
        "images",
        json!({ "name": "two", "bufferView": view, "mimeType": "image/png" }),
    );
    glb.add("samplers", json!({ "wrapS": 33071, "wrapT": 33648 }));
    glb.add("textures", json!({ "source": 0, "sampler": 0 }));
    glb.json["extensionsUsed"] = json!([
        "KHR_texture_transform",
        "KHR_materials_unlit",
        "KHR_materials_emissive_strength"
    ]);
    glb.add(
        "materials",
        json!({
            "name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
            "emissiveFactor": [0.5, 0, 0],
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.1, 0.2, 0.3, 0.4],
                "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": {
                    "offset": [0.5, 0.25], "rotation": 1.5, "scale": [2, 3]
                } } },
            },
            "extensions": {
                "KHR_materials_unlit": {},
                "KHR_materials_emissive_strength": { "emissiveStrength": 4 },
            },
        }),
    );
    let texcoord = glb.f32s("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    glb.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(texcoord);
    let scene = scene(&glb);
    let material = &scene.materials[0];
    assert_eq!(material.base_color, [0.1, 0.2, 0.3, 0.4]);
    assert_eq!(material.alpha_mode, AlphaMode::Mask(0.25));
    assert_eq!(material.emissive, [2.0, 0.0, 0.0]);
    assert!(material.double_sided && material.unlit);
    let texture = material.base_color_texture.expect("a texture");
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(texture.offset, Vec2::new(0.5, 0.25));
    assert_eq!(
        (texture.rotation, texture.scale),
        (1.5, Vec2::new(2.0, 3.0))
    );
    let image = &scene.images[texture.image.0 as usize];
    assert_eq!(
        (image.name.as_str(), image.width, image.height),
        ("two", 2, 1)
    );
    assert_eq!(image.pixels, [[255, 0, 0, 255], [0, 0, 255, 128]]);
}

#[test]
fn older_materials_and_second_texture_coordinates_are_understood() {
    let mut glb = Glb::triangle();
    let view = glb.view(&small_png());
    glb.add("images", json!({ "bufferView": view }));
    glb.add("textures", json!({ "source": 0 }));
    glb.json["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
    glb.add(
        "materials",
        json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": {
            "diffuseFactor": [1, 0.5, 0, 1], "diffuseTexture": { "index": 0, "texCoord": 1 },
        } } }),
    );
    let first = glb.f32s("VEC2", &[0.0; 6]);
    let second = glb.f32s("VEC2", &[0.25; 6]);
    let primitive = &mut glb.json["meshes"][0]["primitives"][0];
    primitive["material"] = json!(0);
    primitive["attributes"]["TEXCOORD_0"] = json!(first);
    primitive["attributes"]["TEXCOORD_1"] = json!(second);
    let scene = scene(&glb);
    assert_eq!(scene.materials[0].base_color, [1.0, 0.5, 0.0, 1.0]);
    assert!(scene.materials[0].base_color_texture.is_some());
    assert_eq!(scene.meshes[0].texcoords, [Vec2::splat(0.25); 3]);
}

#[test]
fn a_primitive_without_material_is_white_and_seen_from_its_front() {
    let scene = scene(&Glb::triangle());
    let material = &scene.materials[scene.meshes[0].material_of(0).index()];
    assert_eq!(material.base_color, [1.0; 4]);
    assert!(!material.double_sided);
}

#[test]
fn cameras_come_along_and_broken_ones_stay_behind() {
    let mut glb = Glb::triangle();
    glb.json["cameras"] = json!([
        { "type": "perspective", "name": "front", "perspective": { "yfov": 0.5, "znear": 0.1, "aspectRatio": 2 } },
        { "type": "orthographic", "orthographic": { "xmag": 3, "ymag": 2, "znear": 0, "zfar": 9 } },
        { "type": "perspective", "perspective": { "yfov": -1, "znear": 0.1 } },
    ]);
    glb.json["nodes"] = json!([
        { "mesh": 0, "children": [1, 2, 3] },
        { "camera": 0, "translation": [0, 0, 5] }, { "camera": 1, "name": "plan" }, { "camera": 2 },
    ]);
    let loaded = Folder::new()
        .read("m.glb", glb.bytes())
        .expect("a sound file");
    let cameras = &loaded.scene.cameras;
    assert_eq!(
        (cameras[0].0.as_str(), cameras[1].0.as_str()),
        ("front", "plan")
    );
    let eye = cameras[0]
        .1
        .eye_from_world
        .transform_point3(DVec3::new(0.0, 1.0, 0.0));
    assert!((eye - DVec3::new(0.0, -1.0, 5.0)).length() < 1e-12, "{eye}");
    let parallel = Projection::Parallel {
        height: 4.0,
        aspect: 1.5,
    };
    assert_eq!(cameras[1].1.projection, parallel);
    assert_eq!(cameras.len(), 2);
    assert!(
        loaded.warnings[0]
            .to_string()
            .contains("cameras[2]: yfov is -1")
    );
}

#[test]
fn buffers_may_lie_in_data_uris_and_in_files_beside() {
    let glb = Glb::triangle();
    let mut json = glb.json.clone();
    let folder = Folder::new();
    folder.write("my buffer.bin", &glb.bin);
    for uri in ["my%20buffer.bin", &data_uri(&glb.bin)] {
        json["buffers"] = json!([{ "byteLength": glb.bin.len(), "uri": uri }]);
        let loaded = folder.read("m.gltf", json.to_string()).expect(uri);
        assert_eq!(loaded.scene.face_count(), 1);
    }
    json["buffers"][0]["uri"] = json!("not there.bin");
    let error = folder
        .read("m.gltf", json.to_string())
        .expect_err("no buffer");
    assert_eq!(error.kind(), ErrorKind::Missing);
    assert!(
        error.to_string().contains("buffers[0].uri: names"),
        "{error}"
    );
    json["buffers"][0]["uri"] = json!("https://example.org/a.bin");
    let error = folder
        .read("m.gltf", json.to_string())
        .expect_err("no buffer");
    assert_eq!(error.kind(), ErrorKind::Unsupported);
}

/// Base64 by hand: the tests need no crate for three lines.
fn data_uri(bytes: &[u8]) -> String {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::from("data:application/octet-stream;base64,");
    for chunk in bytes.chunks(3) {
        let bits = chunk
            .iter()
            .fold(0u32, |bits, &byte| bits << 8 | u32::from(byte));
        let bits = bits << (8 * (3 - chunk.len()));
        for digit in 0..=chunk.len() {
            text.push(DIGITS[(bits >> (18 - 6 * digit)) as usize & 63] as char);
        }
    }
    text
}

#[test]
fn textures_that_cannot_be_had_are_warned_of() {
    let mut glb = Glb::triangle();
    let broken = glb.view(b"\x89PNG\r\n\x1a\nand then nothing");
    glb.json["images"] = json!([{ "bufferView": broken }, { "uri": "gone.png" }]);
    glb.json["textures"] = json!([{ "source": 0 }, { "source": 1 }, {}]);
    let texcoord = glb.f32s("VEC2", &[0.0; 6]);
    let mut primitive = glb.json["meshes"][0]["primitives"][0].clone();
    primitive["attributes"]["TEXCOORD_0"] = json!(texcoord);
    let mut primitives = Vec::new();
    for texture in 0..3 {
        glb.add(
            "materials",
            json!({
                "pbrMetallicRoughness": { "baseColorTexture": { "index": texture } }
            }),
        );
        primitive["material"] = json!(texture);
        primitives.push(primitive.clone());
    }
    glb.json["meshes"][0]["primitives"] = json!(primitives);
    let loaded = Folder::new()
        .read("m.glb", glb.bytes())
        .expect("textures may fail");
    let texts: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(texts.len(), 3, "{texts:?}");
    for (text, place) in texts.iter().zip(["images[0]", "images[1]", "textures[2]"]) {
        assert!(text.contains(place) && text.ends_with("left out"), "{text}");
    }
    let textures = loaded
        .scene
        .materials
        .iter()
        .filter(|m| m.base_color_texture.is_some());
    assert_eq!(textures.count(), 0);
}

#[test]
fn wrong_files_are_refused_with_place_and_reason() {
    type Edit = fn(&mut Glb);
    let cases: &[(Edit, ErrorKind, &str)] = &[
        (
            |glb| glb.json["asset"]["version"] = json!("1.0"),
            ErrorKind::Unsupported,
            ": asset.version: is glTF 1.0, expected glTF 2.0",
        ),
        (
            |glb| glb.json["extensionsRequired"] = json!(["KHR_lights_punctual", "EXT_other"]),
            ErrorKind::Unsupported,
            ": extensionsRequired[1]: the extension EXT_other is required but not supported; \
             export the model without it",
        ),
        (
            |glb| glb.json["extensionsRequired"] = json!(["KHR_texture_basisu"]),
            ErrorKind::Unsupported,
            ": extensionsRequired[0]: the extension KHR_texture_basisu is required but not \
             supported; export the model with textures in PNG, JPEG or WebP",
        ),
        (
            |glb| glb.json["accessors"][0]["count"] = json!("three"),
            ErrorKind::BadInput,
            ": accessors[0].count: is not valid glTF: invalid type: string \"three\"",
        ),
        (
            |glb| glb.json["accessors"][0]["count"] = json!(4),
            ErrorKind::BadInput,
            ": accessors[0]: the accessor, with its offset, needs 48 bytes, but 36 are there",
        ),
        (
            |glb| glb.json["accessors"][0]["count"] = json!(u64::MAX),
            ErrorKind::BadInput,
            ": accessors[0]: the accessor, with its offset, needs",
        ),
        (
            |glb| glb.json["accessors"][0]["bufferView"] = json!(9),
            ErrorKind::BadInput,
            ": accessors[0]: refers to bufferView 9, counted from 0, but the file has 2",
        ),
        (
            |glb| glb.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX),
            ErrorKind::BadInput,
            ": bufferViews[0]: the view, with its offset, needs",
        ),
        (
            |glb| glb.json["bufferViews"][0]["byteStride"] = json!(4),
            ErrorKind::BadInput,
            ": bufferViews[0].byteStride: is 4, for elements of 12 bytes",
        ),
        (
            |glb| glb.json["buffers"] = json!([{ "byteLength": 1_000_000 }]),
            ErrorKind::BadInput,
            ": buffers[0].byteLength: the buffer needs 1000000 bytes, but 40 are there",
        ),
        (
            |glb| glb.bin[37] = 77,
            ErrorKind::BadInput,
            ": meshes[0].primitives[0].indices: index 1 is 77, but the number of vertices is 3",
        ),
        (
            |glb| glb.bin[12..16].copy_from_slice(&f32::NAN.to_le_bytes()),
            ErrorKind::BadInput,
            ": meshes[0].primitives[0].attributes.POSITION: is [NaN, 0.0, 0.0] at vertex 1",
        ),
        (
            |glb| glb.bin[4..8].copy_from_slice(&f32::INFINITY.to_le_bytes()),
            ErrorKind::BadInput,
            ": meshes[0].primitives[0].attributes.POSITION: is [0.0, inf, 0.0] at vertex 0",
        ),
        (
            |glb| glb.json["meshes"][0]["primitives"][0]["attributes"] = json!({}),
            ErrorKind::BadInput,
            ": meshes[0].primitives[0].attributes: has no POSITION",
        ),
        (
            |glb| glb.json["meshes"][0]["primitives"][0]["mode"] = json!(7),
            ErrorKind::BadInput,
            ": meshes[0].primitives[0].mode: is 7, expected 0 to 6",
        ),
        (
            |glb| glb.json["nodes"][0]["mesh"] = json!(1),
            ErrorKind::BadInput,
            ": nodes[0]: refers to mesh 1, counted from 0, but the file has 1",
        ),
        (
            |glb| glb.json["nodes"] = json!([{ "children": [1] }, { "children": [0] }]),
            ErrorKind::BadInput,
            ": nodes[0]: is its own descendant; nodes must form a tree",
        ),
        (
            |glb| glb.json["nodes"] = json!([{ "children": [0] }]),
            ErrorKind::BadInput,
            ": nodes[0]: is its own descendant",
        ),
        (
            |glb| glb.json["nodes"] = json!([{ "children": [1, 2] }, { "children": [2] }, {}]),
            ErrorKind::BadInput,
            ": nodes[1].children[0]: node 2 has a parent already, nodes[0]",
        ),
        (
            |glb| {
                glb.json["nodes"][0]["matrix"] =
                    json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
            },
            ErrorKind::BadInput,
            ": nodes[0].matrix: is a matrix whose last row is",
        ),
        (
            |glb| glb.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]),
            ErrorKind::BadInput,
            ": nodes[0].rotation: is [0.0, 0.0, 0.0, 0.0], expected a quaternion of length 1",
        ),
        (
            |glb| glb.json["nodes"][0]["scale"] = json!([1e300, 1, 1]),
            ErrorKind::BadInput,
            ": object \"root\" reaches 1e300 m from the origin",
        ),
    ];
    for (edit, kind, expected) in cases {
        let mut glb = Glb::triangle();
        edit(&mut glb);
        let (found_kind, message) = refusal(&glb);
        assert!(
            message.starts_with(expected),
            "{message:?} does not start with {expected:?}"
        );
        assert_eq!(found_kind, *kind, "{message}");
    }
}

#[test]
fn damaged_containers_are_refused_with_the_byte() {
    let sound = Glb::triangle().bytes();
    let folder = Folder::new();
    let refusal = |bytes: &[u8]| {
        let error = folder.read("m.glb", bytes).expect_err("a damaged file");
        error
            .to_string()
            .split_once("m.glb")
            .expect("errors name the file")
            .1
            .to_owned()
    };
    assert!(refusal(b"PK\x03\x04").starts_with(": starts with [50, 4b, 03, 04], which is no GLB"));
    assert!(refusal(&sound[..7]).starts_with(": byte 0: the GLB header needs 12 bytes"));
    assert!(refusal(&sound[..200]).starts_with(": byte 8: the GLB needs"));
    let mut version = sound.clone();
    version[4] = 1;
    assert!(refusal(&version).starts_with(": byte 4: is GLB version 1, expected version 2"));
    let mut chunk = sound.clone();
    chunk[14] = 0xff;
    assert!(
        refusal(&chunk).starts_with(": byte 12: the chunk needs"),
        "{}",
        refusal(&chunk)
    );
}

#[test]
fn few_bytes_cannot_ask_for_much_memory() {
    // An accessor without bytes, and one triangle shared by a hundred thousand primitives' worth
    // of indices.
    let mut glb = Glb::triangle();
    let zeros = glb.add(
        "accessors",
        json!({
            "componentType": 5126, "type": "VEC3", "count": 4_000_000_000u32
        }),
    );
    glb.json["meshes"][0]["primitives"] = json!([{ "attributes": { "POSITION": zeros } }]);
    let (kind, message) = refusal(&glb);
    assert_eq!(kind, ErrorKind::BadInput);
    assert!(
        message.contains("POSITION: asks for 16000000000 bytes more of memory"),
        "{message}"
    );

    let mut glb = Glb::triangle();
    let corners = glb.accessor(&[0; 30_000], 5121, "SCALAR", 30_000);
    let primitive = json!({ "attributes": { "POSITION": 0 }, "indices": corners });
    glb.json["meshes"][0]["primitives"] = json!(vec![primitive; 20_000]);
    let (_, message) = refusal(&glb);
    assert!(message.contains("bytes more of memory"), "{message}");
}

#[test]
fn a_tree_of_a_hundred_thousand_nodes_in_a_row_is_climbed() {
    let mut glb = Glb::triangle();
    let count = 100_000;
    let mut nodes: Vec<_> = (1..count)
        .map(|child| json!({ "children": [child] }))
        .collect();
    nodes.push(json!({ "mesh": 0, "translation": [1, 0, 0] }));
    glb.json["nodes"] = json!(nodes);
    let scene = scene(&glb);
    assert_eq!(scene.objects[0].name.split('/').count(), count);
}

#[test]
fn points_lines_and_empty_meshes_leave_no_object() {
    let mut glb = Glb::triangle();
    glb.json["meshes"][0]["primitives"][0]["mode"] = json!(1);
    let loaded = Folder::new()
        .read("m.glb", glb.bytes())
        .expect("lines are legal");
    assert!(loaded.scene.objects.is_empty() && loaded.scene.meshes.is_empty());
    assert!(
        loaded.warnings[0]
            .to_string()
            .contains("points and lines have no faces")
    );
}
