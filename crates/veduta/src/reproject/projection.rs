use super::lens::Ray;
use super::{Lens, Orientation};
use veduta_geometry::{DVec2, DVec3};

/// A picture of all around: which direction is seen at which of its points. The same type serves the picture made
/// and the views it is made from.
///
/// Image points are in pixels, x right, y down, origin at the top left corner of the frame; pixel (i, j) covers
/// [i, i+1) x [j, j+1). Directions are unit vectors of the dome's world ([`Orientation`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// The lens.
    pub lens: Lens,
    /// Where its axis points.
    pub orientation: Orientation,
    /// Width of the frame in pixels.
    pub width: u32,
    /// Height of the frame in pixels.
    pub height: u32,
    /// Image point of the lens plane's origin, pixels.
    centre: DVec2,
    /// Pixels to a unit of the lens plane; y is counted downwards, so it is negative as a rule.
    scale: DVec2,
}

impl Projection {
    /// A lens's picture in a frame of `width` by `height` pixels.
    ///
    /// A disc is as large as the frame allows, in its middle (of Omnimax it is as wide as the frame, its centre as far
    /// below the top as the lens says). A panorama fills the frame, so that its pixels are square only in a frame
    /// of the lens's [`aspect`](Lens::aspect). A perspective window has square pixels, and the fov is vertical.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn new(lens: Lens, orientation: Orientation, width: u32, height: u32) -> Self {
        assert!(width > 0 && height > 0, "a frame has pixels");
        let size = DVec2::new(f64::from(width), f64::from(height));
        let mut centre = 0.5 * size;
        let half = match lens {
            Lens::Omnimax { centre: below, .. } => {
                centre.y = below * size.x;
                DVec2::splat(0.5 * size.x)
            }
            Lens::Perspective { .. } => DVec2::splat(0.5 * size.y),
            Lens::Equiangular => 0.5 * size,
            _ if lens.is_round() => DVec2::splat(0.5 * size.min_element()),
            _ => 0.5 * DVec2::new(size.x, size.y / lens.half_height()),
        };
        Self {
            lens,
            orientation,
            width,
            height,
            centre,
            scale: DVec2::new(half.x, -half.y),
        }
    }

    /// The part of this picture from pixel (`left`, `top`) on, of `width` by `height` pixels; it may reach beyond.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn cropped(mut self, left: f64, top: f64, width: u32, height: u32) -> Self {
        assert!(width > 0 && height > 0, "a frame has pixels");
        self.centre -= DVec2::new(left, top);
        (self.width, self.height) = (width, height);
        self
    }

    /// The picture with left and right exchanged: what someone sees who looks at the dome from outside, and sky charts.
    pub fn mirrored(mut self) -> Self {
        self.centre.x = f64::from(self.width) - self.centre.x;
        self.scale.x = -self.scale.x;
        self
    }

    /// The picture whose outermost samples lie on the frame's border, and not half a pixel inside: OpenEXR's
    /// environment maps.
    ///
    /// # Panics
    /// If a side has less than 2 pixels.
    pub fn sampled_on_border(mut self) -> Self {
        assert!(self.width > 1 && self.height > 1, "two borders");
        let size = DVec2::new(f64::from(self.width), f64::from(self.height));
        self.scale *= (size - 1.0) / size;
        self.centre = (self.centre * (size - 1.0)) / size + 0.5;
        self
    }

    /// World direction of the middle of what is seen: the lens's axis, of a ball the other way.
    pub fn axis(&self) -> DVec3 {
        match self.lens {
            Lens::Ball => -self.orientation.forward(),
            _ => self.orientation.forward(),
        }
    }

    /// Pixels to a unit of the lens plane along y: the radius of a disc.
    pub fn pixels_per_unit(&self) -> f64 {
        self.scale.y.abs()
    }

    /// Point of the lens plane at an image point.
    #[inline]
    pub fn lens_from_image(&self, image: DVec2) -> DVec2 {
        (image - self.centre) / self.scale
    }

    /// Image point of a point of the lens plane.
    #[inline]
    pub fn image_from_lens(&self, point: DVec2) -> DVec2 {
        point * self.scale + self.centre
    }

    /// Direction seen at an image point, also beyond the picture as far as the lens's law goes.
    pub fn direction(&self, image: DVec2) -> Option<DVec3> {
        let view = self.lens.direction(self.lens_from_image(image))?;
        Some(self.orientation.world_from_view(view))
    }

    /// The same with derivatives by x and y of the image, per pixel.
    pub fn ray(&self, image: DVec2) -> Option<Ray> {
        let ray = self.lens.ray(self.lens_from_image(image))?;
        let [x, y] = ray.derivatives;
        Some(Ray {
            direction: self.orientation.world_from_view(ray.direction),
            derivatives: [x / self.scale.x, y / self.scale.y]
                .map(|derivative| self.orientation.world_from_view(derivative)),
        })
    }

    /// Image point at which a direction (of any length but 0) is seen: the inverse of
    /// [`direction`](Self::direction).
    ///
    /// It may lie outside of the picture ([`covers`](Self::covers)). `None` where the lens's law ends
    /// ([`Lens::point`]). Where the picture closes around (panoramas), it is the point of the full turn around the middle.
    pub fn image(&self, direction: DVec3) -> Option<DVec2> {
        let point = self
            .lens
            .point(self.orientation.view_from_world(direction))?;
        Some(self.image_from_lens(point))
    }

    /// Pixels of a full turn, by which an image point may be moved along x to give the same direction; `None` where
    /// the picture does not close around.
    pub fn period(&self) -> Option<f64> {
        self.lens.wraps().then(|| 2.0 * self.scale.x.abs())
    }

    /// Whether an image point lies in the frame and in what the lens shows.
    pub fn covers(&self, image: DVec2) -> bool {
        let inside = image.cmpge(DVec2::ZERO).all()
            && image.x <= f64::from(self.width)
            && image.y <= f64::from(self.height);
        inside && self.lens.covers(self.lens_from_image(image))
    }

    /// Share of a pixel's area that the picture covers, 0 to 1.
    ///
    /// Of discs exact. The arc of Omnimax counts as straight within a pixel, which is wrong by a thousandth where a
    /// frame is 500 pixels wide; where it meets the disc, in two pixels, the two shares are multiplied.
    pub fn coverage(&self, column: u32, row: u32) -> f64 {
        let corner = DVec2::new(f64::from(column), f64::from(row));
        if !self.lens.is_round() {
            return f64::from(self.lens.covers(self.lens_from_image(corner + 0.5)));
        }
        let (a, b) = (corner - self.centre, corner + 1.0 - self.centre);
        let disc = disc_in_box(self.scale.y.abs(), a, b);
        match self.lens {
            Lens::Omnimax { arc: true, .. } if disc > 0.0 => disc * self.above_arc(corner + 0.5),
            _ => disc,
        }
    }

    /// Whether all pixels of a rectangle are known to be covered wholly: what is quicker to tell than each of them.
    /// Pictures are convex, so that the corners tell.
    pub fn fills(&self, min: DVec2, max: DVec2) -> bool {
        if !self.lens.is_round() {
            let centres = [min + 0.5, max - 0.5];
            return centres
                .iter()
                .all(|&at| self.lens.covers(self.lens_from_image(at)));
        }
        let far = (min - self.centre).abs().max((max - self.centre).abs());
        let in_disc = far.length_squared() <= self.scale.y * self.scale.y;
        let corners = [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)];
        in_disc
            && corners
                .iter()
                .all(|&at| self.lens.covers(self.lens_from_image(at)))
    }

    /// Share of the pixel around an image point in which directions are not more than 45 degrees below the axis.
    fn above_arc(&self, image: DVec2) -> f64 {
        let Some(ray) = self.lens.ray(self.lens_from_image(image)) else {
            return 0.0;
        };
        let above = |direction: DVec3| direction.y + direction.z;
        let [x, y] = ray.derivatives.map(above);
        half_plane_in_pixel(above(ray.direction), DVec2::new(x, y) / self.scale)
    }
}

