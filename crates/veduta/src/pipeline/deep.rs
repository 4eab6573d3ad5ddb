//! The same stages, up to deep pixels instead of flat ones.

use super::{
    FACES_PER_STRIP, RenderSettings, Sampling, Step, map_of, material_of, materials_seen,
    without_mattes,
};
use crate::accumulate::{DeepFilter, DeepRows};
use crate::dice::{self, Bands, Dicer, Parts, PixelGrid, VeilBuffers};
use crate::scene::Scene;
use crate::shade::light::Daylight;
use crate::shade::{Radiance, Surfaces, Textures};
use crate::visibility::{self, Strips};
use rayon::prelude::*;
use veduta_map::{Camera, VisibilityMap};

/// Makes the deep picture that `camera` takes of `scene`: flat, it is the picture of
/// [`render`](super::render). `write` gets its rows from the top, some at a time; only those at work are in
/// memory. `begin` is told of each step.
///
/// # Errors
/// Whatever `write` fails with.
///
/// # Panics
/// If the size is 0, or `settings` ask for other than [`Sampling::Exact`]: spans have no depth planes.
pub fn render_deep<E>(
    scene: &Scene,
    camera: &Camera,
    settings: &RenderSettings,
    mut begin: impl FnMut(Step),
    mut write: impl FnMut(&DeepRows) -> Result<(), E>,
) -> Result<(), E> {
    assert!(
        settings.sampling == Sampling::Exact,
        "deep pixels are found exactly"
    );
    let frame = PixelGrid::of_frame(settings.width, settings.height);
    begin(Step::Projecting);
    let faces = visibility::project(scene, camera);
    if faces.len() <= frame.pixel_count() {
        begin(Step::FindingVisibility);
        let map = map_of(camera, faces, [0.0, 1.0]);
        begin(Step::Shading);
        let materials = materials_seen(scene, &map);
        let textures = Textures::new(scene, &materials);
        return write_rows(scene, &textures, &map, &frame, settings.unlit, &mut write);
    }

    // As for flat pictures, strip by strip.
    let height = frame.height as usize;
    let count = faces.len().div_ceil(FACES_PER_STRIP).clamp(1, height);
    let rows: Vec<usize> = (0..=count).map(|strip| strip * height / count).collect();
    let border = |row: usize| row as f64 / height as f64;
    let extents = rows.windows(2).map(|rows| [rows[0], rows[1]].map(border));
    let strips = Strips::new(&faces, extents.collect());
    let in_view = faces.ids().map(|face| material_of(scene, &faces, face));
    let textures = Textures::new(scene, &in_view.collect());
    for strip in 0..count {
        begin(Step::Strip {
            index: strip,
            count,
        });
        let map = map_of(camera, strips.cut(strip).faces, strips.extent(strip));
        let [first, end] = [rows[strip], rows[strip + 1]];
        let grid = frame.window(0.0, first as f64, frame.width, (end - first) as u32);
        write_rows(scene, &textures, &map, &grid, settings.unlit, &mut write)?;
    }
    Ok(())
}

/// Makes the deep picture of a map of `scene` on any grid of pixels; flat, it is that of
/// [`render_window`](super::render_window). `write` gets its rows from the top, some at a time.
///
/// # Errors
/// Whatever `write` fails with.
pub fn deep_window<E>(
    scene: &Scene,
    map: &VisibilityMap,
    grid: &PixelGrid,
    unlit: bool,
    mut write: impl FnMut(&DeepRows) -> Result<(), E>,
) -> Result<(), E> {
    let textures = Textures::new(scene, &materials_seen(scene, map));
    write_rows(scene, &textures, map, grid, unlit, &mut write)
}

/// What a thread keeps from band to band.
#[derive(Default)]
struct Buffers {
    dicer: Dicer,
    parts: Parts,
    veils: VeilBuffers,
    radiance: Radiance,
    filter: DeepFilter,
}

/// Makes the rows of `grid` and writes them, some bands at a time.
fn write_rows<E>(
    scene: &Scene,
    textures: &Textures,
    map: &VisibilityMap,
    grid: &PixelGrid,
    unlit: bool,
    write: &mut impl FnMut(&DeepRows) -> Result<(), E>,
) -> Result<(), E> {
    let map = &*without_mattes(scene, map);
    let shown = map.shown_faces();
    let (camera, faces, light) = (&map.camera, &map.faces, Daylight::default());
    let surfaces = Surfaces::new(scene, textures, camera, faces, &shown, light, unlit);
    let bands = Bands::new(map, *grid);
    // Enough to keep all threads at work; what is written does not depend on it.
    let at_once = 2 * rayon::current_num_threads();
    for first in (0..bands.len()).step_by(at_once) {
        let made: Vec<DeepRows> = (first..bands.len().min(first + at_once))
            .into_par_iter()
            .map_init(Buffers::default, |buffers, band| {
                let (dicer, parts) = (&mut buffers.dicer, &mut buffers.parts);
                dice::dice(map, &bands, band, |_| true, dicer, parts);
                let rows = bands.rows(band);
                let radiance = &mut buffers.radiance;
                surfaces.shade(parts, grid, rows.start, radiance);
                let (opacities, veils) = (&radiance.opacities, &mut buffers.veils);
                dice::attenuate(map, grid, rows.start, opacities, veils, parts);
                let mut deep = DeepRows::default();
                let band = [rows.start, rows.end - rows.start];
                let filter = &mut buffers.filter;
                filter.fill(map, grid, band, parts, radiance, &mut deep);
                deep
            })
            .collect();
        made.iter().try_for_each(&mut *write)?;
    }
    Ok(())
}
