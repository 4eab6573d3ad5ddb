//! `veduta render --lens`: which pictures are made, what is told of them, and what is refused.

use crate::{Folder, png};
use predicates::str::contains;
use serde_json::json;

const BEFORE: &str = "--eye 0,-5,0 --look-at 0,0,0";

#[test]
fn a_dome_shows_what_is_ahead_at_its_lower_rim() {
    let folder = Folder::new();
    let told = folder.json(&format!(
        "render town.obj {BEFORE} --lens domemaster --size 64x64 --unlit -o dome.png"
    ));
    assert_eq!(told["lens"], json!("domemaster:180"));
    let faces = told["views"].as_array().expect("a list").iter();
    let faces: Vec<_> = faces.map(|view| view["side"].clone()).collect();
    assert_eq!(faces, ["front", "right", "back", "left", "up"]);
    let (width, height, pixels) = png(&folder.read("dome.png"));
    assert_eq!((width, height), (64, 64));
    let opacity = |x: usize, y: usize| pixels[y * 64 + x][3];
    // The wall's upper half, the zenith, and outside of the circle.
    assert_eq!(
        [opacity(32, 61), opacity(32, 32), opacity(0, 0)],
        [255, 0, 0]
    );
}

#[test]
fn filtered_pictures_and_crosses_are_made_too() {
    let folder = Folder::new();
    let told = folder.json(&format!(
        "render town.obj {BEFORE} --lens fisheye:90 --lens-filter ewa --size 32x32 --unlit -o a.png"
    ));
    assert_eq!(told["views"], json!(["front"]));
    folder.told(&format!(
        "render town.obj {BEFORE} --lens fisheye:90 --size 32x32 --unlit -o b.png"
    ));
    let [filtered, exact] = ["a.png", "b.png"].map(|name| png(&folder.read(name)).2);
    // In the wall, two pixels from its borders, where both are red all over.
    assert_eq!(
        [filtered, exact].map(|pixels| pixels[13 * 32 + 18]),
        [[255, 0, 0, 255]; 2]
    );

    folder.told(&format!(
        "render town.obj {BEFORE} --lens cube --size 64x48 --unlit -o cross.png"
    ));
    let (width, _, pixels) = png(&folder.read("cross.png"));
    // The front is the second square of the second row; the others see nothing.
    let is_seen = |x: usize, y: usize| pixels[y * width + x][3] > 0;
    assert!(is_seen(24, 24) && !is_seen(8, 24) && !is_seen(24, 8));
    let message = contains("its size is 64x48, for one");
    let refused = folder.veduta(&format!(
        "render town.obj {BEFORE} --lens cube --size 65x48 -o c.png"
    ));
    assert_refused(refused, 2, message);
}

#[test]
fn a_background_ends_where_the_lens_does() {
    let folder = Folder::new();
    let asked = format!("render town.obj {BEFORE} --lens domemaster --size 64x64 --unlit");
    folder.told(&format!("{asked} --background #fff -o dome.png"));
    let (_, _, pixels) = png(&folder.read("dome.png"));
    let pixel = |x: usize, y: usize| pixels[y * 64 + x];
    assert_eq!(pixel(32, 32), [255; 4]);
    assert_eq!([pixel(0, 0)[3], pixel(63, 63)[3]], [0, 0]);
    let rim = pixels.iter().filter(|pixel| (1..255).contains(&pixel[3]));
    assert!(rim.count() > 100, "the rim is smooth");
}

#[test]
fn a_panorama_says_that_it_is_one() {
    let folder = Folder::new();
    for (size, is_told) in [("64x32", true), ("64x48", false)] {
        for file in ["a.png", "a.jpg"] {
            folder.told(&format!(
                "render town.obj {BEFORE} --lens equirect --size {size} -o {file}"
            ));
            let bytes = folder.read(file);
            let found = bytes.windows(6).any(|part| part == b"GPano:");
            assert_eq!(found, is_told, "{size}, {file}");
        }
    }
    let refused = folder.veduta(&format!(
        "render town.obj {BEFORE} --lens cube -o side_{{side}}.png"
    ));
    assert_refused(refused, 2, contains("veduta dome CROSS --lens cube"));
}

