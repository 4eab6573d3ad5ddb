//! Times the reading of scene files: `cargo run --release --example time_read -- FILE…`

use std::path::Path;
use std::time::{Duration, Instant};
use veduta_io::{ReadOptions, read_scene};

/// Reads of each file; the quickest and the slowest are told.
const RUNS: usize = 7;

fn main() {
    for file in std::env::args().skip(1) {
        let mut times: Vec<Duration> = Vec::new();
        let mut faces = 0;
        for _ in 0..RUNS {
            let start = Instant::now();
            let loaded = read_scene(Path::new(&file), &ReadOptions::default());
            times.push(start.elapsed());
            match loaded {
                Ok(loaded) => faces = loaded.scene.face_count(),
                Err(error) => {
                    println!("{error}");
                    break;
                }
            }
        }
        times.sort();
        println!(
            "{file}: {faces} faces in {:.1?} to {:.1?}",
            times[0],
            times[times.len() - 1]
        );
    }
}
