//! How many patches lenses need, and how long finding them takes: `cargo run --release -p veduta --example time_lens`.

use std::time::Instant;
use veduta::reproject::patches::Subdivision;
use veduta::reproject::{Lens, Orientation, Projection};

/// Lenses and sizes of the table in docs/performance.md.
const PICTURES: [(&str, u32, u32); 6] = [
    ("domemaster", 2048, 2048),
    ("domemaster", 4096, 4096),
    ("omnimax", 2048, 1596),
    ("equirect", 4096, 2048),
    ("ball", 1024, 1024),
    ("mercator", 2048, 2048),
];

fn main() {
    for (name, width, height) in PICTURES {
        let lens: Lens = name.parse().expect("a lens");
        let orientation = Orientation::from_angles(0.0, lens.usual_elevation(), 0.0);
        let projection = Projection::new(lens, orientation, width, height);
        let subdivision = Subdivision::new(&projection);
        let mut patches = Vec::new();
        let mut time = |border: bool| {
            let start = Instant::now();
            let mut count = 0;
            for first in (0..height).step_by(16) {
                let rows = first..(first + 16).min(height);
                match border {
                    true => subdivision.cut_border(rows, &mut patches),
                    false => subdivision.cut(rows, &mut patches),
                }
                count += patches.len();
            }
            (count, start.elapsed().as_secs_f64())
        };
        let (border, at_border) = time(true);
        let (all, in_all) = time(false);
        println!(
            "{name} {width}x{height}: {all} patches in {in_all:.3} s; at the border {border} in {at_border:.3} s"
        );
    }
}
