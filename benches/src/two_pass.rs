//! From cube faces to a dome in two passes of one dimension each, as Catmull & Smith, "3-D transformations of images in
//! scanline order" (1980), decompose mappings. Greene & Heckbert (1986) name it as an unexplored way; here it is tried.
//!
//! A pixel (x, y) lies at (u, v) in a face. The first pass filters along the face's columns: for a row y of the picture it
//! gives what each column u shows where it crosses that row. The second filters these along u. Only one row of what
//! is between the passes is kept at a time. All that does not depend on the faces' pictures is found before
//! ([`TwoPass::new`]).
//!
//! A row crosses a column of a face at one place only where u grows or falls all along the row; where it does so slowly,
//! the first pass takes far more of the column than the pixel covers: the bottleneck ([`TwoPass::bottleneck`]).

use rayon::prelude::*;
use std::sync::LazyLock;
use veduta::geometry::DVec2;
use veduta::reproject::Projection;

/// Texels of a face, RGBA, rows from the top.
pub struct Face {
    /// Texels a side.
    pub side: usize,
    /// `side * side` of them.
    pub texels: Vec<[f32; 4]>,
}

/// Pixels of one row in one face, and some on each side, in whose columns the last pixels' kernels end.
struct Run {
    face: usize,
    /// First pixel, and the one after the last, without those on the sides.
    first: u32,
    end: u32,
    /// Of all pixels, those on the sides included.
    places: Vec<Place>,
}

/// Where a pixel lies.
#[derive(Clone, Copy)]
struct Place {
    u: f32,
    v: f32,
    /// How far v moves with a pixel down if u does not: the scale of the first pass.
    down: f32,
    /// How far u moves with a pixel to the right: the scale of the second.
    across: f32,
}

/// Pixels on each side of a run.
const SIDES: u32 = 6;

/// Rows of the picture by runs.
pub struct TwoPass {
    width: u32,
    rows: Vec<Vec<Run>>,
    bottleneck: f64,
}

impl TwoPass {
    /// Finds where the pixels of `target` lie in `faces`, squares that show more than 90 degrees, so that kernels may reach
    /// over the edges of the cube.
    pub fn new(faces: &[Projection], target: &Projection) -> Self {
        let rows: Vec<(Vec<Run>, f64)> = (0..target.height)
            .into_par_iter()
            .map(|row| runs(faces, target, row))
            .collect();
        let bottleneck = rows.iter().fold(1.0, |most, (_, here)| here.max(most));
        Self {
            width: target.width,
            rows: rows.into_iter().map(|(runs, _)| runs).collect(),
            bottleneck,
        }
    }

    /// How many times farther the first pass reaches along v than a pixel does, at most.
    pub fn bottleneck(&self) -> f64 {
        self.bottleneck
    }

    /// The picture from the pictures of the faces; 0 where it shows nothing.
    pub fn picture(&self, faces: &[Face]) -> Vec<[f32; 4]> {
        let width = self.width as usize;
        let mut pixels = vec![[0.0; 4]; width * self.rows.len()];
        pixels.par_chunks_mut(width).zip(&self.rows).for_each_init(
            Vec::new,
            |between, (pixels, runs)| {
                for run in runs {
                    let face = &faces[run.face];
                    let columns = first_pass(run, face, between);
                    let own = run.first as usize..run.end as usize;
                    let skipped = (run.places.len() - own.len()) / 2;
                    let places = &run.places[skipped..skipped + own.len()];
                    for (pixel, place) in pixels[own].iter_mut().zip(places) {
                        let at = |column: i32| between[(column - columns) as usize];
                        let last = columns + between.len() as i32 - 1;
                        *pixel = filtered(at, [columns, last], place.u, place.across);
                    }
                }
            },
        );
        pixels
    }
}

/// The runs of a row, and the bottleneck in it.
fn runs(faces: &[Projection], target: &Projection, row: u32) -> (Vec<Run>, f64) {
    let centre = |column: f64| DVec2::new(column + 0.5, f64::from(row) + 0.5);
    let nearest = |column: u32| {
        let at = centre(f64::from(column));
        let direction = target.covers(at).then(|| target.direction(at)).flatten()?;
        let along = |face: usize| faces[face].axis().dot(direction);
        (0..faces.len()).reduce(|a, b| if along(b) > along(a) { b } else { a })
    };
    let (mut runs, mut bottleneck) = (Vec::new(), 1.0_f64);
    let mut first = 0;
    while first < target.width {
        let face = nearest(first);
        let mut end = first + 1;
        while end < target.width && nearest(end) == face {
            end += 1;
        }
        if let Some(face) = face {
            let columns = i64::from(first) - i64::from(SIDES)..i64::from(end + SIDES);
            let mut places = Vec::with_capacity((end - first + 2 * SIDES) as usize);
            for column in columns {
                let (place, narrow) = place(&faces[face], target, centre(column as f64));
                bottleneck = bottleneck.max(narrow);
                places.push(place);
            }
            runs.push(Run {
                face,
                first,
                end,
                places,
            });
        }
        first = end;
    }
    (runs, bottleneck)
}

