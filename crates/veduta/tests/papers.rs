//! What Tanaka & Takahashi (1991), §5.2, show of thin wires, through the whole pipeline.

use veduta::accumulate::Picture;
use veduta::pipeline::{RenderSettings, render};
use veduta::scene::generate;

/// Size of the picture, in which a wire is 0.05 pixels wide.
const SIZE: usize = 512;
const WIDTH: f64 = 0.05;
/// Wires of each of the two directions, and their distance in pixels.
const WIRES: usize = 25;
const DISTANCE: f64 = 20.1;

fn picture(name: &str) -> Picture {
    let scene = generate::by_name(name).expect("a scene of the generator");
    let settings = RenderSettings {
        width: SIZE as u32,
        height: SIZE as u32,
        unlit: true,
        ..RenderSettings::default()
    };
    render(&scene.scene, &scene.camera, &settings, |_| {}).picture
}

/// Coverage of a pixel.
fn coverage(picture: &Picture, column: usize, row: usize) -> f64 {
    f64::from(picture.pixels[row * SIZE + column][3])
}

/// Sums of the runs of pixels that are not empty.
fn runs(line: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut runs = Vec::new();
    let mut empty = true;
    for coverage in line {
        if coverage == 0.0 {
            empty = true;
        } else if std::mem::replace(&mut empty, false) {
            runs.push(coverage);
        } else {
            *runs.last_mut().expect("a run was begun") += coverage;
        }
    }
    runs
}

#[test]
fn wires_along_the_axes_are_all_there_and_equally_bright_both_ways() {
    let picture = picture("mesh0");
    // A line of pixels halfway between two wires of its own direction crosses all the others.
    let between = SIZE / 2 + 10;
    let down = runs((0..SIZE).map(|row| coverage(&picture, between, row)));
    let across = runs((0..SIZE).map(|column| coverage(&picture, column, between)));
    for wires in [down, across] {
        assert_eq!(wires.len(), WIRES);
        for wire in wires {
            assert!(
                (wire - WIDTH).abs() < 1e-6,
                "a wire covers {wire} of a pixel's width"
            );
        }
    }
}

#[test]
fn wires_at_five_degrees_are_unbroken() {
    let picture = picture("mesh5");
    let (sin, cos) = 5.0_f64.to_radians().sin_cos();
    let half = 0.5 * DISTANCE * (WIRES - 1) as f64;
    for wire in 0..WIRES {
        let across = wire as f64 * DISTANCE - half;
        // Once along the flat wires, column by column, once along the steep ones, row by row.
        for steep in [false, true] {
            for step in 0..SIZE {
                let along = step as f64 + 0.5 - 0.5 * SIZE as f64;
                // Counterclockwise by 5 degrees, in a picture whose y points down.
                let slope = if steep { sin / cos } else { -sin / cos };
                let center = along * slope + across / cos + 0.5 * SIZE as f64;
                let reach = along.abs() / cos + across.abs() * sin / cos;
                if reach > half || !(3.0..SIZE as f64 - 3.0).contains(&center) {
                    continue;
                }
                let near = center as usize - 2..=center as usize + 2;
                let found: f64 = near
                    .map(|other| {
                        let (column, row) = if steep { (other, step) } else { (step, other) };
                        coverage(&picture, column, row)
                    })
                    .sum();
                assert!(
                    found > WIDTH / cos - 1e-6,
                    "wire {wire} ({steep}) covers {found} at {step}"
                );
            }
        }
    }
}
