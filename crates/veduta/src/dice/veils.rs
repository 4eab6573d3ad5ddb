//! Veils in pixels: what is seen of each part through the veils before it.
//!
//! Blending has an order from front to back, which faces as wholes need not have. In a pixel it is
//! found point by point: what is seen of a surface S with opacity α is
//!
//! ```text
//!     ∫   α  ∏ (1 - α_V) dA      over S, the product over the veils V that are nearer at the point
//! ```
//!
//! and these sum up to what covers the pixel. Opaque fragments have α = 1, and no veil behind them is
//! left in the map. A part of a veil has one opacity.
//!
//! - Where the veils of a pixel have an order, they are taken from the front: the pixel is cut into
//!   regions of equal transmittance, which begin as one. Veils that fill the pixel cut nothing.
//! - Where planes cross or veils lie one over the other in a circle, each surface is cut by all the
//!   others' nearer parts: exact without an order, and more work.
//! - Where there is no order and more than [`MOST_UNORDERED`] veils, the pixel is quartered, and its
//!   quarters, until there are fewer. Only for more than [`MOST_QUARTERED`] veils, and in cells of
//!   1/32 pixel with more than [`MOST_UNORDERED`], the order of their planes at the centre is taken for
//!   theirs. Areas stay exact there, and so does their sum; what may be wrong is which of two is in
//!   front.

use super::place::PixelClip;
use super::{Diced, Measure, PixelGrid};
use std::ops::Range;
use veduta_geometry::{Affine, DVec2, cross, signed_area};
use veduta_map::{FaceId, VisibilityMap};

/// Up to so many veils in a pixel that have no order are cut by one another. The work grows with the
/// fourth power of their number.
const MOST_UNORDERED: usize = 16;

/// In pixels with more veils no order is looked for but that at the centre, since looking grows with the
/// square of their number. Foliage far away has hundreds in a pixel.
const MOST_QUARTERED: usize = 64;

/// How often a pixel is quartered.
const QUARTERINGS: u32 = 5;

/// Buffers that [`attenuate`] keeps.
#[derive(Clone, Debug, Default)]
pub struct VeilBuffers<M = f64> {
    veiled: Vec<bool>,
    layers: Vec<Layer<M>>,
    /// Corners of the layers' polygons, from the pixel's corner.
    points: Vec<DVec2>,
    clip: PixelClip,
    cutter: Cutter,
}

/// A veil in a pixel, or in a cell of one.
#[derive(Clone, Copy, Debug)]
struct Layer<M = f64> {
    /// Its part.
    part: u32,
    face: FaceId,
    /// Nearness from the pixel's corner, in pixels.
    plane: Affine,
    opacity: f64,
    /// Of its polygon.
    measure: M,
    /// Its polygon: rows of the points.
    start: u32,
    end: u32,
    extent: Extent,
}

impl<M> Layer<M> {
    fn polygon<'a>(&self, points: &'a [DVec2]) -> &'a [DVec2] {
        &points[self.start as usize..self.end as usize]
    }

    /// Whether this one hides `other` where both have the same nearness.
    fn wins_tie(&self, other: &Self) -> bool {
        self.face < other.face
    }
}

/// Where the parts of a band lie.
pub(super) trait Ground {
    /// A region of a pixel, in which surfaces have an order of their own.
    type Place: Copy + Ord;

    /// Where a part lies, by its place in [`Parts::boundary`](super::Parts::boundary).
    fn place_of(&self, part: usize, pixel: u32) -> Self::Place;

    /// What of a fragment lies there, measured from the pixel's top left corner.
    fn clip<'b>(&self, place: Self::Place, fragment: u32, clip: &'b mut PixelClip) -> &'b [DVec2];

    /// Nearness there as a function of pixel coordinates from that corner, up to a factor that is positive
    /// and the same for all.
    fn nearness(&self, place: Self::Place, plane: &Affine) -> Affine;
}

