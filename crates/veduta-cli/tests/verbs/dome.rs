//! Domes and panoramas of people's own pictures: layouts and conventions, sequences, what is told of doubts.

use crate::{Folder, png};
use predicates::str::contains;
use std::fs;

/// A test card's cube of sides of that many pixels, as six files of that pattern.
fn cube(folder: &Folder, size: u32, pattern: &str) {
    folder.told(&format!(
        "dome --test-card {size} --lens cube --size {size} -o {pattern}"
    ));
}

/// Turns or mirrors a PNG as told: the pixel of the new picture that shows an old one.
fn moved(
    folder: &Folder,
    from: &str,
    to: &str,
    place: impl Fn(usize, usize, usize) -> (usize, usize),
) {
    let (size, height, pixels) = png(&folder.read(from));
    assert_eq!(size, height, "a side is square");
    let mut turned = vec![[0; 4]; size * size];
    for y in 0..size {
        for x in 0..size {
            let (new_x, new_y) = place(x, y, size);
            turned[new_y * size + new_x] = pixels[y * size + x];
        }
    }
    encode(folder, to, size, &turned);
}

/// Writes a square PNG of RGBA.
fn encode(folder: &Folder, name: &str, size: usize, pixels: &[[u8; 4]]) {
    let file = fs::File::create(folder.path(name)).expect("may write in the test's folder");
    let mut encoder = png::Encoder::new(file, size as u32, size as u32);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("can be written");
    writer
        .write_image_data(pixels.as_flattened())
        .expect("can be written");
}

/// Writes a side of a cube: its colour at s to the right and t upwards, from -1 to 1.
fn write_png(folder: &Folder, name: &str, size: usize, color: impl Fn(f64, f64) -> [u8; 4]) {
    let place = |k: usize| (k as f64 + 0.5) / size as f64 * 2.0 - 1.0;
    let pixels: Vec<_> = (0..size * size)
        .map(|k| color(place(k % size), -place(k / size)))
        .collect();
    encode(folder, name, size, &pixels);
}

/// A smooth world without symmetries, as it is seen on a side with these axes: forward, right, up.
fn smooth(axes: [[i8; 3]; 3], s: f64, t: f64) -> [u8; 4] {
    let [forward, right, up] = axes.map(|axis| axis.map(f64::from));
    let d: [f64; 3] = std::array::from_fn(|k| forward[k] + s * right[k] + t * up[k]);
    let length = d.iter().map(|v| v * v).sum::<f64>().sqrt();
    let [x, y, z] = d.map(|v| v / length);
    let wave = |v: f64| (127.5 + 127.5 * v.sin()) as u8;
    [
        wave(3.0 * x + y),
        wave(2.0 * y - z + 0.5 * x * x),
        wave(4.0 * z + x * y),
        255,
    ]
}

fn half_turn(x: usize, y: usize, size: usize) -> (usize, usize) {
    (size - 1 - x, size - 1 - y)
}

fn mirror(x: usize, y: usize, size: usize) -> (usize, usize) {
    (size - 1 - x, y)
}

#[test]
fn every_layout_of_one_cube_gives_the_same_dome() {
    let folder = Folder::new();
    cube(&folder, 32, "s_{side}.png");
    folder.told("dome s_front.png s_right.png s_back.png s_left.png s_up.png s_down.png -o files.png --size 48");
    for layout in [
        "6x1",
        "1x6",
        "3x2",
        "2x3",
        "cross",
        "vertical-cross",
        "sv3d",
    ] {
        folder.told(&format!(
            "dome --test-card 32 --lens cube --size 32 --to-layout {layout} -o {layout}.png"
        ));
        // Their shapes tell what they are, but for what looks like a plain strip.
        let told = if layout == "sv3d" {
            "--layout sv3d"
        } else {
            ""
        };
        folder.told(&format!("dome {layout}.png {told} -o dome.png --size 48"));
        folder.told("diff files.png dome.png");
    }
    folder.told(
        "dome --test-card 32 --lens cube --size 32 --to-layout 3x2 --to-order frblud \
         --to-rotations 012301 -o other.png",
    );
    folder.told("dome other.png --order frblud --rotations 012301 -o dome.png --size 48");
    folder.told("diff files.png dome.png");
    // Of another order the dome is another.
    let other = folder.veduta("dome other.png --order frblud -o dome.png --size 48 -q");
    { other }.assert().success();
    folder.veduta("diff files.png dome.png").assert().code(1);
}