/// Area of the part of a disc of radius `radius` around the origin that lies in the box from `a` to `b`.
fn disc_in_box(radius: f64, a: DVec2, b: DVec2) -> f64 {
    let far = a.abs().max(b.abs());
    if far.length_squared() <= radius * radius {
        return (b.x - a.x) * (b.y - a.y);
    }
    let near = DVec2::ZERO.clamp(a, b);
    if near.length_squared() >= radius * radius {
        return 0.0;
    }
    let corner = |x, y| disc_from_origin(radius, x, y);
    let area = corner(b.x, b.y) - corner(a.x, b.y) - corner(b.x, a.y) + corner(a.x, a.y);
    area.clamp(0.0, 1.0)
}

/// Area of the disc within the box between the origin and (x, y), with the sign of x y.
fn disc_from_origin(radius: f64, x: f64, y: f64) -> f64 {
    let (ax, ay) = (x.abs().min(radius), y.abs().min(radius));
    let chord = |t: f64| (radius * radius - t * t).max(0.0).sqrt();
    // Under the arc from the axis to t.
    let under = |t: f64| 0.5 * (t * chord(t) + radius * radius * (t / radius).asin());
    let straight = chord(ay).min(ax);
    let area = ay * straight + under(ax) - under(straight);
    area * x.signum() * y.signum()
}

