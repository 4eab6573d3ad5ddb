//! One band of rows: the tiles' polynomials, eight pixels at once, and the filter.

use super::Views;
use super::tiles::{Band, Single, Tile};
use crate::filter::ewa::{Ewa, Footprints, LANES, Vector, Work};

/// Makes a band's pixels, `width` to a row. To be run by
/// [`vectorized`](crate::filter::ewa::vectorized).
pub(super) struct Filtering<'a> {
    pub ewa: &'a Ewa,
    pub views: &'a Views,
    pub band: &'a Band,
    pub width: u32,
    pub pixels: &'a mut [[f32; 4]],
}

impl Work for Filtering<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self, token: V::Token) {
        let Self {
            ewa,
            views,
            band,
            width,
            pixels,
        } = self;
        pixels.fill([0.0; 4]);
        for tile in &band.tiles {
            of_tile::<V>(token, ewa, views, tile, width, pixels);
        }
        for of_pixel in band.singles.chunk_by(|a, b| a.pixel == b.pixel) {
            pixels[of_pixel[0].pixel as usize] = of_singles::<V>(token, ewa, views, of_pixel);
        }
        for &(pixel, coverage) in &band.rim {
            for value in &mut pixels[pixel as usize] {
                *value *= coverage;
            }
        }
    }
}

#[inline(always)]
fn of_tile<V: Vector>(
    token: V::Token,
    ewa: &Ewa,
    views: &Views,
    tile: &Tile,
    width: u32,
    pixels: &mut [[f32; 4]],
) {
    let levels = views.pyramid(tile.view as usize);
    let [columns, rows] = tile.size;
    let middle = tile.size.map(|size| 0.5 * size as f32 - 0.5);
    for row in 0..rows {
        let y = row as f32 - middle[1];
        let start = ((tile.corner[1] + row) * width + tile.corner[0]) as usize;
        let pixels = &mut pixels[start..start + columns as usize];
        // In x alone: values, and derivatives by y.
        let (mut value, mut slope) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
        for (k, c) in tile.texel.iter().enumerate() {
            for i in 0..3 {
                value[k][i] = y.mul_add(y.mul_add(c[6 + i], c[3 + i]), c[i]);
                slope[k][i] = (2.0 * y).mul_add(c[6 + i], c[3 + i]);
            }
        }
        let [u, v] = value;
        for (chunk, pixels) in pixels.chunks_mut(LANES).enumerate() {
            // Lanes beyond the tile stay at its last column.
            let x = V::count(token) + V::all(token, (chunk * LANES) as f32 - middle[0]);
            let x = x.min(V::all(token, middle[0]));
            let centre = [x.polynomial(token, &u), x.polynomial(token, &v)];
            let steps = [
                x.polynomial(token, &[u[1], 2.0 * u[2]]),
                x.polynomial(token, &[v[1], 2.0 * v[2]]),
                x.polynomial(token, &slope[0]),
                x.polynomial(token, &slope[1]),
            ];
            let footprints = Footprints::new(token, ewa, ewa.variance, centre, steps);
            if let Some(means) = ewa.of_eight::<V>(token, &levels[0], tile.base, &footprints) {
                pixels.copy_from_slice(&means[..pixels.len()]);
                continue;
            }
            let [ux, vx, uy, vy] = steps;
            let arrays = [ux.array(), vx.array(), uy.array(), vy.array()];
            for (lane, pixel) in pixels.iter_mut().enumerate() {
                let [ux, vx, uy, vy] = &arrays;
                let derivatives = [ux[lane], vx[lane], uy[lane], vy[lane]];
                *pixel = ewa.of_lane::<V>(token, levels, tile.base, &footprints, derivatives, lane);
            }
        }
    }
}

/// A pixel from its parts, as the first and differences to it, so that equal parts give just that.
#[inline(always)]
fn of_singles<V: Vector>(
    token: V::Token,
    ewa: &Ewa,
    views: &Views,
    singles: &[Single],
) -> [f32; 4] {
    let mut result = [0.0; 4];
    let mut first = [0.0; 4];
    for (index, single) in singles.iter().enumerate() {
        let centre = single.part.map(|x| V::all(token, x));
        let steps = single.derivatives.map(|x| V::all(token, x));
        let footprints = Footprints::new(token, ewa, ewa.variance, centre, steps);
        let levels = views.pyramid(single.view as usize);
        let mean: [f32; 4] = ewa.of_lane::<V>(
            token,
            levels,
            single.base,
            &footprints,
            single.derivatives,
            0,
        );
        if index == 0 {
            (result, first) = (mean, mean);
        } else {
            for k in 0..4 {
                result[k] += single.weight * (mean[k] - first[k]);
            }
        }
    }
    result
}
