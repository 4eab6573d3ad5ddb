//! Pictures by any lens, directly from a scene: domes, panoramas, mirror balls.
//!
//! What is seen around the eye is found as maps of the faces of a cube, as far as the lens looks at them. The picture
//! is cut into patches in which the lens is a perspective, and what patches show of the maps is diced, shaded and
//! summed up as in any picture: areas are exact in the lens's own pixels.

use super::mattes::without_mattes;
use super::{BAND_ROWS, RenderSettings, Step, find_visibility, materials_seen, render};
use crate::accumulate::{self, Picture};
use crate::dice::{
    self, Coverage, PatchDicer, PatchedBand, PatchedParts, PatchedView, VeilBuffers,
};
use crate::filter::ewa::Ewa;
use crate::reproject::patches::{CubeFace, CubeView, Patch, Subdivision, cube_views};
use crate::reproject::{Lens, Projection, Reprojection};
use crate::scene::Scene;
use crate::shade::light::Daylight;
use crate::shade::{PatchedPlaces, Radiance, Surfaces, Textures};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;
use veduta_geometry::DVec2;
use veduta_map::{Camera, ObjectId, VisibilityMap};

/// A part of a face of the cube, and what is seen in it.
#[derive(Clone, Debug)]
pub struct SeenView {
    /// The part.
    pub view: CubeView,
    /// What is seen in it.
    pub map: VisibilityMap,
}

/// What is seen around an eye, as far as a lens looks at it.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// In the order of the cube's faces; those that the lens does not look at are left out.
    pub views: Vec<SeenView>,
    /// Patches that the lens's picture is made of.
    pub patches: u64,
}

/// Finds what is seen by the lens of `projection`, whose world is that of the eye of `eye`: its right, up and, to
/// the front, where it looks. Of `eye` the place and the near plane count, which every face of the cube has.
///
/// `begin` is told of each step.
pub fn find_surroundings(
    scene: &Scene,
    eye: &Camera,
    projection: &Projection,
    mut begin: impl FnMut(Step),
) -> Surroundings {
    begin(Step::FollowingLens);
    let mut patches = 0;
    let views = cube_views(eye, |faces| {
        let touched = parts_touched(projection, faces);
        patches = touched.1;
        touched.0
    });
    let count = views.len();
    let views = views.into_iter().enumerate().map(|(index, view)| {
        begin(Step::View { index, count });
        let map = find_visibility(scene, &view.camera);
        SeenView { view, map }
    });
    Surroundings {
        views: views.collect(),
        patches,
    }
}

/// Rows of the bands of a picture of `height` rows.
fn bands(height: u32) -> impl IndexedParallelIterator<Item = Range<u32>> {
    let count = height.div_ceil(BAND_ROWS) as usize;
    (0..count).into_par_iter().map(move |band| {
        let first = band as u32 * BAND_ROWS;
        first..(first + BAND_ROWS).min(height)
    })
}

/// A rectangle around what is touched of each face, and the number of patches.
type Touched = ([Option<[DVec2; 2]>; 6], u64);

