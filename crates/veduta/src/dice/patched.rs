//! Dicing where the picture is made of patches, each a small perspective picture of the same views.
//!
//! What lies in a patch of a fragment is found in the patch's own barycentric coordinates, which are linear in the
//! directions of the eye: there the patch's sides are the planes where one of three numbers is 0, and what is
//! behind the eye needs no care. Neighbouring fragments are cut alike, each common edge from the same end, so that
//! they fill a patch without gap or overlap.
//!
//! Input: [`PatchedView`]s, maps with an index of what is seen where, and the patches of a band. Output:
//! [`PatchedParts`], parts with the patch in which each lies.

use super::coverage::summed;
use super::fragment_index::FragmentIndex;
use super::place::PixelClip;
use super::veils::{Ground, VeilBuffers, attenuate_on};
use super::{Coverage, Diced, Part, Parts, Run};
use crate::reproject::patches::{Patch, Region, View};
use std::cell::RefCell;
use std::ops::Range;
use std::sync::Arc;
use veduta_geometry::{Affine, Cells, DMat3, DVec2, DVec3, GridAreas, signed_area};
use veduta_map::VisibilityMap;

/// A map made ready to be looked up by patches.
pub struct PatchedView<'a> {
    view: &'a View,
    map: &'a VisibilityMap,
    /// What of its frame is shown.
    region: Region,
    direction_from_image: DMat3,
    index: Arc<FragmentIndex>,
}

impl<'a> PatchedView<'a> {
    /// The map that the camera of `view` sees, all of it.
    pub fn new(view: &'a View, map: &'a VisibilityMap) -> Self {
        Self {
            view,
            map,
            region: Region::new(),
            direction_from_image: view.direction_from_image(),
            index: Arc::new(FragmentIndex::new(map)),
        }
    }

    /// The same map where only a region of it is shown.
    pub fn within(&self, region: Region) -> Self {
        Self {
            region,
            index: Arc::clone(&self.index),
            ..*self
        }
    }

    /// The map.
    pub fn map(&self) -> &'a VisibilityMap {
        self.map
    }

    /// What sees it.
    pub fn view(&self) -> &'a View {
        self.view
    }
}

/// Parts of a band, each with the patch in which it lies.
///
/// A pixel may have several parts of one fragment, one for each patch that touches it, and no run reaches beyond
/// its patch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PatchedParts {
    /// The parts; those of veils come last.
    pub parts: Parts,
    /// The patch of each of [`Parts::boundary`].
    boundary_patches: Vec<u32>,
    /// The patch of each of [`Parts::runs`].
    run_patches: Vec<u32>,
}

impl PatchedParts {
    fn clear(&mut self) {
        self.parts.clear();
        self.boundary_patches.clear();
        self.run_patches.clear();
    }

    /// The patch in which a part lies, by its row of [`Parts::boundary`].
    pub fn patch_of_part(&self, index: usize) -> u32 {
        self.boundary_patches[index]
    }

    /// The patch in which a run lies, by its row of [`Parts::runs`].
    pub fn patch_of_run(&self, index: usize) -> u32 {
        self.run_patches[index]
    }

    /// Takes of each part what the rim of the picture leaves of it ([`Patch::share`]).
    pub fn keep_shares(&mut self, patches: &[Patch]) {
        for (part, &patch) in self.parts.boundary.iter_mut().zip(&self.boundary_patches) {
            part.area = (f64::from(part.area) * patches[patch as usize].share) as f32;
        }
    }
}

/// A band of a patched picture.
#[derive(Clone, Copy)]
pub struct PatchedBand<'a> {
    /// Pixels in a row.
    pub width: u32,
    /// The rows of the band.
    pub first_row: u32,
    /// Its patches.
    pub patches: &'a [Patch],
}

