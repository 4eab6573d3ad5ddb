use crate::{FACING, Folder, png};
use serde_json::json;

#[test]
fn equal_pictures_are_equal_and_others_are_measured() {
    let folder = Folder::new();
    let render = format!("render town.obj {FACING} --unlit");
    folder.told(&format!("{render} -o a.npy"));
    folder.told(&format!("{render} -o b.npy --background #000"));
    assert_eq!(folder.told("diff a.npy a.npy"), "equal: all 64 pixels\n");

    folder.veduta("diff a.npy b.npy").assert().code(1);
    let found = folder.json("diff a.npy b.npy --tolerance 1");
    assert_eq!(found["space"], "linear light");
    assert_eq!(
        (&found["differing"], &found["max"]),
        (&json!(48), &json!(1.0))
    );
    assert_eq!(found["maxAt"], json!([0, 0]));
    // Opacity differs by 1 in 48 of 64 pixels, colour in none.
    assert_eq!(found["mean"], json!(48.0 / 256.0));
    assert_eq!(found["rmse"], json!((48.0_f64 / 256.0).sqrt()));
    assert_eq!(found["equal"], true, "within the tolerance");
}

#[test]
fn the_heat_picture_shows_where() {
    let folder = Folder::new();
    let render = format!("render town.obj {FACING} --unlit --background #000");
    folder.told(&format!("{render} -o a.png"));
    folder.write("m.mtl", "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 1 1\n");
    folder.told(&format!("{render} -o b.png"));
    folder
        .veduta("diff a.png b.png -o heat.png")
        .assert()
        .code(1);
    let (width, _, pixels) = png(&folder.read("heat.png"));
    for (index, pixel) in pixels.into_iter().enumerate() {
        let (x, y) = (index % width, index / width);
        let changed = (2..4).contains(&x) && (4..6).contains(&y);
        let [r, g, b, _] = pixel;
        if changed {
            assert_eq!(pixel, [255; 4], "{x}, {y}: the largest difference");
        } else {
            assert!(r == g && g == b && r < 100, "{x}, {y}: {pixel:?}");
        }
    }
}

#[test]
fn other_sizes_differ_and_files_that_are_no_pictures_are_refused() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o a.png"));
    folder.told("render town.obj --size 9x8 -o b.png");
    let differ = folder.veduta("diff a.png b.png").assert().code(1);
    assert_eq!(
        differ.get_output().stdout,
        b"sizes differ: 8 x 8 and 9 x 8 pixels\n"
    );
    folder
        .veduta("diff a.png b.png -o heat.png")
        .assert()
        .code(2);
    folder.veduta("diff a.png town.obj").assert().code(5);
    folder.veduta("diff a.png gone.png").assert().code(6);
    folder
        .veduta("diff a.png b.png --tolerance -1")
        .assert()
        .code(2);
}
