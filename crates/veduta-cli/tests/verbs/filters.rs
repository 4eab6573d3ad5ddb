//! `--filter`: pixels weighed by kernels, as users meet them.

use crate::{FACING, Folder, png};
use predicates::str::contains;

#[test]
fn a_filter_looks_beyond_the_window() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    let look = "--scale 2 --unlit --background #000 --filter mitchell";
    folder.told(&format!("shade town.veduta {look} -o whole.png"));
    // Its left side is the right side of the blue square, whose region is not in the window.
    folder.told(&format!(
        "shade town.veduta {look} --window 8,9,3,2 -o part.png"
    ));
    let (width, _, whole) = png(&folder.read("whole.png"));
    let (part_width, part_height, part) = png(&folder.read("part.png"));
    assert_eq!((width, part_width, part_height), (16, 3, 2));
    assert!(part[0][2] > 9, "some blue: {:?}", part[0]);
    for (index, pixel) in part.into_iter().enumerate() {
        let (x, y) = (8 + index % 3, 9 + index / 3);
        assert_eq!(pixel, whole[y * width + x], "{x}, {y}");
    }
}

#[test]
fn the_box_is_the_usual_filter_and_all_verbs_know_the_others() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    folder.told(&format!("render town.obj {FACING} -o usual.png"));
    folder.told(&format!("render town.obj {FACING} -o box.png --filter box"));
    assert!(folder.read("usual.png") == folder.read("box.png"));
    for filter in [
        "triangle",
        "gaussian",
        "mitchell",
        "catmull-rom",
        "b-spline",
    ] {
        folder.told(&format!(
            "render town.obj {FACING} -o rendered.npy --filter {filter}"
        ));
        folder.told(&format!(
            "shade town.veduta -o shaded.npy --filter {filter}"
        ));
        folder.told(&format!(
            "composite town.veduta -o composed.npy --filter {filter}"
        ));
        let rendered = folder.read("rendered.npy");
        assert!(rendered == folder.read("shaded.npy"), "{filter}");
        assert!(rendered == folder.read("composed.npy"), "{filter}");
        folder.told(&format!("render town.obj {FACING} -o box.npy"));
        assert!(rendered != folder.read("box.npy"), "{filter}");
    }
}

#[test]
fn linear_formats_keep_what_lobes_below_zero_make() {
    let folder = Folder::new();
    let opacities = |filter: &str| -> Vec<f32> {
        folder.told(&format!(
            "render town.obj {FACING} -o a.npy --filter {filter}"
        ));
        let bytes = folder.read("a.npy");
        let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let values = bytes[10 + header..].chunks_exact(16);
        values
            .map(|pixel| f32::from_le_bytes([pixel[12], pixel[13], pixel[14], pixel[15]]))
            .collect()
    };
    let least = |values: &[f32]| values.iter().copied().fold(f32::INFINITY, f32::min);
    let most = |values: &[f32]| values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let mitchell = opacities("mitchell");
    assert!(least(&mitchell) < -0.003 && most(&mitchell) > 1.003);
    let gaussian = opacities("gaussian");
    assert!(least(&gaussian) >= 0.0 && most(&gaussian) < 1.0 + 1e-6);
}

#[test]
fn a_filter_is_refused_where_there_are_no_pixels_to_weigh() {
    let folder = Folder::new();
    folder.told(&format!("render town.obj {FACING} -o town.veduta"));
    for (arguments, word) in [
        ("render town.obj -o a.svg", "vector picture"),
        ("render town.obj -o a.veduta", "map"),
        ("render town.obj -o a.exr --deep", "deep picture"),
        (
            "render town.obj -o a.png --sampling multiscan:4",
            "multiscan",
        ),
        ("shade town.veduta -o a.pdf", "vector picture"),
        ("composite town.veduta -o a.veduta", "map"),
    ] {
        folder
            .veduta(&format!("{arguments} --filter triangle"))
            .assert()
            .code(2)
            .stderr(contains(word))
            .stderr(contains("leave --filter out"));
    }
    assert_eq!(folder.files(), ["m.mtl", "town.obj", "town.veduta"]);
}