impl PatchedBand<'_> {
    /// Top left corner in the picture of a pixel that is counted from the band's first one.
    pub fn corner(&self, pixel: u32) -> DVec2 {
        let row = self.first_row + pixel / self.width;
        DVec2::new(f64::from(pixel % self.width), f64::from(row))
    }

    fn pixel(&self, column: u32, row: u32) -> u32 {
        (row - self.first_row) * self.width + column
    }
}

/// Finds what is seen in patches, in buffers that it keeps.
#[derive(Clone, Debug, Default)]
pub struct PatchDicer {
    near: Vec<u32>,
    placer: PatchPlacer,
    areas: GridAreas,
    veils: PatchedParts,
}

impl PatchDicer {
    /// Dices what the patches of a band show of a view; `diced` is overwritten. `varies` is that of
    /// [`dice`](super::dice).
    pub fn dice(
        &mut self,
        view: &PatchedView,
        band: &PatchedBand,
        varies: impl Fn(u32) -> bool,
        diced: &mut PatchedParts,
    ) {
        diced.clear();
        self.veils.clear();
        let first_veil = view.map.opaque.len();
        for (patch, index) in band.patches.iter().zip(0..) {
            if !view.fragments_near(patch, &mut self.near) {
                continue;
            }
            let looks = view.weights_from_image(patch);
            let opaque = self.near.partition_point(|&k| (k as usize) < first_veil);
            let before = self.veils.parts.boundary.len();
            for k in opaque..self.near.len() {
                self.add(view, band, index, looks, k, true, None, diced);
            }
            let has_veils = self.veils.parts.boundary.len() > before;
            for k in 0..opaque {
                let varies = varies(self.near[k]);
                self.add(view, band, index, looks, k, varies, Some(has_veils), diced);
            }
        }
        let PatchedParts {
            parts,
            boundary_patches,
            ..
        } = &mut self.veils;
        diced.parts.boundary.append(&mut parts.boundary);
        diced.boundary_patches.append(boundary_patches);
    }

    /// Adds what is seen of fragment `near[k]` in a patch. Of an opaque one `veiled` tells whether veils are seen in
    /// the patch, so that there are no runs.
    #[expect(
        clippy::too_many_arguments,
        reason = "the body of a loop over two kinds of fragments"
    )]
    fn add(
        &mut self,
        view: &PatchedView,
        band: &PatchedBand,
        patch: u32,
        looks: DMat3,
        k: usize,
        centroids: bool,
        veiled: Option<bool>,
        diced: &mut PatchedParts,
    ) {
        let fragment = self.near[k];
        let in_patch = &band.patches[patch as usize];
        let polygon = self.placer.place(view, in_patch, looks, fragment);
        if polygon.is_empty() {
            return;
        }
        let PatchedParts {
            parts,
            boundary_patches,
            run_patches,
        } = match veiled {
            Some(_) => diced,
            None => &mut self.veils,
        };
        let mut push = |part: Part| {
            parts.boundary.push(part);
            boundary_patches.push(patch);
        };
        let rows = rows_of(polygon);
        Parts::each_cell(
            &mut self.areas,
            polygon,
            band.width,
            rows,
            centroids,
            |cells| match cells {
                Cells::Boundary { column, row, area } => {
                    push(Part::new(band.pixel(column, row), fragment, &area));
                }
                Cells::Inside { row, columns } if veiled == Some(false) => {
                    parts.runs.push(Run {
                        pixel: band.pixel(columns.start, row),
                        length: columns.len() as u32,
                        fragment,
                    });
                    run_patches.push(patch);
                }
                Cells::Inside { row, columns } => columns.for_each(|column| {
                    push(Part::whole(band.pixel(column, row), fragment));
                }),
            },
        );
    }

    /// Area in square pixels that a view shows of a patch, whether something is seen there or not.
    pub fn area_shown(&mut self, view: &PatchedView, patch: &Patch) -> f64 {
        if view.region.is_empty() && view.view.sees_all_of(patch) {
            return patch.area();
        }
        if view.view.touched(patch).is_none() {
            return 0.0;
        }
        let frame = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(DVec2::from);
        let looks = view.weights_from_image(patch);
        let polygon = self
            .placer
            .place_polygon(&frame, &view.region, patch, looks);
        if polygon.is_empty() {
            return 0.0;
        }
        signed_area(polygon)
    }

    /// What opaque faces cover of the pixels of a band, in order of pixels and faces.
    fn coverage(&mut self, view: &PatchedView, band: &PatchedBand) -> Vec<Coverage> {
        let mut rows = Vec::new();
        for patch in band.patches {
            if !view.fragments_near(patch, &mut self.near) {
                continue;
            }
            let looks = view.weights_from_image(patch);
            for &fragment in &self.near {
                if fragment as usize >= view.map.opaque.len() {
                    continue;
                }
                let polygon = self.placer.place(view, patch, looks, fragment);
                if polygon.is_empty() {
                    continue;
                }
                let face = view.map.face_of(fragment as usize);
                let mut push = |column: u32, row: u32, area: f64| {
                    rows.push(Coverage {
                        pixel: row as usize * band.width as usize + column as usize,
                        face,
                        area: area * patch.share,
                    });
                };
                self.areas
                    .each_cell(polygon, band.width, rows_of(polygon), |cells| match cells {
                        Cells::Boundary { column, row, area } => push(column, row, area),
                        Cells::Inside { row, columns } => {
                            columns.for_each(|column| push(column, row, 1.0));
                        }
                    });
            }
        }
        summed(rows)
    }
}

