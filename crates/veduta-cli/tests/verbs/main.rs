//! The verbs, pictures and pipes as users meet them.

mod casters;
mod check;
mod deep;
mod diff;
mod dome;
mod endings;
mod examples;
mod filters;
mod frames;
mod help;
mod info;
mod lens;
mod openexr;
mod pictures;
mod pipes;
mod preview;
mod readme;
mod spans;
mod stored;
mod viewers;

use assert_cmd::Command;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder with a small model in it.
struct Folder(TempDir);

/// A red square of side 2 that faces -Y once Y is up, with a blue one half as large and high before
/// it.
const MODEL: &str = "mtllib m.mtl\n\
    o wall\nusemtl red\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n\
    o box\nusemtl blue\nv -1 -1 1\nv 0 -1 1\nv 0 0 1\nv -1 0 1\nf 5 6 7 8\n";

const MATERIALS: &str = "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n";

/// A view of the model in which the wall fills the middle half of the frame each way, and a pixel of
/// 8 x 8 is half a metre.
const FACING: &str = "--eye 0,-5,0 --look-at 0,0,0 --parallel 4 --size 8x8";

impl Folder {
    fn new() -> Self {
        let folder = Self(TempDir::new().expect("a folder for the test"));
        folder.write("town.obj", MODEL);
        folder.write("m.mtl", MATERIALS);
        folder
    }

    fn place(&self) -> &Path {
        self.0.path()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.place().join(name)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).expect("may write in the test's folder");
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The names of all files, sorted.
    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.place()).expect("the test's folder");
        let mut names: Vec<_> = entries
            .map(|entry| {
                let name = entry.expect("an entry").file_name();
                name.to_string_lossy().into_owned()
            })
            .collect();
        names.sort();
        names
    }

    /// The command with `arguments`, run in the folder.
    fn veduta(&self, arguments: &str) -> Command {
        let mut command = Command::new(program());
        command
            .current_dir(self.place())
            .args(arguments.split_whitespace());
        command
    }

    /// Runs the command, which must succeed; what it wrote to stdout.
    fn told(&self, arguments: &str) -> String {
        let output = self.veduta(arguments).assert().success();
        String::from_utf8(output.get_output().stdout.clone()).expect("text")
    }

    /// [`Folder::told`] of what is no text.
    fn told_bytes(&self, arguments: &str) -> Vec<u8> {
        let output = self.veduta(arguments).assert().success();
        output.get_output().stdout.clone()
    }

    /// [`Folder::told`] with `--json`.
    fn json(&self, arguments: &str) -> serde_json::Value {
        let told = self.told(&format!("{arguments} --json"));
        serde_json::from_str(&told).unwrap_or_else(|error| panic!("{arguments}: {error}: {told}"))
    }
}

fn program() -> PathBuf {
    assert_cmd::cargo::cargo_bin("veduta")
}

/// The pixels of a PNG of 8 bits, as RGBA.
fn png(bytes: &[u8]) -> (usize, usize, Vec<[u8; 4]>) {
    let decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    let mut reader = decoder.read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a small picture")];
    let frame = reader.next_frame(&mut pixels).expect("a PNG");
    let pixels = pixels.as_chunks::<4>().0.to_vec();
    (frame.width as usize, frame.height as usize, pixels)
}
