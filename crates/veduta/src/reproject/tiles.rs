//! The picture cut into tiles, in each of which the mapping into one view is a polynomial, and single pixels where it
//! is not.

use super::mapping::{Mapping, Place};
use super::parts::VARIANCE;
use super::polynomial::{COEFFICIENTS, Polynomial};
use crate::filter::ewa::{Ewa, LANES, Measuring, vectorized};
use veduta_geometry::DVec2;

/// Side of the largest tiles, and height of the bands of rows that are made one by one, pixels.
pub(super) const TILE: u32 = 16;

/// Most that the polynomial of a tile may be off, in texels. Larger would be seen as jumps along tiles in the sharpest
/// detail; smaller costs more tiles.
const MOST_ERROR: f64 = 1.0 / 128.0;

/// By which part of themselves derivatives may change over a pixel before it is filtered in parts. Half as much takes
/// twice as many pixels along rims; twice as much doubles the error there.
pub(super) const MOST_CHANGE: f64 = 0.1;

/// Derivatives smaller than this, in texels, may change as they like: the filter is larger.
pub(super) const LEAST_STEP: f64 = 0.25;

/// A tile: a rectangle of pixels that lie in one view.
#[derive(Clone, Debug)]
pub(super) struct Tile {
    /// Left top pixel; the row counts from the band's first.
    pub corner: [u32; 2],
    pub size: [u32; 2],
    pub view: u32,
    /// Texel from which `texel` counts.
    pub base: [i32; 2],
    /// Of u and of v: coefficients of x^i y^j at `3 j + i`, with x and y in pixels from the tile's middle.
    pub texel: [[f32; COEFFICIENTS]; 2],
}

/// A pixel, or a part of one, with a place of its own.
#[derive(Clone, Debug)]
pub(super) struct Single {
    /// Counted through the band.
    pub pixel: u32,
    /// Share of the pixel's value; those of a pixel follow one another and sum to 1.
    pub weight: f32,
    pub view: u32,
    pub base: [i32; 2],
    /// Texels from the base.
    pub part: [f32; 2],
    /// `[ux, vx, uy, vy]`.
    pub derivatives: [f32; 4],
}

/// A band of rows.
#[derive(Clone, Debug, Default)]
pub(super) struct Band {
    pub tiles: Vec<Tile>,
    pub singles: Vec<Single>,
    /// Pixels that the picture covers in part, and how much.
    pub rim: Vec<(u32, f32)>,
    pub found: Found,
}

/// What is found out about the views on the way.
#[derive(Clone, Debug, Default)]
pub(super) struct Found {
    /// Of each view: pixels that come from it.
    pub pixels: Vec<f64>,
    /// Of each view: the texels that pixels' footprints touch, from first to last of columns and rows.
    pub windows: Vec<Option<[DVec2; 2]>>,
    /// Pixels that no view shows, by the side of the world: right, left, up, down, back, front.
    pub missing: [f64; 6],
    /// Pixels that the picture covers.
    pub covered: f64,
    /// Largest reach of a footprint in the level of the pyramid that it uses, texels.
    pub reach: f32,
    /// Largest squared minor radius, texels.
    pub minor: f32,
}

/// Cuts one band.
pub(super) struct Cutter<'a> {
    pub mapping: Mapping<'a>,
    pub ewa: &'a Ewa,
    /// First row of the band.
    pub top: u32,
    pub band: Band,
}