/// The exact areas that opaque faces of a view cover of the pixels of a band, ascending by pixel and face: what laws
/// are measured on, as [`coverage`](super::coverage) is.
pub fn patched_coverage(view: &PatchedView, band: &PatchedBand) -> Vec<Coverage> {
    PatchDicer::default().coverage(view, band)
}

/// Makes of each part's area what is seen of it behind the veils before it, as [`attenuate`](super::attenuate) does.
/// In each patch of a pixel, surfaces have an order of their own.
pub fn attenuate_patched(
    view: &PatchedView,
    band: &PatchedBand,
    opacities: &[f32],
    buffers: &mut VeilBuffers,
    diced: &mut PatchedParts,
) {
    let PatchedParts {
        parts,
        boundary_patches,
        ..
    } = diced;
    let ground = PatchedGround {
        view,
        band,
        patches: boundary_patches,
        placer: RefCell::default(),
    };
    attenuate_on(&ground, view.map, opacities, buffers, parts);
}

/// Where the parts of a band lie.
struct PatchedGround<'a> {
    view: &'a PatchedView<'a>,
    band: &'a PatchedBand<'a>,
    patches: &'a [u32],
    /// Buffers, which the clips of a band share.
    placer: RefCell<PatchPlacer>,
}

impl Ground for PatchedGround<'_> {
    /// Pixel and patch.
    type Place = (u32, u32);

    fn place_of(&self, part: usize, pixel: u32) -> (u32, u32) {
        (pixel, self.patches[part])
    }

    fn clip<'b>(
        &self,
        (pixel, patch): (u32, u32),
        fragment: u32,
        clip: &'b mut PixelClip,
    ) -> &'b [DVec2] {
        let patch = &self.band.patches[patch as usize];
        let looks = self.view.weights_from_image(patch);
        let mut placer = self.placer.borrow_mut();
        let polygon = placer.place(self.view, patch, looks, fragment);
        let corner = self.band.corner(pixel);
        clip.clip_placed(polygon.iter().map(|&point| point - corner))
    }

    fn nearness(&self, (pixel, patch): (u32, u32), plane: &Affine) -> Affine {
        let function = self.view.view.along_directions(plane);
        let patch = &self.band.patches[patch as usize];
        patch.along_picture(function, self.band.corner(pixel))
    }
}

