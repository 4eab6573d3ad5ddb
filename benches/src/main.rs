//! `veduta-bench`: tables of what finding visibility costs, and files for `benches/peers`.
//!
//! CPU time of one thread, the least of several rounds in which the methods take turns, from
//! projected faces on.

use std::hint::black_box;
use std::path::Path;
use std::process::ExitCode;
use veduta::accumulate::Picture;
use veduta::filter::Filter;
use veduta::map::VisibilityMap;
use veduta::visibility::multiscan;
use veduta_bench::cases::Case;
use veduta_bench::composite::stored_times;
use veduta_bench::deep;
use veduta_bench::dome::Job;
use veduta_bench::fit::Line;
use veduta_bench::peers;
use veduta_bench::table::Table;
use veduta_bench::timing::{least_times, milliseconds, on_one_thread};
use veduta_bench::zbuffer::ZBuffer;

const USAGE: &str = "\
Usage: veduta-bench TABLE [SCENE[@WIDTHxHEIGHT]...]
       veduta-bench export SCENE[@WIDTHxHEIGHT] FILE
       veduta-bench reference SCENE[@WIDTHxHEIGHT] FILE.npy
       veduta-bench own SCENE[@WIDTHxHEIGHT] EXPORTED_FILE PICTURE.npy
       veduta-bench deep PAIR SAMPLES FOLDER
       veduta-bench difference EXACT_PICTURE PICTURE
       veduta-bench dome-files FACES WIDTH FOLDER
       veduta-bench dome-own FACES WIDTH PROFILE THREADS FOLDER
       veduta-bench dome-printed FACES WIDTH
       veduta-bench dome-two-pass FACES WIDTH FOLDER

Tables:
  n-et      multiscan with n sub-scanlines, the slope and intercept of its time over n, and
            the n that costs as much as the exact picture (Tanaka & Takahashi 1991, table 1)
  zbuffer   the exact map, and picture, against a z-buffer with one sample a pixel
  engines   all methods, supersampling included
  stored    stored maps: compositing two and eight, writing, reading, a window of a sixteenth, zoom
  filters   pixels of a map by each filter, and as a ratio to the box filter

Columns: map is the exact map alone, exact the map and its pixels. Window reads: the largest share of
the bytes over 49 windows, and the share of the fragments that touch that window. Pixels: those of a map made
anew, and those of the stored map, both at 1.5 x 1.25 times the size.

Without scenes, those that the documentation tells of.

For benches/peers:
  export     the scene in a file that the other programs read
  reference  its exact picture in flat colours
  own        our CPU seconds to that picture, as JSON
  deep       two scenes as stored maps and as deep pictures of SAMPLES x SAMPLES samples a pixel
  difference  how many pixels of a picture are off, as JSON
  dome-files  faces of a cube with zone plates, and their exact picture in a dome
  dome-own   our CPU seconds to that picture by a profile of the elliptical filter, as JSON
  dome-printed  CPU seconds of the filter as Greene & Heckbert print it
  dome-two-pass  the same picture in two passes of one dimension, and its CPU seconds, as JSON";

/// Rounds of measuring, for scenes that do not take long.
const ROUNDS: u32 = 5;

/// A table: what it tells of each scene, and of which scenes unless told.
struct Measurement {
    name: &'static str,
    scenes: &'static [&'static str],
    titles: &'static [&'static str],
    row: fn(&Case) -> Vec<String>,
}

