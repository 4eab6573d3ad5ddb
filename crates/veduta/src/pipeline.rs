//! The order of the stages: the only file that knows it, with `pipeline/aovs.rs` for channels beside
//! the light, `pipeline/deep.rs` for deep pictures, `pipeline/filtered.rs` for filters that reach beyond
//! the pixel, `pipeline/frames.rs` for animations, `pipeline/lens.rs` for domes and panoramas,
//! `pipeline/local.rs` for parts of pictures, and
//! `pipeline/guests.rs` and `pipeline/mattes.rs` for what is only in composites.

mod aovs;
mod deep;
mod filtered;
mod frames;
mod guests;
mod lens;
mod local;
mod mattes;

pub use deep::{deep_window, render_deep};
pub use frames::{Extent, FrameStep, FrameWork, Frames};
pub use lens::{
    LensPicture, SeenSide, SeenViews, Surroundings, find_all_around, find_surroundings,
    lens_coverage, render_cube, render_filtered, render_surroundings, render_views,
};
pub use local::render_region;

use crate::accumulate::{self, AovSettings, Aovs, Picture};
use crate::dice::{
    self, BAND_ROWS, Bands, Dicer, GuestBuffers, GuestLight, Parts, PixelGrid, SpanDicer,
    VeilBuffers,
};
use crate::drawing::{self, Drawing, Evenness, Look};
use crate::filter::Filter;
use crate::scene::{Opacities, Opacity, Scene};
use crate::shade::light::Daylight;
use crate::shade::{Radiance, Surfaces, Textures};
use crate::visibility::multiscan;
use crate::visibility::{self, Seen, Strips, speculative};
use aovs::{AovBuffers, AovMaker};
use guests::GuestLayers;
use mattes::without_mattes;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Mutex;
use veduta_map::{
    Camera, FaceId, Faces, Guest, MaterialId, SeenScene, SeenSpans, Spans, TooFewSubScanlines,
    VisibilityMap,
};

/// How a picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// Width of the picture in pixels, at least 1.
    pub width: u32,
    /// Height of the picture in pixels, at least 1.
    pub height: u32,
    /// How areas in pixels are found.
    pub sampling: Sampling,
    /// Materials show their colour as it is, without light.
    pub unlit: bool,
    /// How what is seen around a pixel's centre is weighed. Channels beside the light and deep pictures are
    /// those of pixels, whatever the filter.
    pub filter: Filter,
    /// Channels that are made beside the light.
    pub aovs: AovSettings,
}

impl Default for RenderSettings {
    /// 1280 x 720, exact, lit, by area, light alone.
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            sampling: Sampling::Exact,
            unlit: false,
            filter: Filter::Box,
            aovs: AovSettings::default(),
        }
    }
}

/// How areas in pixels are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampling {
    /// Exactly, from a visibility map.
    #[default]
    Exact,
    /// From this many sub-scanlines in each row of pixels, without a map (Nakamae et al.).
    Multiscan(u32),
}

/// Something of a scene that its picture does not show as it should.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Shortcoming {
    /// The material is not fully opaque but was drawn so: it was made transparent after the map had been
    /// found, which does not know what is behind.
    DrawnOpaque(MaterialId),
    /// This many faces or fragments that are not fully opaque were left out.
    VeilsLeftOut(usize),
}

/// A picture, and what it does not show as it should.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture.
    pub picture: Picture,
    /// The channels that were asked for beside it.
    pub aovs: Aovs,
    /// In ascending order.
    pub shortcomings: Vec<Shortcoming>,
}

/// What [`render`] is about to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Step {
    /// Faces are put into the image plane.
    Projecting,
    /// What is seen is found.
    FindingVisibility,
    /// What a lens looks at is found out.
    FollowingLens,
    /// What is seen in a part of a face of the cube around the eye is found.
    View {
        /// Parts done before.
        index: usize,
        /// All parts.
        count: usize,
    },
    /// What is seen is made to pixels.
    Shading,
    /// A strip of a picture with more faces than pixels is found and made to pixels.
    Strip {
        /// Strips done before.
        index: usize,
        /// All strips.
        count: usize,
    },
}

/// Finds what `camera` sees of `scene`.
///
/// The map has no resolution: pictures of any size are made of it.
pub fn find_visibility(scene: &Scene, camera: &Camera) -> VisibilityMap {
    map_of(camera, visibility::project(scene, camera), [0.0, 1.0])
}

/// The map of faces that all lie in a strip of the frame.
fn map_of(camera: &Camera, faces: Faces, strip: [f64; 2]) -> VisibilityMap {
    let settings = speculative::Settings {
        aspect: camera.aspect(),
        strip,
        ..Default::default()
    };
    let Seen { opaque, veils } = speculative::find(&faces, &settings);
    VisibilityMap {
        camera: *camera,
        faces,
        opaque,
        veils,
    }
}

/// Makes the picture that `camera` takes of `scene`. `begin` is told of each step.
///
/// With more faces than pixels no map is made: strips of the picture are found one after the other.
/// Whether or not changes nothing that can be seen: areas are exact either way.
///
/// # Panics
/// If the size is 0, the picture is too large for the machine's memory, or `settings` ask for another filter
/// than the box with [`Sampling::Multiscan`]: spans have no regions to weigh.
pub fn render(
    scene: &Scene,
    camera: &Camera,
    settings: &RenderSettings,
    mut begin: impl FnMut(Step),
) -> Rendered {
    let grid = PixelGrid::of_frame(settings.width, settings.height);
    begin(Step::Projecting);
    let faces = visibility::project(scene, camera);
    if let Sampling::Multiscan(n) = settings.sampling {
        assert!(
            settings.filter == Filter::Box,
            "what multiscan finds is summed by area"
        );
        begin(Step::FindingVisibility);
        let spans = multiscan::find_spans(&faces, grid.width, grid.height, n);
        begin(Step::Shading);
        let (unlit, aovs) = (settings.unlit, settings.aovs);
        let (picture, aovs) = paint_spans(scene, camera, &faces, &spans, &grid, unlit, aovs);
        return Rendered {
            picture,
            aovs,
            shortcomings: veils_left_out(&faces),
        };
    }
    if faces.len() > grid.pixel_count() {
        let strips = faces.len().div_ceil(FACES_PER_STRIP);
        return render_strips(scene, camera, &faces, strips, settings, begin);
    }
    begin(Step::FindingVisibility);
    let map = map_of(camera, faces, [0.0, 1.0]);
    begin(Step::Shading);
    let RenderSettings {
        unlit,
        filter,
        aovs,
        ..
    } = *settings;
    let (picture, aovs) = render_channels(scene, &map, &grid, unlit, filter, aovs);
    Rendered {
        picture,
        aovs,
        shortcomings: shortcomings(scene, &map),
    }
}

