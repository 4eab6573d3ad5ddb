//! What is laid over dome pictures: circles of altitude, lines of azimuth, the safe area, and a soft rim.
//!
//! All is told in the dome's own angles: the altitude is counted from the circle of a lens of 180 degrees (so
//! that wider ones have altitudes below 0) to the axis, the azimuth from the front, which is at the bottom of
//! the picture.

use super::letters::{Stroke, distance, strokes};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use veduta::accumulate::Picture;
use veduta::geometry::DVec2;
use veduta::reproject::Projection;

/// Lines over a picture of a round lens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guide {
    /// Circles of altitude each 10 degrees and lines of azimuth each 15, with names: to align projectors by.
    Alignment,
    /// The area that all seats of a theatre see well whose seats face one way: 50 degrees to both sides
    /// of the front, from 10 to 60 degrees of altitude (Dome Master Working Specification of IMERSA).
    SafeArea,
}

/// Colour of a guide, linear.
fn color(guide: Guide) -> [f32; 3] {
    match guide {
        Guide::Alignment => [0.6, 0.6, 0.6],
        Guide::SafeArea => [0.9, 0.6, 0.0],
    }
}

/// Width of lines, as a share of the circle's radius.
const WIDTH: f64 = 0.003;

/// Draws guides over a picture of a round lens.
///
/// # Panics
/// If the picture has another size than its projection.
pub fn draw_guides(picture: &mut Picture, projection: &Projection, guides: &[Guide]) {
    let size = [projection.width, projection.height];
    assert_eq!([picture.width, picture.height], size, "the picture's size");
    let names = names(projection);
    let radius = projection.pixels_per_unit();
    let width = (WIDTH * radius).max(1.0);
    let columns = picture.width as usize;
    let rows = picture.pixels.par_chunks_mut(columns).enumerate();
    rows.for_each(|(row, pixels)| {
        for (column, pixel) in pixels.iter_mut().enumerate() {
            let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            let covered = projection.coverage(column as u32, row as u32);
            let Some(place) = Place::at(projection, at).filter(|_| covered > 0.0) else {
                continue;
            };
            for &guide in guides {
                let away = match guide {
                    Guide::Alignment => place
                        .off_grid()
                        .min(distance(&names, at) - 0.3 * width)
                        .min(rim(projection, at)),
                    Guide::SafeArea => place.off_safe_area(),
                };
                let share = (0.5 + 0.5 * width - away).clamp(0.0, 1.0) * covered;
                lay_over(pixel, color(guide), share as f32);
            }
        }
    });
}

/// Distance from the limiting circle, pixels.
fn rim(projection: &Projection, at: DVec2) -> f64 {
    let from_middle = projection.lens_from_image(at).length();
    (from_middle - 1.0).abs() * projection.pixels_per_unit()
}

/// Makes a picture of a round lens end softly: all is kept up to half of `fov - feather` from the axis, and
/// nothing is left from half of `fov` on; in radians.
///
/// # Panics
/// If the picture has another size than its projection.
pub fn mask(picture: &mut Picture, projection: &Projection, fov: f64, feather: f64) {
    let size = [projection.width, projection.height];
    assert_eq!([picture.width, picture.height], size, "the picture's size");
    let columns = picture.width as usize;
    let rows = picture.pixels.par_chunks_mut(columns).enumerate();
    rows.for_each(|(row, pixels)| {
        for (column, pixel) in pixels.iter_mut().enumerate() {
            let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            let share = match Place::at(projection, at) {
                None => 0.0,
                Some(place) => {
                    let inside = 0.5 * fov - (FRAC_PI_2 - place.altitude);
                    // A hard rim is one pixel wide.
                    let soft = (0.5 * feather).max(1.0 / place.altitude_pixels);
                    let t = (inside / soft).clamp(0.0, 1.0);
                    t * t * (3.0 - 2.0 * t)
                }
            };
            for channel in pixel {
                *channel *= share as f32;
            }
        }
    });
}

fn lay_over(pixel: &mut [f32; 4], [r, g, b]: [f32; 3], share: f32) {
    for (channel, over) in pixel.iter_mut().zip([r, g, b, 1.0]) {
        *channel += (over - *channel) * share;
    }
}

/// Where a point of a dome picture is on the dome.
struct Place {
    altitude: f64,
    /// From the front, to the right.
    azimuth: f64,
    /// Pixels of a radian of altitude, and of one of azimuth, there.
    altitude_pixels: f64,
    azimuth_pixels: f64,
}

impl Place {
    fn at(projection: &Projection, at: DVec2) -> Option<Self> {
        let point = projection.lens_from_image(at);
        let radius = point.length();
        let along = |r: f64| {
            let point = if radius > 0.0 {
                point * (r / radius)
            } else {
                DVec2::new(r, 0.0)
            };
            Some(projection.lens.direction(point)?.z.clamp(-1.0, 1.0).acos())
        };
        let from_axis = along(radius)?;
        // From the law along the radius; a thousandth is enough for the width of a line.
        let step = 1e-3;
        let [low, high] = [(radius - step).max(0.0), radius + step];
        let slope = match along(high) {
            Some(beyond) => (beyond - along(low)?) / (high - low),
            None => (from_axis - along(low)?) / (radius - low),
        };
        let pixels = projection.pixels_per_unit();
        Some(Self {
            altitude: FRAC_PI_2 - from_axis,
            azimuth: point.x.atan2(-point.y),
            altitude_pixels: pixels / slope,
            azimuth_pixels: pixels * radius,
        })
    }

