//! Pictures by any lens, directly from a scene: domes, panoramas, mirror balls.
//!
//! What is seen around the eye is found as maps of the sides of a cube, as far as the lens looks at them. The picture
//! is cut into patches in which the lens is a perspective, and what patches show of the maps is diced, shaded and
//! summed up as in any picture: areas are exact in the lens's own pixels.

use super::mattes::without_mattes;
use super::{BAND_ROWS, RenderSettings, Step, find_visibility, materials_seen, render};
use crate::accumulate::{self, Picture};
use crate::dice::{
    self, Coverage, PatchDicer, PatchedBand, PatchedParts, PatchedView, VeilBuffers,
};
use crate::filter::ewa::Ewa;
use crate::reproject::cube::{Layout, Side};
use crate::reproject::patches::{Patch, SideView, Subdivision, View, regions, side_views};
use crate::reproject::{Lens, Projection, Reprojection};
use crate::scene::Scene;
use crate::shade::light::Daylight;
use crate::shade::{PatchedPlaces, Radiance, Surfaces, Textures};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;
use veduta_geometry::{DVec2, DVec3};
use veduta_map::{Camera, ObjectId, VisibilityMap};

/// A part of a side of the cube, and what is seen in it.
#[derive(Clone, Debug)]
pub struct SeenSide {
    /// The part.
    pub part: SideView,
    /// What is seen in it.
    pub map: VisibilityMap,
}

/// What is seen around an eye, as far as a lens looks at it.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// In the order of the cube's sides; those that the lens does not look at are left out.
    pub sides: Vec<SeenSide>,
}

/// Maps of one scene, each with the view that sees it.
#[derive(Clone, Debug)]
pub struct SeenViews<'a> {
    /// What is seen.
    pub scene: &'a Scene,
    /// The views, all of one eye, and what is seen in each.
    pub views: Vec<(View, &'a VisibilityMap)>,
}

/// A picture by a lens.
#[derive(Clone, Debug)]
pub struct LensPicture {
    /// The picture.
    pub picture: Picture,
    /// Share of its area that looks where no view does, and is empty.
    pub unseen: f64,
    /// Patches that it is made of.
    pub patches: u64,
}

/// Finds what is seen by the lens of `projection`, whose world is that of the eye of `eye`: its right, up and, to
/// the front, where it looks. Of `eye` the place and the near plane count, which every side of the cube has.
///
/// `begin` is told of each step.
pub fn find_surroundings(
    scene: &Scene,
    eye: &Camera,
    projection: &Projection,
    mut begin: impl FnMut(Step),
) -> Surroundings {
    begin(Step::FollowingLens);
    let parts = side_views(eye, |sides| parts_touched(projection, sides));
    Surroundings {
        sides: find_sides(scene, parts, begin),
    }
}

/// Finds what is seen all around: the six sides of the cube around the eye of `eye`, wholly.
pub fn find_all_around(scene: &Scene, eye: &Camera, begin: impl FnMut(Step)) -> Surroundings {
    Surroundings {
        sides: find_sides(scene, whole_sides(eye).into(), begin),
    }
}

fn find_sides(scene: &Scene, parts: Vec<SideView>, mut begin: impl FnMut(Step)) -> Vec<SeenSide> {
    let count = parts.len();
    let sides = parts.into_iter().enumerate().map(|(index, part)| {
        begin(Step::View { index, count });
        let map = find_visibility(scene, part.view.camera());
        SeenSide { part, map }
    });
    sides.collect()
}

/// Rows of the bands of a picture of `height` rows.
fn bands(height: u32) -> impl IndexedParallelIterator<Item = Range<u32>> {
    let count = height.div_ceil(BAND_ROWS) as usize;
    (0..count).into_par_iter().map(move |band| {
        let first = band as u32 * BAND_ROWS;
        first..(first + BAND_ROWS).min(height)
    })
}

/// A rectangle around what is touched of each side.
type Touched = [Option<[DVec2; 2]>; 6];