fn parts_touched(projection: &Projection, faces: &[CubeView; 6]) -> Touched {
    let subdivision = Subdivision::new(projection);
    let both = |a: Option<[DVec2; 2]>, b: Option<[DVec2; 2]>| match (a, b) {
        (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
        (one, other) => one.or(other),
    };
    let of_bands = bands(projection.height).map_init(Vec::new, |patches: &mut Vec<Patch>, rows| {
        subdivision.cut(rows, patches);
        let mut touched = [None; 6];
        for patch in &*patches {
            for (face, touched) in faces.iter().zip(&mut touched) {
                *touched = both(*touched, face.touched(patch));
            }
        }
        (touched, patches.len() as u64)
    });
    let join = |a: Touched, b: Touched| {
        let touched = std::array::from_fn(|face| both(a.0[face], b.0[face]));
        (touched, a.1 + b.1)
    };
    of_bands.reduce(|| ([None; 6], 0), join)
}

/// Makes the picture of `surroundings` of `scene` by the lens that they were found for.
pub fn render_surroundings(
    scene: &Scene,
    surroundings: &Surroundings,
    projection: &Projection,
    unlit: bool,
) -> Picture {
    let maps: Vec<Cow<VisibilityMap>> = surroundings
        .views
        .iter()
        .map(|seen| without_mattes(scene, &seen.map))
        .collect();
    let mut materials = BTreeSet::new();
    for map in &maps {
        materials.extend(materials_seen(scene, map));
    }
    let textures = Textures::new(scene, &materials);
    let looked_at: Vec<LookedAt> = surroundings
        .views
        .iter()
        .zip(&maps)
        .map(|(seen, map)| {
            let shown = map.shown_faces();
            let (camera, light) = (&map.camera, Daylight::default());
            LookedAt {
                view: PatchedView::new(&seen.view, map),
                surfaces: Surfaces::new(scene, &textures, camera, &map.faces, &shown, light, unlit),
            }
        })
        .collect();

    let (width, height) = (projection.width, projection.height);
    let mut pixels = vec![[0.0; 4]; width as usize * height as usize];
    let subdivision = Subdivision::new(projection);
    let band_pixels = width as usize * BAND_ROWS as usize;
    let of_bands = bands(height).zip(pixels.par_chunks_mut(band_pixels));
    of_bands.for_each_init(LensBuffers::default, |buffers, (rows, pixels)| {
        let first_row = rows.start;
        subdivision.cut(rows, &mut buffers.patches);
        let LensBuffers { patches, sums, .. } = buffers;
        let band = PatchedBand {
            width,
            first_row,
            patches,
        };
        sums.clear();
        sums.resize(pixels.len(), [0.0; 4]);
        for looked_at in &looked_at {
            looked_at.add(&band, &mut buffers.of_view, sums);
        }
        for (pixel, sum) in pixels.iter_mut().zip(sums) {
            *pixel = sum.map(|channel| channel as f32);
        }
    });
    Picture {
        width,
        height,
        pixels,
    }
}

/// The picture of a lens, filtered from pictures of the cube's faces of `side` pixels in place of exact areas: those
/// that the lens looks at are made, and weighed by ellipses (Greene & Heckbert 1986). Only what is needed is made; tells
/// which faces that is.
///
/// `begin` is told of each step.
///
/// # Panics
/// If `side` is 0, or the pictures are too large for the machine's memory.
pub fn render_filtered(
    scene: &Scene,
    eye: &Camera,
    projection: &Projection,
    side: u32,
    unlit: bool,
    mut begin: impl FnMut(Step),
) -> (Picture, Vec<CubeFace>) {
    begin(Step::FollowingLens);
    let lens = Lens::Perspective { fov: FRAC_PI_2 };
    let sources = CubeFace::ALL.map(|face| Projection::new(lens, face.orientation(), side, side));
    let reprojection = Reprojection::new(&sources, projection, &Ewa::default());
    let views = whole_faces(eye);
    let needs = reprojection.needs();
    let needed = |index: &usize| needs[*index].window.is_some();
    let needed: Vec<usize> = (0..views.len()).filter(needed).collect();
    let mut texels = reprojection.views();
    let settings = RenderSettings {
        width: side,
        height: side,
        unlit,
        ..RenderSettings::default()
    };
    for (index, &face) in needed.iter().enumerate() {
        let count = needed.len();
        begin(Step::View { index, count });
        let picture = render(scene, &views[face].camera, &settings, |_| {}).picture;
        texels.set(face, &picture);
    }
    begin(Step::Shading);
    texels.complete();
    let faces = needed.into_iter().map(|face| views[face].face);
    (reprojection.picture(&texels), faces.collect())
}

/// All of each face of the cube around `eye`.
fn whole_faces(eye: &Camera) -> Vec<CubeView> {
    cube_views(eye, |_| [Some([DVec2::ZERO, DVec2::ONE]); 6])
}

/// Makes the faces of the cube around `eye` as one picture, each of the size that `settings` tell: a cross as
/// seen from inside, with left, front, right and back in its second row, the top above the front and the bottom below.
/// The other squares stay empty.
///
/// `begin` is told of each step.
pub fn render_cube(
    scene: &Scene,
    eye: &Camera,
    settings: &RenderSettings,
    mut begin: impl FnMut(Step),
) -> Picture {
    let views = whole_faces(eye);
    let count = views.len();
    let (width, height) = (settings.width as usize, settings.height as usize);
    let row_of_cross = 4 * width;
    let mut pixels = vec![[0.0; 4]; row_of_cross * 3 * height];
    for (index, view) in views.iter().enumerate() {
        begin(Step::View { index, count });
        let face = render(scene, &view.camera, settings, |_| {}).picture;
        let [column, row] = match view.face {
            CubeFace::Left => [0, 1],
            CubeFace::Front => [1, 1],
            CubeFace::Right => [2, 1],
            CubeFace::Back => [3, 1],
            CubeFace::Top => [1, 0],
            CubeFace::Bottom => [1, 2],
        };
        for (j, from) in face.pixels.chunks(width).enumerate() {
            let first = (row * height + j) * row_of_cross + column * width;
            pixels[first..first + width].copy_from_slice(from);
        }
    }
    Picture {
        width: row_of_cross as u32,
        height: 3 * settings.height,
        pixels,
    }
}

/// A view ready to be made into pixels.
struct LookedAt<'a> {
    view: PatchedView<'a>,
    surfaces: Surfaces<'a>,
}