const MEASUREMENTS: [Measurement; 5] = [
    Measurement {
        name: "stored",
        scenes: &[
            "pierce",
            "balls7",
            "bridge",
            "buildings",
            "field100k",
            "field1m@1920x1080",
        ],
        titles: &[
            "scene, ms",
            "find",
            "composite 2",
            "ratio",
            "8 at once",
            "8 in turn",
            "ratio",
            "write",
            "read",
            "kB",
            "bytes a face",
            "window reads",
            "seen there",
            "pixels",
            "zoom, pixels",
            "ratio",
        ],
        row: stored,
    },
    Measurement {
        name: "filters",
        scenes: &["balls7", "bridge@1920x1080", "field1m@1920x1080"],
        titles: &[
            "scene, ms",
            "map",
            "box",
            "triangle",
            "ratio",
            "mitchell",
            "ratio",
        ],
        row: filters,
    },
    Measurement {
        name: "n-et",
        scenes: &["radial", "buildings", "balls3", "balls7"],
        titles: &[
            "scene, ms",
            "n = 1",
            "n = 2",
            "n = 4",
            "n = 8",
            "n = 16",
            "slope",
            "intercept",
            "map",
            "exact",
            "= n",
        ],
        row: sub_scanlines,
    },
    Measurement {
        name: "zbuffer",
        scenes: &[
            "balls7@1920x1080",
            "field1m@1920x1080",
            "field10m@1920x1080",
            "leaves100@1920x1080",
            "leaves20@1920x1080",
            "leaves400@1920x1080",
            "soup@1920x1080",
            "wires@1920x1080",
            "layers@960x540",
            "bridge@1920x1080",
            "pierce@512x512",
            "balls7@512x512",
        ],
        titles: &[
            "scene, ms",
            "faces",
            "z-buffer",
            "map",
            "ratio",
            "with pixels",
            "exact",
            "ratio",
        ],
        row: against_zbuffer,
    },
    Measurement {
        name: "engines",
        scenes: &[
            "radial",
            "mesh5",
            "buildings",
            "bridge",
            "balls3",
            "balls7",
            "pierce",
            "field100k@512x512",
        ],
        titles: &[
            "scene, ms",
            "z-buffer",
            "with pixels",
            "4 x 4",
            "8 x 8",
            "multiscan 4",
            "multiscan 8",
            "map",
            "exact",
        ],
        row: engines,
    },
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((name, scenes)) = arguments.split_first() else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    if name == "--help" || name == "-h" {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    let done = match (name.as_str(), scenes) {
        ("export", [title, file]) => {
            Case::parse(title).and_then(|case| peers::export(&case, Path::new(file)))
        }
        ("reference", [title, file]) => {
            Case::parse(title).and_then(|case| peers::reference(&case, Path::new(file)))
        }
        ("own", [title, file, picture]) => Case::parse(title)
            .and_then(|case| peers::own_times(&case, Path::new(file), Path::new(picture)))
            .map(|times| println!("{times}")),
        ("deep", [pair, samples, folder]) => write_deep(pair, samples, folder),
        ("difference", [exact, picture]) => {
            deep::difference(Path::new(exact), Path::new(picture)).map(|told| println!("{told}"))
        }
        ("dome-files", [faces, width, folder]) => {
            Job::parse(faces, width).and_then(|job| job.write(Path::new(folder)))
        }
        ("dome-own", [faces, width, profile, threads, folder]) => Job::parse(faces, width)
            .and_then(|job| {
                let threads = threads.parse().map_err(|_| format!("{threads} threads"))?;
                job.own(profile, threads, Path::new(folder))
            })
            .map(|times| println!("{times}")),
        ("dome-printed", [faces, width]) => {
            Job::parse(faces, width).map(|job| println!("{:.3}", job.printed()))
        }
        ("dome-two-pass", [faces, width, folder]) => Job::parse(faces, width)
            .and_then(|job| job.two_pass(Path::new(folder)))
            .map(|times| println!("{times}")),
        _ => print_table(name, scenes),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("veduta-bench: {error}");
            ExitCode::from(2)
        }
    }
}

/// Writes the files of a pair of scenes into a folder.
///
/// # Errors
/// A sentence about what is wrong with the arguments, or could not be written.
fn write_deep(pair: &str, samples: &str, folder: &str) -> Result<(), String> {
    let count = samples
        .parse()
        .ok()
        .filter(|samples| (1..=64).contains(samples));
    let count =
        count.ok_or_else(|| format!("{samples} is not a number of samples from 1 to 64"))?;
    let told = deep::Pair::by_name(pair)?.write(Path::new(folder), count)?;
    println!("{told}");
    Ok(())
}

/// Measures and prints the table `name`.
///
/// # Errors
/// A sentence about a name that is not known.
fn print_table(name: &str, scenes: &[String]) -> Result<(), String> {
    let measurement = MEASUREMENTS
        .iter()
        .find(|measurement| measurement.name == name)
        .ok_or_else(|| format!("there is no table {name}; `--help` lists them"))?;
    let mut titles: Vec<&str> = scenes.iter().map(String::as_str).collect();
    if titles.is_empty() {
        titles = measurement.scenes.to_vec();
    }
    let mut table = Table::new(measurement.titles);
    for title in titles {
        // One at a time: the largest scene has ten million faces.
        let case = Case::parse(title)?;
        eprintln!("{}: {} faces in view", case.title(), case.faces.len());
        table.row(on_one_thread(|| (measurement.row)(&case)));
    }
    print!("{table}");
    Ok(())
}

/// Multiscan to pixels with 1, 2, 4, 8 and 16 sub-scanlines; the line through these times; the n at
/// which it meets the exact picture's. (The paper counts inserted sub-scanlines, one less than n.)
fn sub_scanlines(case: &Case) -> Vec<String> {
    const COUNTS: [u32; 5] = [1, 2, 4, 8, 16];
    let scan = |n| move || multiscan_picture(case, n);
    let [mut n1, mut n2, mut n4, mut n8, mut n16] = COUNTS.map(scan);
    let mut map = case.empty_map();
    let [find, exact, scans @ ..] = least_times(
        ROUNDS,
        [
            &mut || exact_map(case),
            &mut || exact_picture(case, &mut map),
            &mut n1,
            &mut n2,
            &mut n4,
            &mut n8,
            &mut n16,
        ],
    )
    .map(milliseconds);
    let points: Vec<(f64, f64)> = COUNTS.map(f64::from).into_iter().zip(scans).collect();
    let line = Line::through(&points);
    let mut row = vec![case.title()];
    row.extend(scans.map(ms));
    row.extend([line.slope, line.intercept, find, exact].map(ms));
    row.push(format!("{:.1}", line.x_of(exact)));
    row
}

