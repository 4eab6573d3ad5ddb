//! Stored maps: made, shaded, composited, looked into, refused.

use crate::{FACING, Folder, png};
use serde_json::json;

/// The model's two squares in files of their own.
fn folder_of_two() -> Folder {
    let folder = Folder::new();
    let [wall, square] = [[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]].map(|[low, high, z]| {
        let corners = [[low, low], [high, low], [high, high], [low, high]];
        let rows = corners.map(|[x, y]| format!("v {x} {y} {z}\n"));
        format!("{}f 1 2 3 4\n", rows.concat())
    });
    folder.write(
        "wall.obj",
        format!("mtllib m.mtl\no wall\nusemtl red\n{wall}"),
    );
    folder.write(
        "box.obj",
        format!("mtllib m.mtl\no box\nusemtl blue\n{square}"),
    );
    for name in ["wall", "box"] {
        folder.told(&format!("render {name}.obj {FACING} -o {name}.veduta"));
    }
    folder
}

#[test]
fn a_map_gives_the_picture_without_the_scene() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o expected.png"));
    let made = folder.json(&format!("render town.obj {FACING} -o town.veduta"));
    assert_eq!(
        (&made["facesSeen"], &made["facesProjected"]),
        (&json!(2), &json!(2))
    );
    for file in ["town.obj", "m.mtl"] {
        std::fs::remove_file(folder.path(file)).expect("is there");
    }
    let told = folder.json("shade town.veduta -o found.png");
    assert_eq!(told["facesProjected"], 0, "nothing is found anew");
    assert_eq!(told["facesClipped"], 0, "nothing is found anew");
    assert!(folder.read("expected.png") == folder.read("found.png"));
}

#[test]
fn a_scaled_window_is_cut_from_the_scaled_picture() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    let unlit = "--unlit --background #000";
    folder.told(&format!(
        "shade town.veduta --scale 3,0.5 {unlit} -o whole.npy"
    ));
    // As stretched as the picture, which is not square any more.
    folder.told(&format!(
        "shade town.veduta --size 24x4 {unlit} -o same.npy"
    ));
    assert!(folder.read("whole.npy") == folder.read("same.npy"));
    folder.told(&format!("shade town.veduta --scale 2 {unlit} -o whole.png"));
    folder.told(&format!(
        "shade town.veduta --scale 2 --window 5,7,6,4 {unlit} -o part.png"
    ));
    let (width, _, whole) = png(&folder.read("whole.png"));
    let (part_width, part_height, part) = png(&folder.read("part.png"));
    assert_eq!((width, part_width, part_height), (16, 6, 4));
    for (index, pixel) in part.into_iter().enumerate() {
        let (x, y) = (5 + index % 6, 7 + index / 6);
        assert_eq!(pixel, whole[y * width + x], "{x}, {y}");
    }
}

#[test]
fn a_window_is_exposed_as_the_whole_and_knows_what_is_beside_it() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    let whole = folder.json("shade town.veduta -o whole.png");
    // The right end, where the box is not seen.
    let part = folder.json(
        "shade town.veduta --window 5,0,3,8 --set material.blue.color=#0f0 --strict -o part.png",
    );
    let recoloured = folder.json("shade town.veduta --set material.blue.color=#0f0 -o other.png");
    assert_eq!(part["warnings"], json!([]));
    assert_eq!(part["exposure"], recoloured["exposure"]);
    let part = folder.json("shade town.veduta --window 5,0,3,8 -o part.png");
    assert_eq!(part["exposure"], whole["exposure"]);
    let [(width, _, whole), (part_width, _, part)] =
        ["whole.png", "part.png"].map(|name| png(&folder.read(name)));
    for (index, pixel) in part.into_iter().enumerate() {
        let (x, y) = (5 + index % part_width, index / part_width);
        assert_eq!(pixel, whole[y * width + x], "{x}, {y}");
    }
    let told = folder.json("shade town.veduta --window 999,0,3,8 -o nothing.png");
    let warnings = told["warnings"].to_string();
    assert!(warnings.contains("nothing is seen"), "{warnings}");
}