/// Makes the picture of a map of `scene`, which must be the scene that the map was made of. Channels
/// beside the light are made by [`render_channels`].
///
/// # Panics
/// If the size is 0, or `settings` ask for other than [`Sampling::Exact`]: a map has no sub-scanlines.
pub fn render_map(scene: &Scene, map: &VisibilityMap, settings: &RenderSettings) -> Picture {
    assert!(
        settings.sampling == Sampling::Exact,
        "the pixels of a map are found exactly"
    );
    let grid = PixelGrid::of_frame(settings.width, settings.height);
    let (unlit, filter, aovs) = (settings.unlit, settings.filter, AovSettings::default());
    render_channels(scene, map, &grid, unlit, filter, aovs).0
}

/// Makes the picture of a map of `scene` on any grid of pixels: scaled, or a window of it. By area.
///
/// # Panics
/// If the picture is too large for the machine's memory.
pub fn render_window(scene: &Scene, map: &VisibilityMap, grid: &PixelGrid, unlit: bool) -> Picture {
    render_channels(scene, map, grid, unlit, Filter::Box, AovSettings::default()).0
}

/// [`render_window`] by any filter, with channels beside the light.
///
/// A pixel does not depend on the window: filters look at what the map has outside the grid.
///
/// # Panics
/// If the picture is too large for the machine's memory.
pub fn render_channels(
    scene: &Scene,
    map: &VisibilityMap,
    grid: &PixelGrid,
    unlit: bool,
    filter: Filter,
    aovs: AovSettings,
) -> (Picture, Aovs) {
    render_with_guests(scene, map, &[], grid, unlit, filter, aovs)
}

/// [`render_channels`] of a stored map with its guests. Channels beside the light are of the map alone, as
/// far as guests do not hide it.
///
/// # Panics
/// If the picture is too large for the machine's memory, or guests are to be seen by another filter than the
/// box: they are laid into pixels.
pub fn render_seen(
    seen: &SeenScene,
    grid: &PixelGrid,
    unlit: bool,
    filter: Filter,
    aovs: AovSettings,
) -> (Picture, Aovs) {
    let SeenScene {
        scene, map, guests, ..
    } = seen;
    assert!(
        filter == Filter::Box || guests.is_empty(),
        "guests are laid into pixels by area"
    );
    render_with_guests(scene, map, guests, grid, unlit, filter, aovs)
}

fn render_with_guests(
    scene: &Scene,
    map: &VisibilityMap,
    guests: &[Guest],
    grid: &PixelGrid,
    unlit: bool,
    filter: Filter,
    aovs: AovSettings,
) -> (Picture, Aovs) {
    let textures = Textures::new(scene, &materials_seen(scene, map));
    let mut canvas = Canvas::new(grid, filter, aovs);
    canvas.paint_map(scene, &textures, map, guests, grid, unlit, 0);
    (canvas.picture, canvas.aovs)
}

/// A picture in the making.
struct Canvas {
    picture: Picture,
    aovs: Aovs,
    filter: Filter,
    settings: AovSettings,
}

impl Canvas {
    /// Nothing yet of a picture of the size of `grid`.
    fn new(grid: &PixelGrid, filter: Filter, settings: AovSettings) -> Self {
        Self {
            picture: Picture {
                width: grid.width,
                height: grid.height,
                pixels: vec![[0.0; 4]; grid.pixel_count()],
            },
            aovs: Aovs::new(&settings, grid.pixel_count()),
            filter,
            settings,
        }
    }

    /// Makes the pixels of `grid`, which are those of the picture from row `first_row` on.
    #[expect(
        clippy::too_many_arguments,
        reason = "one caller with and one without guests"
    )]
    fn paint_map(
        &mut self,
        scene: &Scene,
        textures: &Textures,
        map: &VisibilityMap,
        guests: &[Guest],
        grid: &PixelGrid,
        unlit: bool,
        first_row: usize,
    ) {
        let guests = (!guests.is_empty()).then(|| GuestLayers::new(scene, map, guests, grid));
        // Mattes hide guests too, and are left out after that.
        let map = match guests {
            Some(_) => Cow::Borrowed(map),
            None => without_mattes(scene, map),
        };
        let map = &*map;
        let shown = map.shown_faces();
        let (camera, faces, light) = (&map.camera, &map.faces, Daylight::default());
        let surfaces = Surfaces::new(scene, textures, camera, faces, &shown, light, unlit);
        let maker = self.maker(scene, textures, camera, faces, &shown);
        let bands = Bands::new(map, *grid);
        let varies = |fragment| {
            let for_maker = maker.as_ref().is_some_and(|maker| maker.varies(fragment));
            for_maker || surfaces.varies(fragment)
        };
        let dice = |band: usize, buffers: &mut BandBuffers| {
            let BandBuffers { dicer, parts, .. } = buffers;
            dice::dice(map, &bands, band, varies, dicer, parts);
            if let Some(guests) = &guests {
                guests.touch(bands.rows(band), &mut buffers.guests, parts);
            }
        };
        let kernel = self.filter.kernel();
        // Channels are those of pixels, and made with the light by area, which a kernel's replaces.
        if kernel.is_none() || maker.is_some() {
            let blended = Blended {
                veiled: (!map.veils.is_empty()).then_some(map),
                guests: guests.as_ref(),
            };
            self.paint(&surfaces, maker.as_ref(), blended, grid, first_row, dice);
        }
        if let Some(kernel) = &kernel {
            let first = first_row * grid.width as usize;
            let light = &mut self.picture.pixels[first..first + grid.pixel_count()];
            match kernel.radius() {
                1 => filtered::paint::<2>(&surfaces, kernel, map, grid, light),
                _ => filtered::paint::<4>(&surfaces, kernel, map, grid, light),
            }
        }
    }

    /// What makes the channels beside the light, if there are any.
    fn maker<'a>(
        &self,
        scene: &'a Scene,
        textures: &'a Textures<'a>,
        camera: &'a Camera,
        faces: &'a Faces,
        shown: &'a [FaceId],
    ) -> Option<AovMaker<'a>> {
        let settings = self.settings;
        (!settings.is_empty())
            .then(|| AovMaker::new(scene, textures, camera, faces, shown, settings))
    }

    /// Makes the bands of `grid` from their parts, which `dice` finds, and what is blended with them.
    fn paint(
        &mut self,
        surfaces: &Surfaces,
        maker: Option<&AovMaker>,
        blended: Blended,
        grid: &PixelGrid,
        first_row: usize,
        dice: impl Fn(usize, &mut BandBuffers) + Sync,
    ) {
        let first = first_row * grid.width as usize;
        let light = &mut self.picture.pixels[first..first + grid.pixel_count()];
        // Bands own their pixels, so that the order in which they are put changes nothing.
        let aovs = Mutex::new(&mut self.aovs);
        let band_pixels = grid.width as usize * BAND_ROWS as usize;
        light.par_chunks_mut(band_pixels).enumerate().for_each_init(
            BandBuffers::default,
            |buffers, (band, light)| {
                dice(band, buffers);
                let row = band as u32 * BAND_ROWS;
                buffers.finish(surfaces, blended, grid, row, light);
                if let Some(maker) = maker {
                    let (parts, aov_buffers) = (&buffers.parts, &mut buffers.aovs);
                    let part = maker.make(parts, grid, row, light.len(), aov_buffers);
                    let mut aovs = aovs.lock().expect("no thread ends while it puts a band");
                    aovs.put(first + band * band_pixels, &part);
                }
            },
        );
    }
}