/// Where an image point lies in a face, and how many times farther the first pass reaches there than the pixel does.
fn place(face: &Projection, target: &Projection, at: DVec2) -> (Place, f64) {
    let texel = |away: DVec2| {
        let direction = target.direction(at + away).expect("the lens's law goes on");
        face.image(direction).expect("half a space is ahead") - 0.5
    };
    let here = texel(DVec2::ZERO);
    let x = texel(0.5 * DVec2::X) - texel(-0.5 * DVec2::X);
    let y = texel(0.5 * DVec2::Y) - texel(-0.5 * DVec2::Y);
    let down = (x.x * y.y - x.y * y.x) / x.x;
    let place = Place {
        u: here.x as f32,
        v: here.y as f32,
        down: down.abs() as f32,
        across: x.x.abs() as f32,
    };
    (place, down.abs() / x.y.hypot(y.y).max(1.0))
}

/// What the columns that a run crosses show where it does, in `between`; the first column.
fn first_pass(run: &Run, face: &Face, between: &mut Vec<[f32; 4]>) -> i32 {
    let (one, other) = (run.places[0].u, run.places[run.places.len() - 1].u);
    let side = face.side as i32;
    let first = (one.min(other).ceil() as i32).clamp(0, side - 1);
    let last = (one.max(other).floor() as i32).clamp(first, side - 1);
    between.clear();
    let grows = other > one;
    let count = run.places.len();
    // Places by growing u.
    let by_u = |k: usize| &run.places[if grows { k } else { count - 1 - k }];
    let mut next = 1;
    for column in first..=last {
        while next + 1 < count && by_u(next).u < column as f32 {
            next += 1;
        }
        let (a, b) = (by_u(next - 1), by_u(next));
        let part = ((column as f32 - a.u) / (b.u - a.u)).clamp(0.0, 1.0);
        let v = a.v + part * (b.v - a.v);
        let down = a.down + part * (b.down - a.down);
        let at = |row: i32| face.texels[row as usize * face.side + column as usize];
        between.push(filtered(at, [0, side - 1], v, down));
    }
    first
}

/// Squared scales, in samples, between which the cubic for magnification passes over into the Gaussian for reduction: those
/// of the elliptical filter.
const BLEND: [f32; 2] = [1.5, 3.0];

/// The weighted mean of samples around `at`, a pixel being `scale` of them; those beyond the first and last are these.
fn filtered(
    sample: impl Fn(i32) -> [f32; 4],
    [first, last]: [i32; 2],
    at: f32,
    scale: f32,
) -> [f32; 4] {
    let square = scale * scale;
    let cubic = ((BLEND[1] - square) / (BLEND[1] - BLEND[0])).clamp(0.0, 1.0);
    // Less the variance of what a sample stands for already.
    let radius = (square - 1.0 / 3.0).max(1.0).sqrt();
    let inverse = 1.0 / radius;
    let reach = if cubic > 0.0 { radius.max(2.0) } else { radius };
    let (mut sum, mut weights) = ([0.0_f32; 4], 0.0);
    for k in (at - reach).ceil() as i32..=(at + reach).floor() as i32 {
        let away = (k as f32 - at).abs();
        let mut weight = 0.0;
        if cubic > 0.0 {
            weight += cubic * catmull_rom(away);
        }
        if cubic < 1.0 && away < radius {
            let q = (away * inverse) * (away * inverse);
            // Of the integral 1, as the cubic.
            weight += (1.0 - cubic) * inverse * MARGINAL[(q * LENGTH as f32) as usize];
        }
        for (sum, value) in sum.iter_mut().zip(sample(k.clamp(first, last))) {
            *sum += weight * value;
        }
        weights += weight;
    }
    sum.map(|sum| sum / weights)
}

/// Entries of [`MARGINAL`].
const LENGTH: usize = 4096;

/// What the kernel exp(-2 r^2), r < 1, of the elliptical filter is along one axis, summed up along the other, by the square of
/// the distance, with integral 1: the product of two has the variance of that kernel, and as soft ends.
static MARGINAL: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let entry = |k: usize| {
        let q = (k as f64 + 0.5) / LENGTH as f64;
        // The integral of exp(-2 x^2) along half a chord, by its series.
        let chord = (1.0 - q).sqrt();
        let (mut term, mut sum) = (chord, 0.0);
        for n in 0..16 {
            sum += term / f64::from(2 * n + 1);
            term *= -2.0 * chord * chord / f64::from(n + 1);
        }
        (-2.0 * q).exp() * sum
    };
    let entries: Vec<f64> = (0..LENGTH).map(entry).collect();
    // Over x from -1 to 1, dx being dq / (2 x).
    let of_entry = |(k, entry): (usize, &f64)| entry / ((k as f64 + 0.5) / LENGTH as f64).sqrt();
    let integral: f64 = entries.iter().enumerate().map(of_entry).sum();
    let scale = LENGTH as f64 / integral;
    entries.iter().map(|entry| (scale * entry) as f32).collect()
});

/// The cubic of Catmull & Rom at a distance from its centre.
fn catmull_rom(x: f32) -> f32 {
    if x < 1.0 {
        1.0 + x * x * (1.5 * x - 2.5)
    } else if x < 2.0 {
        2.0 + x * (-4.0 + x * (2.5 - 0.5 * x))
    } else {
        0.0
    }
}