/// The z-buffer and the exact map; both to pixels.
fn against_zbuffer(case: &Case) -> Vec<String> {
    let mut buffer = ZBuffer::new(case.width, case.height);
    let mut sampling = Supersampling::new(case, 1);
    let mut map = case.empty_map();
    let [z, find, z_picture, exact] = least_times(
        ROUNDS,
        [
            &mut || buffer.find(&case.faces),
            &mut || exact_map(case),
            &mut || sampling.run(case),
            &mut || exact_picture(case, &mut map),
        ],
    )
    .map(milliseconds);
    vec![
        case.title(),
        case.faces.len().to_string(),
        ms(z),
        ms(find),
        format!("{:.1}", find / z),
        ms(z_picture),
        ms(exact),
        format!("{:.1}", exact / z_picture),
    ]
}

/// Stored maps beside finding what is seen.
fn stored(case: &Case) -> Vec<String> {
    let times = stored_times(case);
    vec![
        case.title(),
        ms(times.find),
        ms(times.two),
        format!("{:.2}", times.two / times.find),
        ms(times.eight),
        ms(times.chain),
        format!("{:.2}", times.eight / times.chain),
        ms(times.write),
        ms(times.read),
        (times.bytes / 1000).to_string(),
        format!("{:.0}", times.bytes_per_face),
        format!("{:.3}", times.window),
        format!("{:.3}", times.in_window),
        ms(times.pixels),
        ms(times.zoom),
        format!("{:.2}", times.zoom / times.pixels),
    ]
}

/// From a map to pixels, by filters of radius 1/2, 1 and 2. All cubics take as long as Mitchell's.
fn filters(case: &Case) -> Vec<String> {
    let mut map = case.empty_map();
    case.find_into(&mut map);
    let picture = |filter| black_box(case.picture_of(&map, filter));
    let [find, sharp, triangle, mitchell] = least_times(
        ROUNDS,
        [
            &mut || exact_map(case),
            &mut || drop(picture(Filter::Box)),
            &mut || drop(picture(Filter::Triangle)),
            &mut || drop(picture(Filter::Mitchell)),
        ],
    )
    .map(milliseconds);
    let ratio = |time: f64| format!("{:.1}", time / sharp);
    vec![
        case.title(),
        ms(find),
        ms(sharp),
        ms(triangle),
        ratio(triangle),
        ms(mitchell),
        ratio(mitchell),
    ]
}

/// All methods.
fn engines(case: &Case) -> Vec<String> {
    let mut buffer = ZBuffer::new(case.width, case.height);
    let [mut one, mut four, mut eight] = [1, 4, 8].map(|n| Supersampling::new(case, n));
    let mut map = case.empty_map();
    let times = least_times(
        ROUNDS,
        [
            &mut || buffer.find(&case.faces),
            &mut || one.run(case),
            &mut || four.run(case),
            &mut || eight.run(case),
            &mut || multiscan_picture(case, 4),
            &mut || multiscan_picture(case, 8),
            &mut || exact_map(case),
            &mut || exact_picture(case, &mut map),
        ],
    );
    let mut row = vec![case.title()];
    row.extend(times.map(milliseconds).map(ms));
    row
}

fn exact_map(case: &Case) {
    black_box(case.find_exactly());
}

/// Finds what is seen, puts it into `map`, which has the case's faces, and makes the picture.
fn exact_picture(case: &Case, map: &mut VisibilityMap) {
    black_box(case.picture_exactly(map));
}

fn multiscan_picture(case: &Case, n: u32) {
    let spans = multiscan::find_spans(&case.faces, case.width, case.height, n);
    black_box(multiscan::picture(&spans, |face| case.color(face)));
}

/// A z-buffer with `n` x `n` samples for each pixel, and the picture made of it.
struct Supersampling {
    n: u32,
    buffer: ZBuffer,
    picture: Picture,
}

impl Supersampling {
    fn new(case: &Case, n: u32) -> Self {
        Self {
            n,
            buffer: ZBuffer::new(n * case.width, n * case.height),
            picture: case.empty_picture(),
        }
    }

    fn run(&mut self, case: &Case) {
        self.buffer.find(&case.faces);
        let color = |face| case.color(face);
        self.buffer
            .resolve(self.n as usize, color, &mut self.picture);
        black_box(&self.picture);
    }
}

/// Three digits or more, as the spread allows no others.
fn ms(milliseconds: f64) -> String {
    match milliseconds.abs() {
        long if long >= 100.0 => format!("{milliseconds:.0}"),
        long if long >= 10.0 => format!("{milliseconds:.1}"),
        _ => format!("{milliseconds:.2}"),
    }
}
