//! Guests in pixels: what is seen of their samples, and of each part behind and before them.
//!
//! A sample of another program fills its pixel of the guest's grid, at one nearness, with its opacity. So
//! it is a veil that has the shape of that pixel: what is seen of a surface or of a sample S is
//!
//! ```text
//!     ∫   α  ∏ (1 - α_V) dA      over S, the product over the samples and veils V nearer at the point
//! ```
//!
//! Our surfaces cut the pixel exactly, by their outlines and along the lines where their planes pass through a
//! sample's nearness; the opacity of a sample is the same in each part.
//!
//! 1. [`GuestDicer::touch`] marks the pixels that samples touch, and takes parts there out of runs.
//! 2. [`GuestDicer::lay`] cuts such a pixel into the rectangles that the grids of all guests leave of it. In
//!    each, the samples of all guests are made tidy (`tidy`), front to back. What fills a depth is cut by
//!    OpenEXR's formula where a surface passes through it: where the surface is nearest and farthest, and at
//!    [`CUTS`] - 1 depths between. That is exact for surfaces at one depth.
//!
//! Of a surface and a sample at the same nearness the surface is in front. In a pixel with more than
//! [`MOST_VEILS`] veils each part counts as lying where its centroid does: areas and opacities still sum up.

use super::place::PixelClip;
use super::tidy::{Sample, Tidier, cut_at};
use super::veils::{Extent, Regions, keep, part_before};
use super::{Part, Parts, PixelGrid, push_run};
use std::ops::Range;
use veduta_geometry::{Affine, DVec2, signed_area};
use veduta_map::{Camera, FaceId, Guest, Projection, VisibilityMap};

/// What samples add to a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuestLight {
    /// The pixel, counted from the band's first one.
    pub pixel: u32,
    /// Linear RGB, and opacity.
    pub light: [f64; 4],
}

/// Lays guests into the pixels of a grid.
#[derive(Clone, Copy, Debug)]
pub struct GuestDicer<'a> {
    map: &'a VisibilityMap,
    guests: &'a [Guest],
    grid: PixelGrid,
}

/// Buffers that [`GuestDicer`] keeps.
#[derive(Clone, Debug, Default)]
pub struct GuestBuffers {
    /// Of each pixel of the band, whether samples touch it.
    touched: Vec<bool>,
    /// `(pixel, part)` of the parts in these pixels.
    entries: Vec<(u32, u32)>,
    /// What is seen of these parts.
    seen: Vec<(u32, f32)>,
    cuts: [Vec<f64>; 2],
    samples: Vec<Sample>,
    spare: Vec<Sample>,
    tidier: Tidier,
    depths: Vec<f64>,
    surfaces: Vec<Surface>,
    points: Vec<DVec2>,
    clip: PixelClip,
    regions: Regions,
    front: Vec<DVec2>,
    kept: Vec<DVec2>,
}

/// A part of a pixel that one of our fragments covers.
#[derive(Clone, Copy, Debug)]
struct Surface {
    part: u32,
    face: FaceId,
    /// Nearness from the pixel's corner, in pixels.
    plane: Affine,
    /// 1, or that of a veil.
    opacity: f64,
    is_veil: bool,
    area: f64,
    /// Its polygon in the pixel: rows of the points.
    all: [u32; 2],
    /// What of it lies in the rectangle at hand.
    here: [u32; 2],
    /// Of that, the least and the greatest nearness.
    nearness: [f64; 2],
    /// What is seen of it in the rectangles before.
    seen: f64,
}

impl Surface {
    fn polygon<'a>(&self, points: &'a [DVec2]) -> &'a [DVec2] {
        let [start, end] = self.here;
        &points[start as usize..end as usize]
    }

    fn is_here(&self) -> bool {
        self.here[0] < self.here[1]
    }

    /// What of this one's `polygon` lies before another surface; of equal planes the smaller face does.
    fn part_before(&self, other: &Self, polygon: &[DVec2], kept: &mut Vec<DVec2>) {
        let difference = self.plane.minus(&other.plane);
        part_before(&difference, self.face < other.face, polygon, kept);
    }
}

impl<'a> GuestDicer<'a> {
    /// For guests of the frame that `map` is of.
    pub fn new(map: &'a VisibilityMap, guests: &'a [Guest], grid: PixelGrid) -> Self {
        Self { map, guests, grid }
    }

