//! The command as its users meet it: exit codes, messages, files.

use assert_cmd::Command;
use predicates::prelude::{Predicate, PredicateBooleanExt, predicate};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// A folder with a small model in it.
struct Folder(TempDir);

/// A red square of side 2 in the plane that faces -Y once Y is up, and a triangle of glass.
const SQUARE: &str =
    "mtllib m.mtl\nusemtl red\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";

impl Folder {
    fn new() -> Self {
        let folder = Self(TempDir::new().expect("a folder for the test"));
        folder.write("square.obj", SQUARE);
        folder.write(
            "m.mtl",
            "newmtl red\nKd 1 0 0\nnewmtl glass\nKd 0 1 1\nd 0.5\n",
        );
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).expect("may write in the test's folder");
    }

    /// The names of all files, sorted.
    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("the test's folder");
        let mut names: Vec<_> = entries
            .map(|entry| {
                entry
                    .expect("an entry")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        names
    }

    /// The command with `arguments`, run in the folder.
    fn veduta(&self, arguments: &str) -> Command {
        let mut command = Command::cargo_bin("veduta").expect("the program");
        command
            .current_dir(self.0.path())
            .args(arguments.split_whitespace());
        command
    }
}

/// A view that the square fills to the half: its height is 2, the frame's 4.
const FACING: &str = "render square.obj --eye 0,-5,0 --parallel 4 --size 8x8 --unlit";

/// The pixels of a PNG, as RGBA of 8 bits.
fn png(path: PathBuf) -> (u32, u32, Vec<[u8; 4]>) {
    let file = fs::File::open(path).expect("a picture");
    let mut reader = png::Decoder::new(std::io::BufReader::new(file))
        .read_info()
        .expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a small picture")];
    let frame = reader.next_frame(&mut bytes).expect("a PNG");
    let bytes = match frame.bit_depth {
        png::BitDepth::Sixteen => bytes
            .as_chunks::<2>()
            .0
            .iter()
            .map(|word| word[0])
            .collect(),
        _ => bytes,
    };
    (frame.width, frame.height, bytes.as_chunks::<4>().0.to_vec())
}

#[test]
fn a_square_in_the_middle_is_red_inside_and_transparent_outside() {
    let folder = Folder::new();
    folder
        .veduta(&format!("{FACING} -o a.png"))
        .assert()
        .success()
        .stdout("")
        .stderr("");
    let (width, height, pixels) = png(folder.path("a.png"));
    assert_eq!((width, height), (8, 8));
    for (index, pixel) in pixels.into_iter().enumerate() {
        let inside = |at: usize| (2..6).contains(&at);
        let expected = if inside(index % 8) && inside(index / 8) {
            [255, 0, 0, 255]
        } else {
            [0; 4]
        };
        assert_eq!(pixel, expected, "pixel {index}");
    }
    assert_eq!(folder.files(), ["a.png", "m.mtl", "square.obj"]);
}

#[test]
fn backgrounds_are_srgb_and_come_through_exposure_and_tone() {
    let folder = Folder::new();
    let arguments = format!("{FACING} --background #336699 --exposure 2 --tone filmic -o a.png");
    folder.veduta(&arguments).assert().success();
    let (_, _, pixels) = png(folder.path("a.png"));
    assert_eq!(pixels[0], [0x33, 0x66, 0x99, 255]);
    assert_eq!(pixels[8 * 4 + 4][1..], [0, 0, 255]);
}

#[test]
fn the_three_formats_hold_the_same_picture() {
    let folder = Folder::new();
    for output in ["a.exr", "a.npy", "a.png --depth 16"] {
        folder
            .veduta(&format!("{FACING} -o {output}"))
            .assert()
            .success();
    }
    let npy = fs::read(folder.path("a.npy")).expect("a picture");
    let values: Vec<f32> = npy[128..]
        .as_chunks()
        .0
        .iter()
        .map(|&bytes| f32::from_le_bytes(bytes))
        .collect();
    assert_eq!(values.len(), 8 * 8 * 4);
    let (_, _, pixels) = png(folder.path("a.png"));
    for (linear, shown) in values.as_chunks::<4>().0.iter().zip(pixels) {
        assert_eq!(linear.map(|value| (value * 255.0).round() as u8), shown);
    }
    let exr = fs::read(folder.path("a.exr")).expect("a picture");
    assert_eq!(exr[..4], [0x76, 0x2f, 0x31, 0x01]);
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let folder = Folder::new();
    for suffix in ["png", "exr", "npy"] {
        for threads in [1, 2, 5] {
            let output = format!(
                "render square.obj --size 300x200 --threads {threads} -o {threads}.{suffix}"
            );
            folder.veduta(&output).assert().success();
        }
        let bytes =
            |threads| fs::read(folder.path(&format!("{threads}.{suffix}"))).expect("a picture");
        assert!(bytes(1) == bytes(2) && bytes(1) == bytes(5), "{suffix}");
    }
}

