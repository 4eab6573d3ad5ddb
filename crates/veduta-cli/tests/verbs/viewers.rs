//! Vector pictures as independent programs draw them (poppler the PDF, resvg the SVG), held against our own pixels.

use crate::Folder;
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers};
use std::path::Path;
use std::process::Command;

/// A program that draws vector pictures.
#[derive(Clone, Copy)]
enum Viewer {
    /// `pdftoppm`, of poppler.
    Poppler,
    /// `resvg`, the command.
    Resvg,
    /// The same library in Python, as `resvg_py`.
    ResvgOfPython,
}

const RESVG_OF_PYTHON: &str = "import resvg_py, sys\n\
    drawing, picture, width, height = sys.argv[1:]\n\
    png = resvg_py.svg_to_bytes(svg_path=drawing, width=int(width), height=int(height))\n\
    open(picture, 'wb').write(bytes(png))";

impl Viewer {
    /// Those that are installed; says which are not.
    fn installed() -> Vec<Self> {
        let runs = |program: &str, arguments: &[&str]| {
            let output = Command::new(program).args(arguments).output();
            output.is_ok_and(|output| output.status.success())
        };
        let mut viewers = Vec::new();
        if runs("pdftoppm", &["-v"]) {
            viewers.push(Self::Poppler);
        } else {
            println!("skipped: pdftoppm, of poppler, cannot be run");
        }
        if runs("resvg", &["--version"]) {
            viewers.push(Self::Resvg);
        } else if runs("python3", &["-c", "import resvg_py"]) {
            viewers.push(Self::ResvgOfPython);
        } else {
            println!("skipped: neither resvg nor resvg_py, for Python, can be run");
        }
        viewers
    }

    fn suffix(self) -> &'static str {
        match self {
            Self::Poppler => "pdf",
            Self::Resvg | Self::ResvgOfPython => "svg",
        }
    }

    /// `name` with its suffix in pixels.
    fn show(self, folder: &Folder, name: &str, [width, height]: [usize; 2]) -> Pixels {
        let drawing = format!("{name}.{}", self.suffix());
        let [width, height] = [width, height].map(|side| side.to_string());
        let mut command = match self {
            Self::Poppler => {
                let mut command = Command::new("pdftoppm");
                command.args(["-singlefile", "-png"]);
                command.args(["-scale-to-x", &width, "-scale-to-y", &height]);
                command.args([&drawing, "viewed"]);
                command
            }
            Self::Resvg => {
                let mut command = Command::new("resvg");
                command.args(["--width", &width, "--height", &height]);
                command.args([&drawing, "viewed.png"]);
                command
            }
            Self::ResvgOfPython => {
                let mut command = Command::new("python3");
                command.args(["-c", RESVG_OF_PYTHON]);
                command.args([&drawing, "viewed.png", &width, &height]);
                command
            }
        };
        let output = command
            .current_dir(folder.place())
            .output()
            .expect("it ran before");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{drawing}: {said}");
        Pixels::of_png(&folder.read("viewed.png"))
    }
}

/// RGBA from 0 to 255, with a part after the point where there are more bits.
struct Pixels {
    size: [usize; 2],
    pixels: Vec<[f64; 4]>,
}

impl Pixels {
    fn of_png(bytes: &[u8]) -> Self {
        let decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        let mut reader = decoder.read_info().expect("a PNG");
        let mut samples = vec![0; reader.output_buffer_size().expect("a small picture")];
        let frame = reader.next_frame(&mut samples).expect("a PNG");
        let values: Vec<f64> = match frame.bit_depth {
            png::BitDepth::Eight => samples.iter().map(|&sample| f64::from(sample)).collect(),
            _ => {
                let pairs = samples.as_chunks::<2>().0.iter();
                let wide = pairs.map(|&pair| u16::from_be_bytes(pair));
                wide.map(|sample| f64::from(sample) / 257.0).collect()
            }
        };
        let pixels = match frame.color_type {
            png::ColorType::Rgba => values.as_chunks::<4>().0.to_vec(),
            _ => {
                let opaque = |&[r, g, b]: &[f64; 3]| [r, g, b, 255.0];
                values.as_chunks::<3>().0.iter().map(opaque).collect()
            }
        };
        Self {
            size: [frame.width as usize, frame.height as usize],
            pixels,
        }
    }

    fn is_covered(&self, pixel: usize) -> bool {
        self.pixels[pixel][3] == 255.0
    }

    /// Whether a covered pixel and its eight neighbours have one colour, and are of one object.
    fn is_within_a_surface(&self, pixel: usize, objects: &[u32]) -> bool {
        let [width, height] = self.size;
        let [column, row] = [pixel % width, pixel / width];
        let is_inner = (1..width - 1).contains(&column) && (1..height - 1).contains(&row);
        let around = |row: usize| (row - 1) * width + column - 1..=(row - 1) * width + column + 1;
        is_inner
            && self.is_covered(pixel)
            && (row..row + 3).flat_map(around).all(|near| {
                self.pixels[near] == self.pixels[pixel] && objects[near] == objects[pixel]
            })
    }
}

/// The number of the object that covers most of each pixel, of an .exr.
fn objects_of(file: &Path) -> Vec<u32> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(file)
        .expect("an .exr");
    let mut channels = image.layer_data.channel_data.list.into_iter();
    let objects = channels.find(|channel| channel.name == *"id.object");
    match objects.expect("there is that channel").sample_data {
        FlatSamples::U32(objects) => objects,
        _ => panic!("numbers are whole"),
    }
}

