//! What moves: keys of scene files, animations of glTF models, and what is said of wrong ones.

use crate::scene_file::folder;
use crate::support::{Folder, Glb};
use serde_json::json;
use veduta::geometry::{DMat4, DQuat, DVec3};
use veduta::scene::Scene;
use veduta_io::{
    Animation, AnimationKind, ErrorKind, Loaded, Moment, Place, ReadError, ReadOptions,
    SceneOverTime, UpAxis, read_scene,
};

fn read_at(folder: &Folder, text: &str, moment: Moment) -> Result<Loaded, ReadError> {
    let options = ReadOptions {
        moment,
        ..ReadOptions::default()
    };
    read_scene(&folder.write("s.toml", text), &options)
}

fn scene_at(folder: &Folder, text: &str, moment: Moment) -> Scene {
    let loaded = read_at(folder, text, moment).unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    loaded.scene
}

/// Where a point of the first object's model comes to lie.
fn place(scene: &Scene, point: DVec3) -> DVec3 {
    scene.objects[0].world_from_object.transform_point3(point)
}

fn assert_near(found: DVec3, expected: [f64; 3]) {
    let expected = DVec3::from_array(expected);
    assert!(
        (found - expected).length() < 1e-9,
        "{found} and not {expected}"
    );
}

const MOVING: &str = r#"
    [animation]
    fps = 10
    [[layer]]
    name = "part"
    model = "part.obj"
    up = "z"
    at = { translate = [0, 0, 100], scale = 2 }
    keys = [
        { time = 1, translate = [0, 0, 0] },
        { time = "20 frames", rotate = { axis = [0, 0, 1], angle = 0 } },
        { time = 3, translate = [8, 0, 4] },
        { time = "4000 ms", rotate = { axis = [0, 0, 1], angle = "720deg" } },
    ]
"#;

#[test]
fn each_word_of_the_keys_goes_its_own_way_and_what_none_names_is_as_at_has_it() {
    let folder = folder();
    for (moment, translate, degrees) in [
        (Moment::Rest, [0.0, 0.0, 0.0], 0.0_f64),
        (Moment::Seconds(0.5), [0.0, 0.0, 0.0], 0.0),
        (Moment::Seconds(2.0), [4.0, 0.0, 2.0], 0.0),
        (Moment::Frame(25), [6.0, 0.0, 3.0], 180.0),
        (Moment::Frame(33), [8.0, 0.0, 4.0], 468.0),
        (Moment::Seconds(9.0), [8.0, 0.0, 4.0], 720.0),
    ] {
        let scene = scene_at(&folder, MOVING, moment);
        let expected = DMat4::from_scale_rotation_translation(
            DVec3::splat(2.0),
            DQuat::from_rotation_z(degrees.to_radians()),
            DVec3::from_array(translate),
        );
        for point in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z] {
            let expected = expected.transform_point3(point).to_array();
            assert_near(place(&scene, point), expected);
        }
    }
    let loaded = read_at(&folder, MOVING, Moment::Rest).expect("sound");
    let keys = Animation {
        name: "part".into(),
        kind: AnimationKind::Layer,
        seconds: 4.0,
    };
    assert_eq!(
        (loaded.animations, loaded.frames_per_second),
        (vec![keys], 10.0)
    );
}

#[test]
fn what_repeats_begins_again_and_steps_stay_until_the_next() {
    let folder = folder();
    let text = |more: &str| {
        format!(
            "[[layer]]\nname = \"a\"\nmodel = \"part.obj\"\n{more}\nkeys = [{{ time = 0, translate = [0, 0, 0] }}, \
             {{ time = 2, translate = [4, 0, 0] }}]"
        )
    };
    let x = |more: &str, seconds| {
        let scene = scene_at(&folder, &text(more), Moment::Seconds(seconds));
        place(&scene, DVec3::ZERO).x
    };
    assert_eq!((x("", 0.5), x("", 5.0)), (1.0, 4.0));
    assert_eq!(
        (x("repeat = true", 5.0), x("repeat = true", 2.0)),
        (2.0, 0.0)
    );
    let step = "interpolation = \"step\"";
    assert_eq!((x(step, 1.9), x(step, 2.0)), (0.0, 4.0));
    assert_eq!(x("interpolation = \"ease\"", 0.5), 0.625);
}