#[test]
fn objects_of_deep_pictures_are_chosen_by_their_names() {
    let folder = folder_of_two();
    folder.told(&format!(
        "render box.obj {FACING} --unlit -o deep.exr --deep"
    ));
    let asked = "composite wall.veduta deep.exr --depth-kind planar --unlit";
    folder.told("shade wall.veduta --unlit -o wall.exr");
    folder.told(&format!("{asked} -o both.exr"));
    folder.told(&format!("{asked} --without box -o without.exr"));
    assert!(folder.read("without.exr") == folder.read("wall.exr"));
    assert!(folder.read("both.exr") != folder.read("wall.exr"));
    folder.told(&format!("{asked} --only box -o only.exr"));
    let told = folder.json("composite deep.exr --unlit -o deep-alone.exr");
    assert_eq!(told["warnings"], json!([]));
    let found = folder.json("diff only.exr deep-alone.exr --tolerance 10");
    assert_eq!(found["equal"], true, "{found}");
    for (asked, code, message) in [
        ("--only bx", 3, "did you mean \"box\"?"),
        ("--matte box", 5, "hide by depth only"),
    ] {
        folder
            .veduta(&format!("composite wall.veduta deep.exr {asked} -o x.exr"))
            .assert()
            .code(code)
            .stderr(predicates::str::contains(message));
    }
}

#[test]
fn materials_change_as_in_a_scene_file() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    folder.write("change.toml", "[material.\"r*\"]\ncolor = [0, 1, 0]\n");
    folder.write("m.mtl", "newmtl red\nKd 0 1 0\nnewmtl blue\nKd 1 1 0\n");
    folder.told(&format!("render town.obj {FACING} --unlit -o expected.png"));
    folder.told(
        "shade town.veduta --unlit --changes change.toml --set material.blue.color=#ff0 -o found.png",
    );
    assert!(folder.read("expected.png") == folder.read("found.png"));

    let failed = folder.veduta("shade town.veduta --set material.red.colour=#ff0 -o a.png");
    let text = failed.error_of(4);
    assert!(
        text.contains("--set:1:14") && text.contains("\"color\""),
        "{text}"
    );
}

#[test]
fn maps_composite_to_what_both_scenes_show() {
    let folder = folder_of_two();
    folder.told(&format!("render town.obj {FACING} -o expected.png"));
    for order in ["wall.veduta box.veduta", "box.veduta wall.veduta"] {
        folder.told(&format!("composite {order} -o found.png"));
        assert!(
            folder.read("expected.png") == folder.read("found.png"),
            "{order}"
        );
        let told = folder.json(&format!("composite {order} -o both.veduta --force"));
        assert_eq!(told["facesProjected"], 0);
        folder.told("shade both.veduta -o found.png");
        assert!(
            folder.read("expected.png") == folder.read("found.png"),
            "{order}"
        );
    }
}

#[test]
fn a_holdout_leaves_a_hole_and_a_selection_what_was_asked_for() {
    let folder = folder_of_two();
    let show = |arguments: &str| {
        folder.told(&format!("composite {arguments} --unlit -o found.png"));
        png(&folder.read("found.png")).2
    };
    let held_out = show("wall.veduta --holdout box.veduta");
    let red = |pixels: &[[u8; 4]]| pixels.iter().filter(|p| **p == [255, 0, 0, 255]).count();
    assert_eq!(
        red(&held_out),
        12,
        "a quarter of the wall's 16 pixels is hidden"
    );
    assert_eq!(held_out.iter().filter(|pixel| pixel[3] == 0).count(), 52);
    assert_eq!(red(&show("wall.veduta box.veduta --only wall")), 16);
    assert_eq!(red(&show("wall.veduta box.veduta --without b*")), 16);
    let text = folder
        .veduta("composite wall.veduta --only wal -o a.png")
        .error_of(3);
    assert!(text.contains("did you mean \"wall\"?"), "{text}");
}

#[test]
fn maps_of_other_cameras_are_refused_with_the_difference() {
    let folder = folder_of_two();
    folder.told("render box.obj --eye 0,-5,1 --look-at 0,0,1 --parallel 4 --size 8x8 -o b.veduta");
    let text = folder
        .veduta("composite wall.veduta b.veduta -o a.png")
        .error_of(4);
    assert!(text.contains("its eye stands at"), "{text}");
    assert!(!folder.path("a.png").exists());
}