    /// Marks the pixels of a band, its rows `rows`, that samples touch. There parts stand alone, which may
    /// have been in runs; those of veils, `veils` of them, stay last.
    pub fn touch(
        &self,
        rows: Range<u32>,
        buffers: &mut GuestBuffers,
        parts: &mut Parts,
        veils: usize,
    ) {
        let width = self.grid.width;
        let touched = &mut buffers.touched;
        touched.clear();
        touched.resize((width * (rows.end - rows.start)) as usize, false);
        for guest in self.guests {
            for row in rows.clone() {
                let first = ((row - rows.start) * width) as usize;
                self.touch_row(guest, row, &mut touched[first..first + width as usize]);
            }
        }
        let is_touched = |pixel: u32| touched[pixel as usize];
        let mut alone = Vec::new();
        let mut runs = Vec::new();
        for run in &parts.runs {
            let mut start = run.pixel;
            for pixel in run.pixel..run.pixel + run.length {
                if is_touched(pixel) {
                    push_run(&mut runs, run.fragment, start..pixel);
                    alone.push(Part::whole(pixel, run.fragment));
                    start = pixel + 1;
                }
            }
            push_run(&mut runs, run.fragment, start..run.pixel + run.length);
        }
        parts.runs = runs;
        let before_veils = parts.boundary.len() - veils;
        parts.boundary.splice(before_veils..before_veils, alone);
    }

    fn touch_row(&self, guest: &Guest, row: u32, touched: &mut [bool]) {
        let (grid, own) = (&self.grid, guest.grid());
        let image = |x: u32, y: u32| grid.image_from_pixels(DVec2::new(f64::from(x), f64::from(y)));
        let [min, max] = [image(0, row), image(grid.width, row + 1)];
        let columns = own.between(0, [min.x, max.x]);
        for guest_row in own.between(1, [min.y, max.y]) {
            for column in columns.clone() {
                let pixel = guest_row as usize * own.size[0] as usize + column as usize;
                if guest.samples_of(pixel).is_empty() {
                    continue;
                }
                // Rounding may mark a pixel too many, which is looked at in vain.
                let [left, right] = own.corners(column, guest_row).map(|corner| {
                    let place = grid.pixels_from_image(corner).x;
                    place.clamp(0.0, f64::from(grid.width))
                });
                touched[left.floor() as usize..right.ceil() as usize].fill(true);
            }
        }
    }

    /// Makes of each part's area, in the pixels that [`GuestDicer::touch`] marked, what is seen of it through
    /// what is before it, and adds to `light` what is seen of samples.
    ///
    /// `opacities` are those of the parts of veils, which are the last of `parts`. The parts are of the band
    /// that begins at row `first_row`. `attenuate` is called between: it changes the parts in all other
    /// pixels.
    pub fn lay(
        &self,
        first_row: u32,
        opacities: &[f32],
        buffers: &mut GuestBuffers,
        parts: &mut Parts,
        light: &mut Vec<GuestLight>,
        attenuate: impl FnOnce(&mut Parts),
    ) {
        light.clear();
        let GuestBuffers {
            touched, entries, ..
        } = &mut *buffers;
        entries.clear();
        let rows = parts.boundary.iter().zip(0..);
        let of_touched = rows.filter(|(part, _)| touched[part.pixel as usize]);
        entries.extend(of_touched.map(|(part, row)| (part.pixel, row)));
        entries.sort_unstable();
        let entries = std::mem::take(entries);
        let touched = std::mem::take(touched);
        buffers.seen.clear();
        let mut crowded = Vec::new();
        let first_veil = parts.boundary.len() - opacities.len();
        let mut rest = &entries[..];
        for pixel in (0..touched.len() as u32).filter(|&pixel| touched[pixel as usize]) {
            let own = rest.partition_point(|entry| entry.0 <= pixel);
            let (of_pixel, others) = rest.split_at(own);
            rest = others;
            let row = first_row + pixel / self.grid.width;
            let corner = DVec2::new(f64::from(pixel % self.grid.width), f64::from(row));
            let veils = of_pixel
                .iter()
                .filter(|entry| entry.1 as usize >= first_veil);
            if veils.count() > MOST_VEILS {
                crowded.push((pixel, corner, of_pixel));
                continue;
            }
            buffers.collect(self, corner, of_pixel, opacities, parts);
            let light_here = buffers.lay_pixel(self, corner);
            if light_here != [0.0; 4] {
                light.push(GuestLight {
                    pixel,
                    light: light_here,
                });
            }
        }
        attenuate(parts);
        for &(part, area) in &buffers.seen {
            parts.boundary[part as usize].area = area;
        }
        for (pixel, corner, of_pixel) in crowded {
            buffers.collect(self, corner, of_pixel, opacities, parts);
            light.push(GuestLight {
                pixel,
                light: buffers.lay_crowded(self, corner, parts),
            });
        }
        buffers.entries = entries;
        buffers.touched = touched;
    }
}