/// A band of a pixel grid that lies on the image plane of a map.
struct BandOfGrid<'a> {
    map: &'a VisibilityMap,
    grid: &'a PixelGrid,
    first_row: u32,
}

impl BandOfGrid<'_> {
    /// Top left corner of a pixel in the grid.
    fn corner(&self, pixel: u32) -> DVec2 {
        let row = self.first_row + pixel / self.grid.width;
        DVec2::new(f64::from(pixel % self.grid.width), f64::from(row))
    }
}

impl Ground for BandOfGrid<'_> {
    type Place = u32;

    fn place_of(&self, _part: usize, pixel: u32) -> u32 {
        pixel
    }

    fn clip<'b>(&self, pixel: u32, fragment: u32, clip: &'b mut PixelClip) -> &'b [DVec2] {
        clip.clip(self.map, self.grid, fragment, self.corner(pixel))
    }

    fn nearness(&self, pixel: u32, plane: &Affine) -> Affine {
        self.grid.affine_in_pixels(plane, self.corner(pixel))
    }
}

/// Makes of each part's area, or moments, those of what is seen of it: see
/// [`Part::area`](super::Part::area).
///
/// `opacities` are those of the parts of veils, which are the last of `diced`. The parts are of the band
/// of `grid` that begins at row `first_row`.
pub fn attenuate<D: Diced>(
    map: &VisibilityMap,
    grid: &PixelGrid,
    first_row: u32,
    opacities: &[f32],
    buffers: &mut VeilBuffers<D::Measure>,
    diced: &mut D,
) {
    let ground = BandOfGrid {
        map,
        grid,
        first_row,
    };
    attenuate_on(&ground, map, opacities, buffers, diced);
}

/// [`attenuate`] for parts that lie on any ground.
pub(super) fn attenuate_on<G: Ground, D: Diced>(
    ground: &G,
    map: &VisibilityMap,
    opacities: &[f32],
    buffers: &mut VeilBuffers<D::Measure>,
    diced: &mut D,
) {
    let boundary = &diced.parts().boundary;
    let first_veil = boundary.len() - opacities.len();
    let Some(last) = boundary[first_veil..].iter().map(|p| p.pixel).max() else {
        return;
    };
    let veiled = &mut buffers.veiled;
    veiled.clear();
    veiled.resize(last as usize + 1, false);
    for part in &boundary[first_veil..] {
        veiled[part.pixel as usize] = true;
    }
    let rows = boundary.iter().enumerate();
    let is_veiled = |pixel: u32| veiled.get(pixel as usize).copied().unwrap_or(false);
    let mut entries: Vec<(G::Place, u32)> = rows
        .filter(|(_, part)| is_veiled(part.pixel))
        .map(|(row, part)| (ground.place_of(row, part.pixel), row as u32))
        .collect();
    entries.sort_unstable();
    for of_place in entries.chunk_by(|a, b| a.0 == b.0) {
        let opaque = of_place.partition_point(|&(_, part)| (part as usize) < first_veil);
        let (opaque, veils) = of_place.split_at(opaque);
        if veils.is_empty() {
            continue;
        }
        let mut pixel = Pixel {
            map,
            ground,
            place: of_place[0].0,
            diced,
            buffers,
        };
        pixel.lay(veils, opacities, first_veil);
        pixel.see(opaque);
    }
}

/// A pixel, or a region of one, at work.
struct Pixel<'a, G: Ground, D: Diced> {
    map: &'a VisibilityMap,
    ground: &'a G,
    place: G::Place,
    diced: &'a mut D,
    buffers: &'a mut VeilBuffers<D::Measure>,
}

