//! `veduta render --deep` and `veduta shade --deep`: deep pictures as users meet them.

use crate::{FACING, Folder};
use predicates::str::contains;

#[test]
fn a_deep_picture_lays_flat_to_the_flat_one() {
    let folder = Folder::new();
    // A view from the side, so that edges cross pixels.
    for view in [FACING, "--eye 3,-5,2 --size 61x47"] {
        let render = format!("render town.obj {view}");
        folder.told(&format!("{render} -o flat.exr"));
        for (how, most) in [
            ("", 1e-6),
            ("--compression rle", 1e-6),
            ("--compression none --unlit", f64::INFINITY),
            ("--depth half", 1e-3),
        ] {
            let made = folder.json(&format!("{render} -o deep.exr --deep {how}"));
            assert!(made["samples"].as_u64() > Some(0), "{how}: {made}");
            let found = folder.json("diff flat.exr deep.exr --tolerance 10");
            let largest = found["max"].as_f64().unwrap_or(0.0);
            assert!(largest <= most, "{view} {how}: {found}");
        }
    }
}

#[test]
fn a_stored_map_gives_the_deep_picture_of_its_scene() {
    let folder = Folder::new();
    for view in [FACING, "--eye 3,-5,2 --size 61x47"] {
        let render = format!("render town.obj {view}");
        folder.told(&format!("{render} -o expected.exr --deep"));
        folder.told(&format!("{render} -o town.veduta --force"));
        let told = folder.json("shade town.veduta -o found.exr --deep");
        assert!(told["samples"].as_u64() > Some(0), "{told}");
        assert_eq!(told["facesProjected"], 0, "nothing is found anew");
        assert!(
            folder.read("expected.exr") == folder.read("found.exr"),
            "{view}"
        );
    }
    // A part of it, enlarged, in another colour.
    let part = "--scale 2.5 --window 20.5,30,70,50 --set material.red.color=#446";
    folder.told(&format!("shade town.veduta {part} -o flat.exr"));
    folder.told(&format!("shade town.veduta {part} -o deep.exr --deep"));
    let found = folder.json("diff flat.exr deep.exr --tolerance 10");
    assert!(found["max"].as_f64().unwrap_or(0.0) < 1e-6, "{found}");
    for (arguments, word) in [
        ("-o a.png --deep", "stored as .exr"),
        ("-o a.svg --deep", "stored as .exr"),
        ("-o a.exr --deep --tone none", "--tone"),
        ("-o a.exr --deep --filter triangle", "leave --filter out"),
    ] {
        let mut refused = folder.veduta(&format!("shade town.veduta {arguments}"));
        refused.assert().code(2).stderr(contains(word));
    }
}

#[test]
fn openimageio_lays_our_deep_pictures_flat_as_we_do() {
    let folder = Folder::new();
    folder.told("render town.obj --eye 3,-5,2 --size 61x47 -o town.veduta");
    folder.told("shade town.veduta -o flat.exr");
    for how in ["zips", "rle", "none"] {
        folder.told(&format!(
            "shade town.veduta -o deep.exr --deep --compression {how}"
        ));
        let flatten = std::process::Command::new("oiiotool")
            .current_dir(folder.place())
            .args([
                "deep.exr",
                "--flatten",
                "--ch",
                "R,G,B,A",
                "-d",
                "float",
                "-o",
                "theirs.exr",
            ])
            .output();
        let flatten = match flatten {
            Ok(flatten) => flatten,
            Err(error) => {
                println!("skipped: oiiotool, of OpenImageIO, cannot be run: {error}");
                return;
            }
        };
        let said = String::from_utf8_lossy(&flatten.stderr).into_owned();
        assert!(flatten.status.success(), "{how}: {said}");
        let found = folder.json("diff flat.exr theirs.exr --tolerance 10");
        assert!(
            found["max"].as_f64().expect("a number") < 1e-5,
            "{how}: {found}"
        );
    }
}

#[test]
fn of_each_pixel_every_face_is_a_sample() {
    let folder = Folder::new();
    // Four by four pixels of wall, of which two by two are behind the box; all faces fill their pixels.
    let made = folder.json(&format!("render town.obj {FACING} --deep -o deep.exr"));
    assert_eq!(made["samples"], 16);
    // Between the pixels' borders: two pixels each way have an edge in them, and where box and wall
    // share a pixel it has both.
    let moved = "--eye 0.1,-5,0.1 --look-at 0.1,0,0.1 --parallel 4 --size 8x8";
    let made = folder.json(&format!("render town.obj {moved} --deep -o deep.exr"));
    assert!(made["samples"].as_u64() > Some(25), "{made}");
}

#[test]
fn a_pipe_gets_the_same_bytes_as_a_file() {
    let folder = Folder::new();
    let render = format!("render town.obj {FACING} --deep");
    folder.told(&format!("{render} -o deep.exr"));
    let piped = folder
        .veduta(&format!("{render} -o - --format exr"))
        .output();
    let piped = piped.expect("it runs").stdout;
    assert!(piped == folder.read("deep.exr"));
}

#[test]
fn what_a_deep_picture_cannot_be_is_refused_before_the_work() {
    let folder = Folder::new();
    for (arguments, word) in [
        ("-o a.png --deep", "stored as .exr"),
        ("-o a.exr --deep --tile 16", "leave --tile out"),
        ("-o a.exr --deep --compression piz", "zips, rle or none"),
        ("-o a.exr --deep --sampling multiscan:2", "exact areas"),
        ("-o a.exr --deep --background #ffffff", "--background"),
        ("-o a.exr --deep --exposure 1", "--exposure"),
        ("-o a.veduta --deep", ".veduta"),
    ] {
        folder
            .veduta(&format!("render town.obj {FACING} {arguments}"))
            .assert()
            .code(2)
            .stderr(contains(word));
    }
    assert_eq!(folder.files(), ["m.mtl", "town.obj"]);
}

#[test]
fn a_damaged_deep_picture_is_told_with_its_place() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} --deep -o deep.exr"));
    let sound = folder.read("deep.exr");
    folder.write("cut.exr", &sound[..sound.len() - 1]);
    folder
        .veduta("info cut.exr")
        .assert()
        .code(4)
        .stderr(contains("cut.exr: is damaged in part 0, chunk"));
}