#[test]
fn cameras_have_keys_too_and_scenes_in_scenes_have_the_same_time() {
    let folder = folder();
    folder.write("inner.toml", MOVING);
    let text = r#"
        [camera.flight]
        eye = [0, -10, 5]
        look_at = [0, 0, 0]
        near = 1
        keys = [{ time = 0, eye = [0, -10, 5] }, { time = 4, eye = [8, -10, 5] }]
        [[layer]]
        name = "outer"
        model = "inner.toml"
        at = { translate = [0, 0, 1] }
    "#;
    // 48 frames of 24 a second; the inner scene counts others.
    let loaded = read_at(&folder, text, Moment::Frame(48)).expect("sound");
    assert_near(place(&loaded.scene, DVec3::ZERO), [4.0, 0.0, 3.0]);
    let eye = loaded.scene.cameras[0].1.eye_from_world.inverse().w_axis;
    assert_near(eye.truncate(), [4.0, -10.0, 5.0]);
    let told: Vec<_> = loaded
        .animations
        .iter()
        .map(|animation| (animation.name.as_str(), animation.kind, animation.seconds))
        .collect();
    let expected = [
        ("flight", AnimationKind::Camera, 4.0),
        ("outer/part", AnimationKind::Layer, 4.0),
    ];
    assert_eq!(told, expected);
}

#[test]
fn wrong_keys_are_told_with_their_places() {
    let folder = folder();
    folder.write("empty.glb", Glb::triangle().bytes());
    // What the layer has more, what is said of it, and where that begins.
    for (more, message, at) in [
        ("keys = [{ translate = [0, 0, 0] }]", "time", "{ translate"),
        (
            "keys = [{ time = -1, translate = [0, 0, 0] }]",
            "time",
            "-1",
        ),
        (
            "keys = [{ time = \"1 day\", scale = 1 }]",
            "36 frames",
            "\"1 day\"",
        ),
        ("keys = [{ time = 0, move = [0, 0, 0] }]", "move", "move"),
        (
            "keys = [{ time = 0 }]",
            "has translate, rotate or scale",
            "{ time",
        ),
        ("keys = []", "keys", "[]"),
        (
            "keys = [{ time = 1, scale = 1 }, { time = \"24 frames\", scale = 2 }]",
            "order of their times",
            "\"24 frames\"",
        ),
        (
            "keys = [{ time = 1, scale = 1 }, { time = 2, scale = [1, -1, 1] }]",
            "go through 0",
            "[1, -1, 1]",
        ),
        (
            "keys = [{ time = 0, scale = 1 }]\nat = { matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]] }",
            "a matrix cannot",
            "[[1, 0",
        ),
        (
            "keys = [{ time = 0, scale = 1 }]\nrepeat = true",
            "after 0 s",
            "[{ time",
        ),
        ("repeat = true", "leave it out", "true"),
        ("interpolation = \"step\"", "keys", "interpolation"),
        (
            "keys = [{ time = 0, scale = 1 }]\ninterpolation = \"bezier\"",
            "ease",
            "\"bezier\"",
        ),
        ("animation = true", "for glTF models", "true"),
    ] {
        let text = format!("[[layer]]\nname = \"a\"\nmodel = \"part.obj\"\n{more}\n");
        let error = read_at(&folder, &text, Moment::Rest).expect_err(more);
        assert_eq!(error.kind(), ErrorKind::BadInput, "{error}");
        assert!(error.to_string().contains(message), "{error}\n{more}");
        assert_eq!(error.place, place_of(&text, at), "{error}\n{more}");
    }
    let text = "[[layer]]\nname = \"a\"\nmodel = \"empty.glb\"\nanimation = \"Run\"\n";
    let error = read_at(&folder, text, Moment::Rest).expect_err("no such animation");
    assert_eq!(
        (error.kind(), &error.place),
        (ErrorKind::Missing, &place_of(text, "\"Run\""))
    );
    assert!(error.file.ends_with("s.toml"), "{error}");
    let text = "[animation]\nfps = 0\n[[layer]]\nname = \"a\"\nmodel = \"part.obj\"\n";
    let error = read_at(&folder, text, Moment::Rest).expect_err("no frames a second");
    assert_eq!(error.place, place_of(text, "0"));
    let text = "[camera.c]\neye = [0, 0, 1]\nlook_at = [0, 0, 0]\nkeys = [{ time = 1, look_at = [0, 0, 1] }]\n\
        [[layer]]\nname = \"a\"\nmodel = \"part.obj\"\n";
    let error = read_at(&folder, text, Moment::Rest).expect_err("no direction");
    assert_eq!(error.place, place_of(text, "[{ time"), "{error}");
}

