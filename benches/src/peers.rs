//! What `benches/peers/run.py` asks of us: scenes for the other programs, the exact picture that
//! they are held against, and our own times.

use crate::cases::Case;
use crate::exchange::Exchange;
use crate::timing::{least_times, on_one_thread};
use crate::zbuffer::ZBuffer;
use cpu_time::ThreadTime;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Duration;
use veduta::accumulate::Picture;
use veduta::dice::{PixelGrid, coverage};
use veduta::pipeline::{RenderSettings, find_visibility, render_map};
use veduta::visibility::{project, speculative};
use veduta_io::{PictureOptions, write_picture};

/// Rounds of measuring our own times.
const ROUNDS: u32 = 9;

/// Writes `case` for the other programs to read, see [`Exchange`].
///
/// # Errors
/// When the file cannot be written.
pub fn export(case: &Case, path: &Path) -> Result<(), String> {
    let write = || {
        let mut out = BufWriter::new(File::create(path)?);
        Exchange::new(case).write(&mut out)?;
        out.flush()
    };
    write().map_err(|error| format!("{}: {error}", path.display()))
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
/// `file` is what [`export`] wrote of `case`: "load" is the time to read it, with the scene made
/// ready for projection. "render" is the sum of "project", "map" and "pixels". "zbuffer" is the
/// depth buffer of this crate from projected faces on.
///
/// # Errors
/// When a file cannot be read or written.
pub fn own_times(case: &Case, file: &Path, picture: &Path) -> Result<String, String> {
    let load = || -> Result<_, String> {
        let start = ThreadTime::now();
        let bytes = fs::read(file).map_err(|error| error.to_string())?;
        let scene = Exchange::read(&bytes)?.scene();
        Ok((scene, start.elapsed()))
    };
    let (scene, mut load_time) = load().map_err(|error| format!("{}: {error}", file.display()))?;
    // The file is in eye space.
    let mut camera = case.camera;
    camera.eye_from_world = veduta::geometry::DMat4::IDENTITY;

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
        let (_, time) = load().map_err(|error| format!("{}: {error}", file.display()))?;
        load_time = load_time.min(time);
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

fn write(path: &Path, picture: &Picture) -> Result<(), String> {
    write_picture(path, picture, &PictureOptions::default()).map_err(|error| error.to_string())
}
