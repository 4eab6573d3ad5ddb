//! Scene files as the users of the command meet them.

use assert_cmd::Command;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// A folder with a scene of two squares, side 2, that face -Y: a red one, and a blue one behind it
/// and to the right of it.
struct Folder(TempDir);

const SQUARE: &str =
    "mtllib m.mtl\nusemtl paint\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";

const SCENE: &str = r##"# two squares
[camera.front]
eye = [0, -5, 0]
look_at = [0, 0, 0]
parallel = 4
size = [16, 8]

[camera.above]
eye = [0, 0, 5]
look_at = [0, 0, 0]

[[layer]]
name = "red"
model = "square.obj"

[[layer]]
name = "blue"
model = "square.obj"
at = { translate = [3, 1, 0] }

[material."red/paint"]
color = "#ff0000"
[material."blue/paint"]
color = "#0000ff"
"##;

impl Folder {
    fn new() -> Self {
        let folder = Self(TempDir::new().expect("a folder for the test"));
        folder.write("square.obj", SQUARE);
        folder.write("m.mtl", "newmtl paint\nKd 1 1 1\n");
        folder.write("s.toml", SCENE);
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: impl AsRef<str>) {
        fs::write(self.path(name), text.as_ref()).expect("may write in the test's folder");
    }

    fn veduta(&self, arguments: &str) -> Command {
        let mut command = Command::cargo_bin("veduta").expect("the program");
        command
            .current_dir(self.0.path())
            .args(arguments.split_whitespace());
        command
    }

    /// What the command says to stderr, and its exit code.
    fn said(&self, arguments: &str) -> (String, i32) {
        let output = self.veduta(arguments).output().expect("the program runs");
        let said = String::from_utf8(output.stderr).expect("is text");
        (said, output.status.code().expect("it ends by itself"))
    }

    /// The rows of a picture: a letter for each pixel.
    fn picture(&self, arguments: &str) -> Vec<String> {
        let (said, code) = self.said(&format!("render {arguments} --unlit -o out.png"));
        assert_eq!((said.as_str(), code), ("", 0), "{arguments}");
        let file = fs::File::open(self.path("out.png")).expect("a picture");
        let mut reader = png::Decoder::new(std::io::BufReader::new(file))
            .read_info()
            .expect("a PNG");
        let mut bytes = vec![0; reader.output_buffer_size().expect("a small picture")];
        let frame = reader.next_frame(&mut bytes).expect("a PNG");
        let letter = |pixel: &[u8; 4]| match pixel {
            [255, 0, 0, 255] => 'r',
            [0, 0, 255, 255] => 'b',
            [_, _, _, 0] => '.',
            _ => '?',
        };
        bytes
            .as_chunks::<4>()
            .0
            .chunks(frame.width as usize)
            .map(|row| row.iter().map(letter).collect())
            .collect()
    }
}

#[test]
fn the_first_camera_and_its_size_are_used_unless_others_are_asked_for() {
    let folder = Folder::new();
    let side = ["................", "......rrrr..bbbb"];
    let expected = [
        side[0], side[0], side[1], side[1], side[1], side[1], side[0], side[0],
    ];
    assert_eq!(folder.picture("s.toml"), expected);
    assert_eq!(folder.picture("s.toml --camera front"), expected);
    // The height of the view is kept.
    let expected = ["....", ".rr.", ".rr.", "...."];
    assert_eq!(folder.picture("s.toml --size 4x4"), expected);
    // From above, both are seen edge-on: not at all.
    let rows = folder.picture("s.toml --camera above --size 4x4");
    assert_eq!(rows, ["...."; 4]);
    // All of it is shown where no camera is wanted.
    let rows = folder.picture("s.toml --camera auto --size 40x20").concat();
    assert!(rows.contains('r') && rows.contains('b'), "{rows}");
}

#[test]
fn layers_made_apart_fit_one_on_the_other() {
    let folder = Folder::new();
    for camera in ["", "--camera auto --size 60x40"] {
        let all = folder.picture(&format!("s.toml {camera}")).concat();
        let red = folder
            .picture(&format!("s.toml {camera} --layer red"))
            .concat();
        let blue = folder
            .picture(&format!("s.toml {camera} --layer blue"))
            .concat();
        let both = folder
            .picture(&format!("s.toml {camera} --layer blue --layer red"))
            .concat();
        assert_eq!(both, all);
        assert!(!red.contains('b') && !blue.contains('r'), "{camera}");
        for ((all, red), blue) in all.chars().zip(red.chars()).zip(blue.chars()) {
            // Where an edge passes through, colours mix.
            let expected = match (red, blue) {
                ('.', other) | (other, '.') => other,
                ('r', _) => 'r',
                _ => all,
            };
            assert!(
                all == expected || all == '?',
                "{camera}: {all} of {red} and {blue}"
            );
        }
    }
}

#[test]
fn a_shift_moves_the_frame_and_a_shifted_camera_keeps_its_own() {
    let folder = Folder::new();
    let shifted = ["....", "....", ".rr.", ".rr."];
    let up = folder.picture("s.toml --size 4x4 --shift 0,0.25");
    assert_eq!(up, shifted);
    let right = folder.picture("s.toml --size 4x4 --shift 0.5,0");
    assert_eq!(right, ["....", "r.bb", "r.bb", "...."]);
    folder.write(
        "t.toml",
        SCENE.replacen("parallel", "shift = [0, 0.25]\nparallel", 1),
    );
    assert_eq!(folder.picture("t.toml --size 4x4"), shifted);
    let back = folder.picture("t.toml --size 4x4 --shift 0,0");
    assert_eq!(back, ["....", ".rr.", ".rr.", "...."]);
    let model = "square.obj --eye 0,-5,0 --parallel 4 --size 4x4";
    let rows = folder.picture(&format!("{model} --shift -0.25,0"));
    // The model itself is white.
    assert_eq!(rows, ["....", "..??", "..??", "...."]);
}

