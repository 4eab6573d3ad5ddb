//! Pixels on their own: along the rim, along seams, and where the mapping bends too much for the polynomial of a tile.

use super::mapping::Place;
use super::parts::{VARIANCE, count, parts};
use super::tiles::{Cutter, LEAST_STEP, MOST_CHANGE, Single};
use veduta_geometry::DVec2;

impl Cutter<'_> {
    /// A pixel on its own, in parts where the mapping bends too much for one ellipse.
    pub(super) fn pixel(&mut self, column: u32, row: u32) {
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
        let axes = self.axes(centre);
        let bend = self.bend(centre, axes, &place);
        if bend.counts == [1, 1] {
            let texel = place.texel + bend.shift;
            self.single(pixel, 1.0, &Place { texel, ..place });
            return;
        }
        let first = self.band.singles.len();
        let mut sum = 0.0;
        for part in parts(bend.counts) {
            let at = centre + axes[0] * part.away.x + axes[1] * part.away.y;
            if !target.lens.covers(target.lens_from_image(at)) && target.lens.is_round() {
                continue;
            }
            if let Some(place) = self.mapping.place(at) {
                let [first, second] = along(&place, axes);
                let derivatives = [first * part.radii.x, second * part.radii.y];
                let place = Place {
                    derivatives,
                    ..place
                };
                self.single(pixel, part.weight, &place);
                sum += part.weight;
            }
        }
        for single in &mut self.band.singles[first..] {
            single.weight /= sum as f32;
        }
    }

    /// Along which axes a pixel is split: first the one along which lenses bend most.
    fn axes(&self, centre: DVec2) -> [DVec2; 2] {
        let target = self.mapping.target;
        if !target.lens.is_round() {
            return [DVec2::Y, DVec2::X];
        }
        let outwards = centre - target.image_from_lens(DVec2::ZERO);
        let outwards = outwards.try_normalize().unwrap_or(DVec2::X);
        [outwards, outwards.perp()]
    }

    /// How the mapping bends over a pixel.
    fn bend(&self, centre: DVec2, axes: [DVec2; 2], place: &Place) -> Bend {
        let here = along(place, axes);
        let (mut change, mut longest) = ([0.0_f64; 2], here.map(DVec2::length));
        let mut shift = DVec2::ZERO;
        for (axis, change) in axes.into_iter().zip(&mut change) {
            let at = |side: f64| self.mapping.place_in(place.view, centre + side * axis);
            let (Some(ahead), Some(behind)) = (at(0.5), at(-0.5)) else {
                *change = f64::INFINITY;
                longest = [f64::INFINITY; 2];
                continue;
            };
            let steps = [&ahead, &behind].map(|place| along(place, axes));
            for k in 0..2 {
                let of_step = (steps[0][k] - steps[1][k]).length();
                let of_step = of_step / here[k].length().max(2.0 * LEAST_STEP);
                // Not a number: the lens's law ends here.
                *change = if of_step.is_nan() {
                    f64::INFINITY
                } else {
                    change.max(of_step)
                };
                longest[k] = longest[k].max(steps[0][k].length().max(steps[1][k].length()));
            }
            let [ahead, behind] = [ahead, behind]
                .map(|there| self.mapping.nearest(place.view, there.texel, place.texel));
            // Half the variance times the second derivative.
            shift += 2.0 * VARIANCE * (ahead + behind - 2.0 * place.texel);
        }
        Bend {
            counts: [0, 1].map(|k| count(k, change[k] / MOST_CHANGE, longest[k])),
            shift,
        }
    }

    /// Adds a part, at a place whose derivatives are those by the part's sides.
    fn single(&mut self, pixel: u32, weight: f64, place: &Place) {
        let base = place.texel.floor();
        let part = place.texel - base;
        let [x, y] = place.derivatives;
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
}

struct Bend {
    /// In how many parts a pixel is to be split along each axis.
    counts: [usize; 2],
    /// From where the pixel's centre lies to the mean of where its kernel does, texels.
    shift: DVec2,
}

/// Derivatives along other axes.
fn along(place: &Place, axes: [DVec2; 2]) -> [DVec2; 2] {
    let [x, y] = place.derivatives;
    axes.map(|axis| x * axis.x + y * axis.y)
}