impl Cutter<'_> {
    /// Cuts all tiles of the band, which is `height` rows high.
    pub fn run(mut self, height: u32) -> Band {
        let views = self.mapping.sources.len();
        self.band.found.pixels.resize(views, 0.0);
        self.band.found.windows.resize(views, None);
        let width = self.mapping.target.width;
        for left in (0..width).step_by(TILE as usize) {
            self.cut([left, self.top], [TILE.min(width - left), height]);
        }
        self.band
    }

    fn cut(&mut self, corner: [u32; 2], size: [u32; 2]) {
        let cover = self.cover(corner, size);
        if cover == Cover::None {
            return;
        }
        // Three points along each side make a polynomial.
        if size[0].min(size[1]) < 3 {
            for row in corner[1]..corner[1] + size[1] {
                for column in corner[0]..corner[0] + size[0] {
                    self.pixel(column, row);
                }
            }
            return;
        }
        if cover == Cover::Whole {
            match self.fit(corner, size) {
                Fit::Tile(tile) => {
                    self.band.found.covered += area(size);
                    self.band.found.pixels[tile.view as usize] += area(size);
                    self.band.tiles.push(tile);
                    return;
                }
                Fit::Missing => {
                    self.missing(corner_middle(corner, size), area(size));
                    return;
                }
                Fit::None => {}
            }
        }
        let halves = |k: usize| {
            let first = size[k].div_ceil(2);
            [(corner[k], first), (corner[k] + first, size[k] - first)]
        };
        for (top, height) in halves(1) {
            for (left, width) in halves(0) {
                self.cut([left, top], [width, height]);
            }
        }
    }

    /// How much of a rectangle of pixels the picture covers. What lenses cover is convex.
    fn cover(&self, corner: [u32; 2], size: [u32; 2]) -> Cover {
        let target = self.mapping.target;
        let [a, b] = [corner, [corner[0] + size[0], corner[1] + size[1]]]
            .map(|[x, y]| DVec2::new(f64::from(x), f64::from(y)));
        let corners = [a, DVec2::new(b.x, a.y), DVec2::new(a.x, b.y), b];
        let covered = |at: DVec2| target.lens.covers(target.lens_from_image(at));
        if corners.into_iter().all(covered) {
            return Cover::Whole;
        }
        if target.lens.is_round() {
            let middle = target.image_from_lens(DVec2::ZERO);
            let away = (middle.clamp(a, b) - middle).length();
            if away >= target.pixels_per_unit() {
                return Cover::None;
            }
        }
        Cover::Part
    }

    /// A polynomial for a rectangle all of which is covered.
    fn fit(&mut self, corner: [u32; 2], size: [u32; 2]) -> Fit {
        let middle = corner_middle(corner, size);
        // From the middle to the centres of the outermost pixels.
        let half = 0.5 * (DVec2::new(f64::from(size[0]), f64::from(size[1])) - 1.0);
        let mapping = &self.mapping;
        let node = |k: usize| DVec2::new((k % 3) as f64 - 1.0, (k / 3) as f64 - 1.0) * half;
        let places: [Option<Place>; 9] = std::array::from_fn(|k| mapping.place(middle + node(k)));
        if places.iter().all(Option::is_none) {
            return Fit::Missing;
        }
        let Some(centre) = places[4] else {
            return Fit::None;
        };
        let view = centre.view;
        let mut nodes = [DVec2::ZERO; 9];
        for (node, place) in nodes.iter_mut().zip(places) {
            match place {
                Some(place) if place.view == view => *node = place.texel,
                _ => return Fit::None,
            }
        }
        let nodes = nodes.map(|node| mapping.nearest(view, node, centre.texel));
        let base = centre.texel.floor();
        let polynomial = Polynomial::through(&nodes.map(|at| at - base), half);
        // Between the nodes, where the first neglected terms are largest.
        let between = 3.0_f64.sqrt().recip();
        for k in 0..9 {
            if k == 4 {
                continue;
            }
            let at = between * node(k);
            let near = polynomial.at(at) + base;
            let exact = mapping.texel_near(view, middle + at, near);
            let within = exact.is_some_and(|exact| {
                let off = (exact - near).abs();
                off.cmple(DVec2::splat(MOST_ERROR)).all()
            });
            if !within {
                return Fit::None;
            }
        }
        let outer: [usize; 8] = [0, 1, 2, 3, 5, 6, 7, 8];
        let steps = outer.map(|k| polynomial.derivatives(node(k)));
        if steps
            .iter()
            .any(|step| changes(step, &polynomial.changes()))
        {
            return Fit::None;
        }
        // Pixels between the nodes may lie farther out than these, by what the polynomial bends.
        let bend = polynomial.bend(half);
        let source = &mapping.sources[view];
        let last = DVec2::new(f64::from(source.width), f64::from(source.height)) - 0.5;
        let outside = nodes.iter().any(|&at| {
            (at - bend).cmplt(DVec2::splat(-1.5)).any() || (at + bend).cmpgt(last + 1.0).any()
        });
        if source.period().is_none() && outside {
            return Fit::None;
        }
        let reach = self.measure(steps);
        self.take(view, &nodes, bend + f64::from(reach));
        let row = corner[1] - self.top;
        Fit::Tile(Tile {
            corner: [corner[0], row],
            size,
            view: view as u32,
            base: [base.x as i32, base.y as i32],
            texel: polynomial.averaged(VARIANCE).coefficients(),
        })
    }

    pub(super) fn missing(&mut self, image: DVec2, pixels: f64) {
        let found = &mut self.band.found;
        found.covered += pixels;
        let Some(direction) = self.mapping.target.direction(image) else {
            return;
        };
        let axis = direction.abs();
        let k = (0..3).fold(0, |best, k| if axis[k] > axis[best] { k } else { best });
        found.missing[2 * k + usize::from(direction[k] < 0.0)] += pixels;
    }

    /// Notes how large footprints are; gives the largest reach.
    pub(super) fn measure(&mut self, steps: [[DVec2; 2]; 8]) -> f32 {
        let lanes = |f: &dyn Fn(&[DVec2; 2]) -> f64| -> [f32; LANES] {
            std::array::from_fn(|k| f(&steps[k]) as f32)
        };
        let derivatives = [
            lanes(&|[x, _]| x.x),
            lanes(&|[x, _]| x.y),
            lanes(&|[_, y]| y.x),
            lanes(&|[_, y]| y.y),
        ];
        let ewa = self.ewa;
        let [reaches, minors] = vectorized(Measuring { ewa, derivatives });
        let found = &mut self.band.found;
        let mut reach: f32 = 0.0;
        for lane in 0..LANES {
            reach = reach.max(reaches[lane]);
            found.minor = found.minor.max(minors[lane]);
            // In texels of the finer level that is used.
            let level = ewa.level(minors[lane]).floor();
            found.reach = found.reach.max(reaches[lane] * (-level).exp2());
        }
        reach
    }

    /// Notes which texels are read.
    pub(super) fn take(&mut self, view: usize, at: &[DVec2], reach: DVec2) {
        let window = &mut self.band.found.windows[view];
        for &at in at {
            let [low, high] = window.get_or_insert([at - reach, at + reach]);
            *low = low.min(at - reach);
            *high = high.max(at + reach);
        }
    }
}

#[derive(PartialEq)]
enum Cover {
    Whole,
    Part,
    None,
}

enum Fit {
    Tile(Tile),
    /// No view shows any of it.
    Missing,
    /// One polynomial is not enough.
    None,
}

fn area(size: [u32; 2]) -> f64 {
    f64::from(size[0]) * f64::from(size[1])
}

fn corner_middle(corner: [u32; 2], size: [u32; 2]) -> DVec2 {
    let of = |k: usize| f64::from(corner[k]) + 0.5 * f64::from(size[k]);
    DVec2::new(of(0), of(1))
}

/// Whether derivatives change so much over a pixel that it needs parts.
fn changes(step: &[DVec2; 2], change: &[DVec2; 2]) -> bool {
    step.iter()
        .zip(change)
        .any(|(step, change)| change.length() > MOST_CHANGE * step.length().max(2.0 * LEAST_STEP))
}