impl<G: Ground, D: Diced> Pixel<'_, G, D> {
    /// Makes layers of the parts of veils. What lets all through is done.
    fn lay(&mut self, veils: &[(G::Place, u32)], opacities: &[f32], first_veil: usize) {
        let Self {
            map, ground, place, ..
        } = *self;
        let VeilBuffers {
            layers,
            points,
            clip,
            ..
        } = &mut *self.buffers;
        layers.clear();
        points.clear();
        for &(_, row) in veils {
            let fragment = self.diced.parts().boundary[row as usize].fragment;
            let opacity = f64::from(opacities[row as usize - first_veil]);
            let start = points.len() as u32;
            let measure = self.diced.measure(row as usize);
            if opacity > 0.0 {
                points.extend_from_slice(ground.clip(place, fragment, clip));
            }
            if points.len() as u32 == start {
                self.diced.set_measure(row as usize, measure * opacity);
                continue;
            }
            let face = map.face_of(fragment as usize);
            let nearness = map.faces.face_nearness(face);
            layers.push(Layer {
                part: row,
                face,
                plane: ground.nearness(place, nearness),
                opacity,
                measure,
                start,
                end: points.len() as u32,
                extent: Extent::of(&points[start as usize..]),
            });
        }
    }

    /// Finds what is seen of the layers and of the parts of opaque fragments, `opaque`.
    fn see(&mut self, opaque: &[(G::Place, u32)]) {
        let VeilBuffers {
            layers,
            points,
            clip,
            cutter,
            ..
        } = &mut *self.buffers;
        let diced = &mut *self.diced;
        if layers.len() > MOST_QUARTERED || sort(layers, &Extent::UNIT_SQUARE) {
            cutter.take_from_front(layers, points, &Extent::UNIT_SQUARE, |part, seen| {
                diced.set_measure(part as usize, seen);
            });
            for &(_, row) in opaque {
                let row = row as usize;
                let (measure, regions) = (diced.measure(row), &mut cutter.regions);
                let seen = if regions.is_uncut() {
                    // What was diced is more exact than what is clipped.
                    measure * regions.regions[0].transmittance
                } else if measure.area() >= 1.0 {
                    regions.total()
                } else {
                    let fragment = diced.parts().boundary[row].fragment;
                    regions.through(self.ground.clip(self.place, fragment, clip))
                };
                diced.set_measure(row, seen);
            }
            return;
        }

        let mut surfaces = Vec::new();
        for &(_, row) in opaque {
            let start = points.len();
            let fragment = diced.parts().boundary[row as usize].fragment;
            points.extend_from_slice(self.ground.clip(self.place, fragment, clip));
            surfaces.push((row, start..points.len()));
        }
        let mut told: Vec<(u32, D::Measure)> = Vec::new();
        let rows = layers.iter().map(|layer| layer.part);
        told.extend(
            rows.chain(surfaces.iter().map(|surface| surface.0))
                .map(|row| (row, D::Measure::default())),
        );
        let mut tell = |row: u32, seen: D::Measure| told.push((row, seen));
        cutter.without_order(
            layers,
            points,
            &surfaces,
            &Extent::UNIT_SQUARE,
            0,
            &mut tell,
        );
        // Stable: what was told of a part is summed in the order of its telling.
        told.sort_by_key(|&(row, _)| row);
        for of_part in told.chunk_by(|a, b| a.0 == b.0) {
            let mut sum = D::Measure::default();
            of_part.iter().for_each(|&(_, seen)| sum += seen);
            diced.set_measure(of_part[0].0 as usize, sum);
        }
    }
}

/// Sorts layers from front to back by their planes at the centre of `cell`, and tells whether that is
/// right wherever two of them overlap.
fn sort<M>(layers: &mut [Layer<M>], cell: &Extent) -> bool {
    let centre = 0.5 * (cell.min + cell.max);
    layers.sort_by(|a, b| {
        let by_nearness = b.plane.at(centre).total_cmp(&a.plane.at(centre));
        by_nearness.then(a.face.cmp(&b.face))
    });
    let in_order = |front: &Layer<M>, back: &Layer<M>| {
        let both = front.extent.and(&back.extent);
        let Some(both) = both.filter(|_| front.face != back.face) else {
            return true;
        };
        let difference = front.plane.minus(&back.plane);
        let corners = both.corners().map(|corner| difference.at(corner));
        corners.iter().all(|&d| d > 0.0)
            || corners.iter().all(|&d| d == 0.0) && front.wins_tie(back)
    };
    (1..layers.len()).all(|k| layers[..k].iter().all(|front| in_order(front, &layers[k])))
}