/// Line and column of the first character of `what`.
fn place_of(text: &str, what: &str) -> Place {
    let before = &text[..text.find(what).expect("is there")];
    Place::Text {
        line: 1 + before.matches('\n').count() as u64,
        column: 1 + before
            .rsplit('\n')
            .next()
            .map_or(0, |line| line.chars().count()) as u64,
    }
}

/// The triangle in a node, moved by the sampler of these keys; names of two animations: `still`, which
/// moves nothing, and `move`.
fn animated(path: &str, how: &str, times: &[f32], shape: &str, values: &[f32]) -> Glb {
    let mut glb = Glb::triangle();
    let input = glb.f32s("SCALAR", times);
    let output = glb.f32s(shape, values);
    glb.add(
        "animations",
        json!({ "name": "still", "channels": [], "samplers": [] }),
    );
    glb.add(
        "animations",
        json!({
            "name": "move",
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": path } }],
            "samplers": [{ "input": input, "output": output, "interpolation": how }],
        }),
    );
    glb
}

fn played(glb: &Glb, seconds: f64, repeats: bool) -> Result<Loaded, ReadError> {
    let options = ReadOptions {
        up_axis: Some(UpAxis::Z),
        moment: Moment::Seconds(seconds),
        animation: Some("move".into()),
        repeats,
        ..ReadOptions::default()
    };
    read_scene(&Folder::new().write("m.glb", glb.bytes()), &options)
}