/// Draws a map of `scene`, which must be the scene that the map was made of, as shapes and lines, in a
/// picture of `grid`.
///
/// Each shape has one colour: that of its faces, or where it differs from point to point (textures,
/// smooth normals, colours at corners) the mean over what [`render_window`] shows of the face.
pub fn draw_window(
    scene: &Scene,
    map: &VisibilityMap,
    grid: &PixelGrid,
    unlit: bool,
    settings: &drawing::Settings,
) -> Drawing {
    let map = &*without_mattes(scene, map);
    let looks = looks(scene, map, grid, unlit);
    drawing::draw(scene, map, &looks, grid, settings)
}

/// What each fragment looks like; the same for all of a face.
fn looks(scene: &Scene, map: &VisibilityMap, grid: &PixelGrid, unlit: bool) -> Vec<Look> {
    let textures = Textures::new(scene, &materials_seen(scene, map));
    let shown = map.shown_faces();
    let (camera, faces, light) = (&map.camera, &map.faces, Daylight::default());
    let surfaces = Surfaces::new(scene, &textures, camera, faces, &shown, light, unlit);
    // Of each fragment that is not even.
    let mut sums = vec![LookSum::default(); shown.len()];
    if (0..shown.len() as u32).any(|fragment| surfaces.varies(fragment)) {
        let bands = Bands::new(map, *grid);
        let of_bands: Vec<Vec<(u32, LookSum)>> = (0..bands.len())
            .into_par_iter()
            .map_init(BandBuffers::default, |buffers, band| {
                buffers.fragment_sums(&surfaces, map, &bands, band)
            })
            .collect();
        // In the order of bands, whichever was ready first.
        for (fragment, sum) in of_bands.into_iter().flatten() {
            sums[fragment as usize].add(&sum);
        }
    }
    let mut looks = Vec::with_capacity(shown.len());
    for fragments in shown.chunk_by(|a, b| a == b) {
        let first = looks.len();
        let mut sum = LookSum::default();
        for of_fragment in &sums[first..first + fragments.len()] {
            sum.add(of_fragment);
        }
        let (object, source) = (faces.object(fragments[0]), faces.source(fragments[0]));
        let material = scene.mesh_of(object).material_of(source);
        let textures = scene.material(material);
        let has_picture =
            textures.base_color_texture.is_some() || textures.emissive_texture.is_some();
        let (radiance, evenness, opacity) = match surfaces.constant(first as u32) {
            Some(radiance) => {
                let opacity = surfaces.constant_opacity(first as u32).unwrap_or(1.0);
                (radiance, Evenness::Even, opacity)
            }
            None => {
                // An area too small for a float is too small to be seen: any colour will do.
                let share = |sum: f64, of: f64| if of > 0.0 { (sum / of) as f32 } else { 0.0 };
                let mean = |of_channel: f64| share(of_channel, sum.opacity);
                let evenness = if has_picture {
                    Evenness::Picture
                } else {
                    Evenness::Gradual
                };
                let opacity = share(sum.opacity, sum.area);
                (sum.radiance.map(mean), evenness, opacity)
            }
        };
        let look = Look {
            object,
            material,
            radiance,
            evenness,
            opacity,
        };
        looks.extend(fragments.iter().map(|_| look));
    }
    looks
}

/// Sums over what is seen of a fragment.
#[derive(Clone, Copy, Debug, Default)]
struct LookSum {
    /// Of area times opacity times radiance.
    radiance: [f64; 3],
    /// Of area times opacity.
    opacity: f64,
    /// In pixels.
    area: f64,
}

impl LookSum {
    fn of(area: f64, opacity: f64, radiance: [f32; 3]) -> Self {
        Self {
            radiance: radiance.map(|channel| area * opacity * f64::from(channel)),
            opacity: area * opacity,
            area,
        }
    }

    fn add(&mut self, other: &Self) {
        for (channel, other) in self.radiance.iter_mut().zip(other.radiance) {
            *channel += other;
        }
        self.opacity += other.opacity;
        self.area += other.area;
    }
}

/// Finds what `camera` sees of `scene` along `n` sub-scanlines of each row of a picture of `width` x
/// `height` pixels, and what that leaves out.
///
/// # Panics
/// As [`multiscan::find_spans`].
pub fn find_spans(
    scene: &Scene,
    camera: &Camera,
    [width, height]: [u32; 2],
    n: u32,
) -> (SeenSpans, Vec<Shortcoming>) {
    let faces = visibility::project(scene, camera);
    let spans = multiscan::find_spans(&faces, width, height, n);
    let left_out = veils_left_out(&faces);
    (SeenSpans::of(scene, camera, faces, &spans), left_out)
}