/// Finds what is seen of layers in a cell, in buffers that it keeps.
#[derive(Clone, Debug, Default)]
struct Cutter {
    regions: Regions,
    front: Vec<DVec2>,
}

impl Cutter {
    /// Takes sorted layers one after the other, and tells `seen` of each part; leaves in the regions what
    /// they let through.
    fn take_from_front<M: Measure>(
        &mut self,
        layers: &[Layer<M>],
        points: &[DVec2],
        cell: &Extent,
        mut seen: impl FnMut(u32, M),
    ) {
        let regions = &mut self.regions;
        regions.begin(&cell.corners());
        let cell_area = cell.area();
        for layer in layers {
            let before = if layer.measure.area() >= cell_area {
                regions.dim(layer.opacity)
            } else if regions.is_uncut() {
                let transmittance = regions.regions[0].transmittance;
                regions.cut::<f64>(layer.polygon(points), &layer.extent, layer.opacity);
                layer.measure * transmittance
            } else {
                regions.cut(layer.polygon(points), &layer.extent, layer.opacity)
            };
            seen(layer.part, before * layer.opacity);
        }
    }

    /// Cuts each layer by the parts of the others before it, and opaque surfaces by all.
    fn each_by_all<M: Measure>(
        &mut self,
        layers: &[Layer<M>],
        points: &[DVec2],
        surfaces: &[(u32, Range<usize>)],
        seen: &mut impl FnMut(u32, M),
    ) {
        let Self { regions, front } = self;
        for layer in layers {
            regions.begin(layer.polygon(points));
            for other in layers.iter().filter(|other| other.face != layer.face) {
                let difference = other.plane.minus(&layer.plane);
                let polygon = other.polygon(points);
                part_before(&difference, other.wins_tie(layer), polygon, front);
                if front.len() >= 3 {
                    regions.cut::<f64>(front, &Extent::of(front), other.opacity);
                }
            }
            seen(layer.part, regions.total::<M>() * layer.opacity);
        }
        for (row, polygon) in surfaces {
            regions.begin(&points[polygon.clone()]);
            for other in layers {
                regions.cut::<f64>(other.polygon(points), &other.extent, other.opacity);
            }
            seen(*row, regions.total());
        }
    }

    /// Finds what is seen in a cell that is a pixel quartered `depth` times, whose layers have no order.
    fn without_order<M: Measure>(
        &mut self,
        layers: &mut [Layer<M>],
        points: &mut Vec<DVec2>,
        surfaces: &[(u32, Range<usize>)],
        cell: &Extent,
        depth: u32,
        seen: &mut impl FnMut(u32, M),
    ) {
        if layers.len() <= MOST_UNORDERED {
            self.each_by_all(layers, points, surfaces, seen);
            return;
        }
        if depth == QUARTERINGS {
            self.take_from_front(layers, points, cell, &mut *seen);
            for (row, polygon) in surfaces {
                seen(*row, self.regions.through(&points[polygon.clone()]));
            }
            return;
        }
        let before = points.len();
        for quarter in cell.quarters() {
            let mut inside: Vec<Layer<M>> = Vec::new();
            for layer in &*layers {
                let range = quarter.clip(points, layer.start as usize..layer.end as usize);
                let measure = M::of(&points[range.clone()]);
                if measure.area() > 0.0 {
                    inside.push(Layer {
                        start: range.start as u32,
                        end: range.end as u32,
                        extent: Extent::of(&points[range]),
                        measure,
                        ..*layer
                    });
                }
            }
            let clipped = surfaces.iter();
            let clipped = clipped.map(|(row, range)| (*row, quarter.clip(points, range.clone())));
            let clipped: Vec<(u32, Range<usize>)> = clipped.collect();
            if sort(&mut inside, &quarter) {
                self.take_from_front(&inside, points, &quarter, &mut *seen);
                for (row, polygon) in &clipped {
                    seen(*row, self.regions.through(&points[polygon.clone()]));
                }
            } else {
                self.without_order(&mut inside, points, &clipped, &quarter, depth + 1, seen);
            }
            points.truncate(before);
        }
    }
}