#[test]
fn a_map_is_replaced_only_when_told_and_damage_is_found() {
    let folder = Folder::new();
    let render = format!("render town.obj {FACING} -o town.veduta");
    folder.told(&render);
    let text = folder.veduta(&render).error_of(2);
    assert!(text.contains("--force"), "{text}");
    let sound = folder.read("town.veduta");
    folder.told(&format!("{render} --force"));
    assert!(
        folder.read("town.veduta") == sound,
        "equal maps are equal files"
    );
    assert!(folder.told("check town.veduta").contains("2 faces seen"));
    assert!(folder.told("info town.veduta").contains("town.obj"));
    let picked = folder.json("info town.veduta --pick 2,5");
    assert_eq!(picked["seen"]["object"], "box");

    let mut damaged = sound;
    damaged[700] ^= 4;
    folder.write("town.veduta", &damaged);
    let text = folder.veduta("shade town.veduta -o a.png").error_of(4);
    assert!(text.contains("town.veduta: damaged in"), "{text}");
    folder.veduta("check town.veduta").assert().code(1);
    folder.write("town.veduta", "no map at all");
    let text = folder.veduta("shade town.veduta -o a.png").error_of(4);
    assert!(text.contains("not a visibility map"), "{text}");
}

/// A command that fails, and what it says then.
trait Fails {
    fn error_of(self, code: i32) -> String;
}

impl Fails for assert_cmd::Command {
    fn error_of(mut self, code: i32) -> String {
        let failed = self.assert().code(code);
        String::from_utf8(failed.get_output().stderr.clone()).expect("text")
    }
}

#[test]
fn operators_keep_what_lies_in_out_of_and_on_another_map() {
    let folder = folder_of_two();
    let show = |arguments: &str| {
        folder.told(&format!("composite {arguments} --unlit -o found.png"));
        png(&folder.read("found.png")).2
    };
    let (red, blue) = ([255, 0, 0, 255], [0, 0, 255, 255]);
    let count = |pixels: &[[u8; 4]], color| pixels.iter().filter(|p| **p == color).count();
    let [wall, square] = ["wall", "box"].map(|name| show(&format!("{name}.veduta")));
    let [wall, square] = [count(&wall, red), count(&square, blue)];
    // The square lies before a quarter of the wall.
    let inside = show("wall.veduta --in box.veduta");
    assert_eq!([count(&inside, red), count(&inside, blue)], [square, 0]);
    let outside = show("wall.veduta --out box.veduta");
    assert_eq!(
        [count(&outside, red), count(&outside, blue)],
        [wall - square, 0]
    );
    let atop = show("box.veduta --atop wall.veduta");
    assert_eq!(
        [count(&atop, red), count(&atop, blue)],
        [wall - square, square]
    );
    let matte = show("wall.veduta box.veduta --matte box");
    assert_eq!(
        [count(&matte, red), count(&matte, blue)],
        [wall - square, 0]
    );
    let behind = show("wall.veduta --background box.veduta");
    assert_eq!([count(&behind, red), count(&behind, blue)], [wall, 0]);
    // Stored, it is still a matte, and holes are still holes.
    folder.told("composite box.veduta --matte box -o matte.veduta");
    let through = show("wall.veduta matte.veduta");
    assert_eq!(
        [count(&through, red), count(&through, blue)],
        [wall - square, 0]
    );
    folder.told("composite box.veduta --out box.veduta -o none.veduta");
    let through = show("wall.veduta none.veduta");
    assert_eq!(count(&through, red), wall);
    folder.told("shade wall.veduta --unlit --background box.veduta -o found.png");
    assert!(png(&folder.read("found.png")).2 == behind);
    let refused = folder.veduta("render wall.obj --background box.veduta -o a.png");
    assert!(refused.error_of(2).contains("composite"));
}