/// What a lens touches of the sides of the cube.
///
/// Of what is seen in a side, the outermost lies where the lens's picture ends, or in a corner of the side: within its
/// picture a lens sees more on every side. So the patches along the picture's border are enough.
fn parts_touched(projection: &Projection, sides: &[View; 6]) -> Touched {
    let subdivision = Subdivision::new(projection);
    let both = |a: Option<[DVec2; 2]>, b: Option<[DVec2; 2]>| match (a, b) {
        (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
        (one, other) => one.or(other),
    };
    let join = |a: Touched, b: Touched| std::array::from_fn(|side| both(a[side], b[side]));
    let of_bands = bands(projection.height).map_init(Vec::new, |patches: &mut Vec<Patch>, rows| {
        subdivision.cut_border(rows, patches);
        let of_patches = patches.iter();
        let of_patches = of_patches.map(|patch| sides.map(|side| side.touched(patch)));
        of_patches.fold([None; 6], join)
    });
    let sees = |direction: DVec3| {
        let world = DVec3::new(direction.x, -direction.y, -direction.z);
        let seen = projection.image(world);
        seen.is_some_and(|point| projection.covers(point))
    };
    let corners = sides.map(|side| {
        let corners = side.corners().into_iter().filter(|&corner| sees(corner));
        let places = corners.map(|corner| side.homogeneous(corner));
        let places = places.map(|place| place.truncate() / place.z);
        places.fold(None, |box_so_far, place| both(box_so_far, Some([place; 2])))
    });
    join(of_bands.reduce(|| [None; 6], join), corners)
}

/// Makes the picture of `surroundings` of `scene` by the lens that they were found for.
pub fn render_surroundings(
    scene: &Scene,
    surroundings: &Surroundings,
    projection: &Projection,
    unlit: bool,
) -> LensPicture {
    let views = surroundings.sides.iter();
    let views = views.map(|seen| (seen.part.view, &seen.map)).collect();
    render_views(&[SeenViews { scene, views }], projection, unlit)
}

/// Makes the picture by the lens of `projection` of what is seen in views of its eye: of each scene some.
///
/// Where frames overlap, the first view shows what is seen. Where no view looks, the picture stays empty.
pub fn render_views(scenes: &[SeenViews], projection: &Projection, unlit: bool) -> LensPicture {
    let kept: Vec<SeenMaps> = scenes.iter().map(SeenMaps::new).collect();
    let all: Vec<View> = scenes
        .iter()
        .flat_map(|of| of.views.iter().map(|(view, _)| *view))
        .collect();
    let mut regions = regions(&all).into_iter();
    let mut looked_at = Vec::new();
    for (SeenViews { scene, views }, kept) in scenes.iter().zip(&kept) {
        let textures = &kept.textures;
        for (((view, _), map), regions) in views.iter().zip(&kept.maps).zip(&mut regions) {
            let shown = map.shown_faces();
            let (camera, light) = (&map.camera, Daylight::default());
            let surfaces = Surfaces::new(scene, textures, camera, &map.faces, &shown, light, unlit);
            let whole = PatchedView::new(view, map);
            let views = regions.into_iter().map(|region| whole.within(region));
            looked_at.push(LookedAt {
                views: views.collect(),
                surfaces,
            });
        }
    }

    let (width, height) = (projection.width, projection.height);
    let mut pixels = vec![[0.0; 4]; width as usize * height as usize];
    let subdivision = Subdivision::new(projection);
    let band_pixels = width as usize * BAND_ROWS as usize;
    let of_bands = bands(height).zip(pixels.par_chunks_mut(band_pixels));
    let areas = of_bands.map_init(LensBuffers::default, |buffers, (rows, pixels)| {
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
        let mut seen = 0.0;
        for looked_at in &looked_at {
            seen += looked_at.add(&band, &mut buffers.of_view, sums);
        }
        for (pixel, sum) in pixels.iter_mut().zip(sums) {
            *pixel = sum.map(|channel| channel as f32);
        }
        let all = patches.iter().map(|patch| patch.share * patch.area());
        (seen, all.sum(), patches.len() as u64)
    });
    let areas: Vec<(f64, f64, u64)> = areas.collect();
    let seen: f64 = areas.iter().map(|areas| areas.0).sum();
    let all: f64 = areas.iter().map(|areas| areas.1).sum();
    // The sums of whole pictures differ by rounding.
    let unseen = 1.0 - seen / all;
    LensPicture {
        picture: Picture {
            width,
            height,
            pixels,
        },
        unseen: if unseen > ROUNDING { unseen } else { 0.0 },
        patches: areas.iter().map(|areas| areas.2).sum(),
    }
}

/// The picture of a lens, filtered from pictures of the cube's sides of `side` pixels in place of exact areas: those
/// that the lens looks at are made, and weighed by ellipses (Greene & Heckbert 1986). Only what is needed is made; tells
/// which sides that is.
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
) -> (Picture, Vec<Side>) {
    begin(Step::FollowingLens);
    let lens = Lens::Perspective { fov: FRAC_PI_2 };
    let sources = Side::ALL.map(|of| Projection::new(lens, of.orientation(), side, side));
    let reprojection = Reprojection::new(&sources, projection, &Ewa::default());
    let views = whole_sides(eye);
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
    for (index, &row) in needed.iter().enumerate() {
        let count = needed.len();
        begin(Step::View { index, count });
        let picture = render(scene, views[row].view.camera(), &settings, |_| {}).picture;
        texels.set(row, &picture);
    }
    begin(Step::Shading);
    texels.complete();
    let sides = needed.into_iter().map(|row| views[row].side);
    (reprojection.picture(&texels), sides.collect())
}

