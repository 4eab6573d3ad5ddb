//! What casts shadows of a stored map: told, kept, checked.

use crate::{FACING, Folder};
use predicates::str::contains;
use serde_json::json;

#[test]
fn a_map_names_all_files_of_its_scene_or_keeps_it_whole() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    let told = folder.json("info town.veduta");
    assert_eq!(told["sources"], json!(["town.obj", "m.mtl"]));
    let again = json!({ "embedded": false, "readAgain": ["town.obj"] });
    assert_eq!(told["casters"], again);
    assert!(
        folder
            .told("info town.veduta")
            .contains("casters   read again from town.obj")
    );

    folder.told(&format!(
        "render town.obj {FACING} -o whole.veduta --self-contained"
    ));
    let told = folder.json("info whole.veduta");
    assert_eq!(
        told["casters"],
        json!({ "embedded": true, "readAgain": [] })
    );
    assert!(
        folder
            .told("info whole.veduta")
            .contains("casters   kept in the file")
    );
    for file in ["town.obj", "m.mtl"] {
        std::fs::remove_file(folder.path(file)).expect("is there");
    }
    folder.told("check town.veduta whole.veduta");
    // What is seen is the same.
    for name in ["town", "whole"] {
        folder.told(&format!("shade {name}.veduta -o {name}.png"));
    }
    assert!(folder.read("town.png") == folder.read("whole.png"));
}

#[test]
fn sources_that_are_not_as_they_were_are_named() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    folder.told("check --sources town.veduta");
    folder.write("m.mtl", "newmtl red\nKd 0 1 0\n");
    std::fs::remove_file(folder.path("town.obj")).expect("is there");
    folder.told("check town.veduta");
    let failed = folder
        .veduta("check --sources town.veduta")
        .assert()
        .code(1);
    let failed = failed.stdout(contains("m.mtl: has changed since"));
    failed.stdout(contains("town.obj: is needed"));
}

#[test]
fn a_composite_keeps_what_casts_of_all() {
    let folder = Folder::new();
    for name in ["wall", "box"] {
        folder.write(&format!("{name}.obj"), folder.read("town.obj"));
    }
    folder.told(&format!(
        "render wall.obj {FACING} -o wall.veduta --self-contained"
    ));
    folder.told(&format!(
        "render box.obj {FACING} -o box.veduta --self-contained"
    ));
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    let casters = |maps: &str| {
        folder.told(&format!("composite {maps} -o all.veduta --force"));
        folder.told("check --sources all.veduta");
        folder.json("info all.veduta")["casters"].clone()
    };
    let both = casters("wall.veduta box.veduta");
    assert_eq!(both, json!({ "embedded": true, "readAgain": [] }));
    let mixed = casters("wall.veduta town.veduta");
    assert_eq!(
        mixed,
        json!({ "embedded": true, "readAgain": ["town.obj"] })
    );
    let again = casters("town.veduta --without box");
    assert_eq!(
        again,
        json!({ "embedded": false, "readAgain": ["town.obj"] })
    );
    // From another folder files are found from there.
    std::fs::create_dir(folder.path("maps")).expect("may write in the test's folder");
    folder.told("composite wall.veduta town.veduta -o maps/all.veduta");
    let told = folder.json("info maps/all.veduta");
    let sources = json!(["../wall.obj", "../m.mtl", "../town.obj"]);
    assert_eq!(told["sources"], sources);
    folder.told("check --sources maps/all.veduta");
}

#[test]
fn a_picture_does_not_hold_its_scene() {
    let folder = Folder::new();
    for output in ["a.png", "a.svg"] {
        let arguments = format!("render town.obj {FACING} -o {output} --self-contained");
        let refused = folder.veduta(&arguments).assert().code(2);
        refused.stderr(contains("--self-contained is for .veduta"));
    }
}
