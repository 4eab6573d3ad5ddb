//! No seams in vector pictures, as a program of others draws them: poppler the PDF.
//!
//! It smooths each shape by itself. In a pixel that is covered nothing of what is behind the picture may be
//! seen, along the outline of the whole as little as within.

use std::path::{Path, PathBuf};
use std::process::Command;
use veduta::dice::PixelGrid;
use veduta::drawing::{Drawing, Settings};
use veduta::pipeline::{draw_window, find_visibility, render_window};
use veduta::scene::{Scene, framing_camera, generate};
use veduta_io::{ReadOptions, VectorFormat, VectorOptions, read_scene, write_drawing};
use veduta_map::{Camera, VisibilityMap};

/// Width and height of the pictures.
const SIDE: u32 = 160;

/// How many of a viewer's pixels are as wide as one of the picture.
const ZOOMS: [f64; 3] = [1.0, 2.3, 4.0];

/// A drawing with what is needed to find out which pixels it covers.
struct Subject {
    name: String,
    scene: Scene,
    map: VisibilityMap,
    drawing: Drawing,
}

impl Subject {
    fn new(name: &str, scene: Scene, camera: &Camera) -> Self {
        let map = find_visibility(&scene, camera);
        let grid = PixelGrid::of_frame(SIDE, SIDE);
        let drawing = draw_window(&scene, &map, &grid, true, &Settings::default());
        Self {
            name: name.to_owned(),
            scene,
            map,
            drawing,
        }
    }

    /// Whether each pixel is covered, of `side * side` from the top.
    fn covered(&self, side: u32) -> Vec<bool> {
        let grid = PixelGrid::of_frame(side, side);
        let picture = render_window(&self.scene, &self.map, &grid, true);
        let alphas = picture.pixels.iter().map(|pixel| pixel[3]);
        alphas.map(|alpha| alpha >= 1.0 - 1e-6).collect()
    }

    /// The pixels that are covered and seen through, by `seen_through` in steps of 255.
    fn seams(&self, zoom: f64, seen_through: impl Fn(u32) -> Vec<u8>) -> Option<String> {
        let side = (f64::from(SIDE) * zoom).round() as u32;
        let covered = self.covered(side);
        let through = seen_through(side);
        assert_eq!(covered.len(), through.len());
        let seams: Vec<usize> = (0..covered.len())
            .filter(|&pixel| covered[pixel] && through[pixel] > 1)
            .collect();
        let worst = seams.iter().copied().max_by_key(|&pixel| through[pixel])?;
        Some(format!(
            "{} at zoom {zoom}: {} of {} covered pixels, at ({}, {}) {} of 255",
            self.name,
            seams.len(),
            covered.iter().filter(|&&covered| covered).count(),
            worst % side as usize,
            worst / side as usize,
            through[worst]
        ))
    }
}

/// Generated scenes, and models of others from the folder that `VEDUTA_DATA` names.
fn subjects() -> Vec<Subject> {
    let generated = ["buildings", "balls3", "pierce"].map(|name| {
        let found = generate::by_name_for_aspect(name, 1.0);
        let generate::Generated { scene, camera, .. } = found.expect("a known scene");
        Subject::new(name, scene, &camera)
    });
    let mut subjects = Vec::from(generated);
    match std::env::var_os("VEDUTA_DATA") {
        None => eprintln!("SKIPPED: VEDUTA_DATA is not set, so no real models are drawn"),
        Some(data) => {
            for file in ["models/fandisk.obj", "city/delft.city.json"] {
                let path = PathBuf::from(&data).join(file);
                let loaded = read_scene(&path, &ReadOptions::default());
                let scene = loaded.unwrap_or_else(|error| panic!("{error}")).scene;
                let camera = framing_camera(&scene, 1.0).expect("something to see");
                subjects.push(Subject::new(file, scene, &camera));
            }
        }
    }
    subjects
}

/// The pixels of a page as poppler draws it, three bytes each.
fn drawn_by_poppler(pdf: &Path, side: u32) -> Vec<u8> {
    let picture = pdf.with_extension("ppm");
    let side_text = side.to_string();
    let status = Command::new("pdftoppm")
        .args([
            "-singlefile",
            "-scale-to-x",
            &side_text,
            "-scale-to-y",
            &side_text,
        ])
        .arg(pdf)
        .arg(pdf.with_extension(""))
        .status();
    assert!(status.expect("poppler runs").success());
    let bytes = std::fs::read(picture).expect("a picture");
    let pixels = 3 * (side * side) as usize;
    assert!(bytes.starts_with(b"P6") && bytes.len() > pixels);
    bytes[bytes.len() - pixels..].to_vec()
}

#[test]
fn poppler_shows_nothing_of_what_is_behind_covered_pixels() {
    if Command::new("pdftoppm").arg("-v").output().is_err() {
        eprintln!("SKIPPED: poppler (pdftoppm) is not installed, so no PDF is drawn by it");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let format = VectorFormat::of_suffix("pdf").expect("a format");
    let mut failures = Vec::new();
    for subject in subjects() {
        let backgrounds = [[0.0; 3], [1.0; 3]].map(|background| {
            let path = folder.path().join(format!("{}.pdf", background[0]));
            let options = VectorOptions {
                background: Some(background),
                ..VectorOptions::default()
            };
            write_drawing(&path, format, &subject.drawing, &options).expect("a file is written");
            path
        });
        for zoom in ZOOMS {
            failures.extend(subject.seams(zoom, |side| {
                // How much a pixel changes with what is behind it.
                let [black, white] = backgrounds
                    .each_ref()
                    .map(|pdf| drawn_by_poppler(pdf, side));
                let differences = black.iter().zip(&white).map(|(b, w)| w.abs_diff(*b));
                let differences: Vec<u8> = differences.collect();
                let pixels = differences.chunks_exact(3);
                pixels
                    .map(|channels| channels.iter().copied().max().unwrap_or(0))
                    .collect()
            }));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