/// All of each side of the cube around `eye`.
fn whole_sides(eye: &Camera) -> [SideView; 6] {
    Side::ALL.map(|side| SideView::whole(eye, side))
}

/// Makes the sides of the cube around `eye` as one picture, each `side` pixels wide and high, where `layout` has them.
///
/// `begin` is told of each step.
pub fn render_cube(
    scene: &Scene,
    eye: &Camera,
    layout: &Layout,
    side: u32,
    unlit: bool,
    mut begin: impl FnMut(Step),
) -> Picture {
    let settings = RenderSettings {
        width: side,
        height: side,
        unlit,
        ..RenderSettings::default()
    };
    let count = layout.cells().len();
    let mut indices = 0..count;
    layout.join(side, |of| {
        if let Some(index) = indices.next() {
            begin(Step::View { index, count });
        }
        let view = SideView::whole(eye, of).view;
        render(scene, view.camera(), &settings, |_| {}).picture
    })
}

/// Maps without mattes, and the textures of what is seen in them.
struct SeenMaps<'a> {
    maps: Vec<Cow<'a, VisibilityMap>>,
    textures: Textures<'a>,
}

impl<'a> SeenMaps<'a> {
    fn new(seen: &SeenViews<'a>) -> Self {
        let maps = seen
            .views
            .iter()
            .map(|(_, map)| without_mattes(seen.scene, map));
        let maps: Vec<Cow<VisibilityMap>> = maps.collect();
        let mut materials = BTreeSet::new();
        for map in &maps {
            materials.extend(materials_seen(seen.scene, map));
        }
        Self {
            maps,
            textures: Textures::new(seen.scene, &materials),
        }
    }
}

/// What rounding may take from a picture's area. Larger would overlook what no view sees.
const ROUNDING: f64 = 1e-12;

/// A view ready to be made into pixels.
struct LookedAt<'a> {
    /// One for each region that no view before shows.
    views: Vec<PatchedView<'a>>,
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
    /// Adds what a band shows of the view; the area in square pixels that it shows, empty or not.
    fn add(&self, band: &PatchedBand, buffers: &mut ViewBuffers, sums: &mut [[f64; 4]]) -> f64 {
        let ViewBuffers {
            dicer,
            parts,
            veils,
            radiance,
        } = buffers;
        let surfaces = &self.surfaces;
        let mut area = 0.0;
        for view in &self.views {
            dicer.dice(view, band, |fragment| surfaces.varies(fragment), parts);
            let places = PatchedPlaces { view, band, parts };
            surfaces.shade_on(&places, &parts.parts, radiance);
            dice::attenuate_patched(view, band, &radiance.opacities, veils, parts);
            parts.keep_shares(band.patches);
            accumulate::add_parts(&parts.parts, radiance, sums);
            let shown = band.patches.iter();
            let shown = shown.map(|patch| patch.share * dicer.area_shown(view, patch));
            area += shown.sum::<f64>();
        }
        area
    }
}

/// The exact areas that opaque faces cover of the pixels of a lens's picture, for each view: what laws are measured
/// on.
pub fn lens_coverage(surroundings: &Surroundings, projection: &Projection) -> Vec<Vec<Coverage>> {
    let subdivision = Subdivision::new(projection);
    let of_view = surroundings.sides.iter().map(|seen| {
        let view = PatchedView::new(&seen.part.view, &seen.map);
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
        for SeenSide { map, .. } in &self.sides {
            let faces = map.shown_faces().into_iter();
            seen.extend(faces.map(|face| (map.faces.object(face), map.faces.source(face))));
        }
        seen.sort_unstable();
        seen.dedup();
        seen.len()
    }
}