/// What of `polygon`, which lies in one plane, is before another: where the difference of the two is
/// positive, and in all of it where they are the same and `wins_tie`.
pub(super) fn part_before(
    difference: &Affine,
    wins_tie: bool,
    polygon: &[DVec2],
    kept: &mut Vec<DVec2>,
) {
    if polygon.iter().any(|&p| difference.at(p) != 0.0) {
        keep(polygon, |p| difference.at(p), kept);
        return;
    }
    kept.clear();
    if wins_tie {
        kept.extend_from_slice(polygon);
    }
}

/// Smallest rectangle around a polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    min: DVec2,
    max: DVec2,
}

impl Extent {
    const UNIT_SQUARE: Self = Self {
        min: DVec2::ZERO,
        max: DVec2::ONE,
    };

    fn area(&self) -> f64 {
        let size = self.max - self.min;
        size.x * size.y
    }

    fn quarters(&self) -> [Self; 4] {
        let half = 0.5 * (self.max - self.min);
        [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|corner| {
            let min = self.min + half * corner;
            let max = min + half;
            Self { min, max }
        })
    }

    /// Appends to `points` what lies in this of a polygon of theirs; returns where.
    fn clip(&self, points: &mut Vec<DVec2>, polygon: Range<usize>) -> Range<usize> {
        let mut inside = points[polygon].to_vec();
        let mut kept = Vec::new();
        for edge in edges(&self.corners()) {
            keep(&inside, |p| inside_of(edge, p), &mut kept);
            std::mem::swap(&mut inside, &mut kept);
        }
        let start = points.len();
        points.append(&mut inside);
        start..points.len()
    }

    pub fn of(polygon: &[DVec2]) -> Self {
        let (mut min, mut max) = (polygon[0], polygon[0]);
        for &point in &polygon[1..] {
            min = min.min(point);
            max = max.max(point);
        }
        Self { min, max }
    }

    /// What both have, if that has an area.
    fn and(&self, other: &Self) -> Option<Self> {
        let (min, max) = (self.min.max(other.min), self.max.min(other.max));
        min.cmplt(max).all().then_some(Self { min, max })
    }

    fn corners(&self) -> [DVec2; 4] {
        let Self { min, max } = *self;
        [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)]
    }
}

/// Convex regions that do not overlap, each with a transmittance.
#[derive(Clone, Debug, Default)]
pub(super) struct Regions {
    regions: Vec<Region>,
    points: Vec<DVec2>,
    /// The regions as they will be, while they are cut.
    next: Vec<Region>,
    next_points: Vec<DVec2>,
    rest: Vec<DVec2>,
    kept: Vec<DVec2>,
    cut: bool,
}

#[derive(Clone, Copy, Debug)]
struct Region {
    start: u32,
    end: u32,
    extent: Extent,
    transmittance: f64,
}

impl Regions {
    /// One region that lets all through; none for a polygon without area.
    pub fn begin(&mut self, polygon: &[DVec2]) {
        self.regions.clear();
        self.points.clear();
        self.cut = false;
        push(&mut self.regions, &mut self.points, polygon, 1.0);
    }

    /// Whether there still is only one region, that of the beginning.
    fn is_uncut(&self) -> bool {
        !self.cut && self.regions.len() == 1
    }

    /// The integral of the transmittance.
    pub fn total<M: Measure>(&self) -> M {
        let mut sum = M::default();
        for region in &self.regions {
            let corners = &self.points[region.start as usize..region.end as usize];
            sum += M::of(corners) * region.transmittance;
        }
        sum
    }