/// Share of a unit square around the origin in which `value + slope . p` is positive.
fn half_plane_in_pixel(value: f64, slope: DVec2) -> f64 {
    let slope = slope.abs();
    let (low, high) = (slope.min_element(), slope.max_element());
    let reach = 0.5 * (low + high);
    if value >= reach {
        return 1.0;
    }
    if value <= -reach {
        return 0.0;
    }
    // By symmetry for the smaller part: a triangle at a corner, or a trapezoid.
    let rest = reach - value.abs();
    let small = if rest <= low {
        0.5 * rest * rest / (low * high)
    } else {
        (rest - 0.5 * low) / high
    };
    if value > 0.0 { 1.0 - small } else { small }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lenses() -> Vec<Lens> {
        let names = [
            "omnimax",
            "omnimax:full",
            "domemaster",
            "domemaster:210",
            "fisheye:180",
            "angular",
            "equisolid:180",
            "equisolid:360",
            "stereographic:180",
            "stereographic:300",
            "orthographic:180",
            "orthographic:120",
            "polynomial:1.2,0.3,-0.2",
            "equirect",
            "cylinder",
            "mercator",
            "ball",
            "face",
            "perspective:120",
            "equiangular",
        ];
        names.map(|name| name.parse().expect(name)).to_vec()
    }

    fn turned(lens: Lens) -> Projection {
        let orientation = Orientation::from_angles(0.7, 0.4, -0.2);
        let width = 200;
        let height = (f64::from(width) / lens.aspect()).round() as u32;
        Projection::new(lens, orientation, width, height)
    }

    /// Image points in the picture, on no grid that a lens may favour.
    fn points(projection: &Projection) -> Vec<DVec2> {
        let size = DVec2::new(f64::from(projection.width), f64::from(projection.height));
        (1..4000)
            .map(|k| {
                let at = DVec2::new(f64::from(k) * 0.754_877_666, f64::from(k) * 0.569_840_291);
                at.fract() * size
            })
            .filter(|&at| projection.covers(at))
            .collect()
    }

    #[test]
    fn images_of_directions_are_where_they_came_from() {
        for lens in lenses() {
            let projection = turned(lens);
            for at in points(&projection) {
                let direction = projection.direction(at).expect("covered");
                assert!((direction.length() - 1.0).abs() < 1e-14, "{lens} {at}");
                let back = projection.image(2.0 * direction).expect("in view");
                let off = (back - at).length();
                assert!(off < 1e-9, "{lens} at {at}: {off}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        for lens in lenses() {
            let projection = turned(lens);
            for at in points(&projection) {
                // At a ball's rim, differences are wrong.
                if projection.lens_from_image(at).length() > 0.95 && lens.is_round() {
                    continue;
                }
                let ray = projection.ray(at).expect("covered");
                let step = 1e-4;
                for (axis, derivative) in [DVec2::X, DVec2::Y].into_iter().zip(ray.derivatives) {
                    let ahead = projection.direction(at + step * axis).expect("near");
                    let behind = projection.direction(at - step * axis).expect("near");
                    let difference = (ahead - behind) / (2.0 * step);
                    let off = (difference - derivative).length();
                    assert!(
                        off < 1e-9,
                        "{lens} at {at}: {difference} and not {derivative}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_middle_looks_along_the_axis_and_right_is_right() {
        for lens in lenses() {
            let projection = Projection::new(lens, Orientation::default(), 101, 101);
            let middle = projection.image_from_lens(DVec2::ZERO);
            let ahead = projection.direction(middle).expect("the middle");
            let right = projection.direction(middle + DVec2::X).expect("near") - ahead;
            let down = projection.direction(middle + DVec2::Y).expect("near") - ahead;
            let forward = if lens == Lens::Ball {
                DVec3::Z
            } else {
                -DVec3::Z
            };
            assert!((ahead - forward).length() < 1e-12, "{lens}: {ahead}");
            assert!(right.x > 0.0 && right.y.abs() < 1e-12, "{lens}: {right}");
            assert!(down.y < 0.0 && down.x.abs() < 1e-12, "{lens}: {down}");
        }
    }

    #[test]
    fn omnimax_is_that_of_the_paper() {
        let projection = Projection::new(Lens::OMNIMAX, Orientation::default(), 1966, 1532);
        // 90.162 degrees at the limiting circle.
        let rim = projection
            .direction(DVec2::new(0.0, 983.0))
            .expect("the rim");
        assert!(
            (rim.z - (90.162_f64 - 90.0).to_radians().sin()).abs() < 1e-5,
            "{rim}"
        );
        // 45 degrees below the axis at the frame's lower border.
        let low = projection
            .direction(DVec2::new(983.0, 1531.8))
            .expect("inside");
        assert!((low.y / low.z - 1.0).abs() < 1e-3, "{low}");
        assert!(projection.covers(DVec2::new(983.0, 1531.0)));
        assert!(!projection.covers(DVec2::new(500.0, 1531.0)));
    }

    #[test]
    fn a_domemaster_has_the_front_below_and_the_zenith_in_the_middle() {
        let lens: Lens = "domemaster".parse().expect("a name");
        let up = Orientation::from_angles(0.0, lens.usual_elevation(), 0.0);
        let projection = Projection::new(lens, up, 64, 64);
        let at = |x, y| projection.direction(DVec2::new(x, y)).expect("inside");
        assert!((at(32.0, 32.0) - DVec3::Y).length() < 1e-12);
        assert!((at(32.0, 64.0) + DVec3::Z).length() < 1e-12);
        assert!((at(64.0, 32.0) - DVec3::X).length() < 1e-12);
    }

    #[test]
    fn coverages_of_a_disc_add_up_to_its_area() {
        for size in [1, 2, 3, 16, 101, 1000] {
            let projection = Projection::new(Lens::Ball, Orientation::default(), size, size);
            let all = (0..size).flat_map(|y| (0..size).map(move |x| (x, y)));
            let sum: f64 = all.map(|(x, y)| projection.coverage(x, y)).sum();
            let area = std::f64::consts::PI * (0.5 * f64::from(size)).powi(2);
            assert!(
                (sum / area - 1.0).abs() < 1e-11,
                "{size}: {sum} and not {area}"
            );
        }
    }

    #[test]
    fn coverages_are_the_shares_of_many_points() {
        let lens = Lens::Omnimax {
            centre: 0.45,
            arc: true,
        };
        let projection = Projection::new(lens, Orientation::default(), 40, 30);
        for row in 0..30 {
            for column in 0..40 {
                let corner = DVec2::new(f64::from(column), f64::from(row));
                let inside = (0..1600).filter(|k| {
                    let at = DVec2::new(f64::from(k % 40), f64::from(k / 40));
                    projection.covers(corner + (at + 0.5) / 40.0)
                });
                let share = inside.count() as f64 / 1600.0;
                let told = projection.coverage(column, row);
                assert!(
                    (share - told).abs() < 0.012,
                    "{column} {row}: {told}, not {share}"
                );
            }
        }
    }

    #[test]
    fn crops_mirrors_and_border_samples_move_the_picture_as_told() {
        let whole = Projection::new(Lens::Equirect, Orientation::default(), 400, 200);
        let part = whole.cropped(100.0, 50.0, 30, 20);
        let at = DVec2::new(7.0, 3.0);
        assert_eq!(
            part.direction(at),
            whole.direction(at + DVec2::new(100.0, 50.0))
        );
        let other = whole
            .mirrored()
            .direction(DVec2::new(400.0 - 7.0, 3.0))
            .expect("inside");
        assert!((other - whole.direction(at).expect("inside")).length() < 1e-14);
        // The first sample is the border, which is right behind.
        let border = whole.sampled_on_border();
        let first = border.direction(DVec2::new(0.5, 100.0)).expect("inside");
        assert!((first - DVec3::Z).length() < 1e-14, "{first}");
        assert_eq!(whole.period(), Some(400.0));
        assert_eq!(border.period(), Some(399.0));
    }
}