/// That multiscan leaves veils out, if there are any.
fn veils_left_out(faces: &Faces) -> Vec<Shortcoming> {
    let veils = faces.ids().filter(|&face| faces.is_veil(face)).count();
    let left_out = (veils > 0).then_some(Shortcoming::VeilsLeftOut(veils));
    left_out.into_iter().collect()
}

/// Makes the picture of what multiscan found on any grid of pixels, with channels beside the light.
///
/// # Errors
/// [`TooFewSubScanlines`] where the picture is enlarged too much.
///
/// # Panics
/// If the picture is too large for the machine's memory.
pub fn render_spans(
    seen: &SeenSpans,
    grid: &PixelGrid,
    unlit: bool,
    aovs: AovSettings,
) -> Result<(Picture, Aovs), TooFewSubScanlines> {
    let (frame, size) = (grid.pixels_per_frame, [grid.width, grid.height]);
    let spans = seen.spans.on_grid(frame, grid.origin, size)?;
    let (scene, camera, faces) = (&seen.scene, &seen.camera, &seen.faces);
    Ok(paint_spans(scene, camera, faces, &spans, grid, unlit, aovs))
}

/// Makes a picture of spans that lie on the rows of `grid`.
fn paint_spans(
    scene: &Scene,
    camera: &Camera,
    faces: &Faces,
    spans: &Spans,
    grid: &PixelGrid,
    unlit: bool,
    aovs: AovSettings,
) -> (Picture, Aovs) {
    let shown = spans.faces();
    let materials = shown.iter().map(|&face| material_of(scene, faces, face));
    let textures = Textures::new(scene, &materials.collect());
    let light = Daylight::default();
    let surfaces = Surfaces::new(scene, &textures, camera, faces, &shown, light, unlit);
    let fragment_of = |face: FaceId| shown.partition_point(|&shown| shown < face) as u32;
    let mut canvas = Canvas::new(grid, Filter::Box, aovs);
    let maker = canvas.maker(scene, &textures, camera, faces, &shown);
    let are_seen = scene.are_seen();
    let dice = |band: usize, buffers: &mut BandBuffers| {
        let first = band as u32 * BAND_ROWS;
        let rows = first..(first + BAND_ROWS).min(grid.height);
        let (dicer, parts) = (&mut buffers.span_dicer, &mut buffers.parts);
        dice::dice_spans(spans, rows, fragment_of, dicer, parts);
        if let Some(are_seen) = &are_seen {
            let is_seen = |fragment: u32| are_seen[faces.object(shown[fragment as usize]).index()];
            parts.boundary.retain(|part| is_seen(part.fragment));
            parts.runs.retain(|run| is_seen(run.fragment));
        }
    };
    let blended = Blended::default();
    canvas.paint(&surfaces, maker.as_ref(), blended, grid, 0, dice);
    (canvas.picture, canvas.aovs)
}

/// Faces of a strip, about, where there are more faces than pixels: enough to keep all cores at
/// work, few enough to bound memory.
const FACES_PER_STRIP: usize = 128 * 1024;

/// Makes a picture in `strips` strips of its rows or fewer, without keeping a map.
fn render_strips(
    scene: &Scene,
    camera: &Camera,
    faces: &Faces,
    strips: usize,
    settings: &RenderSettings,
    mut begin: impl FnMut(Step),
) -> Rendered {
    let frame = PixelGrid::of_frame(settings.width, settings.height);
    let height = frame.height as usize;
    let count = strips.clamp(1, height);
    let rows: Vec<usize> = (0..=count).map(|strip| strip * height / count).collect();
    // Filters look at what lies above and below a strip.
    let kernel = settings.filter.kernel();
    let reach = kernel.map_or(0.0, |kernel| f64::from(kernel.radius()) - 0.5);
    let at = |row: f64| row.clamp(0.0, height as f64) / height as f64;
    let extents = rows
        .windows(2)
        .map(|rows| [at(rows[0] as f64 - reach), at(rows[1] as f64 + reach)]);
    let strips = Strips::new(faces, extents.collect());
    let in_view = faces.ids().map(|face| material_of(scene, faces, face));
    let textures = Textures::new(scene, &in_view.collect());

    let mut canvas = Canvas::new(&frame, settings.filter, settings.aovs);
    for strip in 0..count {
        begin(Step::Strip {
            index: strip,
            count,
        });
        let map = map_of(camera, strips.cut(strip).faces, strips.extent(strip));
        let [first, end] = [rows[strip], rows[strip + 1]];
        let grid = frame.window(0.0, first as f64, frame.width, (end - first) as u32);
        canvas.paint_map(scene, &textures, &map, &[], &grid, settings.unlit, first);
    }
    // What is found from the scene itself is shown as it is.
    Rendered {
        picture: canvas.picture,
        aovs: canvas.aovs,
        shortcomings: Vec::new(),
    }
}

/// What a thread keeps from band to band.
#[derive(Default)]
struct BandBuffers {
    dicer: Dicer,
    span_dicer: SpanDicer,
    parts: Parts,
    veils: VeilBuffers,
    guests: GuestBuffers,
    guest_light: Vec<GuestLight>,
    radiance: Radiance,
    sums: Vec<[f64; 4]>,
    aovs: AovBuffers,
}

impl BandBuffers {
    /// Of the fragments in a band that are not even, ascending.
    fn fragment_sums(
        &mut self,
        surfaces: &Surfaces,
        map: &VisibilityMap,
        bands: &Bands,
        band: usize,
    ) -> Vec<(u32, LookSum)> {
        let (grid, parts) = (bands.grid(), &mut self.parts);
        let varies = |fragment| surfaces.varies(fragment);
        dice::dice(map, bands, band, varies, &mut self.dicer, parts);
        // Only what is not even costs anything to shade.
        parts.boundary.retain(|part| varies(part.fragment));
        parts.runs.retain(|run| varies(run.fragment));
        surfaces.shade(parts, grid, bands.rows(band).start, &mut self.radiance);
        let mut values: Vec<(u32, LookSum)> = Vec::new();
        // Veils come last.
        let opacities = &self.radiance.opacities;
        let opaque = std::iter::repeat_n(&1.0, parts.boundary.len() - opacities.len());
        let opacities = opaque.chain(opacities).copied().map(f64::from);
        let lit = parts.boundary.iter().zip(&self.radiance.boundary);
        for ((part, &radiance), opacity) in lit.zip(opacities) {
            let sum = LookSum::of(f64::from(part.area), opacity, radiance);
            values.push((part.fragment, sum));
        }
        for (index, run) in parts.runs.iter().enumerate() {
            let mut sum = LookSum::default();
            for &radiance in self.radiance.of_run(index) {
                sum.add(&LookSum::of(1.0, 1.0, radiance));
            }
            values.push((run.fragment, sum));
        }
        values.sort_by_key(|value| value.0);
        let of_fragments = values.chunk_by(|a, b| a.0 == b.0);
        let sum_up = |values: &[(u32, LookSum)]| {
            let mut sum = LookSum::default();
            values.iter().for_each(|value| sum.add(&value.1));
            (values[0].0, sum)
        };
        of_fragments.map(sum_up).collect()
    }