#[test]
fn cubes_of_other_spacings_show_the_same_within_their_own_sampling() {
    let folder = Folder::new();
    folder.told("dome --test-card 256 -o dome.png --size 128");
    for (layout, suffix) in [("eac", "png"), ("exr", "exr")] {
        folder.told(&format!(
            "dome --test-card 256 --lens cube --size 256 --to-layout {layout} -o {layout}.{suffix}"
        ));
        let told = if layout == "eac" { "--layout eac" } else { "" };
        folder.told(&format!(
            "dome {layout}.{suffix} {told} -o again.png --size 128"
        ));
        let told = folder.json("diff dome.png again.png --tolerance 1");
        // Borders of the card's squares are as sharp as a texel, which is half a pixel.
        assert!(
            told["rmse"].as_f64().expect("a number") < 0.02,
            "{layout}: {told}"
        );
    }
    // One that is wrong by half a turn differs by far more.
    folder.told("dome --test-card 256 --yaw 180deg -o turned.png --size 128");
    let told = folder.json("diff dome.png turned.png --tolerance 1");
    assert!(told["rmse"].as_f64().expect("a number") > 0.05, "{told}");
}

#[test]
fn files_are_told_apart_by_the_usual_names() {
    let folder = Folder::new();
    cube(&folder, 24, "s_{side}.png");
    cube(&folder, 24, "pano_{letter}.png");
    cube(&folder, 24, "{axis}.png");
    folder.told(
        "dome s_up.png s_back.png s_left.png s_down.png s_front.png s_right.png -o a.png --size 40",
    );
    for views in [
        "pano_b.png pano_d.png pano_f.png pano_l.png pano_r.png pano_u.png",
        "nx.png ny.png nz.png px.png py.png pz.png",
        "--order frblud -- pz.png s_right.png nz.png s_left.png py.png s_down.png",
    ] {
        let (before, after) = views
            .split_once("--order")
            .map_or((views, ""), |_| ("", views));
        folder.told(&format!("dome {before} -o b.png --size 40 {after}"));
        folder.told("diff a.png b.png");
    }
    let refused = folder
        .veduta("dome s_front.png town.png -o b.png")
        .assert()
        .code(6);
    assert!(String::from_utf8_lossy(&refused.get_output().stderr).contains("town.png"));
    fs::copy(folder.path("pz.png"), folder.path("view.png")).expect("may copy");
    let refused = folder
        .veduta("dome s_front.png view.png -o b.png")
        .assert()
        .code(2);
    let stderr = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(
        stderr.contains("view.png") && stderr.contains("--order"),
        "{stderr}"
    );
}

#[test]
fn cubes_of_video_and_of_right_handed_worlds_are_understood() {
    let folder = Folder::new();
    cube(&folder, 24, "{side}.png");
    folder.told("dome front.png right.png back.png left.png up.png down.png -o a.png --size 40");
    // Spherical Video V2: the upper and the lower side stand on their heads.
    moved(&folder, "up.png", "v_up.png", half_turn);
    moved(&folder, "down.png", "v_down.png", half_turn);
    folder.told(
        "dome front.png right.png back.png left.png v_up.png v_down.png --convention video -o b.png --size 40",
    );
    folder.told("diff a.png b.png");
    // OpenGL's names in a world whose front is -z: the picture called +z is what lies behind, mirrored.
    for (side, axis) in [
        ("right", "px"),
        ("left", "nx"),
        ("back", "pz"),
        ("front", "nz"),
    ] {
        moved(
            &folder,
            &format!("{side}.png"),
            &format!("{axis}.png"),
            mirror,
        );
    }
    for (side, axis) in [("up", "py"), ("down", "ny")] {
        moved(
            &folder,
            &format!("{side}.png"),
            &format!("{axis}.png"),
            |x, y, size| (x, size - 1 - y),
        );
    }
    let views = "px.png nx.png py.png ny.png pz.png nz.png";
    folder.told(&format!(
        "dome {views} --handedness right -o b.png --size 40"
    ));
    folder.told("diff a.png b.png");
}