fn assert_refused(
    mut command: assert_cmd::Command,
    code: i32,
    message: impl predicates::Predicate<str>,
) {
    command.assert().code(code).stderr(message);
}

#[test]
fn what_no_lens_makes_is_refused_before_the_work() {
    let folder = Folder::new();
    for (arguments, code, message) in [
        ("-o a.svg", 5, "vector pictures: not made by a lens"),
        ("-o a.veduta", 2, "put {side} into the name"),
        ("-o a.exr --deep", 5, "--deep: not made by a lens"),
        ("-o a.exr --aov depth", 5, "--aov: not made by a lens"),
        ("-o a.png --filter mitchell", 5, "--filter: not made"),
        ("-o a.png --sampling multiscan:2", 5, "multiscan: not made"),
        ("-o a.png --fov 40", 2, "--fov is of a frame"),
        ("-o a.png --parallel 4", 2, "--parallel is of a frame"),
    ] {
        let refused = folder.veduta(&format!("render town.obj --lens fisheye {arguments}"));
        assert_refused(refused, code, contains(message));
        assert!(
            !folder
                .path(arguments.split(' ').nth(1).expect("a file"))
                .exists()
        );
    }
    let refused = folder.veduta("render town.obj --lens fishbowl -o a.png");
    assert_refused(refused, 2, contains("there is no lens of that name"));
}

/// An eye between the two walls, near enough to the smaller one that several sides of a cube see both.
const BETWEEN: &str = "--eye 0.2,-0.6,0.3 --look-at 0.2,4,0.3";

/// Lenses whose pictures are made of the same maps.
const LENSES: [&str; 4] = ["domemaster", "equirect", "ball", "fisheye:200 --yaw 30deg"];

#[test]
fn stored_maps_make_the_pictures_of_the_scene_which_is_not_needed() {
    let folder = Folder::new();
    let whole = folder.json(&format!(
        "render town.obj {BETWEEN} --lens cube -o whole_{{side}}.veduta"
    ));
    assert_eq!(whole["views"].as_array().expect("a list").len(), 6);
    assert_eq!(whole["output"][4], json!("whole_up.veduta"));
    for (k, lens) in LENSES.into_iter().enumerate() {
        folder.told(&format!(
            "render town.obj {BETWEEN} --lens {lens} --size 64x48 --unlit -o {k}.pfm"
        ));
    }
    // Only what an Omnimax frame looks at: all of the picture, though not of the cube.
    let omnimax = "--lens omnimax --size 64x50 --unlit";
    let parts = folder.json(&format!(
        "render town.obj {BETWEEN} {omnimax} -o part_{{letter}}.veduta"
    ));
    folder.told(&format!(
        "render town.obj {BETWEEN} {omnimax} -o omnimax.pfm"
    ));
    let windows: Vec<_> = parts["views"].as_array().expect("a list").iter().collect();
    assert!(
        windows
            .iter()
            .any(|view| view["window"] != json!([0.0, 0.0, 1.0, 1.0]))
    );
    for file in ["town.obj", "m.mtl"] {
        std::fs::remove_file(folder.path(file)).expect("may remove it");
    }

    let sides =
        ["up", "left", "front", "back", "down", "right"].map(|s| format!("whole_{s}.veduta"));
    for (k, lens) in LENSES.into_iter().enumerate() {
        let told = folder.json(&format!(
            "shade {} --lens {lens} --size 64x48 --unlit --strict -o again.pfm",
            sides.join(" ")
        ));
        assert!(
            folder.read("again.pfm") == folder.read(&format!("{k}.pfm")),
            "{lens}"
        );
        assert_eq!(
            [
                &told["facesProjected"],
                &told["facesClipped"],
                &told["unseen"]
            ],
            [&json!(0), &json!(0), &json!(0.0)]
        );
    }
    let kept: Vec<String> = parts["output"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|name| name.as_str().expect("a name").to_owned())
        .collect();
    let kept = kept.join(" ");
    folder.told(&format!("shade {kept} {omnimax} --strict -o again.pfm"));
    assert!(folder.read("again.pfm") == folder.read("omnimax.pfm"));

    // In another colour, which the maps of sides that do not show it do not know.
    let set = r#"--set material."red".color=#0f0"#;
    folder.told(&format!(
        "shade {} --lens fisheye:90 --size 32x32 --unlit {set} -o green.png",
        sides.join(" ")
    ));
    let (_, _, pixels) = png(&folder.read("green.png"));
    assert!(pixels.contains(&[0, 255, 0, 255]) && !pixels.contains(&[255, 0, 0, 255]));
    let refused = folder.veduta(&format!(
        "shade {kept} {omnimax} --strict --set material.\"rot\".color=#0f0 -o a.png"
    ));
    assert_refused(refused, 4, contains("no material is called"));
}