    /// Shades the parts of a band that begins at `first_row`, puts before them and between them what is
    /// blended with them, and sums all up.
    fn finish(
        &mut self,
        surfaces: &Surfaces,
        blended: Blended,
        grid: &PixelGrid,
        first_row: u32,
        pixels: &mut [[f32; 4]],
    ) {
        let Self {
            parts,
            veils,
            guests,
            guest_light,
            radiance,
            sums,
            ..
        } = self;
        surfaces.shade(parts, grid, first_row, radiance);
        let opacities = &radiance.opacities;
        let mut attenuate = |parts: &mut Parts| {
            if let Some(map) = blended.veiled {
                dice::attenuate(map, grid, first_row, opacities, veils, parts);
            }
        };
        match blended.guests {
            Some(layers) => {
                layers.lay(first_row, opacities, guests, parts, guest_light, attenuate);
            }
            None => attenuate(parts),
        }
        accumulate::box_filter(parts, radiance, sums, pixels);
        if blended.guests.is_some() {
            accumulate::add_guests(guest_light, pixels);
        }
    }
}

/// What is blended with the parts of opaque fragments.
#[derive(Clone, Copy, Default)]
struct Blended<'a> {
    /// The map, if it has veils.
    veiled: Option<&'a VisibilityMap>,
    guests: Option<&'a GuestLayers<'a>>,
}

fn material_of(scene: &Scene, faces: &Faces, face: FaceId) -> MaterialId {
    let mesh = scene.mesh_of(faces.object(face));
    mesh.material_of(faces.source(face))
}

fn materials_seen(scene: &Scene, map: &VisibilityMap) -> BTreeSet<MaterialId> {
    (0..map.fragment_count())
        .map(|fragment| material_of(scene, &map.faces, map.face_of(fragment)))
        .collect()
}

/// What [`render_map`] does not show as it should, in ascending order.
pub fn shortcomings(scene: &Scene, map: &VisibilityMap) -> Vec<Shortcoming> {
    let opaque = (0..map.opaque.len()).map(|fragment| map.opaque.face(fragment));
    drawn_opaque(scene, &map.faces, opaque)
}

/// What [`render_spans`] does not show as it should, in ascending order, beside what was left out when
/// they were found.
pub fn shortcomings_of_spans(seen: &SeenSpans) -> Vec<Shortcoming> {
    drawn_opaque(&seen.scene, &seen.faces, seen.faces.ids())
}