/// The largest difference of two colours.
fn most(one: [f64; 4], other: [f64; 4]) -> f64 {
    let channels = one.iter().zip(other).take(3);
    channels.fold(0.0, |most, (a, b)| f64::max(most, (a - b).abs()))
}

/// Draws `scene` before black and before white, for `viewer`.
fn draw(folder: &Folder, viewer: Viewer, scene: &str, [width, height]: [usize; 2]) {
    let suffix = viewer.suffix();
    for (name, background) in [("black", "#000"), ("white", "#fff")] {
        folder.told(&format!(
            "render -q {scene} --size {width}x{height} --background {background} -o {name}.{suffix}"
        ));
    }
}

/// What the viewer shows of both, in pixels.
fn shown(folder: &Folder, viewer: Viewer, size: [usize; 2]) -> [Vec<[f64; 4]>; 2] {
    ["black", "white"].map(|name| {
        let shown = viewer.show(folder, name, size);
        assert_eq!(shown.size, size);
        shown.pixels
    })
}

/// Holds what a viewer shows of `scene` against our own pixels, at sizes from that of the drawing to four times it.
fn compare(folder: &Folder, viewers: &[Viewer], scene: &str, size: [usize; 2]) {
    for &viewer in viewers {
        draw(folder, viewer, scene, size);
    }
    for zoom in [1.0, 2.3, 4.0] {
        let [width, height] = size.map(|side| (side as f64 * zoom).round() as usize);
        folder.told(&format!(
            "render -q {scene} --size {width}x{height} --depth 16 -o own.png"
        ));
        let own = Pixels::of_png(&folder.read("own.png"));
        folder.told(&format!(
            "render -q {scene} --size {width}x{height} --aov object -o own.exr"
        ));
        let objects = objects_of(&folder.path("own.exr"));
        for &viewer in viewers {
            let what = format!("{scene} as {} at {zoom}", viewer.suffix());
            let [black, white] = shown(folder, viewer, [width, height]);
            let place = |pixel: usize| [pixel % width, pixel / width];
            let (mut within, mut off_within) = (0, 0);
            let (mut edges, mut far_off) = (0, 0);
            let (mut parts, mut too_opaque) = (0, 0.0);
            for (pixel, &[r, g, b, alpha]) in own.pixels.iter().enumerate() {
                // How much of what lies behind is seen.
                let through = most(black[pixel], white[pixel]);
                if own.is_covered(pixel) {
                    assert!(
                        through <= 1.0,
                        "{what}: a seam at {:?}: {through} of 255",
                        place(pixel)
                    );
                } else if alpha > 0.0 {
                    parts += 1;
                    too_opaque += 255.0 - through - alpha;
                }
                let expected = [r, g, b].map(|channel| channel * alpha / 255.0);
                let off = most(black[pixel], [expected[0], expected[1], expected[2], 0.0]);
                if own.is_within_a_surface(pixel, &objects) {
                    within += 1;
                    off_within += usize::from(off > 1.0);
                    assert!(off <= 64.0, "{what}: another colour at {:?}", place(pixel));
                } else if alpha > 0.0 {
                    edges += 1;
                    far_off += usize::from(off > 64.0);
                }
            }
            // Thinner things than a pixel are in some that look like one surface.
            assert!(
                off_within * 1000 <= within,
                "{what}: {off_within} of {within} pixels within surfaces have other colours"
            );
            // Viewers smooth edges each in their way: of what is covered by half, poppler makes more.
            let too_opaque = too_opaque / f64::from(parts);
            assert!(too_opaque.abs() <= 20.0, "{what}: {too_opaque} of 255");
            assert!(
                far_off * 100 <= edges,
                "{what}: of {edges} pixels on edges {far_off} have other colours"
            );
        }
    }
}

#[test]
fn viewers_show_no_seams_and_our_colours() {
    let viewers = Viewer::installed();
    let folder = Folder::new();
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/bridge.toml");
    // Flat colours: a shape of a drawing has one.
    let own = format!("{} --unlit", own.display());
    compare(&folder, &viewers, &own, [240, 120]);
    // Without traps there are seams: this is what is being tested.
    for &viewer in &viewers {
        draw(&folder, viewer, &format!("{own} --trap 0"), [240, 120]);
        folder.told(&format!("render -q {own} --size 240x120 -o own.png"));
        let covered = Pixels::of_png(&folder.read("own.png"));
        let [black, white] = shown(&folder, viewer, [240, 120]);
        let seams = (0..black.len())
            .filter(|&pixel| covered.is_covered(pixel) && most(black[pixel], white[pixel]) > 1.0);
        let seams = seams.count();
        assert!(seams > 500, "{seams} as {}", viewer.suffix());
    }
    let Some(data) = std::env::var_os("VEDUTA_DATA") else {
        println!("skipped: VEDUTA_DATA is not set, so no real models are drawn");
        return;
    };
    let data = Path::new(&data).display();
    for (scene, size) in [
        (format!("{data}/city/delft.city.json"), [320, 160]),
        (format!("{data}/models/fandisk.obj"), [120, 120]),
    ] {
        compare(&folder, &viewers, &format!("{scene} --exposure 0"), size);
    }
}