    /// Puts a layer before all that follows, everywhere; returns the integral of the transmittance before
    /// it.
    fn dim<M: Measure>(&mut self, opacity: f64) -> M {
        let total = self.total();
        for region in &mut self.regions {
            region.transmittance *= 1.0 - opacity;
        }
        self.regions.retain(|region| region.transmittance > 0.0);
        total
    }

    /// Puts a layer before all that follows, in `polygon`; returns the integral over it of the
    /// transmittance before the layer.
    pub fn cut<M: Measure>(&mut self, polygon: &[DVec2], extent: &Extent, opacity: f64) -> M {
        let Self {
            regions,
            points,
            next,
            next_points,
            rest,
            kept,
            cut,
        } = self;
        *cut = true;
        next.clear();
        next_points.clear();
        let mut seen = M::default();
        for region in &*regions {
            let corners = &points[region.start as usize..region.end as usize];
            if region.extent.and(extent).is_none() || separate(polygon, corners) {
                push(next, next_points, corners, region.transmittance);
                continue;
            }
            rest.clear();
            rest.extend_from_slice(corners);
            for edge in edges(polygon) {
                let inside = |p| inside_of(edge, p);
                if rest.iter().all(|&p| inside(p) >= 0.0) {
                    continue;
                }
                keep(rest, |p| -inside(p), kept);
                push(next, next_points, kept, region.transmittance);
                keep(rest, inside, kept);
                std::mem::swap(rest, kept);
            }
            seen += M::of(rest) * region.transmittance;
            let transmittance = region.transmittance * (1.0 - opacity);
            if transmittance > 0.0 {
                push(next, next_points, rest, transmittance);
            }
        }
        std::mem::swap(regions, next);
        std::mem::swap(points, next_points);
        seen
    }

    /// The integral of the transmittance over a polygon.
    fn through<M: Measure>(&mut self, polygon: &[DVec2]) -> M {
        if polygon.is_empty() {
            return M::default();
        }
        let Self {
            regions,
            points,
            rest,
            kept,
            ..
        } = self;
        let extent = Extent::of(polygon);
        let mut seen = M::default();
        for region in regions
            .iter()
            .filter(|region| region.extent.and(&extent).is_some())
        {
            rest.clear();
            rest.extend_from_slice(&points[region.start as usize..region.end as usize]);
            for edge in edges(polygon) {
                keep(rest, |p| inside_of(edge, p), kept);
                std::mem::swap(rest, kept);
            }
            seen += M::of(rest) * region.transmittance;
        }
        seen
    }
}

fn push(regions: &mut Vec<Region>, points: &mut Vec<DVec2>, polygon: &[DVec2], transmittance: f64) {
    if signed_area(polygon) > 0.0 {
        let start = points.len() as u32;
        points.extend_from_slice(polygon);
        regions.push(Region {
            start,
            end: points.len() as u32,
            extent: Extent::of(polygon),
            transmittance,
        });
    }
}

