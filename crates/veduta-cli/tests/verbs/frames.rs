//! Animations and local processing: frames made, kept, gone on with, refused; parts of pictures made
//! again.

use crate::{FACING, Folder, png};
use serde_json::json;

/// The model's wall stands, its box flies past; the wall comes down in the last frame.
const SCENE: &str = r##"
    [animation]
    fps = 2
    [camera.front]
    eye = [0, -5, 0]
    look_at = [0, 0, 0]
    parallel = 4
    size = [16, 16]
    [camera.moving]
    eye = [0, -5, 0]
    look_at = [0, 0, 0]
    parallel = 4
    size = [16, 16]
    keys = [{ time = 0, eye = [0, -5, 0] }, { time = 2, eye = [1, -5, 0] }]
    [[layer]]
    name = "wall"
    model = "wall.obj"
    keys = [{ time = "3 frames", translate = [0, 0, 0] }, { time = "4 frames", translate = [0, 0, -1.3] }]
    [[layer]]
    name = "box"
    model = "box.obj"
    keys = [{ time = 0, translate = [-0.5, 0, 0.3] }, { time = "3 frames", translate = [1.1, 0.5, 0.3] }]
"##;

fn folder() -> Folder {
    let folder = Folder::new();
    // Two walls, so that the box is less than half of all faces.
    folder.write(
        "wall.obj",
        "mtllib m.mtl\no wall\nusemtl red\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n\
         v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nf 5 6 7 8\n",
    );
    folder.write(
        "box.obj",
        "mtllib m.mtl\no box\nusemtl blue\nv -1 -1 1\nv 0 -1 1\nv 0 0 1\nv -1 0 1\nf 1 2 3 4\n",
    );
    folder.write("s.toml", SCENE);
    folder
}

#[test]
fn frames_of_what_moved_are_the_pictures_of_their_moments() {
    let folder = folder();
    let told = folder.json("frames s.toml -o f.##.exr --compare");
    let rows = told["frames"].as_array().expect("rows");
    let of = |key: &str| rows.iter().map(|row| row[key].clone()).collect::<Vec<_>>();
    assert_eq!(of("frame"), [0, 1, 2, 3, 4]);
    assert_eq!(
        of("made"),
        ["first", "parts", "parts", "parts", "mostChanged"]
    );
    // What stands is not known alone before something has moved.
    let (all, moved) = (json!(["wall", "box"]), json!(["box"]));
    assert_eq!(
        of("found"),
        [all.clone(), all.clone(), moved.clone(), moved.clone(), all]
    );
    assert_eq!(
        of("changed")[1..],
        [moved.clone(), moved.clone(), moved, json!(["wall"])]
    );
    assert!(rows[2]["cpuSeconds"]["findingAll"].is_number(), "{told}");
    for frame in 0..5 {
        folder.told(&format!("render s.toml --frame {frame} -o whole.exr"));
        folder.told(&format!("diff whole.exr f.0{frame}.exr --tolerance 1e-5"));
    }
    // Half a second a frame.
    folder.told("render s.toml --time 1.5s -o moment.exr");
    folder.told("diff moment.exr f.03.exr --tolerance 1e-5");
}

#[test]
fn frames_that_are_there_are_left_and_the_others_look_as_if_made_in_one_run() {
    let folder = folder();
    folder.told("frames s.toml -o all.#.png --frames 0..3");
    folder.told("frames s.toml -o some.#.png --frames 0..3x2");
    let before = folder.read("some.0.png");
    let told = folder.json("frames s.toml -o some.#.png --frames 0..3");
    assert_eq!(told["leftAsTheyWere"], 2, "{told}");
    for frame in 0..4 {
        let [all, some] = ["all", "some"].map(|name| folder.read(&format!("{name}.{frame}.png")));
        // One exposure for all: that of the first frame.
        let ((_, _, all), (_, _, some)) = (png(&all), png(&some));
        for (all, some) in all.iter().flatten().zip(some.iter().flatten()) {
            assert!(all.abs_diff(*some) <= 1, "frame {frame}");
        }
    }
    assert!(before == folder.read("some.0.png"));
    folder.write("some.2.png", "not a picture");
    folder.told("frames s.toml -o some.#.png --frames 2");
    assert!(folder.read("some.2.png") == b"not a picture");
    folder.told("frames s.toml -o some.#.png --frames 2 --force");
    png(&folder.read("some.2.png"));
}

