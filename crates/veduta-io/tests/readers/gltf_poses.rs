//! What stands otherwise than its own table of vertices says: morph targets, skins, instances; and
//! what shines.

use crate::support::{Folder, Glb, small_png};
use serde_json::{Value, json};
use veduta::scene::{LightKind, Mesh, Scene, TexcoordSet};
use veduta_geometry::{DQuat, DVec3, Vec2, Vec3};
use veduta_io::{ErrorKind, Loaded};

fn load(glb: &Glb) -> Loaded {
    let loaded = Folder::new().read("m.glb", glb.bytes());
    loaded.unwrap_or_else(|error| panic!("{error}"))
}

/// Reads a GLB that must be sound; no warnings.
fn scene(glb: &Glb) -> Scene {
    let loaded = load(glb);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

/// Reads a GLB that must be refused as damaged; the message without the file's name.
fn refusal(glb: &Glb) -> String {
    let error = Folder::new()
        .read("m.glb", glb.bytes())
        .expect_err("a wrong file");
    assert_eq!(error.kind(), ErrorKind::BadInput, "{error}");
    let message = error.to_string();
    let (_, rest) = message.split_once("m.glb").expect("errors name the file");
    rest.to_owned()
}

/// The first primitive of the first mesh.
fn primitive(glb: &mut Glb) -> &mut Value {
    &mut glb.json["meshes"][0]["primitives"][0]
}

/// The mesh that the object of a row shows.
fn mesh_of(scene: &Scene, object: usize) -> &Mesh {
    &scene.meshes[scene.objects[object].mesh.0 as usize]
}

/// The triangle, with two targets: the first lifts its last corner and turns its normals, the second
/// moves all by 10 along x and dims its colour.
fn morphing() -> Glb {
    let mut glb = Glb::triangle();
    let normal = glb.f32s("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    let color = glb.f32s("VEC4", &[1.0, 0.5, 0.25, 1.0].repeat(3));
    let uv = glb.f32s("VEC2", &[0.0; 6]);
    let lift = glb.f32s("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0]);
    let tilt = glb.f32s("VEC3", &[1.0, 0.0, -1.0].repeat(3));
    let shift = glb.f32s("VEC3", &[10.0, 0.0, 0.0].repeat(3));
    let dim = glb.f32s("VEC4", &[-0.5, -0.5, -0.5, -0.5].repeat(3));
    let slide = glb.f32s("VEC2", &[0.25; 6]);
    let primitive = primitive(&mut glb);
    primitive["attributes"]["NORMAL"] = json!(normal);
    primitive["attributes"]["COLOR_0"] = json!(color);
    primitive["attributes"]["TEXCOORD_0"] = json!(uv);
    primitive["targets"] = json!([
        { "POSITION": lift, "NORMAL": tilt },
        { "POSITION": shift, "COLOR_0": dim, "TEXCOORD_0": slide },
    ]);
    glb
}

#[test]
fn morph_targets_have_the_shares_of_their_node_or_else_of_their_mesh() {
    let mut glb = morphing();
    glb.json["meshes"][0]["weights"] = json!([0.5, 0]);
    glb.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    glb.json["nodes"] = json!([
        { "mesh": 0 },
        { "mesh": 0, "weights": [0, 1] },
        { "mesh": 0 },
        { "mesh": 0, "weights": [1, 2] },
    ]);
    let scene = scene(&glb);
    assert_eq!(scene.meshes.len(), 3, "one for each pose");
    assert_eq!(scene.objects[0].mesh, scene.objects[2].mesh);
    let half = mesh_of(&scene, 0);
    assert_eq!(half.positions[2], DVec3::new(0.0, 1.0, 1.0));
    let tilted = Vec3::new(1.0, 0.0, 1.0).normalize();
    assert!((half.normals[0] - tilted).length() < 1e-6);
    assert_eq!(half.colors[0], [1.0, 0.5, 0.25]);
    assert!(half.opacities.is_empty(), "all are 1");

    let shifted = mesh_of(&scene, 1);
    assert_eq!(shifted.positions[2], DVec3::new(10.0, 1.0, 0.0));
    assert_eq!(shifted.normals, [Vec3::Z; 3]);
    assert_eq!(shifted.colors[0], [0.5, 0.0, 0.0], "no colour is negative");
    assert_eq!(shifted.texcoords, [Vec2::splat(0.25); 3]);
    let both = mesh_of(&scene, 3);
    assert_eq!(both.positions[2], DVec3::new(20.0, 1.0, 2.0));
}

#[test]
fn a_model_without_shares_has_none_of_its_targets() {
    let scene = scene(&morphing());
    assert_eq!(scene.meshes[0].positions[2], DVec3::Y);
}

#[test]
fn morph_targets_may_be_sparse_and_without_a_view() {
    let mut glb = Glb::triangle();
    let at = glb.view(&[2]);
    let value = glb.view(&[0.0f32, 0.0, 8.0].map(f32::to_le_bytes).concat());
    let target = glb.add(
        "accessors",
        json!({
            "componentType": 5126, "type": "VEC3", "count": 3,
            "sparse": {
                "count": 1,
                "indices": { "bufferView": at, "componentType": 5121 },
                "values": { "bufferView": value },
            },
        }),
    );
    primitive(&mut glb)["targets"] = json!([{ "POSITION": target }]);
    glb.json["meshes"][0]["weights"] = json!([0.25]);
    let expected = [DVec3::ZERO, DVec3::X, DVec3::new(0.0, 1.0, 2.0)];
    assert_eq!(scene(&glb).meshes[0].positions, expected);
    glb.json["accessors"][target]["count"] = json!(2);
    glb.json["accessors"][target]["sparse"]["count"] = json!(0);
    assert!(
        refusal(&glb).starts_with(
            ": meshes[0].primitives[0].targets[0].POSITION: is 2 elements for 3 vertices"
        ),
        "{}",
        refusal(&glb)
    );
}

/// The triangle on two joints. Its first corner hangs on the first one, its second on the other, its
/// third on both alike. Joints were bound at the origin and at (1, 0, 0).
fn skinned() -> Glb {
    let mut glb = Glb::triangle();
    let normal = glb.f32s("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    let joints = glb.accessor(&[0, 9, 9, 9, 1, 9, 9, 9, 0, 1, 9, 9], 5121, "VEC4", 3);
    let weights = glb.accessor(
        &[255, 0, 0, 0, 255, 0, 0, 0, 100, 100, 0, 0],
        5121,
        "VEC4",
        3,
    );
    glb.json["accessors"][weights]["normalized"] = json!(true);
    let mut bind = [[0.0; 16]; 2];
    for matrix in &mut bind {
        for k in 0..4 {
            matrix[5 * k] = 1.0;
        }
    }
    bind[1][12] = -1.0;
    let bytes: Vec<u8> = bind
        .as_flattened()
        .iter()
        .flat_map(|c: &f32| c.to_le_bytes())
        .collect();
    let bind = glb.accessor(&bytes, 5126, "MAT4", 2);
    let primitive = primitive(&mut glb);
    primitive["attributes"]["NORMAL"] = json!(normal);
    primitive["attributes"]["JOINTS_0"] = json!(joints);
    primitive["attributes"]["WEIGHTS_0"] = json!(weights);
    let half = 0.5f64.sqrt();
    glb.json["scenes"][0]["nodes"] = json!([0, 1]);
    glb.json["nodes"] = json!([
        // Where this node stands is of no account.
        { "name": "skin", "mesh": 0, "skin": 0, "translation": [1e6, 0, 0] },
        { "name": "hip", "translation": [0, 5, 0], "children": [2] },
        // A quarter turn about x: what pointed along z points along -y.
        { "name": "knee", "translation": [1, 0, 3], "rotation": [half, 0, 0, half] },
    ]);
    glb.json["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": bind }]);
    glb
}

#[test]
fn a_skin_is_where_its_joints_stand() {
    let scene = scene(&skinned());
    let object = &scene.objects[0];
    assert_eq!(object.name, "skin");
    let mesh = mesh_of(&scene, 0);
    let at = |corner: usize| {
        object
            .world_from_object
            .transform_point3(mesh.positions[corner])
    };
    assert_eq!(at(0), DVec3::new(0.0, 5.0, 0.0));
    assert!((at(1) - DVec3::new(1.0, 5.0, 3.0)).length() < 1e-15);
    // (0, 1, 0): up with the hip, (0, 6, 0); and with the knee from (-1, 1, 0), turned to (-1, 0, 1),
    // to (0, 5, 4).
    assert!(
        (at(2) - DVec3::new(0.0, 5.5, 2.0)).length() < 1e-15,
        "{}",
        at(2)
    );
    assert_eq!(mesh.normals[0], Vec3::Z);
    assert!((mesh.normals[1] + Vec3::Y).length() < 1e-6);
    let between = (Vec3::Z - Vec3::Y).normalize();
    assert!((mesh.normals[2] - between).length() < 1e-6);
}

#[test]
fn nodes_that_share_a_skin_share_the_posed_mesh_and_others_have_it_unposed() {
    let mut glb = skinned();
    glb.json["scenes"][0]["nodes"] = json!([0, 1, 3, 4]);
    let nodes = glb.json["nodes"].as_array_mut().expect("nodes");
    nodes.push(json!({ "mesh": 0, "skin": 0 }));
    nodes.push(json!({ "mesh": 0 }));
    let scene = scene(&glb);
    assert_eq!(scene.meshes.len(), 2);
    assert_eq!(scene.objects[0].mesh, scene.objects[1].mesh);
    assert_eq!(mesh_of(&scene, 2).positions[1], DVec3::X);
}

#[test]
fn vertices_have_any_number_of_joints() {
    let mut glb = skinned();
    // The first corner gets a second set, of equal weight, on the knee.
    let joints = glb.accessor(&[1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], 5121, "VEC4", 3);
    let weights = glb.f32s(
        "VEC4",
        &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    );
    let primitive = primitive(&mut glb);
    primitive["attributes"]["JOINTS_1"] = json!(joints);
    primitive["attributes"]["WEIGHTS_1"] = json!(weights);
    let first = scene(&glb).meshes[0].positions[0];
    // Between (0, 5, 0) and, by the knee, (-1, 0, 0) + (1, 5, 3).
    assert!(
        (first - DVec3::new(0.0, 5.0, 1.5)).length() < 1e-15,
        "{first}"
    );
}

#[test]
fn wrong_skins_are_refused_with_place_and_reason() {
    type Edit = fn(&mut Glb);
    let cases: &[(Edit, &str)] = &[
        (
            |glb| glb.json["nodes"][0]["skin"] = json!(3),
            ": nodes[0]: refers to skin 3, counted from 0, but the file has 1",
        ),
        (
            |glb| glb.json["skins"][0]["joints"] = json!([1]),
            ": meshes[0].primitives[0].attributes.JOINTS_0: refers to joint 1, counted from 0, \
             but the file has 1",
        ),
        (
            |glb| glb.json["skins"][0]["joints"] = json!([1, 2, 0]),
            ": skins[0].inverseBindMatrices: is 2 matrices, expected one for each joint",
        ),
        (
            |glb| glb.json["scenes"][0]["nodes"] = json!([0]),
            ": skins[0].joints[0]: is node 1, which the scene does not show",
        ),
        (
            |glb| {
                let attributes = primitive(glb)["attributes"].as_object_mut();
                attributes.expect("an object").remove("WEIGHTS_0");
            },
            ": meshes[0].primitives[0].attributes: has no weights for its joints",
        ),
        (
            |glb| {
                let attributes = primitive(glb)["attributes"].as_object_mut();
                attributes.expect("an object").remove("JOINTS_0");
            },
            ": meshes[0].primitives[0].attributes: has no JOINTS_0, which its skin needs",
        ),
    ];
    for (edit, expected) in cases {
        let mut glb = skinned();
        edit(&mut glb);
        let message = refusal(&glb);
        assert!(
            message.starts_with(expected),
            "{message:?} is not {expected:?}"
        );
    }
}

#[test]
fn instances_are_objects_in_the_space_of_their_node() {
    let mut glb = Glb::triangle();
    let places = glb.f32s("VEC3", &[1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    // A half turn about z, as normalised bytes; and a quarter turn.
    let turns = glb.accessor(&[0, 0, 127, 0, 0, 0, 90, 90], 5120, "VEC4", 2);
    glb.json["accessors"][turns]["normalized"] = json!(true);
    let scales = glb.f32s("VEC3", &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]);
    glb.json["nodes"] = json!([
        { "name": "tree", "mesh": 0, "translation": [0, 0, 7], "children": [1],
          "extensions": { "EXT_mesh_gpu_instancing": { "attributes": {
              "TRANSLATION": places, "ROTATION": turns, "SCALE": scales } } } },
        { "name": "instance1", "mesh": 0 },
    ]);
    let scene = scene(&glb);
    let names: Vec<_> = scene
        .objects
        .iter()
        .map(|object| object.name.as_str())
        .collect();
    let expected = ["tree/instance0", "tree/instance1#2", "tree/instance1"];
    assert_eq!(names, expected, "no name is given twice");
    assert_eq!(scene.meshes.len(), 1, "the mesh is shared");
    let x = |object: usize| {
        let placed = &scene.objects[object].world_from_object;
        placed.transform_point3(DVec3::X)
    };
    assert!(
        (x(0) - DVec3::new(0.0, 0.0, 7.0)).length() < 1e-12,
        "{}",
        x(0)
    );
    assert!(
        (x(1) - DVec3::new(2.0, 3.0, 7.0)).length() < 1e-12,
        "{}",
        x(1)
    );
}

#[test]
fn wrong_instances_are_refused_with_place_and_reason() {
    let with = |attributes: fn(&mut Glb) -> Value| {
        let mut glb = Glb::triangle();
        let attributes = attributes(&mut glb);
        let extension = json!({ "attributes": attributes });
        glb.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": extension });
        refusal(&glb)
    };
    let at = ": nodes[0].extensions.EXT_mesh_gpu_instancing.attributes";
    let unequal = with(|glb| {
        let places = glb.f32s("VEC3", &[0.0; 6]);
        json!({ "TRANSLATION": places, "SCALE": 0 })
    });
    let expected = format!("{at}.SCALE: is 3 elements, where others have 2");
    assert!(unequal.starts_with(&expected), "{unequal}");
    let unturned = with(|glb| json!({ "ROTATION": glb.f32s("VEC4", &[0.0; 4]) }));
    let expected = format!("{at}.ROTATION: is [0.0, 0.0, 0.0, 0.0] at instance 0");
    assert!(unturned.starts_with(&expected), "{unturned}");
    let nowhere = with(|_| json!({ "_ID": 0 }));
    let expected = format!("{at}: has no TRANSLATION, ROTATION or SCALE");
    assert!(nowhere.starts_with(&expected), "{nowhere}");
    let many = with(|glb| {
        let zeros = json!({ "componentType": 5126, "type": "VEC3", "count": 1_000_000_000 });
        json!({ "TRANSLATION": glb.add("accessors", zeros) })
    });
    assert!(many.contains("bytes more of memory"), "{many}");
}

#[test]
fn lights_stand_where_their_nodes_are_and_one_warning_says_that_none_is_shown() {
    let mut glb = Glb::triangle();
    glb.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "directional", "name": "sun", "intensity": 90_000, "color": [1, 0.9, 0.8] },
        { "type": "point", "range": 4.5 },
        { "type": "spot", "intensity": 60, "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.2 } },
        { "type": "spot", "spot": { "innerConeAngle": 0.3, "outerConeAngle": 0.2 } },
    ] } });
    let light = |index: u32| json!({ "KHR_lights_punctual": { "light": index } });
    glb.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4]);
    // Down, from above: a quarter turn about -x takes -z to -y.
    let down = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2).to_array();
    glb.json["nodes"] = json!([
        { "mesh": 0 },
        { "rotation": down, "extensions": light(0) },
        { "name": "lamp", "translation": [1, 2, 3], "scale": [5, 5, 5], "extensions": light(1) },
        { "name": "lamp", "translation": [1, 2, 3], "extensions": light(2) },
        { "extensions": light(3) },
    ]);
    let loaded = load(&glb);
    let texts: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(texts.len(), 2, "{texts:?}");
    assert!(
        texts[0].contains("lights[3]: has cones of 0.3 and 0.2"),
        "{texts:?}"
    );
    assert!(
        texts[1].contains("3 lights are read, but pictures"),
        "{texts:?}"
    );
    let lights = &loaded.scene.lights;
    let names: Vec<_> = lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["sun", "lamp", "lamp#2"]);
    assert_eq!(
        lights[0].kind,
        LightKind::Directional {
            illuminance: 90_000.0
        }
    );
    assert_eq!(lights[0].color, [1.0, 0.9, 0.8]);
    assert!((lights[0].direction() + DVec3::Y).length() < 1e-12);
    let (intensity, range) = (1.0, 4.5);
    assert_eq!(lights[1].kind, LightKind::Point { intensity, range });
    assert_eq!(lights[1].position(), DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(
        lights[2].kind,
        LightKind::Spot {
            intensity: 60.0,
            range: f32::INFINITY,
            inner_angle: 0.1,
            outer_angle: 0.2
        }
    );
}