fn edges(polygon: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> {
    (0..polygon.len()).map(|k| [polygon[k], polygon[(k + 1) % polygon.len()]])
}

/// Positive where `p` lies on the inner side of an edge of a positively wound polygon.
fn inside_of([from, to]: [DVec2; 2], p: DVec2) -> f64 {
    cross(to - from, p - from)
}

/// Whether an edge of `polygon` has all of `other` on its outer side.
fn separate(polygon: &[DVec2], other: &[DVec2]) -> bool {
    edges(polygon).any(|edge| other.iter().all(|&p| inside_of(edge, p) <= 0.0))
}

/// What of a polygon lies where `distance`, an affine function, is not negative (Sutherland and Hodgman).
pub(super) fn keep(polygon: &[DVec2], distance: impl Fn(DVec2) -> f64, kept: &mut Vec<DVec2>) {
    kept.clear();
    let Some(&last) = polygon.last() else {
        return;
    };
    let (mut p, mut a) = (last, distance(last));
    for &q in polygon {
        let b = distance(q);
        if (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0) {
            kept.push(p + (q - p) * (a / (a - b)));
        }
        if b >= 0.0 {
            kept.push(q);
        }
        (p, a) = (q, b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SplitMix64.
    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 * 2.0_f64.powi(-53)
        }
    }

    /// Random triangles clipped to the pixel, each with a plane.
    fn layers(random: &mut Random, count: u32, slope: f64, points: &mut Vec<DVec2>) -> Vec<Layer> {
        let mut layers = Vec::new();
        while layers.len() < count as usize {
            let corner = |random: &mut Random| DVec2::new(random.unit(), random.unit()) * 3.0 - 1.0;
            let start = points.len();
            points.extend([(); 3].map(|()| corner(random)));
            if signed_area(&points[start..]) < 0.0 {
                points[start..].reverse();
            }
            let range = Extent::UNIT_SQUARE.clip(points, start..start + 3);
            let polygon = &points[range.clone()];
            if signed_area(polygon) <= 0.0 {
                continue;
            }
            let mut plane = || slope * (random.unit() - 0.5);
            layers.push(Layer {
                part: layers.len() as u32,
                face: FaceId(layers.len() as u32),
                plane: Affine::new(plane(), plane(), random.unit()),
                opacity: random.unit(),
                measure: signed_area(polygon),
                start: range.start as u32,
                end: range.end as u32,
                extent: Extent::of(polygon),
            });
        }
        layers
    }

    fn sums(count: usize, run: impl FnOnce(&mut dyn FnMut(u32, f64))) -> Vec<f64> {
        let mut sums = vec![0.0; count];
        run(&mut |row, area| sums[row as usize] += area);
        sums
    }

    #[test]
    fn an_order_changes_nothing_where_there_is_one() {
        for seed in 0..200 {
            let mut random = Random(seed);
            let mut points = Vec::new();
            let mut layers = layers(&mut random, 2 + seed as u32 % 10, 0.0, &mut points);
            assert!(sort(&mut layers, &Extent::UNIT_SQUARE));
            let mut cutter = Cutter::default();
            let count = layers.len();
            let in_order = sums(count, |seen| {
                cutter.take_from_front(&layers, &points, &Extent::UNIT_SQUARE, seen);
            });
            let by_all = sums(count, |mut seen| {
                cutter.each_by_all(&layers, &points, &[], &mut seen)
            });
            for (a, b) in in_order.iter().zip(&by_all) {
                assert!((a - b).abs() < 1e-12, "{a} and {b} in case {seed}");
            }
        }
    }

    #[test]
    fn quarters_change_nothing() {
        for seed in 0..40 {
            let mut random = Random(1000 + seed);
            let mut points = Vec::new();
            let layers = layers(&mut random, 6 + seed as u32 % 8, 2.0, &mut points);
            let square = points.len()..points.len() + 4;
            points.extend(Extent::UNIT_SQUARE.corners());
            let surfaces = [(layers.len() as u32, square)];
            let mut cutter = Cutter::default();
            let count = layers.len() + 1;
            let whole = sums(count, |mut seen| {
                cutter.each_by_all(&layers, &points, &surfaces, &mut seen);
            });
            let quartered = sums(count, |mut seen| {
                for quarter in Extent::UNIT_SQUARE.quarters() {
                    let mut inside = layers.clone();
                    for layer in &mut inside {
                        let range =
                            quarter.clip(&mut points, layer.start as usize..layer.end as usize);
                        (layer.start, layer.end) = (range.start as u32, range.end as u32);
                        layer.measure = signed_area(&points[range.clone()]);
                        if layer.measure > 0.0 {
                            layer.extent = Extent::of(&points[range]);
                        }
                    }
                    inside.retain(|layer| layer.measure > 0.0);
                    let clipped = quarter.clip(&mut points, surfaces[0].1.clone());
                    let clipped = [(surfaces[0].0, clipped)];
                    cutter.each_by_all(&inside, &points, &clipped, &mut seen);
                }
            });
            assert!((whole.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            for (a, b) in whole.iter().zip(&quartered) {
                assert!((a - b).abs() < 1e-12, "{a} and {b} in case {seed}");
            }
        }
    }
}
