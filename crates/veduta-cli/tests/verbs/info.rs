use crate::{FACING, Folder};
use serde_json::json;

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