/// Where a point of the animated triangle is.
fn point_at(glb: &Glb, seconds: f64, point: DVec3) -> DVec3 {
    let loaded = played(glb, seconds, false).unwrap_or_else(|error| panic!("{error}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    place(&loaded.scene, point)
}

#[test]
fn nodes_go_by_steps_lines_and_splines_and_stay_at_both_ends() {
    let times = [0.5, 1.5, 3.5];
    let values = [0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 8.0, 0.0];
    let step = animated("translation", "STEP", &times, "VEC3", &values);
    let line = animated("translation", "LINEAR", &times, "VEC3", &values);
    for (seconds, by_step, on_line) in [
        (0.0, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        (1.0, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
        (1.5, [2.0, 0.0, 0.0], [2.0, 0.0, 0.0]),
        (2.0, [2.0, 0.0, 0.0], [2.0, 2.0, 0.0]),
        (9.0, [2.0, 8.0, 0.0], [2.0, 8.0, 0.0]),
    ] {
        assert_near(point_at(&step, seconds, DVec3::ZERO), by_step);
        assert_near(point_at(&line, seconds, DVec3::ZERO), on_line);
    }
    // A spline through the keys of a cubic with its slopes is that cubic: x = t^3 - 2t at 0 and 2 s.
    let cubic = |t: f64| t * t * t - 2.0 * t;
    let slope = |t: f64| (3.0 * t * t - 2.0) as f32;
    let mut values = Vec::new();
    for t in [0.0, 2.0] {
        values.extend([
            slope(t),
            0.0,
            0.0,
            cubic(t) as f32,
            0.0,
            0.0,
            slope(t),
            0.0,
            0.0,
        ]);
    }
    let spline = animated("translation", "CUBICSPLINE", &[0.0, 2.0], "VEC3", &values);
    for seconds in [0.0, 0.25, 1.0, 1.75, 2.0] {
        assert_near(
            point_at(&spline, seconds, DVec3::ZERO),
            [cubic(seconds), 0.0, 0.0],
        );
    }
    assert_near(point_at(&spline, 3.0, DVec3::ZERO), [cubic(2.0), 0.0, 0.0]);
}

#[test]
fn nodes_turn_the_short_way_at_an_even_speed() {
    // The same turn by 90 degrees about Z, told by the quaternion of the other sign.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let values = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -half, -half];
    let glb = animated("rotation", "LINEAR", &[0.0, 3.0], "VEC4", &values);
    for seconds in [0.0, 1.0, 2.0, 3.0] {
        let (sin, cos) = (seconds * 30.0_f64).to_radians().sin_cos();
        let found = point_at(&glb, seconds, DVec3::X);
        assert!(
            (found - DVec3::new(cos, sin, 0.0)).length() < 1e-6,
            "{seconds}: {found}"
        );
    }
    // Scale, in shares of 255.
    let mut glb = animated("scale", "LINEAR", &[0.0, 1.0], "VEC3", &[1.0; 6]);
    let bytes = [255, 255, 255, 0, 51, 255, 255, 0];
    let view = glb.view(&bytes);
    glb.json["bufferViews"][view]["byteStride"] = json!(4);
    let output = glb.add(
        "accessors",
        json!({ "bufferView": view, "componentType": 5121, "normalized": true, "type": "VEC3",
            "count": 2 }),
    );
    glb.json["animations"][1]["samplers"][0]["output"] = json!(output);
    let found = point_at(&glb, 0.5, DVec3::X);
    assert!((found - DVec3::X * 0.6).length() < 1e-6, "{found}");
}

#[test]
fn morph_targets_are_played_for_each_node_alone() {
    let mut glb = animated(
        "weights",
        "LINEAR",
        &[0.0, 2.0],
        "SCALAR",
        &[0.0, 1.0, 1.0, 3.0],
    );
    let lift = glb.f32s("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    let shift = glb.f32s("VEC3", &[1.0, 0.0, 0.0].repeat(3));
    glb.json["meshes"][0]["primitives"][0]["targets"] =
        json!([{ "POSITION": lift }, { "POSITION": shift }]);
    glb.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "weights": [2, 0] }]);
    glb.json["scenes"][0]["nodes"] = json!([0, 1]);
    let loaded = played(&glb, 1.0, false).expect("sound");
    let corner = |object: usize| {
        let mesh = loaded.scene.objects[object].mesh;
        loaded.scene.meshes[mesh.0 as usize].positions[0]
    };
    assert_near(corner(0), [2.0, 0.0, 0.5]);
    assert_near(corner(1), [0.0, 0.0, 2.0]);
}

#[test]
fn a_skin_follows_its_joints() {
    let mut glb = animated(
        "translation",
        "LINEAR",
        &[0.0, 1.0],
        "VEC3",
        &[0.0, 0.0, 0.0, 0.0, 0.0, 4.0],
    );
    let joints = glb.accessor(&[0; 12], 5121, "VEC4", 3);
    let weights = glb.f32s("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(3));
    let attributes = &mut glb.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    // The joint moves, which is node 0; the mesh hangs elsewhere.
    glb.json["nodes"] = json!([{}, { "mesh": 0, "skin": 0, "translation": [9, 9, 9] }]);
    glb.json["scenes"][0]["nodes"] = json!([0, 1]);
    glb.json["skins"] = json!([{ "joints": [0] }]);
    let loaded = played(&glb, 0.5, false).expect("sound");
    assert_near(loaded.scene.meshes[0].positions[1], [1.0, 0.0, 2.0]);
}

#[test]
fn animations_are_told_and_played_by_name_and_at_rest_nothing_moves() {
    let values = [0.0, 0.0, 1.0, 0.0, 0.0, 3.0];
    let glb = animated("translation", "LINEAR", &[0.0, 2.0], "VEC3", &values);
    let folder = Folder::new();
    let path = folder.write("m.glb", glb.bytes());
    let read = |moment, animation: Option<&str>| {
        let options = ReadOptions {
            up_axis: Some(UpAxis::Z),
            moment,
            animation: animation.map(str::to_owned),
            ..ReadOptions::default()
        };
        read_scene(&path, &options)
    };
    let at_rest = read(Moment::Rest, None).expect("sound");
    let told: Vec<_> = at_rest
        .animations
        .iter()
        .map(|a| (a.name.as_str(), a.seconds))
        .collect();
    assert_eq!(told, [("still", 0.0), ("move", 2.0)]);
    assert_near(place(&at_rest.scene, DVec3::ZERO), [0.0, 0.0, 0.0]);
    // The first stands still; the other is asked for, at 24 frames a second.
    let first = read(Moment::Seconds(1.0), None).expect("sound");
    assert_near(place(&first.scene, DVec3::ZERO), [0.0, 0.0, 0.0]);
    let frame = read(Moment::Frame(12), Some("move")).expect("sound");
    assert_near(place(&frame.scene, DVec3::ZERO), [0.0, 0.0, 1.5]);
    let again = played(&glb, 5.0, true).expect("sound");
    assert_near(place(&again.scene, DVec3::ZERO), [0.0, 0.0, 2.0]);
    let error = read(Moment::Frame(12), Some("walk")).expect_err("no such");
    assert_eq!(error.kind(), ErrorKind::Missing);
    assert!(error.to_string().contains("it has: still, move"), "{error}");
    // What has none says so.
    let path = folder.write("still.glb", Glb::triangle().bytes());
    let options = ReadOptions {
        moment: Moment::Seconds(1.0),
        ..ReadOptions::default()
    };
    let still = read_scene(&path, &options).expect("sound");
    assert!(
        still.warnings[0].message.contains("no animations"),
        "{:?}",
        still.warnings
    );
}

#[test]
fn wrong_animations_are_refused_where_they_are_played_and_told_where_not() {
    let good = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
    let glb = |change: &dyn Fn(&mut Glb)| {
        let mut glb = animated("translation", "LINEAR", &[0.0, 1.0], "VEC3", &good);
        change(&mut glb);
        glb
    };
    let set = |pointer: &'static str, value: serde_json::Value| {
        move |glb: &mut Glb| *glb.json.pointer_mut(pointer).expect("is there") = value.clone()
    };
    let at = "/animations/1";
    let cases: [(Glb, &str); 9] = [
        (
            animated("translation", "LINEAR", &[1.0, 1.0], "VEC3", &good),
            "ascend",
        ),
        (
            animated("translation", "LINEAR", &[0.0, f32::NAN], "VEC3", &good),
            "ascend",
        ),
        (
            animated("translation", "CUBICSPLINE", &[0.0, 1.0], "VEC3", &good),
            "CUBICSPLINE",
        ),
        (
            animated("translation", "CURVE", &[0.0, 1.0], "VEC3", &good),
            "CURVE",
        ),
        (
            animated("colour", "LINEAR", &[0.0, 1.0], "VEC3", &good),
            "colour",
        ),
        (
            animated("rotation", "LINEAR", &[0.0, 1.0], "VEC4", &[0.0; 8]),
            "quaternions",
        ),
        (
            glb(&set("/animations/1/channels/0/sampler", json!(7))),
            "sampler 7",
        ),
        (
            glb(&set("/animations/1/channels/0/target/node", json!(9))),
            "node 9",
        ),
        (
            glb(&|glb| {
                glb.json["nodes"][0]["matrix"] =
                    json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
            }),
            "a matrix",
        ),
    ];
    for (glb, message) in &cases {
        let error = played(glb, 0.5, false).expect_err(message);
        assert_eq!(error.kind(), ErrorKind::BadInput, "{error}");
        assert!(
            error.to_string().contains(message),
            "{error}, not {message}"
        );
        assert!(error.to_string().contains("animations[1]"), "{error}");
        // Who does not play it has a sound model.
        let at_rest = Folder::new().read("m.glb", glb.bytes());
        at_rest.unwrap_or_else(|error| panic!("{at}: {error}"));
    }
}

#[test]
fn a_scene_over_time_is_the_scene_read_at_each_moment() {
    let folder = folder();
    let values = [0.0, 0.0, 1.0, 0.0, 0.0, 3.0];
    let glb = animated("translation", "LINEAR", &[0.0, 2.0], "VEC3", &values);
    folder.write("m.glb", glb.bytes());
    let text = format!(
        "{MOVING}\n[[layer]]\nname = \"b\"\nmodel = \"m.glb\"\nanimation = \"move\"\n\
         [[layer]]\nname = \"c\"\nmodel = \"m.glb\"\n[[layer]]\nname = \"d\"\nmodel = \"part.obj\"\n"
    );
    let path = folder.write("s.toml", &text);
    let mut over_time = SceneOverTime::new(&path, ReadOptions::default());
    for frame in [0, 15, 7, 15] {
        let moment = Moment::Frame(frame);
        let found = over_time
            .at(moment)
            .unwrap_or_else(|error| panic!("{error}"));
        let expected = read_at(&folder, &text, moment).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(found.scene, expected.scene, "frame {frame}");
        assert_eq!(found.animations, expected.animations);
    }
    // What does not move is not read again; what may is.
    std::fs::remove_file(folder.path("m.mtl")).expect("is there");
    over_time.at(Moment::Frame(3)).expect("is known");
    std::fs::write(folder.path("m.glb"), "no model any more").expect("may write");
    over_time.at(Moment::Frame(4)).expect_err("is read again");
}
