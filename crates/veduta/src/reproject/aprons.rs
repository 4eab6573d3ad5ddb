//! What lies around the views' pictures: by what their neighbours show there.
//!
//! First a narrow ring is filled, in which interpolation near a neighbour's edge has only that neighbour's texels; then all,
//! with the ring of the neighbours to interpolate in. Where a texel comes from is worked out once for all frames of a
//! sequence: that took nine tenths of the time.

use super::Projection;
use super::views::find;
use crate::filter::Texels;
use rayon::prelude::*;
use veduta_geometry::DVec2;

/// Width of the first ring of an apron: what cubic interpolation reaches over a border.
const RING: u32 = 2;

/// Where the texels around a view's picture come from, and those within that the lens does not show.
#[derive(Clone, Debug)]
pub(super) struct Apron {
    texels: Vec<Continued>,
    /// How far beyond their borders views are read.
    ring: i32,
}

/// One texel of an apron.
#[derive(Clone, Copy, Debug)]
struct Continued {
    column: i32,
    row: i32,
    /// The view that shows it, the texel there, and how far beyond that one's centre.
    view: u32,
    at: [i32; 2],
    part: [f32; 2],
}

impl Apron {
    /// The two steps of a level, each of all views.
    pub fn of_level(
        projections: &[Projection],
        pyramids: &[Vec<Texels>],
        level: usize,
    ) -> [Vec<Self>; 2] {
        let width = pyramids.first().map_or(0, |levels| levels[0].apron());
        let ring = RING.min(width);
        [(ring, 0), (width, ring)].map(|(width, ring)| {
            let apron = |view| Self {
                texels: continued(projections, view, &pyramids[view][level], level, width),
                ring: ring as i32,
            };
            (0..projections.len()).into_par_iter().map(apron).collect()
        })
    }

    /// What the texels are, from the pictures of a level.
    pub fn texels(&self, pyramids: &[Vec<Texels>], level: usize) -> Vec<[f32; 4]> {
        let texel = |of: &Continued| {
            let texels = &pyramids[of.view as usize][level];
            interpolate(texels, of.at, of.part, self.ring)
        };
        self.texels.iter().map(texel).collect()
    }

    /// Sets them.
    pub fn fill(&self, texels: &mut Texels, found: &[[f32; 4]]) {
        for (of, &texel) in self.texels.iter().zip(found) {
            texels.set(of.column, of.row, texel);
        }
    }
}

/// The texels around a view's picture, `width` of them on each side, and those within that the lens does not show.
fn continued(
    projections: &[Projection],
    view: usize,
    texels: &Texels,
    level: usize,
    width: u32,
) -> Vec<Continued> {
    let (projection, scale) = (&projections[view], f64::from(1_u32 << level));
    let [columns, rows] = [texels.width() as i32, texels.height() as i32];
    let width = width as i32;
    let mut found = Vec::new();
    for row in -width..rows + width {
        let within = (0..rows).contains(&row);
        let mut column = -width;
        while column < columns + width {
            let image = scale * (DVec2::new(f64::from(column), f64::from(row)) + 0.5);
            if within && (0..columns).contains(&column) {
                if !projection.lens.is_round() {
                    column = columns;
                    continue;
                }
                if projection.lens.covers(projection.lens_from_image(image)) {
                    column += 1;
                    continue;
                }
            }
            let other = projection
                .direction(image)
                .and_then(|direction| find(projections, direction));
            let (view, at) = match other {
                Some((other, image)) => (other, image / scale - 0.5),
                // Nobody shows it: the border is continued.
                None => {
                    let inside = nearest_covered(projection, image) / scale;
                    let last = DVec2::new(f64::from(columns - 1), f64::from(rows - 1));
                    (view, inside.floor().clamp(DVec2::ZERO, last))
                }
            };
            let corner = at.floor();
            found.push(Continued {
                column,
                row,
                view: view as u32,
                at: [corner.x as i32, corner.y as i32],
                part: [(at.x - corner.x) as f32, (at.y - corner.y) as f32],
            });
            column += 1;
        }
    }
    found
}

/// The image point in the picture that is nearest to one outside.
fn nearest_covered(projection: &Projection, image: DVec2) -> DVec2 {
    let size = DVec2::new(f64::from(projection.width), f64::from(projection.height));
    let inside = image.clamp(DVec2::splat(0.5), size - 0.5);
    if !projection.lens.is_round() {
        return inside;
    }
    let point = projection.lens_from_image(inside);
    let most = 1.0 - 0.5 / projection.pixels_per_unit();
    projection.image_from_lens(point.clamp_length_max(most.max(0.0)))
}

/// The picture at a texel and a part of one beyond its centre, by the cubic of Catmull & Rom on texels that lie at most
/// `ring` outside of it. Equal texels give that value exactly, and no value is beyond those of the texels.
fn interpolate(texels: &Texels, [column, row]: [i32; 2], part: [f32; 2], ring: i32) -> [f32; 4] {
    let [columns, rows] = [texels.width() as i32, texels.height() as i32];
    let clamped = |k: i32, size: i32| k.clamp(-ring, size - 1 + ring);
    let columns = [-1, 0, 1, 2].map(|k| clamped(column + k, columns));
    let [across, down] = part.map(catmull_rom);
    let middle = texels.texel(columns[1], clamped(row, rows));
    let (mut sum, mut low, mut high) = ([0.0_f32; 4], middle, middle);
    for (k, down) in down.into_iter().enumerate() {
        let row = clamped(row + k as i32 - 1, rows);
        for (column, across) in columns.into_iter().zip(across) {
            let texel = texels.texel(column, row);
            let weight = across * down;
            for channel in 0..4 {
                // Differences, so that a constant is not rounded.
                sum[channel] += weight * (texel[channel] - middle[channel]);
                low[channel] = low[channel].min(texel[channel]);
                high[channel] = high[channel].max(texel[channel]);
            }
        }
    }
    std::array::from_fn(|k| (middle[k] + sum[k]).clamp(low[k], high[k]))
}

/// Weights of four neighbours at a part of the way from the second to the third.
fn catmull_rom(x: f32) -> [f32; 4] {
    let outer = |x: f32| 0.5 * x * (1.0 - x) * (x - 1.0);
    let inner = |x: f32| 1.0 + x * x * (1.5 * x - 2.5);
    [outer(x), inner(x), inner(1.0 - x), outer(1.0 - x)]
}