#[test]
fn through_a_moving_camera_each_frame_is_found_as_a_whole() {
    let folder = folder();
    let told = folder.json("frames s.toml --camera moving -o f.#.exr --frames 0..2");
    let rows = told["frames"].as_array().expect("rows");
    let made: Vec<_> = rows.iter().map(|row| &row["made"]).collect();
    assert_eq!(made, ["first", "otherView", "otherView"]);
    folder.told("render s.toml --camera moving --frame 2 -o whole.exr");
    folder.told("diff whole.exr f.2.exr --tolerance 1e-5");
}

#[test]
fn frames_may_be_maps() {
    let folder = folder();
    folder.told("frames s.toml -o f.#.veduta --frames 1..2");
    folder.told("check f.1.veduta f.2.veduta");
    folder.told("shade f.2.veduta -o found.exr");
    folder.told("render s.toml --frame 2 -o whole.exr");
    folder.told("diff whole.exr found.exr --tolerance 1e-5");
}

#[test]
fn frames_that_cannot_be_are_refused() {
    let folder = folder();
    folder.write(
        "still.toml",
        "[[layer]]\nname = \"a\"\nmodel = \"wall.obj\"\n",
    );
    for (arguments, code, message) in [
        ("frames s.toml -o f.png", 2, "f.####.png"),
        ("frames s.toml -o - --frames 0..1", 2, "frames are files"),
        (
            "frames s.toml -o f.#.png --frames 3..1",
            2,
            "frame 1 comes before",
        ),
        ("frames s.toml -o f.#.svg", 2, "render --frame N"),
        ("frames s.toml -o f.#.exr --aov object", 2, "crypto-object"),
        ("frames s.toml -o nowhere/f.#.png", 6, "make it first"),
        ("frames still.toml -o f.#.png", 4, "nothing moves"),
        ("render s.toml --frame 1 --time 1s -o f.png", 2, "--time"),
        ("render s.toml --time soon -o f.png", 2, "1.5s"),
    ] {
        let output = folder.veduta(arguments).assert().code(code);
        let told = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
        let shown = message.replace("f.####.png", "####");
        assert!(told.contains(&shown), "{arguments}: {told}");
    }
    // The frame at which it fails is named.
    let failing = SCENE.replace("eye = [1, -5, 0]", "eye = [0, 5, 0]");
    folder.write("s.toml", failing);
    let run = "frames s.toml --camera moving -o f.#.png --frames 1..4";
    let output = folder.veduta(run).assert().code(4);
    let told = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
    assert!(told.contains("frame 2: s.toml:"), "{told}");
    let made: Vec<String> = folder
        .files()
        .into_iter()
        .filter(|f| f.starts_with("f."))
        .collect();
    assert_eq!(made, ["f.1.png"], "nothing half made is left");
}

#[test]
fn info_tells_what_moves() {
    let folder = folder();
    let told = folder.json("info s.toml");
    assert_eq!(told["framesPerSecond"], 2.0);
    let expected = json!([
        { "name": "moving", "of": "camera", "seconds": 2.0 },
        { "name": "wall", "of": "layer", "seconds": 2.0 },
        { "name": "box", "of": "layer", "seconds": 1.5 },
    ]);
    assert_eq!(told["animations"], expected);
    let text = folder.told("info s.toml");
    assert!(text.contains("box  layer, 1.500 s, 3 frames"), "{text}");
    assert_eq!(folder.json("info town.obj")["animations"], json!([]));
}