impl PatchedView<'_> {
    /// Finds the fragments that may be seen in a patch, ascending; tells whether there are any.
    fn fragments_near(&self, patch: &Patch, near: &mut Vec<u32>) -> bool {
        near.clear();
        if let Some(extent) = self.view.touched(patch) {
            self.index.find(extent, near);
        }
        !near.is_empty()
    }

    /// The weights of a patch's corners as linear functions of (x, y, 1) of the image plane.
    fn weights_from_image(&self, patch: &Patch) -> DMat3 {
        let columns = &self.direction_from_image;
        DMat3::from_cols(
            patch.weights(columns.x_axis),
            patch.weights(columns.y_axis),
            patch.weights(columns.z_axis),
        )
    }
}

/// Lays fragments into patches, in buffers that it keeps.
#[derive(Clone, Debug, Default)]
struct PatchPlacer {
    weights: Vec<DVec3>,
    clipped: Vec<DVec3>,
    polygon: Vec<DVec2>,
}

impl PatchPlacer {
    /// What of a fragment lies in a patch, in pixels of the picture, positively wound; nothing if that has no area.
    fn place(
        &mut self,
        view: &PatchedView,
        patch: &Patch,
        weights_from_image: DMat3,
        fragment: u32,
    ) -> &[DVec2] {
        let map = view.map;
        let polygon = map.polygon(map.fragment(fragment as usize));
        self.place_polygon(polygon, &view.region, patch, weights_from_image)
    }

    /// The same for a polygon of the image plane, of which a region is shown.
    fn place_polygon(
        &mut self,
        polygon: &[DVec2],
        region: &Region,
        patch: &Patch,
        weights_from_image: DMat3,
    ) -> &[DVec2] {
        let m = &weights_from_image;
        self.weights.clear();
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.weights.extend(polygon.iter().map(|p| {
            let weights = m.x_axis * p.x + m.y_axis * p.y + m.z_axis;
            (least, most) = (least.min(weights), most.max(weights));
            weights
        }));
        self.polygon.clear();
        if most.cmple(DVec3::ZERO).any() {
            return &self.polygon;
        }
        for side in 0..3 {
            if least[side] < 0.0 {
                self.clip(|weights| weights[side], Some(side));
            }
        }
        for side in region {
            // A direction is the sum of the corners', by their weights.
            let at_corners = DVec3::from(patch.directions().map(|corner| side.dot(corner)));
            self.clip(|weights| weights.dot(at_corners), None);
        }
        if self.weights.len() < 3 {
            return &self.polygon;
        }
        let points = self.weights.iter().map(|&weights| patch.point(weights));
        self.polygon.extend(points);
        let area = signed_area(&self.polygon);
        if area < 0.0 {
            // A mirror turns everything over.
            self.polygon.reverse();
        } else if area.is_nan() || area == 0.0 {
            self.polygon.clear();
        }
        &self.polygon
    }

    /// Keeps that where a linear function is not negative (Sutherland and Hodgman); where it is a weight, its number
    /// is told, since on the border it is 0 and not almost.
    fn clip(&mut self, function: impl Fn(DVec3) -> f64, weight: Option<usize>) {
        self.clipped.clear();
        let Some(&last) = self.weights.last() else {
            return;
        };
        let mut p = last;
        for &q in &self.weights {
            let (a, b) = (function(p), function(q));
            if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
                // From the inner end, so that both neighbours of an edge find the same point.
                let [(inner, x), (outer, y)] = if a > 0.0 {
                    [(p, a), (q, b)]
                } else {
                    [(q, b), (p, a)]
                };
                let mut at = inner + (outer - inner) * (x / (x - y));
                if let Some(side) = weight {
                    at[side] = 0.0;
                }
                self.clipped.push(at);
            }
            if b >= 0.0 {
                self.clipped.push(q);
            }
            p = q;
        }
        std::mem::swap(&mut self.weights, &mut self.clipped);
    }
}

/// The rows that a polygon touches.
fn rows_of(polygon: &[DVec2]) -> Range<u32> {
    let heights = polygon.iter().map(|p| p.y);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
        (low.min(y), high.max(y))
    });
    low.max(0.0) as u32..high.ceil() as u32
}