/// Up to so many veils in a pixel are cut by one another and by samples. The work grows with the fourth
/// power of their number.
const MOST_VEILS: usize = 16;

/// Into how many parts a surface that leans through what fills a depth cuts it. The error falls with
/// their square: with 4 it is below 0.01 for what lets 1/6 through, in a pixel that has all of it.
const CUTS: u32 = 4;

/// Rectangles thinner than this share of a pixel come from grids whose lines differ by rounding.
const NEGLIGIBLE_WIDTH: f64 = 1e-12;

impl GuestBuffers {
    /// Makes surfaces of the parts of a pixel.
    fn collect(
        &mut self,
        dicer: &GuestDicer,
        corner: DVec2,
        of_pixel: &[(u32, u32)],
        opacities: &[f32],
        parts: &Parts,
    ) {
        let (map, grid) = (dicer.map, &dicer.grid);
        let first_veil = parts.boundary.len() - opacities.len();
        self.surfaces.clear();
        self.points.clear();
        for &(_, row) in of_pixel {
            let part = &parts.boundary[row as usize];
            let veil = (row as usize).checked_sub(first_veil);
            let start = self.points.len() as u32;
            let polygon = self.clip.clip(map, grid, part.fragment, corner);
            self.points.extend_from_slice(polygon);
            let face = map.face_of(part.fragment as usize);
            let nearness = map.faces.face_nearness(face);
            self.surfaces.push(Surface {
                part: row,
                face,
                plane: grid.affine_in_pixels(nearness, corner),
                opacity: veil.map_or(1.0, |veil| f64::from(opacities[veil])),
                is_veil: veil.is_some(),
                area: f64::from(part.area),
                all: [start, self.points.len() as u32],
                here: [0, 0],
                nearness: [0.0; 2],
                seen: 0.0,
            });
        }
    }