#[test]
fn a_part_made_again_is_that_of_the_whole_with_the_change() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    let size = "--size 61x47";
    let blue = "--set material.\"blue\".color=#3a7";
    for (suffix, look) in [
        ("exr", ""),
        ("npy", ""),
        ("png", "--exposure 1"),
        ("tif", "--exposure 1"),
    ] {
        folder.told(&format!("shade town.veduta {size} {look} -o old.{suffix}"));
        folder.told(&format!(
            "shade town.veduta {size} {look} {blue} -o whole.{suffix}"
        ));
        let told = folder.json(&format!(
            "shade town.veduta {size} {look} {blue} --into old.{suffix} --objects box -o new.{suffix}"
        ));
        let made = told["pixelsMade"].as_u64().expect("a number");
        assert!((100..1000).contains(&made), "{told}");
        let whole = folder.read(&format!("whole.{suffix}"));
        assert!(folder.read(&format!("new.{suffix}")) == whole, "{suffix}");
        // In two windows, the second into what the first made, in place.
        folder.told(&format!(
            "shade town.veduta {size} {look} {blue} --into old.{suffix} --window 0,0,30,47 -o half.{suffix}"
        ));
        assert!(folder.read(&format!("half.{suffix}")) != whole, "{suffix}");
        folder.told(&format!(
            "shade town.veduta {size} {look} {blue} --into half.{suffix} --window 30,0,99,99 -o half.{suffix}"
        ));
        assert!(folder.read(&format!("half.{suffix}")) == whole, "{suffix}");
    }
}

#[test]
fn objects_that_moved_are_made_again_where_they_were_as_well() {
    let folder = folder();
    folder.told("frames s.toml -o f.#.veduta --frames 1..2");
    folder.told("shade f.1.veduta -o one.npy");
    folder.told("shade f.2.veduta -o two.npy");
    let part = "shade f.2.veduta --into one.npy --objects box/**";
    folder.told(&format!("{part} -o ghost.npy"));
    folder.told(&format!("{part} --was f.1.veduta -o new.npy"));
    folder.told("diff two.npy new.npy --tolerance 1e-5");
    folder
        .veduta("diff two.npy ghost.npy --tolerance 1e-5")
        .assert()
        .code(1);
}

#[test]
fn parts_that_cannot_be_are_refused() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    folder.told("shade town.veduta -o old.png");
    folder.told("shade town.veduta -o old.exr");
    folder.told("shade town.veduta -o deep.exr --aov depth");
    let window = "--window 0,0,4,4";
    for (arguments, code, message) in [
        (
            format!("--into old.exr -o new.exr"),
            2,
            "--window, --objects or both",
        ),
        (
            format!("--into old.png {window} -o new.png"),
            2,
            "--exposure",
        ),
        (
            format!("--into old.exr {window} -o new.png --exposure 0"),
            2,
            "linear light",
        ),
        (
            format!("--into old.exr {window} -o new.exr --size 9x9"),
            2,
            "8 x 8 pixels",
        ),
        (
            format!("--into deep.exr {window} -o new.exr"),
            2,
            "would be lost: Z",
        ),
        (
            format!("--into old.exr {window} -o new.exr --aov depth"),
            2,
            "leave --aov out",
        ),
        (
            format!("--into old.exr {window} -o new.svg"),
            2,
            "leave --into out",
        ),
        (
            format!("--into old.exr --window 0.5,0,4,4 -o new.exr"),
            2,
            "whole pixels",
        ),
        (
            format!("--into old.exr --window 8,0,4,4 -o new.exr"),
            2,
            "outside",
        ),
        (
            format!("--into old.exr --objects bix -o new.exr"),
            3,
            "\"box\"",
        ),
        (
            format!("--into none.exr {window} -o new.exr"),
            6,
            "none.exr",
        ),
        (format!("--objects box -o new.exr"), 2, "--into"),
    ] {
        let output = folder
            .veduta(&format!("shade town.veduta {arguments}"))
            .assert()
            .code(code);
        let told = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
        assert!(told.contains(message), "{arguments}: {told}");
    }
    assert!(!folder.files().iter().any(|name| name.starts_with("new.")));
}
