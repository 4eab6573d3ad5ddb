//! What `benches/peers/run.py` asks of us: scenes for the other programs, the exact picture that
//! they are held against, and our own times.

use crate::cases::Case;
use crate::exchange::Exchange;
use crate::glb;
use crate::timing::{least_times, on_one_thread};
use crate::zbuffer::ZBuffer;
use cpu_time::ThreadTime;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Duration;
use veduta::accumulate::Picture;
use veduta::dice::{PixelGrid, coverage};
use veduta::geometry::{DMat4, DVec4};
use veduta::map::Camera;
use veduta::pipeline::{RenderSettings, find_visibility, render_map};
use veduta::scene::Scene;
use veduta::visibility::{project, speculative};
use veduta_io::{PictureOptions, ReadOptions, read_scene, write_picture};

/// Rounds of measuring our own times.
const ROUNDS: u32 = 9;

/// Writes `case` for the other programs to read, see [`Exchange`]; as binary glTF if `path` ends in
/// `.glb`.
///
/// # Errors
/// When the file cannot be written.
pub fn export(case: &Case, path: &Path) -> Result<(), String> {
    let write = || {
        let mut out = BufWriter::new(File::create(path)?);
        let scene = Exchange::new(case);
        if is_glb(path) {
            glb::write(&scene, &mut out)?;
        } else {
            scene.write(&mut out)?;
        }
        out.flush()
    };
    write().map_err(|error| format!("{}: {error}", path.display()))
}

fn is_glb(path: &Path) -> bool {
    path.extension().is_some_and(|suffix| suffix == "glb")
}

/// Writes the exact picture of `case` in flat colours: areas and sums in f64, rounded to f32 at the
/// end.
///
/// # Errors
/// When the file cannot be written.
pub fn reference(case: &Case, path: &Path) -> Result<(), String> {
    let map = find_visibility(&case.scene, &case.camera);
    let grid = PixelGrid::of_frame(case.width, case.height);
    let mut sums = vec![[0.0_f64; 4]; grid.pixel_count()];
    for covered in coverage(&map, &grid) {
        for (sum, channel) in sums[covered.pixel].iter_mut().zip(case.color(covered.face)) {
            *sum += covered.area * f64::from(channel);
        }
    }
    let picture = Picture {
        width: case.width,
        height: case.height,
        pixels: sums
            .into_iter()
            .map(|sum| sum.map(|channel| channel as f32))
            .collect(),
    };
    write(path, &picture)
}

/// Our own CPU times as a line of JSON, and the picture written.
///
/// `file` is what [`export`] wrote of `case`, in either format: "load" is the time to read it, with
/// the scene made ready for projection. "render" is the sum of "project", "map" and "pixels". "zbuffer" is the
/// depth buffer of this crate from projected faces on.
///
/// # Errors
/// When a file cannot be read or written.
pub fn own_times(case: &Case, file: &Path, picture: &Path) -> Result<String, String> {
    let load = || {
        on_one_thread(|| {
            let start = ThreadTime::now();
            read(file).map(|scene| (scene, start.elapsed()))
        })
    };
    let (scene, mut load_time) = load()?;
    // The file is in eye space; a reader of models has turned it to have z up.
    let camera = Camera {
        eye_from_world: if is_glb(file) {
            EYE_FROM_Z_UP
        } else {
            DMat4::IDENTITY
        },
        ..case.camera
    };

    let settings = RenderSettings {
        width: case.width,
        height: case.height,
        unlit: true,
        ..RenderSettings::default()
    };
    let engine = speculative::Settings {
        aspect: camera.aspect(),
        ..speculative::Settings::default()
    };
    let map = on_one_thread(|| find_visibility(&scene, &camera));
    let made = on_one_thread(|| render_map(&scene, &map, &settings));
    write(picture, &made)?;

    let mut buffer = ZBuffer::new(case.width, case.height);
    let [
        mut project_time,
        mut map_time,
        mut pixel_time,
        mut zbuffer_time,
    ] = [Duration::MAX; 4];
    on_one_thread(|| {
        [project_time, map_time, pixel_time, zbuffer_time] = least_times(
            ROUNDS,
            [
                &mut || drop(project(&scene, &camera)),
                &mut || drop(speculative::find(&map.faces, &engine)),
                &mut || drop(render_map(&scene, &map, &settings)),
                &mut || buffer.find(&map.faces),
            ],
        );
    });
    // Twice more: the first read may have met a cold disk.
    for _ in 0..2 {
        load_time = load_time.min(load()?.1);
    }
    let [load, project, map_seconds, pixels, zbuffer] =
        [load_time, project_time, map_time, pixel_time, zbuffer_time]
            .map(|time| time.as_secs_f64());
    Ok(format!(
        "{{\"faces\": {}, \"load\": {load:.6}, \"project\": {project:.6}, \"map\": {map_seconds:.6}, \
         \"pixels\": {pixels:.6}, \"render\": {:.6}, \"zbuffer\": {zbuffer:.6}}}",
        map.faces.len(),
        project + map_seconds + pixels,
    ))
}

/// Eye space (x right, y down, z forward) from the world of a camera at the origin that looks along
/// +Y, with Z up.
const EYE_FROM_Z_UP: DMat4 = DMat4::from_cols(DVec4::X, DVec4::Z, DVec4::NEG_Y, DVec4::W);

fn read(file: &Path) -> Result<Scene, String> {
    if is_glb(file) {
        let loaded = read_scene(file, &ReadOptions::default());
        return loaded
            .map(|loaded| loaded.scene)
            .map_err(|error| error.to_string());
    }
    fs::read(file)
        .map_err(|error| error.to_string())
        .and_then(|bytes| Exchange::read(&bytes))
        .map(|exchange| exchange.scene())
        .map_err(|error| format!("{}: {error}", file.display()))
}

fn write(path: &Path, picture: &Picture) -> Result<(), String> {
    write_picture(path, picture, &PictureOptions::default()).map_err(|error| error.to_string())
}