    /// Distance from the nearest line of the grid, pixels.
    fn off_grid(&self) -> f64 {
        let [tenth, twelfth] = [10_f64.to_radians(), 15_f64.to_radians()];
        let circle = (self.altitude - (self.altitude / tenth).round() * tenth).abs();
        let line = (self.azimuth - (self.azimuth / twelfth).round() * twelfth).abs();
        // All lines would run together at the zenith: only the cross of the four quarters goes on.
        let is_main = ((self.azimuth / twelfth).round() as i64) % 6 == 0;
        let mut nearest = circle * self.altitude_pixels;
        if is_main || self.altitude < 80_f64.to_radians() {
            nearest = nearest.min(line * self.azimuth_pixels);
        }
        nearest
    }

    /// Distance from the border of the safe area, pixels.
    fn off_safe_area(&self) -> f64 {
        let [side, low, high] = [50_f64, 10.0, 60.0].map(f64::to_radians);
        let beside = (self.azimuth.abs() - side) * self.azimuth_pixels;
        let below = (low - self.altitude) * self.altitude_pixels;
        let above = (self.altitude - high) * self.altitude_pixels;
        beside.max(below).max(above).abs()
    }
}

/// The names of the four sides and of the altitudes, in pixels.
fn names(projection: &Projection) -> Vec<Stroke> {
    let radius = projection.pixels_per_unit();
    let mut found = Vec::new();
    let put = |found: &mut Vec<Stroke>, text: &str, altitude: f64, azimuth: f64, height: f64| {
        let from_axis = FRAC_PI_2 - altitude;
        let direction = veduta::geometry::DVec3::new(
            from_axis.sin() * azimuth.sin(),
            -from_axis.sin() * azimuth.cos(),
            from_axis.cos(),
        );
        if let Some(point) = projection.lens.point(direction) {
            found.extend(strokes(
                text,
                projection.image_from_lens(point),
                height * radius,
            ));
        }
    };
    for (name, azimuth) in [
        ("FRONT", 0.0),
        ("RIGHT", FRAC_PI_2),
        ("BACK", PI),
        ("LEFT", -FRAC_PI_2),
    ] {
        put(&mut found, name, 15_f64.to_radians(), azimuth, 0.05);
    }
    for ten in (20..=80).step_by(10) {
        let altitude = f64::from(ten).to_radians();
        for azimuth in [7.5_f64, 187.5] {
            put(
                &mut found,
                &ten.to_string(),
                altitude,
                azimuth.to_radians(),
                0.025,
            );
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use veduta::reproject::Orientation;

    fn dome(size: u32) -> (Projection, Picture) {
        let lens = "domemaster".parse().expect("a lens");
        let projection = Projection::new(lens, Orientation::default(), size, size);
        let picture = Picture {
            width: size,
            height: size,
            pixels: vec![[0.2, 0.2, 0.2, 1.0]; (size * size) as usize],
        };
        (projection, picture)
    }

    #[test]
    fn the_safe_area_lies_before_the_front_row() {
        let (projection, mut picture) = dome(401);
        draw_guides(&mut picture, &projection, &[Guide::SafeArea]);
        let is_drawn = |x: usize, y: usize| picture.pixels[y * 401 + x][0] > 0.3;
        // Altitude 10 degrees is 8/9 of the radius from the centre, and 60 degrees a third.
        let below = |share: f64| (200.5 + share * 200.5).floor() as usize;
        assert!(is_drawn(200, below(8.0 / 9.0)) && is_drawn(200, below(1.0 / 3.0)));
        assert!(!is_drawn(200, below(0.6)));
        assert!(!is_drawn(200, 401 - below(8.0 / 9.0)), "nothing behind");
    }

    #[test]
    fn a_mask_fades_from_its_feather_to_its_rim() {
        let (projection, mut picture) = dome(400);
        mask(&mut picture, &projection, PI, 20_f64.to_radians());
        let alpha = |x: usize| f64::from(picture.pixels[200 * 400 + x][3]);
        assert_eq!(alpha(200), 1.0);
        // Ten degrees of 180 are a ninth of the radius.
        assert!(
            alpha(24) > 0.99 && alpha(1) < 0.02,
            "{} {}",
            alpha(24),
            alpha(1)
        );
        assert!((alpha(11) - 0.5).abs() < 0.05, "{}", alpha(11));
        let rises = (0..40).map(alpha).collect::<Vec<_>>();
        assert!(rises.is_sorted(), "{rises:?}");
    }

    #[test]
    fn guides_leave_what_is_outside_of_the_circle() {
        let (projection, mut picture) = dome(64);
        let corner = picture.pixels[0];
        draw_guides(
            &mut picture,
            &projection,
            &[Guide::Alignment, Guide::SafeArea],
        );
        assert_eq!(picture.pixels[0], corner);
        assert_ne!(picture.pixels[32 * 64 + 32], corner, "the zenith is marked");
    }
}
