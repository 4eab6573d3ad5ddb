//! Picture files: what is written is read again, and damaged files are read or refused.

mod damaged;
mod layers;
mod round_trips;
mod sphere;
mod vector;

use std::path::PathBuf;
use tempfile::TempDir;
use veduta::accumulate::Picture;
use veduta_io::{PictureFormat, PictureOptions, stream_picture};

/// A picture with edges, partial opacity, and light beyond 0 to 1, which displays cut off.
fn sample_picture() -> Picture {
    let (width, height) = (37_u32, 21_u32);
    let pixel = |index: u32| {
        let (x, y) = (
            (index % width) as f32 / width as f32,
            (index / width) as f32,
        );
        let alpha = match index % 5 {
            0 => 0.0,
            1 => 0.25,
            _ => 1.0,
        };
        [x, 0.1 * y, (1.0 - x) * 0.5, 1.0].map(|channel| channel * alpha)
    };
    Picture {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
    }
}

fn encoded(suffix: &str, picture: &Picture, options: &PictureOptions) -> Vec<u8> {
    let format = PictureFormat::of_suffix(suffix).expect("a format");
    let mut bytes = Vec::new();
    stream_picture(&mut bytes, format, picture, options).expect("memory takes all");
    bytes
}

/// A file of a folder of its own.
struct OneFile {
    _folder: TempDir,
    path: PathBuf,
}

impl OneFile {
    fn new(name: &str) -> Self {
        let folder = TempDir::new().expect("a folder for the test");
        let path = folder.path().join(name);
        Self {
            _folder: folder,
            path,
        }
    }

    fn write(&self, bytes: &[u8]) {
        std::fs::write(&self.path, bytes).expect("may write in the test's folder");
    }
}