/// Runs that must fail: arguments, exit code, and what the message holds.
const FAILURES: &[(&str, i32, &str)] = &[
    ("render", 2, "required arguments were not provided"),
    (
        "render square.obj -o a.gif",
        2,
        "a.gif: is of no format that is written; pictures are written as .png, .jpg, .jpeg, .tif, .tiff, \
            .webp, .exr, .pfm, .npy",
    ),
    (
        "render square.obj -o a.png --size 0x10",
        2,
        "each side must be 1 to 65535 pixels",
    ),
    (
        "render square.obj -o a.png --size 100000x100000",
        2,
        "each side must be 1 to 65535 pixels",
    ),
    (
        "render square.obj -o a.png --size 60000x60000",
        2,
        "3600000000 pixels are too many",
    ),
    (
        "render square.obj -o a.png --fov 200deg",
        2,
        "above 0deg and below 180deg",
    ),
    (
        "render square.obj -o a.png --fov 40deg --parallel 3",
        2,
        "cannot be used with",
    ),
    ("render square.obj -o a.png --look-at 0,0,0", 2, "--eye"),
    ("render square.obj -o a.png --eye 1,2", 2, "expected X,Y,Z"),
    (
        "render square.obj -o a.png --eye 0,0,5 --up 0,0,1",
        2,
        "define no direction",
    ),
    (
        "render square.obj -o a.png --eye 0,0,0",
        2,
        "define no direction",
    ),
    (
        "render square.obj -o a.png --background red",
        2,
        "expected none, a colour such as '#8ab4d8' (in quotes, since shells take # for a comment), or a \
            picture such as sky.jpg",
    ),
    (
        "render square.obj -o a.png --exposure bright",
        2,
        "expected auto or a number of EV",
    ),
    (
        "render square.obj -o a.png --sampling multiscan:0",
        2,
        "multiscan:N with N from 1",
    ),
    ("render square.obj -o a.png --threads 0", 2, "--threads"),
    (
        "render square.obj -o a.png --camera side",
        3,
        "square.obj: no camera \"side\"; it has no cameras",
    ),
    (
        "render lost.gltf -o a.png",
        3,
        "lost.gltf: buffers[0].uri: names lost.bin, which cannot be read",
    ),
    (
        "render wrong.obj -o a.png",
        4,
        "wrong.obj:2: refers to vertex 2, but 1 stand before it",
    ),
    (
        "render cut.glb -o a.png",
        4,
        "cut.glb: byte 0: the GLB header needs 12 bytes",
    ),
    (
        "render points.obj -o a.png",
        4,
        "points.obj: has no faces, so there is nothing to show",
    ),
    (
        "render untextured.obj -o a.png --strict",
        4,
        "untextured.obj:1: the material library",
    ),
    (
        "render model.fbx -o a.png",
        5,
        "scenes are read from .glb, .gltf, .obj",
    ),
    (
        "render basis.gltf -o a.png",
        5,
        "the extension KHR_texture_basisu is required",
    ),
    (
        "render gone.obj -o a.png",
        6,
        "gone.obj: there is no such file",
    ),
    (
        "render square.obj -o nowhere/a.png",
        6,
        "nowhere/a.png: there is no folder nowhere; make it first",
    ),
    (
        "render square.obj -o folder.png",
        6,
        "folder.png: is a folder; name a file in it, such as folder.png/square.png",
    ),
    ("info gone.glb", 6, "gone.glb: there is no such file"),
    (
        "info squrae.obj",
        6,
        "squrae.obj: there is no such file; did you mean \"square.obj\"?",
    ),
    ("render gone.png -o a.png", 5, "gone.png: is a picture"),
    (
        "render . -o a.png",
        6,
        ".: is a folder; name the model in it",
    ),
    (
        "render square.obj a.png",
        2,
        "tip: the picture to write is named by -o: -o a.png",
    ),
    (
        "render square.obj -o a.png --eye 1 2 3",
        2,
        "tip: coordinates are one word: 1,2,3",
    ),
];

