//! Spans of multiscan, stored, scaled and composited beside exact maps.

use crate::Folder;
use predicates::str::contains;

/// A view from the side, so that edges cross rows.
const VIEW: &str = "--eye 3,-5,2 --look-at 0,0,0 --parallel 4 --size 40x30";

#[test]
fn stored_spans_give_the_picture_that_was_sampled() {
    let folder = Folder::new();
    let sampled = format!("render town.obj {VIEW} --sampling multiscan:4");
    folder.told(&format!("{sampled} -o expected.exr"));
    folder.told(&format!("{sampled} -o town.veduta"));
    for file in ["town.obj", "m.mtl"] {
        std::fs::remove_file(folder.path(file)).expect("is there");
    }
    let told = folder.json("shade town.veduta -o found.exr");
    assert_eq!(told["facesProjected"], 0, "nothing is found anew");
    assert!(folder.read("expected.exr") == folder.read("found.exr"));
    let told = folder.json("info town.veduta");
    assert_eq!(told["subScanlines"], 4);
    assert!(told["spans"].as_u64() > Some(50), "{told}");
    assert!(
        folder
            .told("check town.veduta")
            .contains("spans on 4 sub-scanlines a row")
    );
}

#[test]
fn scaled_spans_come_near_the_exact_picture_up_to_their_number() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {VIEW} -o exact.veduta"));
    folder.told(&format!(
        "render town.obj {VIEW} --sampling multiscan:8 -o spans.veduta"
    ));
    let off = |scale: &str| {
        for name in ["exact", "spans"] {
            folder.told(&format!(
                "shade {name}.veduta --scale {scale} --unlit -o {name}.exr"
            ));
        }
        let found = folder.json("diff exact.exr spans.exr --tolerance 10");
        found["max"].as_f64().expect("a number")
    };
    let [plain, wide, high] = ["1", "5,1", "1,8"].map(off);
    assert!(plain > 0.0 && plain < 0.3, "{plain}");
    assert!(wide < 0.5, "x is exact at any scale: {wide}");
    assert!(high > plain, "with one sub-scanline a row left: {high}");
    let refused = folder
        .veduta("shade spans.veduta --scale 1,8.5 -o a.exr")
        .assert()
        .code(2);
    refused.stderr(contains("up to 8 times as high"));
}

#[test]
fn spans_composite_with_spans_of_as_many_sub_scanlines() {
    let folder = Folder::new();
    folder.write(
        "box.obj",
        "mtllib m.mtl\no box\nusemtl blue\nv -1 -1 1\nv 0 -1 1\nv 0 0 1\nv -1 0 1\nf 1 2 3 4\n",
    );
    folder.write(
        "wall.obj",
        "mtllib m.mtl\no wall\nusemtl red\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n",
    );
    let sampled = format!("{VIEW} --sampling multiscan:4");
    folder.told(&format!("render town.obj {sampled} -o expected.exr"));
    for name in ["box", "wall"] {
        folder.told(&format!("render {name}.obj {sampled} -o {name}.veduta"));
    }
    folder.told("composite box.veduta wall.veduta -o both.veduta");
    folder.told("shade both.veduta -o stored.exr");
    folder.told("composite wall.veduta box.veduta -o found.exr");
    for found in ["stored.exr", "found.exr"] {
        let found = folder.json(&format!("diff expected.exr {found} --tolerance 10"));
        assert!(found["max"].as_f64().unwrap_or(0.0) < 1e-5, "{found}");
    }

    folder.told(&format!("render box.obj {VIEW} -o exact.veduta"));
    folder.told(&format!(
        "render box.obj {VIEW} --sampling multiscan:3 -o three.veduta"
    ));
    for (arguments, code, word) in [
        (
            "composite wall.veduta three.veduta -o a.png",
            4,
            "with 3 sub-scanlines instead of",
        ),
        (
            "composite wall.veduta exact.veduta -o a.png",
            2,
            "the same --sampling",
        ),
        (
            "composite wall.veduta box.veduta --only wall -o a.png",
            2,
            "not of spans",
        ),
        ("shade wall.veduta -o a.exr --deep", 2, "holds spans"),
        ("shade wall.veduta -o a.svg", 2, "holds spans"),
        ("info wall.veduta --pick 3,3", 2, "for maps of regions"),
    ] {
        let refused = folder.veduta(arguments).assert().code(code);
        refused.stderr(contains(word));
    }
}
