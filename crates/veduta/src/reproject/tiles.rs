//! The picture cut into tiles, in each of which the mapping into one view is a polynomial, and single pixels where it
//! is not.

use super::mapping::{Mapping, Place};
use crate::filter::ewa::{Ewa, LANES, Measuring, vectorized};
use veduta_geometry::DVec2;

/// Side of the largest tiles, and height of the bands of rows that are made one by one, pixels.
pub(super) const TILE: u32 = 16;

/// Most that the polynomial of a tile may be off, in texels. Larger would be seen as jumps along tiles in the sharpest
/// detail; smaller costs more tiles.
const MOST_ERROR: f64 = 1.0 / 128.0;

/// By which part of themselves derivatives may change over a pixel before it is filtered in parts.
const MOST_CHANGE: f64 = 0.5;

/// Derivatives smaller than this, in texels, may change as they like: the filter is larger.
const LEAST_STEP: f64 = 0.25;

/// How many coefficients a polynomial of second degree in x and in y has.
const COEFFICIENTS: usize = 9;

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
        if let Some(period) = mapping.sources[view].period() {
            for node in &mut nodes {
                node.x -= ((node.x - centre.texel.x) / period).round() * period;
            }
        }
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
            texel: polynomial.coefficients(),
        })
    }

    /// A pixel on its own, in parts where the mapping bends too much for one ellipse.
    fn pixel(&mut self, column: u32, row: u32) {
        let target = self.mapping.target;
        let coverage = target.coverage(column, row);
        if coverage <= 0.0 {
            return;
        }
        let pixel = (row - self.top) * target.width + column;
        let centre = self.inside(DVec2::new(f64::from(column), f64::from(row)) + 0.5);
        if coverage < 1.0 {
            self.band.rim.push((pixel, coverage as f32));
        }
        let Some(place) = self.mapping.place(centre) else {
            self.missing(centre, coverage);
            return;
        };
        self.band.found.covered += coverage;
        self.band.found.pixels[place.view] += coverage;
        let parts = self.parts(centre, &place);
        if parts == 1 {
            self.single(pixel, 1.0, &place, 1.0);
            return;
        }
        let first = self.band.singles.len();
        let mut sum = 0.0;
        // The Gaussian of radius 1, less what the parts' own have of it.
        let n = f64::from(parts);
        let sharpness = 2.0 / (1.0 - 1.0 / (n * n));
        for j in 0..2 * parts {
            for i in 0..2 * parts {
                let away = (DVec2::new(f64::from(i), f64::from(j)) + 0.5) / n - 1.0;
                let weight = (-sharpness * away.length_squared()).exp();
                let at = centre + away;
                if away.length_squared() > 1.0
                    || !target.lens.covers(target.lens_from_image(at)) && target.lens.is_round()
                {
                    continue;
                }
                if let Some(place) = self.mapping.place(at) {
                    self.single(pixel, weight, &place, 1.0 / n);
                    sum += weight;
                }
            }
        }
        for single in &mut self.band.singles[first..] {
            single.weight /= sum as f32;
        }
    }

    /// In how many parts along each side a pixel is to be filtered.
    fn parts(&self, centre: DVec2, place: &Place) -> u32 {
        if !place.derivatives.iter().all(|step| step.is_finite()) {
            return 8;
        }
        let mut most: f64 = 0.0;
        for axis in [DVec2::X, DVec2::Y] {
            let at = |side: f64| self.mapping.place_in(place.view, centre + side * axis);
            let (Some(ahead), Some(behind)) = (at(0.5), at(-0.5)) else {
                return 8;
            };
            for k in 0..2 {
                let change = (ahead.derivatives[k] - behind.derivatives[k]).length();
                let change = change / place.derivatives[k].length().max(2.0 * LEAST_STEP);
                most = most.max(if change.is_nan() {
                    f64::INFINITY
                } else {
                    change
                });
            }
        }
        match most {
            _ if most <= MOST_CHANGE => 1,
            _ if most <= 2.0 * MOST_CHANGE => 2,
            _ if most <= 4.0 * MOST_CHANGE => 4,
            _ => 8,
        }
    }

    fn single(&mut self, pixel: u32, weight: f64, place: &Place, scale: f64) {
        let base = place.texel.floor();
        let part = place.texel - base;
        let [x, y] = place.derivatives.map(|step| step * scale);
        let reach = self.measure([[x, y]; 8]);
        self.take(place.view, &[place.texel], DVec2::splat(f64::from(reach)));
        self.band.singles.push(Single {
            pixel,
            weight: weight as f32,
            view: place.view as u32,
            base: [base.x as i32, base.y as i32],
            part: [part.x as f32, part.y as f32],
            derivatives: [x.x, x.y, y.x, y.y].map(|d| d as f32),
        });
    }

    /// Nearest point that the lens shows, a little inside.
    fn inside(&self, image: DVec2) -> DVec2 {
        let target = self.mapping.target;
        let point = target.lens_from_image(image);
        if !target.lens.is_round() || target.lens.covers(point) {
            return image;
        }
        let mut point = point.clamp_length_max(1.0 - 1e-9);
        // Towards the middle, as far as the arc asks for; a pixel reaches less than its diagonal over it.
        let step = point * (0.125 / target.pixels_per_unit()).min(1.0) / point.length().max(1e-9);
        for _ in 0..16 {
            if target.lens.covers(point) {
                break;
            }
            point -= step;
        }
        target.image_from_lens(point)
    }

    fn missing(&mut self, image: DVec2, pixels: f64) {
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
    fn measure(&mut self, steps: [[DVec2; 2]; 8]) -> f32 {
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
    fn take(&mut self, view: usize, at: &[DVec2], reach: DVec2) {
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

/// Of second degree in x and in y.
struct Polynomial {
    coefficients: [DVec2; COEFFICIENTS],
}

impl Polynomial {
    /// Through values at the nodes -half, 0 and half of each axis, rows from the top.
    fn through(nodes: &[DVec2; 9], half: DVec2) -> Self {
        let along = |a: DVec2, b: DVec2, c: DVec2, half: f64| {
            [
                b,
                (c - a) / (2.0 * half),
                (c - 2.0 * b + a) / (2.0 * half * half),
            ]
        };
        let rows =
            [0, 1, 2].map(|j| along(nodes[3 * j], nodes[3 * j + 1], nodes[3 * j + 2], half.x));
        let mut coefficients = [DVec2::ZERO; COEFFICIENTS];
        for i in 0..3 {
            let of_power = along(rows[0][i], rows[1][i], rows[2][i], half.y);
            for (j, value) in of_power.into_iter().enumerate() {
                coefficients[3 * j + i] = value;
            }
        }
        Self { coefficients }
    }

    fn at(&self, DVec2 { x, y }: DVec2) -> DVec2 {
        let c = &self.coefficients;
        let row = |j: usize| c[3 * j] + x * (c[3 * j + 1] + x * c[3 * j + 2]);
        row(0) + y * (row(1) + y * row(2))
    }

    fn derivatives(&self, DVec2 { x, y }: DVec2) -> [DVec2; 2] {
        let c = &self.coefficients;
        let along = |j: usize| c[3 * j + 1] + 2.0 * x * c[3 * j + 2];
        let row = |j: usize| c[3 * j] + x * (c[3 * j + 1] + x * c[3 * j + 2]);
        [
            along(0) + y * (along(1) + y * along(2)),
            row(1) + 2.0 * y * row(2),
        ]
    }

    /// How much the derivatives by x and by y change over a pixel, about: along their own axis and the other.
    fn changes(&self) -> [DVec2; 2] {
        let c = &self.coefficients;
        let (xx, xy, yy) = (2.0 * c[2].abs(), c[4].abs(), 2.0 * c[6].abs());
        [xx.max(xy), yy.max(xy)]
    }

    /// How far between the nodes it may be beyond them.
    fn bend(&self, half: DVec2) -> DVec2 {
        let c = &self.coefficients;
        0.25 * (c[2].abs() * half.x * half.x
            + c[6].abs() * half.y * half.y
            + c[4].abs() * half.x * half.y)
    }

    fn coefficients(&self) -> [[f32; COEFFICIENTS]; 2] {
        [
            self.coefficients.map(|c| c.x as f32),
            self.coefficients.map(|c| c.y as f32),
        ]
    }
}
