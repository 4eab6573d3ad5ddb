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
    let faces: Vec<_> = faces.map(|view| view["face"].clone()).collect();
    assert_eq!(faces, ["front", "right", "back", "left", "top"]);
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
        (
            "-o a.veduta",
            5,
            "stored maps (.veduta): not made by a lens",
        ),
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