#[test]
fn sides_that_do_not_fit_are_told_with_what_would_mend_them() {
    let folder = Folder::new();
    for (side, axes) in [
        ("front", [[0, 0, 1], [1, 0, 0], [0, 1, 0]]),
        ("right", [[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
        ("back", [[0, 0, -1], [-1, 0, 0], [0, 1, 0]]),
        ("left", [[-1, 0, 0], [0, 0, 1], [0, 1, 0]]),
        ("up", [[0, 1, 0], [1, 0, 0], [0, 0, -1]]),
        ("down", [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
    ] {
        write_png(&folder, &format!("{side}.png"), 40, |s, t| {
            smooth(axes, s, t)
        });
    }
    let others = "front.png right.png back.png left.png up.png";
    let sound = folder.veduta(&format!("dome {others} down.png -o a.png --size 64"));
    { sound }.assert().success().stderr("");
    moved(&folder, "down.png", "turned_down.png", half_turn);
    let warned = folder.veduta(&format!("dome {others} turned_down.png -o b.png --size 64"));
    let warned = { warned }.assert().success();
    let stderr = String::from_utf8_lossy(&warned.get_output().stderr).into_owned();
    assert!(
        stderr.contains("down were turned by 180 degrees"),
        "{stderr}"
    );
    folder
        .veduta(&format!(
            "dome {others} turned_down.png -o b.png --size 64 --strict"
        ))
        .assert()
        .code(4);
    let swapped = "dome --order flbrud -o b.png --size 64 -- front.png right.png back.png left.png up.png down.png";
    let warned = folder.veduta(swapped).assert().success();
    let stderr = String::from_utf8_lossy(&warned.get_output().stderr).into_owned();
    assert!(
        stderr.contains("left were the picture of right"),
        "{stderr}"
    );
}

#[test]
fn missing_sides_are_told_with_their_share_and_left_clear() {
    let folder = Folder::new();
    cube(&folder, 128, "{side}.png");
    // A dome of 180 degrees to the zenith needs no lower side.
    let fine = "dome front.png right.png back.png left.png up.png -o a.png --size 64";
    folder.veduta(fine).assert().success().stderr("");
    let told =
        folder.json("dome front.png right.png back.png left.png down.png -o b.png --size 64 -q");
    assert_eq!(told["missing"][0]["what"], "the side up");
    let share = told["missing"][0]["share"].as_f64().expect("a share");
    // It ends at half the radius in the middle of its edges and at 0.61 in its corners: 0.288 of the disc. A
    // texel around it is still taken from the neighbours.
    assert!((0.265..0.29).contains(&share), "{share}");
    let (_, _, pixels) = png(&folder.read("b.png"));
    assert_eq!(pixels[32 * 64 + 32][3], 0, "the zenith is clear");
    assert_eq!(pixels[58 * 64 + 32][3], 255, "the front is there");
    // What the four views of the paper do not show, the arc of Omnimax leaves out.
    folder.told("dome front.png right.png left.png up.png --lens omnimax --elevation 0 -o c.png --size 64 --strict");
}

#[test]
fn odd_sides_are_refused_or_doubted() {
    let folder = Folder::new();
    cube(&folder, 16, "{side}.png");
    folder.told("dome --test-card 8 --lens cube --size 8 -o small_{side}.png");
    folder.told("dome --test-card 16 --lens equirect --size 32 -o wide_front.png");
    let warned = folder.veduta(
        "dome front.png right.png back.png left.png up.png small_down.png --lens equirect -o a.png",
    );
    let warned = { warned }.assert().success();
    let stderr = String::from_utf8_lossy(&warned.get_output().stderr).into_owned();
    assert!(stderr.contains("different sizes"), "{stderr}");
    let refused = folder
        .veduta("dome wide_front.png right.png -o a.png")
        .assert()
        .code(4);
    let stderr = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(
        stderr.contains("wide_front.png: has 32 x 16 pixels"),
        "{stderr}"
    );
    // Single pixels are a cube, too.
    folder.told("dome --test-card 1 --lens cube --size 1 --to-layout 3x2 -o dot.png");
    folder.told("dome dot.png -o dots.png --size 16 -q");
    let (_, _, pixels) = png(&folder.read("dots.png"));
    assert_eq!(pixels[8 * 16 + 8][3], 255);
}

#[test]
fn a_sequence_with_a_damaged_frame_goes_on_and_says_so() {
    let folder = Folder::new();
    for frame in 1..=4 {
        folder.told(&format!(
            "dome --test-card 16 --lens cube --size 16 --to-layout 3x2 --yaw {}deg -o in.000{frame}.png",
            10 * frame
        ));
    }
    let sound = folder.read("in.0003.png");
    folder.write("in.0003.png", &sound[..sound.len() / 2]);
    let output = folder
        .veduta("dome in.####.png -o out_######.png --size 24 --json")
        .assert()
        .code(3);
    let output = output.get_output();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("frame 3: in.0003.png"), "{stderr}");
    assert!(
        stderr.contains("1 of 4 frames could not be made: 3"),
        "{stderr}"
    );
    assert!(!stderr.contains('\r'), "no progress into a pipe");
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(told["failed"][0]["frame"], 3);
    assert_eq!(told["frames"].as_array().map(Vec::len), Some(3));
    for frame in [1, 2, 4] {
        folder.told(&format!("dome in.000{frame}.png -o alone.png --size 24"));
        folder.told(&format!("diff alone.png out_00000{frame}.png"));
    }
    assert!(!folder.path("out_000003.png").exists());
    // A range names what is not there; others start counting anew.
    let refused = folder.veduta("dome in.####.png --frames 4..5 --start 1 -o n_###.png --size 24");
    let refused = { refused }.assert().code(3);
    let stderr = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(stderr.contains("in.0005.png"), "{stderr}");
    folder.told("diff n_001.png out_000004.png");
    // What no view has is a gap between the others.
    std::fs::remove_file(folder.path("in.0002.png")).expect("is there");
    folder
        .veduta("dome in.####.png -o gap_##.png --size 8")
        .assert()
        .code(3)
        .stderr(contains("there is no frame 2"));
    for arguments in [
        "dome none.####.png -o out_##.png",
        "dome in.####.png -o out.png",
        "dome in.0001.png --frames 1..2 -o out_##.png",
    ] {
        let code = if arguments.contains("none") { 3 } else { 2 };
        folder.veduta(arguments).assert().code(code);
    }
}

#[test]
fn two_eyes_make_two_files_or_one() {
    let folder = Folder::new();
    folder.told("dome --test-card 16 --lens cube --size 16 --to-layout 3x2 -o l.png");
    folder.told("dome --test-card 16 --lens cube --size 16 --to-layout 3x2 --yaw 3deg -o r.png");
    folder.told("dome l.png --right r.png -o show_{eye}.png --size 24");
    folder.told("dome l.png --right r.png --stereo top-bottom -o tb.png --size 24");
    folder.told("dome l.png --right r.png --stereo side-by-side -o sbs.png --size 24");
    let (_, _, left) = png(&folder.read("show_left.png"));
    let (_, _, right) = png(&folder.read("show_right.png"));
    assert_ne!(left, right);
    let (width, height, pixels) = png(&folder.read("tb.png"));
    assert_eq!((width, height), (24, 48));
    assert_eq!(pixels, [left.clone(), right.clone()].concat());
    let (width, _, pixels) = png(&folder.read("sbs.png"));
    assert_eq!(
        (width, &pixels[..24], &pixels[24..48]),
        (48, &left[..24], &right[..24])
    );
    for arguments in [
        "dome l.png --right r.png -o one.png",
        "dome l.png -o one_{eye}.png",
        "dome l.png --right r.png --stereo top-bottom -o one_{eye}.png",
        "dome l.png --stereo top-bottom -o one.png",
    ] {
        folder.veduta(arguments).assert().code(2);
    }
}

#[test]
fn panoramas_are_known_by_what_they_tell_and_come_back() {
    let folder = Folder::new();
    folder.told("dome --test-card 256 --lens equirect --size 512 -o pano.jpg --quality 100");
    folder.told("dome --test-card 256 --lens equirect --size 512 -o pano.png");
    folder.told("dome --test-card 256 --lens equirect --size 513 --envmap -o pano.exr");
    folder.told("dome --test-card 256 -o dome.png --size 96");
    for (pano, most) in [("pano.png", 0.03), ("pano.jpg", 0.04), ("pano.exr", 0.03)] {
        folder.told(&format!("dome {pano} -o again.png --size 96"));
        let told = folder.json("diff dome.png again.png --tolerance 1");
        assert!(
            told["rmse"].as_f64().expect("a number") < most,
            "{pano}: {told}"
        );
    }
    let bytes = folder.read("pano.png");
    assert!(bytes.windows(14).any(|found| found == b"GPano:FullPano"));
    // Through two fisheyes and a ball, too.
    folder.told("dome pano.png --lens fisheye:180 --size 256 -o front.png");
    folder.told("dome front.png --from fisheye:180 --lens perspective:60 --size 64 -o a.png");
    folder.told("dome pano.png --lens perspective:60 --size 64 -o b.png");
    let told = folder.json("diff a.png b.png --tolerance 1");
    assert!(told["rmse"].as_f64().expect("a number") < 0.04, "{told}");
}

#[test]
fn files_of_views_take_any_lens_and_any_direction() {
    let folder = Folder::new();
    cube(&folder, 32, "{side}.png");
    folder.told("dome front.png right.png back.png left.png up.png down.png -o a.png --size 48");
    let mut rig = String::new();
    for (side, angles) in [
        ("front", "yaw = 0"),
        ("right", "yaw = '90deg'"),
        ("back", "yaw = 180"),
        ("left", "direction = [-1, 0, 0]"),
        ("up", "elevation = 90"),
        ("down", "direction = [0, 0, -1]"),
    ] {
        rig += &format!("[[view]]\npicture = '{side}.png'\n{angles}\n");
    }
    folder.write("rig.toml", &rig);
    folder.told("dome rig.toml -o b.png --size 48");
    let told = folder.json("diff a.png b.png --tolerance 1");
    assert!(told["max"].as_f64().expect("a number") < 0.005, "{told}");
    folder.write("rig.toml", rig.replace("yaw = 0", "yawn = 0"));
    let refused = folder.veduta("dome rig.toml -o b.png").assert().code(4);
    let stderr = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    assert!(
        stderr.contains("rig.toml:3:1") && stderr.contains("did you mean \"yaw\"?"),
        "{stderr}"
    );
    for arguments in [
        "dome rig.toml front.png -o b.png",
        "dome rig.toml --layout 3x2 -o b.png",
    ] {
        folder.veduta(arguments).assert().code(2);
    }
}

#[test]
fn padded_sides_give_the_dome_of_plain_ones() {
    let folder = Folder::new();
    folder.told("dome --test-card 256 -o a.png --size 96");
    // 90 degrees in the middle half of the picture: 126.87 degrees in all.
    let mut views = String::new();
    for (side, angles) in [
        ("front", "--elevation 0"),
        ("right", "--yaw 90deg"),
        ("back", "--yaw 180deg"),
        ("left", "--yaw -90deg"),
        ("up", "--elevation 90deg"),
        ("down", "--elevation -90deg"),
    ] {
        folder.told(&format!(
            "dome --test-card 256 --lens perspective --fov 126.86989764584402 {angles} --size 512x512 -o {side}.png"
        ));
        views += &format!("{side}.png ");
    }
    for padding in ["--padding 128", "--side-fov 126.86989764584402deg"] {
        folder.told(&format!("dome {views} {padding} -o b.png --size 96"));
        let told = folder.json("diff a.png b.png --tolerance 1");
        assert!(
            told["rmse"].as_f64().expect("a number") < 0.02,
            "{padding}: {told}"
        );
    }
}

#[test]
fn masks_guides_and_backgrounds_finish_a_dome() {
    let folder = Folder::new();
    folder.told("dome --test-card 32 -o plain.png --size 64");
    folder.told("dome --test-card 32 --mask 120deg,20deg -o masked.png --size 64");
    let (_, _, pixels) = png(&folder.read("masked.png"));
    assert_eq!(
        pixels[32 * 64 + 4][3],
        0,
        "beyond 60 degrees from the zenith"
    );
    assert_eq!(pixels[32 * 64 + 32][3], 255);
    folder.told("dome --guides alignment,safe-area -o lines.png --size 64");
    let (_, _, lines) = png(&folder.read("lines.png"));
    assert!(lines.iter().any(|pixel| pixel[3] > 0) && lines[0][3] == 0);
    folder.told("dome --test-card 32 --mirror -o mirrored.png --size 64");
    let (_, _, mirrored) = png(&folder.read("mirrored.png"));
    let (_, _, plain) = png(&folder.read("plain.png"));
    for (row, other) in plain.chunks(64).zip(mirrored.chunks(64)) {
        let mut back: Vec<_> = other.to_vec();
        back.reverse();
        for (a, b) in row.iter().zip(back) {
            assert!((0..4).all(|k| a[k].abs_diff(b[k]) <= 1));
        }
    }
    // Around a dome it is dark where a format has no opacity.
    folder.told("dome --test-card 32 -o dome.jpg --size 64 --quality 100");
    folder.told("dome --test-card 32 -o black.png --size 64 --background #000");
    let told = folder.json("diff dome.jpg black.png --tolerance 1");
    assert!(told["rmse"].as_f64().expect("a number") < 0.03, "{told}");
    for arguments in [
        "dome --test-card 8 --lens equirect --guides alignment -o a.png",
        "dome --test-card 8 --lens equirect --mask 90deg -o a.png",
        "dome --test-card 8 --lens equirect --tilt 10deg -o a.png",
        "dome --test-card 8 --lens cube -o a.png",
        "dome --test-card 8 --lens cube --to-layout 3x2 -o a_{side}.png",
        "dome --test-card 8 -o a_{side}.png",
        "dome --test-card 8 --envmap -o a.png",
        "dome --test-card 8 --lens fish -o a.png",
        "dome --test-card 8 --lens fisheye:100 --fov 90deg -o a.png",
        "dome --test-card 8 --lens fisheye --fov 400deg -o a.png",
        "dome --test-card 0 -o a.png",
        "dome -o a.png",
        "dome plain.png --layout 3x2 --order rl -o a.png",
        "dome plain.png --layout cross --order rludfb -o a.png",
        "dome plain.png -o a.png",
        "dome plain.png --from fish -o a.png",
        "dome plain.png --from ball -o a.png --aov depth",
        "dome plain.png --from ball -o a.svg",
    ] {
        folder.veduta(arguments).assert().code(2);
    }
    assert!(!folder.path("a.png").exists());
}

#[test]
fn a_tilted_dome_looks_lower_and_any_number_of_threads_gives_the_same() {
    let folder = Folder::new();
    folder.told("dome --test-card 32 --tilt 20deg -o tilted.png --size 48");
    folder.told("dome --test-card 32 --elevation 70deg -o elevated.png --size 48");
    assert_eq!(folder.read("tilted.png"), folder.read("elevated.png"));
    for threads in [1, 2, 5] {
        folder.told(&format!(
            "dome --test-card 32 --tilt 20deg -o threads.png --size 48 --threads {threads}"
        ));
        assert_eq!(
            folder.read("threads.png"),
            folder.read("tilted.png"),
            "{threads}"
        );
    }
    // Into a pipe.
    let piped = folder.told_bytes("dome --test-card 32 --tilt 20deg -o - --size 48");
    assert_eq!(piped, folder.read("tilted.png"));
}

#[test]
fn a_cube_in_one_picture_goes_to_stdout_and_six_files_do_not() {
    let folder = Folder::new();
    folder.told("dome --test-card 16 --lens cube --to-layout 3x2 -o strip.png");
    let streamed = folder.told_bytes("dome --test-card 16 --lens cube --to-layout 3x2 -o -");
    assert!(streamed == folder.read("strip.png"));
    folder
        .veduta("dome --test-card 16 --lens cube -o -")
        .assert()
        .code(2);
}