#[test]
fn failures_say_why_with_their_exit_code_and_leave_no_file() {
    let folder = Folder::new();
    let gltf = |rest: &str| format!("{{\"asset\":{{\"version\":\"2.0\"}},{rest}}}");
    folder.write(
        "lost.gltf",
        gltf(r#""buffers":[{"uri":"lost.bin","byteLength":4}]"#),
    );
    folder.write(
        "basis.gltf",
        gltf(r#""extensionsRequired":["KHR_texture_basisu"]"#),
    );
    folder.write("wrong.obj", "v 0 0 0\nf 1 2 3\n");
    folder.write("cut.glb", "glTF\x02");
    folder.write("points.obj", "v 0 0 0\nv 0 0 1\n");
    folder.write(
        "untextured.obj",
        "mtllib gone.mtl\nv 0 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n",
    );
    folder.write("model.fbx", "Kaydara\n");
    fs::create_dir(folder.path("folder.png")).expect("may write in the test's folder");
    let before = folder.files();
    for (arguments, code, message) in FAILURES {
        let starts = predicate::str::starts_with("veduta: error: ");
        let one_sentence = predicate::function(|text: &str| text.trim_end().lines().count() == 1)
            .or(predicate::str::contains("--help"))
            .or(predicate::str::contains("Usage:"));
        let expected = starts
            .and(predicate::str::contains(*message))
            .and(one_sentence);
        let output = folder.veduta(arguments).output().expect("the program runs");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(expected.eval(&stderr), "veduta {arguments}: {stderr}");
        assert_eq!(
            output.status.code(),
            Some(*code),
            "veduta {arguments}: {stderr}"
        );
        assert!(output.stdout.is_empty(), "veduta {arguments}");
        assert_eq!(folder.files(), before, "veduta {arguments}");
    }
}

#[test]
fn warnings_go_to_stderr_unless_they_are_not_wanted() {
    let folder = Folder::new();
    folder.write(
        "glass.obj",
        SQUARE
            .replace("red", "glass")
            .replace("m.mtl", "m.mtl\nmtllib gone.mtl"),
    );
    let missing = "veduta: warning: glass.obj:2: the material library \"gone.mtl\" cannot be read";
    let said = predicate::str::contains(missing);
    folder
        .veduta("render glass.obj -o a.png --size 8x8")
        .assert()
        .success()
        .stderr(said);
    folder
        .veduta("render glass.obj -o a.png --size 8x8 -q")
        .assert()
        .success()
        .stderr("");
}

#[test]
fn an_old_picture_is_replaced_and_survives_a_failure() {
    let folder = Folder::new();
    folder.write("a.png", "old");
    folder.veduta("render gone.obj -o a.png").assert().code(6);
    assert_eq!(
        fs::read(folder.path("a.png")).expect("the old file"),
        b"old"
    );
    folder
        .veduta(&format!("{FACING} -o a.png"))
        .assert()
        .success();
    assert_eq!(png(folder.path("a.png")).0, 8);
}

#[test]
fn views_from_below_and_with_z_up_show_what_is_there() {
    let folder = Folder::new();
    // With Z up, the square lies on the ground: seen from above it is there, edge-on it is not.
    let z_up = "render square.obj --up-axis z --parallel 4 --size 4x4 --unlit";
    folder
        .veduta(&format!("{z_up} --eye 0,0,5 -o above.png"))
        .assert()
        .success();
    folder
        .veduta(&format!("{z_up} --eye 0,-5,0 -o beside.png"))
        .assert()
        .success();
    let covered = |name: &str| {
        png(folder.path(name))
            .2
            .iter()
            .filter(|pixel| pixel[3] > 0)
            .count()
    };
    assert_eq!((covered("above.png"), covered("beside.png")), (4, 0));
    // The near plane cuts it away.
    folder
        .veduta(&format!("{FACING} --near 5.5 -o near.png"))
        .assert()
        .success();
    assert_eq!(covered("near.png"), 0);
}

#[test]
fn json_tells_what_was_made_and_what_is_inside() {
    let folder = Folder::new();
    let made = folder
        .veduta(&format!("{FACING} -o a.png --json"))
        .output()
        .expect("runs");
    let made: serde_json::Value = serde_json::from_slice(&made.stdout).expect("JSON");
    assert_eq!(made["output"], "a.png");
    assert_eq!(made["size"], serde_json::json!([8, 8]));
    // A flat quadrilateral is one face.
    assert_eq!(made["faces"], 1);

    let inside = folder
        .veduta("info square.obj --json")
        .output()
        .expect("runs");
    let inside: serde_json::Value = serde_json::from_slice(&inside.stdout).expect("JSON");
    assert_eq!(inside["faces"], 1);
    assert_eq!(inside["objects"][0]["name"], "square");
    assert_eq!(inside["materials"][0]["name"], "red");
    // Upright: what was Y in the file is Z.
    assert_eq!(inside["extent"]["max"], serde_json::json!([1.0, 0.0, 1.0]));
    let text = predicate::str::contains("faces     1").and(predicate::str::contains("red"));
    folder
        .veduta("info square.obj")
        .assert()
        .success()
        .stdout(text);
}

#[test]
fn progress_is_told_as_json_on_request() {
    let folder = Folder::new();
    let output = folder
        .veduta(&format!("{FACING} -o a.png --progress json"))
        .output()
        .expect("runs");
    let lines = String::from_utf8(output.stderr).expect("text");
    let steps: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).expect("a line of JSON"))
        .collect();
    assert_eq!(
        steps[0],
        serde_json::json!({ "step": "reading", "done": false })
    );
    let last = steps.last().expect("some steps");
    assert_eq!(
        (&last["step"], &last["done"]),
        (&"writing".into(), &true.into())
    );
}

#[test]
fn help_and_version_are_data_not_errors() {
    let folder = Folder::new();
    for arguments in ["--help", "render --help", "info -h", "--version"] {
        let said = predicate::str::is_empty().not();
        folder
            .veduta(arguments)
            .assert()
            .success()
            .stdout(said)
            .stderr("");
    }
}