    /// Lays the samples of all guests into a pixel; what is seen of them.
    fn lay_pixel(&mut self, dicer: &GuestDicer, corner: DVec2) -> [f64; 4] {
        self.cut_pixel(dicer, corner);
        let [columns, rows] = std::mem::take(&mut self.cuts);
        let is_whole = columns.len() == 2 && rows.len() == 2;
        let all_points = self.points.len();
        let mut light = [0.0; 4];
        for y in rows.windows(2) {
            for x in columns.windows(2) {
                let min = DVec2::new(x[0], y[0]);
                let max = DVec2::new(x[1], y[1]);
                if (max - min).min_element() < NEGLIGIBLE_WIDTH {
                    continue;
                }
                self.points.truncate(all_points);
                self.place_surfaces(is_whole, [min, max]);
                self.gather(dicer, corner + 0.5 * (min + max));
                let rectangle = [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)];
                self.lay_rectangle(dicer, &rectangle, is_whole, &mut light);
            }
        }
        self.cuts = [columns, rows];
        let seen = self
            .surfaces
            .iter()
            .map(|surface| (surface.part, surface.seen as f32));
        self.seen.extend(seen);
        light
    }

    /// Lays samples between parts that are attenuated already, each as a whole.
    fn lay_crowded(&mut self, dicer: &GuestDicer, corner: DVec2, parts: &mut Parts) -> [f64; 4] {
        self.cut_pixel(dicer, corner);
        let [columns, rows] = std::mem::take(&mut self.cuts);
        let camera = &dicer.map.camera;
        // What is seen of each surface without samples, and how near it is.
        let mut surfaces: Vec<(f64, f64)> = Vec::new();
        for surface in &self.surfaces {
            let centroid = parts.boundary[surface.part as usize].centroid.as_dvec2();
            surfaces.push((surface.area, surface.plane.at(centroid)));
        }
        let mut light = [0.0; 4];
        for y in rows.windows(2) {
            for x in columns.windows(2) {
                let size = DVec2::new(x[1] - x[0], y[1] - y[0]);
                let share = size.x * size.y;
                let middle = DVec2::new(x[0], y[0]) + 0.5 * size;
                self.surfaces
                    .iter_mut()
                    .for_each(|surface| surface.here = [0, 0]);
                self.gather(dicer, corner + middle);
                let at =
                    |sample: &Sample| nearness(camera, 0.5 * (sample.depths[0] + sample.depths[1]));
                for (surface, &(area, near)) in self.surfaces.iter_mut().zip(&surfaces) {
                    let before = self.samples.iter().filter(|sample| at(sample) > near);
                    let through: f64 = before.map(|sample| 1.0 - sample.opacity).product();
                    surface.seen += share * area * through;
                }
                let mut through = share;
                for sample in &self.samples {
                    let before = surfaces.iter().filter(|&&(_, near)| near >= at(sample));
                    let hidden: f64 = before.map(|&(area, _)| area).sum();
                    let seen = through * (1.0 - hidden).max(0.0);
                    add_sample(&mut light, sample, seen);
                    through *= 1.0 - sample.opacity;
                }
            }
        }
        self.cuts = [columns, rows];
        for surface in &self.surfaces {
            parts.boundary[surface.part as usize].area = surface.seen as f32;
        }
        light
    }

    /// Where the grids of guests cut a pixel, along x and y.
    fn cut_pixel(&mut self, dicer: &GuestDicer, corner: DVec2) {
        let grid = &dicer.grid;
        let image = [corner, corner + 1.0].map(|p| grid.image_from_pixels(p));
        for (axis, cuts) in self.cuts.iter_mut().enumerate() {
            cuts.clear();
            cuts.extend([0.0, 1.0]);
            for guest in dicer.guests {
                let own = guest.grid();
                let cells = own.between(axis, image.map(|p| p[axis]));
                if cells.is_empty() {
                    continue;
                }
                let lines = (cells.start..=cells.end).map(|index| {
                    let at = DVec2::splat(own.line(axis, index));
                    grid.pixels_from_image(at)[axis] - corner[axis]
                });
                cuts.extend(lines.filter(|&at| at > 0.0 && at < 1.0));
            }
            cuts.sort_by(f64::total_cmp);
            cuts.dedup();
        }
    }

    /// What of the surfaces lies in a rectangle.
    fn place_surfaces(&mut self, is_whole: bool, [min, max]: [DVec2; 2]) {
        let Self {
            surfaces,
            points,
            front,
            kept,
            ..
        } = self;
        for surface in surfaces {
            surface.here = surface.all;
            if !is_whole {
                let [start, end] = surface.all;
                front.clear();
                front.extend_from_slice(&points[start as usize..end as usize]);
                for axis in [0, 1] {
                    keep(front, |p| p[axis] - min[axis], kept);
                    std::mem::swap(front, kept);
                    keep(front, |p| max[axis] - p[axis], kept);
                    std::mem::swap(front, kept);
                }
                let start = points.len() as u32;
                if signed_area(front) > 0.0 {
                    points.extend_from_slice(front);
                }
                surface.here = [start, points.len() as u32];
            }
            let nearness = surface.polygon(points).iter().map(|&p| surface.plane.at(p));
            surface.nearness = nearness
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], n| {
                    [low.min(n), high.max(n)]
                });
        }
    }

    /// The tidy samples of all guests at a place of the grid, cut where surfaces pass through them.
    fn gather(&mut self, dicer: &GuestDicer, place: DVec2) {
        let camera = &dicer.map.camera;
        let image = dicer.grid.image_from_pixels(place);
        self.samples.clear();
        for guest in dicer.guests {
            let own = guest.grid();
            let [column, row] = [0, 1].map(|axis| {
                (image[axis] * f64::from(own.frame[axis]) - f64::from(own.first[axis])).floor()
            });
            let [columns, rows] = own.size;
            let is_inside = |at: f64, count: u32| at >= 0.0 && at < f64::from(count);
            if !(is_inside(column, columns) && is_inside(row, rows)) {
                continue;
            }
            let all = guest.samples();
            for sample in guest.samples_of(row as usize * columns as usize + column as usize) {
                self.samples.push(Sample {
                    depths: [all.near[sample], all.far[sample]].map(|n| depth(camera, n)),
                    opacity: f64::from(all.opacity[sample]),
                    color: all.color[sample].map(f64::from),
                });
            }
        }
        self.tidier.make_tidy(&mut self.samples);
        if self
            .samples
            .iter()
            .all(|sample| sample.depths[0] == sample.depths[1])
        {
            return;
        }
        self.depths.clear();
        for surface in self.surfaces.iter().filter(|surface| surface.is_here()) {
            let [low, high] = surface.nearness;
            let steps = (0..=CUTS).map(|step| f64::from(step) / f64::from(CUTS));
            self.depths
                .extend(steps.map(|step| depth(camera, low + step * (high - low))));
        }
        cut_at(&mut self.samples, &self.depths, &mut self.spare);
    }

    /// Lays tidy samples and surfaces over one another in a rectangle.
    fn lay_rectangle(
        &mut self,
        dicer: &GuestDicer,
        rectangle: &[DVec2; 4],
        is_whole: bool,
        light: &mut [f64; 4],
    ) {
        let camera = &dicer.map.camera;
        let Self {
            samples,
            surfaces,
            points,
            regions,
            front,
            ..
        } = self;
        let middle =
            |sample: &Sample| nearness(camera, 0.5 * (sample.depths[0] + sample.depths[1]));
        for index in 0..surfaces.len() {
            let surface = surfaces[index];
            if !surface.is_here() {
                continue;
            }
            let polygon = surface.polygon(points);
            regions.begin(polygon);
            let mut through = 1.0;
            let mut is_uncut = true;
            for other in surfaces
                .iter()
                .filter(|other| other.is_veil && other.is_here())
            {
                if other.face == surface.face {
                    continue;
                }
                let before = other.polygon(points);
                if surface.is_veil {
                    other.part_before(&surface, before, front);
                } else {
                    // Veils that are left in a map are before what is opaque.
                    front.clear();
                    front.extend_from_slice(before);
                }
                if front.len() >= 3 {
                    regions.cut::<f64>(front, &Extent::of(front), other.opacity);
                    is_uncut = false;
                }
            }
            for sample in &*samples {
                let at = middle(sample);
                let [low, high] = surface.nearness;
                if at > high {
                    through *= 1.0 - sample.opacity;
                } else if at > low {
                    keep(polygon, |p| at - surface.plane.at(p), front);
                    if front.len() >= 3 {
                        regions.cut::<f64>(front, &Extent::of(front), sample.opacity);
                        is_uncut = false;
                    }
                }
            }
            // The area as diced is more exact than that of what was clipped.
            let area = if is_uncut && is_whole {
                surface.area
            } else {
                regions.total::<f64>()
            };
            surfaces[index].seen += area * through * surface.opacity;
        }
        let mut through = 1.0;
        for sample in &*samples {
            if through == 0.0 {
                break;
            }
            let at = middle(sample);
            regions.begin(rectangle);
            for surface in surfaces.iter().filter(|surface| surface.is_here()) {
                let polygon = surface.polygon(points);
                let [low, high] = surface.nearness;
                if low >= at {
                    regions.cut::<f64>(polygon, &Extent::of(polygon), surface.opacity);
                } else if high > at {
                    keep(polygon, |p| surface.plane.at(p) - at, front);
                    if front.len() >= 3 {
                        regions.cut::<f64>(front, &Extent::of(front), surface.opacity);
                    }
                }
            }
            add_sample(light, sample, regions.total::<f64>() * through);
            through *= 1.0 - sample.opacity;
        }
    }
}

/// Adds `seen` times a sample.
fn add_sample(light: &mut [f64; 4], sample: &Sample, seen: f64) {
    let [r, g, b] = sample.color;
    for (sum, value) in light.iter_mut().zip([r, g, b, sample.opacity]) {
        *sum += seen * value;
    }
}

/// The planar depth at a nearness of a guest; infinite for what lies behind everything.
fn depth(camera: &Camera, nearness: f64) -> f64 {
    match camera.projection {
        Projection::Perspective { .. } if nearness > 0.0 => 1.0 / nearness,
        Projection::Perspective { .. } => f64::INFINITY,
        Projection::Parallel { .. } => -nearness,
    }
}

fn nearness(camera: &Camera, depth: f64) -> f64 {
    match camera.projection {
        Projection::Perspective { .. } => 1.0 / depth,
        Projection::Parallel { .. } => -depth,
    }
}