#[test]
fn what_no_map_shows_is_told_and_other_eyes_are_refused() {
    let folder = Folder::new();
    folder
        .told("render town.obj --eye 0,-5,0 --look-at 0,0,0 --fov 60 --size 64x48 -o ahead.veduta");
    folder.told(
        "render town.obj --eye 0,-5,0 --look-at 1,0,0.3 --fov 50 --size 64x48 -o aside.veduta",
    );
    folder.told("render town.obj --eye 0,-4.5,0 --look-at 0,0,0 --size 64x48 -o other.veduta");
    folder.told(
        "render town.obj --eye 0,-5,0 --look-at 0,0,0 --parallel 4 --size 64x48 -o parallel.veduta",
    );
    // A frame wider than the lens: nothing is missing.
    let told = folder.json("shade ahead.veduta --lens fisheye:50 --size 32x32 -o a.png");
    assert_eq!(told["unseen"], json!(0.0));
    // Two frames that overlap show no direction twice.
    let told = folder
        .json("shade ahead.veduta aside.veduta --lens fisheye:90 --size 64x64 --unlit -o a.exr");
    let warnings = told["warnings"].as_array().expect("a list");
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0]
            .as_str()
            .expect("text")
            .contains("% of the picture")
    );
    let unseen = told["unseen"].as_f64().expect("a number");
    assert!((0.1..0.9).contains(&unseen), "{unseen}");
    folder.told("shade ahead.veduta aside.veduta --lens fisheye:90 --look-at 0,0,0 --size 64x64 --unlit -o a.png");
    folder.told("render town.obj --eye 0,-5,0 --look-at 0,0,0 --lens fisheye:90 --size 64x64 --unlit -o b.png");
    let [both, all] = ["a.png", "b.png"].map(|name| png(&folder.read(name)).2);
    // All of the walls is in one of the two.
    let differ = both
        .iter()
        .zip(&all)
        .filter(|(a, b)| a.iter().zip(&b[..]).any(|(a, b)| a.abs_diff(*b) > 1));
    assert_eq!(differ.count(), 0);

    for (arguments, code, message) in [
        ("ahead.veduta --lens fisheye:90 --strict", 4, "--strict"),
        (
            "ahead.veduta other.veduta --lens fisheye:90",
            4,
            "stands 0.5 m away",
        ),
        (
            "ahead.veduta parallel.veduta --lens fisheye:90",
            4,
            "projects in parallel",
        ),
        ("ahead.veduta aside.veduta", 2, "one map is shown at a time"),
        ("ahead.veduta --lens cube", 2, "sides of a cube already"),
        (
            "ahead.veduta --lens fisheye:90 --scale 2",
            2,
            "--scale and --window",
        ),
        (
            "ahead.veduta --lens fisheye:90 --filter mitchell",
            5,
            "--filter: not made",
        ),
        ("ahead.veduta --look-at 0,0,0", 2, "--lens"),
        (
            "ahead.veduta --lens fisheye:90 --look-at 0,-5,0",
            2,
            "define no direction",
        ),
    ] {
        let refused = folder.veduta(&format!("shade {arguments} --unlit -o refused.png"));
        assert_refused(refused, code, contains(message));
        assert!(!folder.path("refused.png").exists());
    }
    // Names that are those of sides, of cameras that are not.
    std::fs::rename(folder.path("ahead.veduta"), folder.path("front.veduta")).expect("may");
    std::fs::rename(folder.path("aside.veduta"), folder.path("right.veduta")).expect("may");
    let refused = folder.veduta("shade front.veduta right.veduta --lens fisheye:90 -o refused.png");
    assert_refused(
        refused,
        4,
        contains("say where the lens looks with --look-at"),
    );
    folder.told("shade front.veduta right.veduta --lens fisheye:90 --look-at 0,0,0 -o a.png");
}