fn drawn_opaque(
    scene: &Scene,
    faces: &Faces,
    shown: impl Iterator<Item = FaceId>,
) -> Vec<Shortcoming> {
    let opacities = Opacities::of(scene);
    let materials: BTreeSet<MaterialId> = shown
        .filter(|&face| {
            let (object, source) = (faces.object(face), faces.source(face));
            opacities.of_face(object, source) != Opacity::Opaque
        })
        .map(|face| material_of(scene, faces, face))
        .collect();
    materials
        .into_iter()
        .map(Shortcoming::DrawnOpaque)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{AlphaMode, Image, ImageId, Material, Mesh, MeshId, Object, TextureRef};
    use veduta_geometry::{DMat4, DVec2, DVec3, Vec2, Vec3};
    use veduta_map::{Affine, Fragments, ObjectId, Projection};

    /// A scene of one mesh with one material.
    fn scene_of(mesh: Mesh, material: Material) -> Scene {
        let mesh = Mesh {
            materials: vec![(0, MaterialId(0))],
            ..mesh
        };
        mesh.check().expect("a sound mesh");
        Scene {
            objects: vec![Object {
                name: "object".into(),
                mesh: MeshId(0),
                world_from_object: DMat4::IDENTITY,
            }],
            meshes: vec![mesh],
            materials: vec![material],
            ..Scene::default()
        }
    }

    /// The map of a scene whose faces hide nothing of one another and lie before the eye. What lies
    /// outside the frame is for the window to cut off.
    fn flat_map_of(scene: &Scene, camera: Camera) -> VisibilityMap {
        let mut faces = Faces::new();
        let mut opaque = Fragments::new();
        let plane = faces.push_plane(Affine::new(0.0, 0.0, 1.0));
        for (index, object) in scene.objects.iter().enumerate() {
            let id = ObjectId(index as u32);
            let mesh = scene.mesh_of(id);
            let eye_from_object = camera.eye_from_world * object.world_from_object;
            for (source, triangle) in mesh.triangles.iter().enumerate() {
                let outline = triangle.map(|corner| {
                    let position = mesh.positions[corner as usize];
                    camera.image_from_eye(eye_from_object.transform_point3(position))
                });
                let face = faces.push(&outline, plane, id, source as u32);
                opaque.push_whole(face.expect("no face is seen edge-on"));
            }
        }
        let veils = Fragments::new();
        VisibilityMap {
            camera,
            faces,
            opaque,
            veils,
        }
    }

    fn perspective(eye: DVec3, tan_half_height: f64, aspect: f64) -> Camera {
        let projection = Projection::Perspective {
            tan_half_height,
            aspect,
        };
        Camera::looking(eye, DVec3::ZERO, DVec3::Z, projection, 0.01).expect("a sound camera")
    }

    fn parallel(eye: DVec3, height: f64, aspect: f64) -> Camera {
        let projection = Projection::Parallel { height, aspect };
        Camera::looking(eye, DVec3::ZERO, DVec3::Z, projection, 0.0).expect("a sound camera")
    }

    /// A square of the ground around the origin, cut into `cells` x `cells` pairs of triangles.
    fn ground(half: f64, cells: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for j in 0..=cells {
            for i in 0..=cells {
                let uv = DVec2::new(f64::from(i), f64::from(j)) / f64::from(cells);
                let flat = (2.0 * uv - 1.0) * half;
                mesh.positions.push(DVec3::new(flat.x, -flat.y, 0.0));
                mesh.texcoords.push(uv.as_vec2());
            }
        }
        for j in 0..cells {
            for i in 0..cells {
                let first = j * (cells + 1) + i;
                let [p, q, r, s] = [first, first + 1, first + cells + 1, first + cells + 2];
                mesh.triangles.push([p, r, q]);
                mesh.triangles.push([q, r, s]);
            }
        }
        mesh
    }

    fn unlit(width: u32, height: u32) -> RenderSettings {
        RenderSettings {
            width,
            height,
            unlit: true,
            ..RenderSettings::default()
        }
    }

    /// 8 x 8 squares of 64 x 64 texels each.
    fn checker() -> Image {
        let size = 512;
        let square = |k: u32| k / 64;
        Image {
            name: "checker".into(),
            width: size,
            height: size,
            pixels: (0..size * size)
                .map(|k| {
                    let light = (square(k % size) + square(k / size)) % 2 == 0;
                    [if light { 255 } else { 0 }; 4]
                })
                .collect(),
        }
    }

    fn textured(mesh: Mesh, image: Image) -> Scene {
        let material = Material {
            base_color: [1.0; 4],
            base_color_texture: Some(TextureRef::new(ImageId(0))),
            ..Material::default()
        };
        Scene {
            images: vec![image],
            ..scene_of(mesh, material)
        }
    }

    #[test]
    fn a_white_wall_is_white_to_the_last_pixel() {
        let material = Material {
            base_color: [1.0, 0.5, 0.25, 1.0],
            ..Material::default()
        };
        let scene = scene_of(ground(5.0, 40), material);
        let map = flat_map_of(&scene, parallel(DVec3::new(0.1, -1.0, 4.0), 3.0, 1.5));
        let picture = render_map(&scene, &map, &unlit(96, 64));
        for pixel in &picture.pixels {
            for (value, expected) in pixel.iter().zip([1.0, 0.5, 0.25, 1.0]) {
                assert!((value - expected).abs() < 1e-6, "{pixel:?}");
            }
        }
    }

    #[test]
    fn a_texture_in_perspective_is_where_the_rays_meet_it() {
        let scene = textured(ground(2.0, 3), checker());
        for camera in [
            perspective(DVec3::new(1.0, -4.0, 1.5), 0.35, 1.5),
            parallel(DVec3::new(1.0, -4.0, 1.5), 2.5, 1.5),
        ] {
            let (width, height) = (144_usize, 96_usize);
            let map = flat_map_of(&scene, camera);
            let picture = render_map(&scene, &map, &unlit(width as u32, height as u32));

            // What a ray meets, straight from the scene's description: light, dark or nothing.
            let world_from_eye = camera.eye_from_world.inverse();
            let seen = |x: f64, y: f64| {
                let image = DVec2::new(x / width as f64, y / height as f64);
                let (origin, direction) = camera.eye_ray(image);
                let origin = world_from_eye.transform_point3(origin);
                let direction = world_from_eye.transform_vector3(direction);
                let distance = -origin.z / direction.z;
                let hit = origin + distance * direction;
                let uv = DVec2::new(hit.x + 2.0, 2.0 - hit.y) / 4.0;
                let on_ground =
                    distance > 0.0 && uv.min_element() >= 0.0 && uv.max_element() <= 1.0;
                let square = (uv * 8.0).floor();
                let light = (square.x + square.y) as i64 % 2 == 0;
                let value = if light { 1.0 } else { 0.0 };
                if on_ground { [value, 1.0] } else { [0.0; 2] }
            };
            const SAMPLES: usize = 16;
            let supersampled: Vec<[f64; 2]> = (0..width * height)
                .map(|pixel| {
                    let mut sum = [0.0; 2];
                    for sample in 0..SAMPLES * SAMPLES {
                        let offset = |k: usize| (k as f64 + 0.5) / SAMPLES as f64;
                        let x = (pixel % width) as f64 + offset(sample % SAMPLES);
                        let y = (pixel / width) as f64 + offset(sample / SAMPLES);
                        let [color, alpha] = seen(x, y);
                        sum[0] += color;
                        sum[1] += alpha;
                    }
                    sum.map(|sum| sum / (SAMPLES * SAMPLES) as f64)
                })
                .collect();

            let mut squares = 0.0;
            let mut edges = 0;
            for (found, expected) in picture.pixels.iter().zip(&supersampled) {
                // The outline is exact, the rays' share of it is within a sample along each edge.
                assert!((f64::from(found[3]) - expected[1]).abs() < 2.0 / SAMPLES as f64);
                squares += (f64::from(found[0]) - expected[0]).powi(2);
                edges += usize::from(expected[0] > 0.0 && expected[0] < expected[1]);
            }
            // A trilinear look-up blurs an edge a little more than the box filter does: 0.0145 here.
            let rms = (squares / supersampled.len() as f64).sqrt();
            assert!(
                edges > 1000 && rms < 0.02,
                "off by {rms} with {edges} pixels on edges"
            );

            let mut plain = 0;
            for (row, column) in (2..height - 2).flat_map(|j| (2..width - 2).map(move |i| (j, i))) {
                let around = (row - 2..=row + 2)
                    .flat_map(|j| (column - 2..=column + 2).map(move |i| j * width + i));
                let here = supersampled[row * width + column];
                if here[1] == 1.0 && around.clone().all(|pixel| supersampled[pixel] == here) {
                    plain += 1;
                    let found = f64::from(picture.pixels[row * width + column][0]);
                    assert!((found - here[0]).abs() < 0.02, "{found} at {column}, {row}");
                }
            }
            assert!(plain > 800, "{plain} pixels are away from edges");
        }
    }

    #[test]
    fn a_square_looks_like_its_two_halves() {
        let mut halves = ground(2.0, 1);
        let ramp = |p: &DVec3| [0.5 + 0.1 * p.x, 0.5 + 0.2 * p.y, 1.0].map(|c| c as f32);
        halves.colors = halves.positions.iter().map(ramp).collect();
        let mut square = Mesh {
            triangles: Vec::new(),
            ..halves.clone()
        };
        square.push_polygon(&[2, 3, 1, 0]);
        // From outside, and from a corner of it, so that much of it is behind the eye.
        for eye in [DVec3::new(1.0, -4.0, 1.5), DVec3::new(-1.9, -1.8, 0.3)] {
            let [halves, square] = [&halves, &square].map(|mesh| {
                let scene = scene_of(mesh.clone(), Material::default());
                let map = find_visibility(&scene, &perspective(eye, 0.5, 1.5));
                render_map(&scene, &map, &unlit(90, 60))
            });
            for (a, b) in halves.pixels.iter().zip(&square.pixels) {
                for (a, b) in a.iter().zip(b) {
                    // Along the diagonal one looks at two centroids, the other at one.
                    assert!((a - b).abs() < 1e-3, "{a} and {b}");
                }
            }
        }
    }

    #[test]
    fn a_fine_pattern_far_away_is_grey() {
        let scene = textured(ground(2.0, 1), checker());
        let map = flat_map_of(
            &scene,
            perspective(DVec3::new(0.0, -500.0, 100.0), 0.003, 1.0),
        );
        let picture = render_map(&scene, &map, &unlit(5, 5));
        let [r, _, _, a] = picture.pixels[12];
        assert!(
            (r - 0.5).abs() < 0.01 && a == 1.0,
            "{:?}",
            picture.pixels[12]
        );
    }

    #[test]
    fn vertex_colours_and_normals_go_smoothly_over_a_face() {
        // Colours that are an affine function of the ground: interpolation must give it back.
        let mut mesh = ground(2.0, 2);
        let ramp = |p: DVec3| (0.5 + 0.1 * p.x + 0.2 * p.y) as f32;
        mesh.colors = mesh
            .positions
            .iter()
            .map(|&p| [ramp(p), 0.5, 1.0])
            .collect();
        let material = Material {
            base_color: [1.0; 4],
            ..Material::default()
        };
        let scene = scene_of(mesh, material);
        let camera = perspective(DVec3::new(1.0, -3.0, 1.5), 0.2, 1.0);
        let picture = render_map(&scene, &flat_map_of(&scene, camera), &unlit(40, 40));
        let world_from_eye = camera.eye_from_world.inverse();
        let eye = world_from_eye.transform_point3(DVec3::ZERO);
        for (pixel, found) in picture
            .pixels
            .iter()
            .enumerate()
            .filter(|(_, p)| p[3] > 1.0 - 1e-6)
        {
            let image = DVec2::new((pixel % 40) as f64 + 0.5, (pixel / 40) as f64 + 0.5) / 40.0;
            let direction = world_from_eye.transform_vector3(camera.eye_ray(image).1);
            let hit = eye - direction * (eye.z / direction.z);
            // A pixel is the mean of its parts at their centroids, which for an affine function
            // differs from its value at the pixel's centre by perspective only.
            assert!(
                (found[0] - ramp(hit)).abs() < 5e-3,
                "{found:?} and not {}",
                ramp(hit)
            );
            assert!((found[1] - 0.5).abs() < 1e-6 && (found[2] - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn normals_may_point_either_way() {
        let material = Material::default;
        let flat = scene_of(ground(2.0, 2), material());
        let settings = RenderSettings {
            unlit: false,
            ..unlit(20, 20)
        };
        for (eye, seen_normal) in [
            (DVec3::new(0.3, -3.0, 2.0), Vec3::Z),
            (DVec3::new(0.3, -3.0, -2.0), -Vec3::Z),
        ] {
            let camera = perspective(eye, 0.1, 1.0);
            let expected = render_map(&flat, &flat_map_of(&flat, camera), &settings);
            let light = 0.6 * Daylight::default().on(seen_normal);
            assert!(
                (Vec3::from_slice(&expected.pixels[210]) - light)
                    .abs()
                    .max_element()
                    < 1e-6
            );
            for normal in [Vec3::Z, -Vec3::Z, Vec3::ZERO] {
                // One normal differs by a hair, so that they are interpolated.
                let mut mesh = ground(2.0, 2);
                mesh.normals = vec![normal; mesh.positions.len()];
                mesh.normals[4] *= 1.000_001;
                let scene = scene_of(mesh, material());
                let picture = render_map(&scene, &flat_map_of(&scene, camera), &settings);
                for (found, expected) in picture.pixels.iter().zip(&expected.pixels) {
                    for (a, b) in found.iter().zip(expected) {
                        assert!((a - b).abs() < 1e-6, "{found:?} and not {expected:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_number_of_threads_changes_no_byte() {
        let mut mesh = ground(2.0, 30);
        mesh.normals = mesh
            .positions
            .iter()
            .map(|p| Vec3::new(p.x as f32, p.y as f32, 2.0).normalize())
            .collect();
        mesh.texcoords
            .iter_mut()
            .for_each(|uv| *uv *= Vec2::splat(3.3));
        let scene = textured(mesh, checker());
        let camera = perspective(DVec3::new(1.0, -4.0, 1.5), 0.35, 1.5);
        let settings = RenderSettings {
            width: 200,
            height: 131,
            ..RenderSettings::default()
        };
        let with_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a thread pool").install(|| {
                let picture = render_map(&scene, &flat_map_of(&scene, camera), &settings);
                let bits = |pixel: &[f32; 4]| pixel.map(f32::to_bits);
                picture.pixels.iter().map(bits).collect::<Vec<_>>()
            })
        };
        assert!(with_threads(1) == with_threads(3));
    }

    #[test]
    fn a_window_is_cut_from_the_picture() {
        let scene = textured(ground(2.0, 6), checker());
        let map = flat_map_of(&scene, perspective(DVec3::new(1.0, -4.0, 1.5), 0.35, 1.0));
        let grid = PixelGrid::of_frame(60, 60);
        let whole = render_window(&scene, &map, &grid, false);
        let window = render_window(&scene, &map, &grid.window(20.0, 33.0, 25, 19), false);
        for (index, pixel) in window.pixels.iter().enumerate() {
            let expected = whole.pixels[(33 + index / 25) * 60 + 20 + index % 25];
            for (a, b) in pixel.iter().zip(expected) {
                assert!((a - b).abs() < 1e-5, "{pixel:?} and not {expected:?}");
            }
        }
    }

    #[test]
    fn a_picture_made_in_strips_is_the_maps() {
        let leaves = crate::scene::generate::by_name("leaves20").expect("a scene");
        let mut settings = RenderSettings {
            width: 120,
            height: 77,
            ..RenderSettings::default()
        };
        let (scene, camera) = (&leaves.scene, &leaves.camera);
        let faces = visibility::project(scene, camera);
        assert!(faces.len() > 120 * 77, "a crowded picture");
        let map = find_visibility(scene, camera);
        for filter in [Filter::Box, Filter::Triangle, Filter::Mitchell] {
            settings.filter = filter;
            let expected = render_map(scene, &map, &settings);
            for strips in [1, 3, 200] {
                let found = render_strips(scene, camera, &faces, strips, &settings, |_| {});
                for (a, b) in found.picture.pixels.iter().zip(&expected.pixels) {
                    for (a, b) in a.iter().zip(b) {
                        let wrong = (a - b).abs();
                        assert!(wrong < 1e-5, "{filter:?}, {strips} strips: {a} and {b}");
                    }
                }
                assert_eq!(found.shortcomings, shortcomings(scene, &map));
            }
        }
        let mut steps = Vec::new();
        render(scene, camera, &settings, |step| steps.push(step));
        assert!(matches!(steps[1], Step::Strip { .. }), "{steps:?}");
    }

    #[test]
    fn multiscan_comes_to_the_exact_picture_with_more_sub_scanlines() {
        let scene = textured(ground(2.0, 3), checker());
        let camera = perspective(DVec3::new(1.0, -4.0, 1.5), 0.35, 1.5);
        let error_of = |n: u32| {
            let picture = |sampling| {
                let settings = RenderSettings {
                    sampling,
                    ..unlit(72, 48)
                };
                render(&scene, &camera, &settings, |_| {}).picture
            };
            let (exact, found) = (picture(Sampling::Exact), picture(Sampling::Multiscan(n)));
            let pairs = found
                .pixels
                .iter()
                .flatten()
                .zip(exact.pixels.iter().flatten());
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        // Along the nearly level far side of the ground an error of half a sub-scanline is likely.
        for n in [1, 4, 16, 64] {
            let error = error_of(n);
            assert!(error < 1.0 / n as f32, "{error} with {n} sub-scanlines");
            assert!(error > 0.0, "multiscan is not exact");
        }
    }

    #[test]
    fn scaled_spans_are_off_by_more_the_fewer_sub_scanlines_are_left() {
        let made = crate::scene::generate::by_name("balls3").expect("a generated scene");
        let camera = made.camera.with_aspect(1.5);
        let map = find_visibility(&made.scene, &camera);
        let aovs = AovSettings::default();
        // Root mean square of what the opacity is off by, scaled by `scale` along y.
        let error_of = |n: u32, scale: f64| {
            let (seen, _) = find_spans(&made.scene, &camera, [90, 60], n);
            let mut grid = PixelGrid::of_frame(90, (60.0 * scale).round() as u32);
            grid.pixels_per_frame.x *= 1.25;
            grid.origin.x = 10.5;
            let (found, _) = render_spans(&seen, &grid, true, aovs).expect("is close enough");
            let exact = render_window(&made.scene, &map, &grid, true);
            let pairs = found.pixels.iter().zip(&exact.pixels);
            let squares = pairs.map(|(a, b)| f64::from(a[3] - b[3]).powi(2));
            (squares.sum::<f64>() / grid.pixel_count() as f64).sqrt()
        };
        // With n at equal scale, then with the scale at equal n.
        for errors in [
            [64, 16, 4, 1].map(|n| error_of(n, 1.0)),
            [0.5, 1.0, 2.0, 4.0].map(|scale| error_of(8, scale)),
        ] {
            assert!(
                errors.windows(2).all(|pair| 1.3 * pair[0] < pair[1]),
                "{errors:?}"
            );
            assert!(errors[0] > 0.0, "multiscan is not exact");
        }
        // What is not scaled is what was rendered, to the last bit.
        let (seen, left_out) = find_spans(&made.scene, &camera, [90, 60], 3);
        assert_eq!(left_out, []);
        let settings = RenderSettings {
            sampling: Sampling::Multiscan(3),
            ..unlit(90, 60)
        };
        let expected = render(&made.scene, &camera, &settings, |_| {}).picture;
        let (found, _) =
            render_spans(&seen, &PixelGrid::of_frame(90, 60), true, aovs).expect("is as it was");
        assert!(found == expected);
        let enlarged = PixelGrid::of_frame(90, 181);
        let error = render_spans(&seen, &enlarged, true, aovs).expect_err("is too large");
        assert!(
            error.to_string().contains("up to 3 times as high"),
            "{error}"
        );
    }

    #[test]
    fn a_material_made_transparent_after_its_map_was_found_is_named() {
        let opaque = scene_of(ground(2.0, 2), Material::default());
        let map = flat_map_of(&opaque, perspective(DVec3::new(1.0, -4.0, 1.5), 0.35, 1.0));
        assert_eq!(shortcomings(&opaque, &map), []);
        let mut changed = opaque.clone();
        changed.materials[0].base_color[3] = 0.5;
        assert_eq!(shortcomings(&changed, &map), [], "opacity is ignored");
        changed.materials[0].alpha_mode = AlphaMode::Blend;
        let named = [Shortcoming::DrawnOpaque(MaterialId(0))];
        assert_eq!(shortcomings(&changed, &map), named);
    }

    #[test]
    fn multiscan_tells_that_it_leaves_veils_out() {
        let glass = Material {
            base_color: [1.0, 1.0, 1.0, 0.5],
            alpha_mode: AlphaMode::Blend,
            ..Material::default()
        };
        let scene = scene_of(ground(2.0, 1), glass);
        let camera = perspective(DVec3::new(1.0, -4.0, 1.5), 0.35, 1.0);
        let made = |sampling| {
            let settings = RenderSettings {
                sampling,
                ..unlit(20, 20)
            };
            render(&scene, &camera, &settings, |_| {}).shortcomings
        };
        assert_eq!(made(Sampling::Exact), []);
        assert_eq!(made(Sampling::Multiscan(2)), [Shortcoming::VeilsLeftOut(2)]);
    }
}