#[test]
fn colour_and_emission_may_have_texture_coordinates_of_their_own() {
    let mut glb = Glb::triangle();
    let view = glb.view(&small_png());
    glb.add("images", json!({ "bufferView": view }));
    glb.add("textures", json!({ "source": 0 }));
    // The override of a texture transform counts.
    let transform = json!({ "KHR_texture_transform": { "texCoord": 7, "offset": [0.5, 0] } });
    let emissive = json!({ "index": 0, "texCoord": 1, "extensions": transform });
    glb.add(
        "materials",
        json!({
            "emissiveFactor": [1, 0.5, 0], "emissiveTexture": emissive,
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "texCoord": 2 } },
        }),
    );
    glb.add(
        "materials",
        json!({ "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0, "texCoord": 7 } }),
    );
    glb.add(
        "materials",
        json!({ "emissiveTexture": { "index": 0, "texCoord": 7 } }),
    );
    for set in [0, 2, 7] {
        let value = set as f32 / 8.0;
        let texcoord = glb.f32s("VEC2", &[value; 6]);
        let attributes = &mut primitive(&mut glb)["attributes"];
        attributes[format!("TEXCOORD_{set}")] = json!(texcoord);
    }
    let plain = primitive(&mut glb).clone();
    let primitives: Vec<_> = (0..3)
        .map(|material| {
            let mut primitive = plain.clone();
            primitive["material"] = json!(material);
            primitive
        })
        .collect();
    glb.json["meshes"][0]["primitives"] = json!(primitives);
    let scene = scene(&glb);
    let mesh = &scene.meshes[0];
    let at = |value: f32| [Vec2::splat(value); 3];
    assert_eq!(mesh.texcoords, [at(0.25), at(0.875), at(0.0)].concat());
    assert_eq!(mesh.second_texcoords[..3], at(0.875));
    let [both, emissive, neither] = &scene.materials[..] else {
        panic!("three materials");
    };
    let color = both.base_color_texture.expect("a texture");
    let emission = both.emissive_texture.expect("a texture");
    assert_eq!(
        (color.texcoords, emission.texcoords),
        (TexcoordSet::First, TexcoordSet::Second)
    );
    assert_eq!(emission.offset, Vec2::new(0.5, 0.0));
    assert_eq!(both.emissive, [1.0, 0.5, 0.0]);
    let emission = emissive.emissive_texture.expect("a texture");
    assert_eq!(emission.texcoords, TexcoordSet::First, "the only one");
    assert!(neither.emissive_texture.is_none(), "nothing is emitted");
}

#[test]
fn a_texture_without_coordinates_is_looked_up_at_their_origin() {
    let mut glb = Glb::triangle();
    let view = glb.view(&small_png());
    glb.add("images", json!({ "bufferView": view }));
    glb.add("textures", json!({ "source": 0 }));
    let texture = json!({ "baseColorTexture": { "index": 0 } });
    glb.add("materials", json!({ "pbrMetallicRoughness": texture }));
    primitive(&mut glb)["material"] = json!(0);
    let loaded = load(&glb);
    let text = loaded.warnings[0].to_string();
    assert!(
        text.contains("lacks TEXCOORD_0, which its material asks for"),
        "{text}"
    );
    assert_eq!(loaded.scene.meshes[0].texcoords, [Vec2::ZERO; 3]);
}

#[test]
fn a_replacement_for_other_programs_is_used_where_it_is_named() {
    let mut glb = Glb::triangle();
    let view = glb.view(&small_png());
    glb.json["images"] = json!([
        { "name": "png", "bufferView": view },
        { "name": "webp", "bufferView": view },
        { "name": "ktx", "bufferView": view },
    ]);
    glb.json["extensionsUsed"] = json!(["KHR_texture_basisu", "EXT_texture_webp"]);
    glb.json["textures"] = json!([
        { "source": 0, "extensions": { "EXT_texture_webp": { "source": 1 } } },
        { "source": 0, "extensions": { "KHR_texture_basisu": { "source": 2 } } },
        { "extensions": { "KHR_texture_basisu": { "source": 2 } } },
    ]);
    let texcoord = glb.f32s("VEC2", &[0.0; 6]);
    primitive(&mut glb)["attributes"]["TEXCOORD_0"] = json!(texcoord);
    let plain = primitive(&mut glb).clone();
    let mut primitives = Vec::new();
    for texture in 0..3 {
        let texture = json!({ "baseColorTexture": { "index": texture } });
        let material = glb.add("materials", json!({ "pbrMetallicRoughness": texture }));
        let mut primitive = plain.clone();
        primitive["material"] = json!(material);
        primitives.push(primitive);
    }
    glb.json["meshes"][0]["primitives"] = json!(primitives);
    let loaded = load(&glb);
    let scene = &loaded.scene;
    let image = |material: usize| {
        let texture = scene.materials[material].base_color_texture?;
        Some(scene.images[texture.image.0 as usize].name.as_str())
    };
    assert_eq!(
        [image(0), image(1), image(2)],
        [Some("webp"), Some("png"), None]
    );
    let texts: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(texts.len(), 1, "{texts:?}");
    assert!(
        texts[0].contains("textures[2]: has no PNG, JPEG or WebP image"),
        "{texts:?}"
    );
}