#[test]
fn mistakes_are_shown_with_their_lines_and_carets() {
    let folder = Folder::new();
    let broken =
        SCENE
            .replacen("model =", "modle =", 1)
            .replacen("parallel = 4", "parallel = \"4 yd\"", 1);
    folder.write("s.toml", broken);
    let (said, code) = folder.said("render s.toml -o out.png");
    let expected = r#"veduta: error: s.toml:5:12: parallel is "4 yd", expected a length above 0 in metres, or with a unit, such as "2.5 m"
    5 | parallel = "4 yd"
      |            ^^^^^^
veduta: error: s.toml:14:1: unknown key "modle" in [[layer]]; did you mean "model"?
   14 | modle = "square.obj"
      | ^^^^^
"#;
    assert_eq!(said, expected);
    assert_eq!(code, 4);
    assert!(!folder.path("out.png").exists());
}

#[test]
fn carets_stand_under_their_places_whatever_the_script() {
    let folder = Folder::new();
    // Full-width characters take two columns, a combining accent none, a tab is shown as a blank.
    let line = "[[layer]]\nname = \"a\"\nmodel = \"塔e\u{301}.obj\"\t; x\n";
    folder.write("s.toml", line);
    let (said, code) = folder.said("render s.toml -o out.png");
    let mut lines = said.lines();
    let message = lines.next().unwrap_or_default();
    assert!(message.contains("s.toml:3:19: is not valid TOML"), "{said}");
    let quoted = lines.next().unwrap_or_default();
    let carets = lines.next().unwrap_or_default();
    assert!(quoted.ends_with("塔e\u{301}.obj\" ; x"), "{said}");
    let before = &quoted[..quoted.find("; x").expect("is there")];
    // One wide character and one that has no width make up for each other.
    let columns = before.chars().count();
    assert_eq!(carets.find('^'), Some(columns), "{said}");
    assert_eq!(code, 4);
}

#[test]
fn names_that_are_not_there_are_told_with_those_that_are_meant() {
    let folder = Folder::new();
    for (arguments, expected) in [
        (
            "render s.toml --camera fornt -o o.png",
            "s.toml: no camera \"fornt\"; did you mean \"front\"?",
        ),
        (
            "render s.toml --camera tele -o o.png",
            "s.toml: no camera \"tele\"; it has: front, above",
        ),
        (
            "render s.toml --layer reed -o o.png",
            "s.toml: no layer \"reed\"; did you mean \"red\"?",
        ),
        (
            "render square.obj --layer red -o o.png",
            "square.obj: no layer \"red\"; it has no layers",
        ),
    ] {
        let (said, code) = folder.said(arguments);
        assert_eq!(said, format!("veduta: error: {expected}\n"));
        assert_eq!(code, 3, "{arguments}");
    }
}

#[test]
fn exit_codes_tell_what_is_wrong_with_a_scene_file() {
    let folder = Folder::new();
    for (part, replacement, expected) in [
        ("square.obj", "squares.obj", 3),
        ("[camera.above]", "[[light]]", 5),
        ("eye", "eyes", 4),
        ("[16, 8]", "[65535, 65535]", 4),
    ] {
        folder.write("t.toml", SCENE.replacen(part, replacement, 1));
        let (said, code) = folder.said("render t.toml -o o.png");
        assert_eq!(code, expected, "{replacement}: {said}");
    }
    assert_eq!(folder.said("render gone.toml -o o.png").1, 6);
}

#[test]
fn a_glob_without_material_is_a_warning_and_with_strict_an_error() {
    let folder = Folder::new();
    folder.write("t.toml", SCENE.replace("blue/paint", "blue/pant"));
    let (said, code) = folder.said("render t.toml -o o.png");
    let expected = "veduta: warning: t.toml:23:11: no material is called \"blue/pant\"; did you \
        mean \"blue/paint\"?\n";
    assert_eq!((said.as_str(), code), (expected, 0));
    let (said, code) = folder.said("render t.toml -o o.png --strict");
    assert!(said.contains("--strict") && code == 4, "{said}");
}

#[test]
fn the_schema_is_json_and_knows_the_keys() {
    let output = Folder::new()
        .veduta("schema")
        .output()
        .expect("the program runs");
    let schema: serde_json::Value = serde_json::from_slice(&output.stdout).expect("is JSON");
    let layer = &schema["properties"]["layer"]["items"];
    assert_eq!(layer["required"], serde_json::json!(["name", "model"]));
    assert!(layer["properties"]["instances"]["description"].is_string());
}

#[test]
fn the_example_scene_is_made_from_each_of_its_cameras() {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/bridge.toml");
    let folder = Folder::new();
    for (camera, size) in [
        ("flight", [960, 540]),
        ("tower", [600, 800]),
        ("plan", [1260, 810]),
    ] {
        let mut command = folder.veduta("render --json -o o.png --camera");
        let output = command
            .args([camera, examples])
            .output()
            .expect("the program runs");
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).expect("is JSON");
        assert_eq!(told["size"], serde_json::json!(size), "{camera}");
        assert_eq!(told["warnings"], serde_json::json!([]), "{camera}");
    }
}