#[test]
fn maps_of_other_cameras_are_taken_only_on_trust() {
    let folder = folder_of_two();
    folder.told("render box.obj --eye 3,-4,9 --fov 50deg --size 8x8 -o other.veduta");
    folder.told("render wall.obj --eye 0,-9,9 --fov 30deg --size 8x8 -o wall.veduta --force");
    let refused = folder.veduta("composite wall.veduta other.veduta -o a.png");
    let text = refused.error_of(4);
    assert!(
        text.contains("other.veduta") && text.contains("--trust-camera"),
        "{text}"
    );
    let refused = folder.veduta("shade wall.veduta --background other.veduta -o a.png");
    assert!(refused.error_of(4).contains("--trust-camera"));
    folder.told("shade other.veduta --unlit -o expected.png");
    folder.told(
        "composite wall.veduta other.veduta --without wall --trust-camera --unlit -o found.png",
    );
    assert!(folder.read("found.png") == folder.read("expected.png"));
}

#[test]
fn pictures_of_other_programs_composite_by_depth_and_are_stored() {
    let folder = folder_of_two();
    folder.told("composite wall.veduta box.veduta --unlit -o expected.exr");
    folder.told(&format!(
        "render box.obj {FACING} --unlit -o box.exr --aov depth"
    ));
    folder.told(&format!(
        "render box.obj {FACING} --unlit -o deep.exr --deep"
    ));
    for (guest, kind) in [
        ("box.exr", "picture with depths"),
        ("deep.exr", "deep picture"),
    ] {
        let asked = format!("composite wall.veduta {guest} --depth-kind planar --unlit");
        let told = folder.json(&format!("{asked} -o found.exr"));
        let inputs = &told["inputs"];
        assert_eq!(inputs[0]["exactness"], "exact");
        assert_eq!(
            (&inputs[1]["file"], &inputs[1]["kind"]),
            (&json!(guest), &json!(kind))
        );
        assert_eq!(
            told["warnings"],
            json!([]),
            "they tell the camera, and the kind was told"
        );
        folder.told("diff expected.exr found.exr --tolerance 1e-5");
        folder.told(&format!("{asked} -o kept.veduta --force"));
        folder.told("check kept.veduta");
        folder.told("shade kept.veduta --unlit -o again.exr");
        assert!(folder.read("again.exr") == folder.read("found.exr"));
        let told = folder.json("info kept.veduta");
        assert_eq!(told["guests"][0]["name"], guest);
        folder.told(&format!(
            "composite {guest} --holdout wall.veduta --depth-kind planar -o a.exr"
        ));
    }
    // Two guests without a map.
    folder.told("composite deep.exr box.exr --depth-kind planar -o found.exr");
    // A card before and behind; the eye is 5 m before the wall.
    folder.told(&format!("render box.obj {FACING} --unlit -o box.png"));
    let blue = |arguments: &str| {
        folder.told(&format!("composite {arguments} --unlit -o found.png"));
        let pixels = png(&folder.read("found.png")).2;
        pixels
            .iter()
            .filter(|pixel| **pixel == [0, 0, 255, 255])
            .count()
    };
    assert!(blue("wall.veduta box.png@4m") > 0);
    assert_eq!(blue("wall.veduta box.png@6m"), 0);

    for (arguments, code, words) in [
        ("wall.veduta box.png", 2, "box.png@12m"),
        ("wall.veduta box.png@far", 2, "after @"),
        ("wall.veduta box.exr --depth-kind ndc", 2, "--depth-near"),
        ("wall.veduta box.exr --depth-near 1", 2, "ndc"),
        ("wall.veduta expected.exr", 4, "no channel of depth"),
        ("wall.veduta --in kept.veduta", 5, "kept.veduta"),
        (
            "kept.veduta --background wall.veduta",
            5,
            "pictures of other programs",
        ),
    ] {
        let refused = folder.veduta(&format!("composite {arguments} -o a.png"));
        let text = refused.error_of(code);
        assert!(text.contains(words), "{arguments}: {text}");
    }
    folder.told("render box.obj --eye 0,-5,0.5 --look-at 0,0,0 --parallel 4 --size 8x8 -o other.exr --aov depth");
    let refused = folder.veduta("composite wall.veduta other.exr -o a.png");
    assert!(refused.error_of(4).contains("--trust-camera"));
    folder.told(
        &format!("render box.obj {FACING} --size 8x6 -o flat.exr --aov depth")
            .replace("--size 8x8 ", ""),
    );
    let refused = folder.veduta("composite wall.veduta flat.exr -o a.png");
    assert!(refused.error_of(4).contains("same camera"));
}