/// What a thread keeps from band to band.
#[derive(Default)]
struct LensBuffers {
    patches: Vec<Patch>,
    of_view: ViewBuffers,
    sums: Vec<[f64; 4]>,
}

#[derive(Default)]
struct ViewBuffers {
    dicer: PatchDicer,
    parts: PatchedParts,
    veils: VeilBuffers,
    radiance: Radiance,
}

impl LookedAt<'_> {
    /// Adds what a band shows of the view.
    fn add(&self, band: &PatchedBand, buffers: &mut ViewBuffers, sums: &mut [[f64; 4]]) {
        let Self { view, surfaces } = self;
        let ViewBuffers {
            dicer,
            parts,
            veils,
            radiance,
        } = buffers;
        dicer.dice(view, band, |fragment| surfaces.varies(fragment), parts);
        let places = PatchedPlaces { view, band, parts };
        surfaces.shade_on(&places, &parts.parts, radiance);
        dice::attenuate_patched(view, band, &radiance.opacities, veils, parts);
        parts.keep_shares(band.patches);
        accumulate::add_parts(&parts.parts, radiance, sums);
    }
}

/// The exact areas that opaque faces cover of the pixels of a lens's picture, for each view: what laws are measured
/// on.
pub fn lens_coverage(surroundings: &Surroundings, projection: &Projection) -> Vec<Vec<Coverage>> {
    let subdivision = Subdivision::new(projection);
    let of_view = surroundings.views.iter().map(|seen| {
        let view = PatchedView::new(&seen.view, &seen.map);
        let of_bands = bands(projection.height).map_init(Vec::new, |patches, rows| {
            let first_row = rows.start;
            subdivision.cut(rows, patches);
            let band = PatchedBand {
                width: projection.width,
                first_row,
                patches,
            };
            dice::patched_coverage(&view, &band)
        });
        of_bands.collect::<Vec<_>>().concat()
    });
    of_view.collect()
}

impl Surroundings {
    /// Number of faces that are seen.
    pub fn faces_seen(&self) -> usize {
        let mut seen: Vec<(ObjectId, u32)> = Vec::new();
        for SeenView { map, .. } in &self.views {
            let faces = map.shown_faces().into_iter();
            seen.extend(faces.map(|face| (map.faces.object(face), map.faces.source(face))));
        }
        seen.sort_unstable();
        seen.dedup();
        seen.len()
    }
}
