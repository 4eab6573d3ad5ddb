use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use veduta_geometry::{DVec2, DVec3};

/// How the directions around a point of view lie in a plane.
///
/// Points of the *lens plane* have x right and y up, the view's axis at the origin. For round lenses the limiting
/// circle has radius 1; for panoramas x goes from -1 to 1 once around; for perspective windows y goes from -1 to 1.
/// Directions are unit vectors (right, up, forward) in the view. Angles are in radians.
///
/// Formulas: `phi(r)` of Omnimax from Greene & Heckbert (1986), who have it from Max; the others are the usual ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// The film lens C430 of Omnimax theatres: `phi(r) = 1.411269 r - 0.094389 r^3 + 0.25674 r^5`, 90.162 degrees
    /// at the circle.
    Omnimax {
        /// Height of the frame's top above the projection centre, in widths of the frame. At 1/2 the limiting circle
        /// touches it, which is as wide as the frame.
        centre: f64,
        /// Whether all that is more than 45 degrees below the axis is left out: the elliptical arc that ends the
        /// picture below.
        arc: bool,
    },
    /// A fisheye of fulldome, equidistant; where nothing else is told, its axis is the zenith.
    Domemaster {
        /// Angle across the circle.
        fov: f64,
    },
    /// A round lens by one of the usual laws.
    Fisheye {
        /// How the angle from the axis grows from the centre to the circle.
        law: FisheyeLaw,
        /// Angle across the circle.
        fov: f64,
    },
    /// A round lens with the angle from its axis a polynomial of the radius.
    Polynomial(LensPolynomial),
    /// Longitude and latitude: 360 by 180 degrees.
    Equirect,
    /// Longitude, and the tangent of the latitude.
    Cylinder {
        /// Angle from the lower to the upper border, less than pi.
        fov: f64,
    },
    /// Mercator's projection, conformal; its frame ends at a latitude to the north and the south.
    Mercator {
        /// The last latitude, less than pi/2.
        latitude: f64,
    },
    /// What a mirror ball reflects to someone infinitely far away who looks forward: what is behind the viewer in
    /// the middle, what is in front all along the rim.
    Ball,
    /// A perspective window: a picture of an ordinary camera.
    Perspective {
        /// Vertical angle, less than pi.
        fov: f64,
    },
    /// A face of an equiangular cube map: a window of 90 degrees in which angles along its axes, and not their
    /// tangents, are equidistant.
    Equiangular,
}

/// Laws of round lenses: the angle from the axis `phi` at radius `r`, by the angle `fov` across the circle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FisheyeLaw {
    /// `phi = r fov / 2`. With a fov of 360 degrees the *angular map*.
    Equidistant,
    /// `phi = 2 asin(r sin(fov / 4))`: areas are true.
    Equisolid,
    /// `phi = 2 atan(r tan(fov / 4))`: angles are true. The fov is less than 360 degrees.
    Stereographic,
    /// `phi = asin(r sin(fov / 2))`. The fov is at most 180 degrees.
    Orthographic,
}

/// `phi(r) = k1 r + k2 r^2 + …`, which grows from the centre to the circle at least, and reaches half a turn at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensPolynomial {
    coefficients: [f64; Self::MOST],
}

impl LensPolynomial {
    /// The most coefficients.
    pub const MOST: usize = 8;

    /// From the coefficients of `r`, `r^2` and so on, radians.
    ///
    /// # Errors
    /// A sentence about what is wrong: their number, or a polynomial that does not grow.
    pub fn new(given: &[f64]) -> Result<Self, String> {
        if given.is_empty() || given.len() > Self::MOST {
            let most = Self::MOST;
            return Err(format!("a lens polynomial has 1 to {most} coefficients"));
        }
        let mut coefficients = [0.0; Self::MOST];
        coefficients[..given.len()].copy_from_slice(given);
        let polynomial = Self { coefficients };
        // Half a step in 4096 is far below any pixel's share of the angle.
        let grows = (0..=4096).all(|k| polynomial.at(f64::from(k) / 4096.0).1 > 0.0);
        let (last, _) = polynomial.at(1.0);
        if !grows || !last.is_finite() {
            return Err("the angle must grow from the centre (r = 0) to the circle (r = 1)".into());
        }
        if last > PI + 1e-9 {
            let degrees = last.to_degrees();
            return Err(format!(
                "the angle at the circle (r = 1) is {degrees:.1} degrees from the axis, more than 180"
            ));
        }
        Ok(polynomial)
    }

    /// Coefficients of `r`, `r^2` and so on, up to the last that is not 0.
    pub fn coefficients(&self) -> &[f64] {
        let last = self.coefficients.iter().rposition(|&k| k != 0.0);
        &self.coefficients[..last.map_or(1, |last| last + 1)]
    }

    /// The angle and its derivative.
    fn at(&self, r: f64) -> (f64, f64) {
        let (mut value, mut slope) = (0.0, 0.0);
        for k in self.coefficients.iter().rev() {
            slope = slope * r + value;
            value = value * r + k;
        }
        (value * r, slope * r + value)
    }
}

/// The lens C430, as in the paper.
const OMNIMAX: LensPolynomial = LensPolynomial {
    coefficients: [1.411269, 0.0, -0.094389, 0.0, 0.25674, 0.0, 0.0, 0.0],
};

/// A direction with its derivatives by x and y of the plane it comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Unit vector.
    pub direction: DVec3,
    /// By x, then by y.
    pub derivatives: [DVec3; 2],
}

/// Radius below which a round lens is taken to be linear; the error is of its square.
const AT_THE_AXIS: f64 = 1e-8;

impl Lens {
    /// Omnimax as usual: the circle touches the frame's top, and the arc ends the picture.
    pub const OMNIMAX: Self = Self::Omnimax {
        centre: 0.5,
        arc: true,
    };

    /// Whether the picture is a disc (or, of Omnimax, a part of one) of radius 1 in the lens plane.
    pub fn is_round(&self) -> bool {
        matches!(
            self,
            Self::Omnimax { .. }
                | Self::Domemaster { .. }
                | Self::Fisheye { .. }
                | Self::Polynomial(_)
                | Self::Ball
        )
    }

    /// Whether the left border of the picture continues the right one.
    pub fn wraps(&self) -> bool {
        matches!(
            self,
            Self::Equirect | Self::Cylinder { .. } | Self::Mercator { .. }
        )
    }

    /// Largest |y| of a panorama's frame; 1 for the others.
    pub fn half_height(&self) -> f64 {
        match *self {
            Self::Equirect => 0.5,
            Self::Cylinder { fov } => (0.5 * fov).tan() / PI,
            Self::Mercator { latitude } => latitude.tan().asinh() / PI,
            _ => 1.0,
        }
    }

    /// Width over height of the frame in which pixels are square.
    pub fn aspect(&self) -> f64 {
        match self {
            // The film frame: POV-Ray's, in which the arc just fits.
            Self::Omnimax { .. } => 1.283458,
            _ => 1.0 / self.half_height(),
        }
    }

    /// How far above the horizon the axis is where nothing else is told, in radians: the zenith for fulldome, 11 degrees
    /// in Omnimax theatres, and the horizon otherwise.
    pub fn usual_elevation(&self) -> f64 {
        match self {
            Self::Domemaster { .. } => FRAC_PI_2,
            Self::Omnimax { .. } => 11_f64.to_radians(),
            _ => 0.0,
        }
    }

    /// Whether a point of the lens plane belongs to the picture. A perspective window has no border of its own.
    pub fn covers(&self, point: DVec2) -> bool {
        match self {
            Self::Omnimax { arc: true, .. } => {
                let in_arc = |direction: DVec3| direction.y + direction.z >= 0.0;
                point.length_squared() <= 1.0 && self.direction(point).is_some_and(in_arc)
            }
            _ if self.is_round() => point.length_squared() <= 1.0,
            Self::Perspective { .. } | Self::Equiangular => true,
            _ => point.x.abs() <= 1.0 && point.y.abs() <= self.half_height(),
        }
    }

    /// Unit direction (right, up, forward) seen at a point of the lens plane.
    ///
    /// Also beyond the picture as far as the law goes: round lenses to half a turn from the axis, panoramas around and
    /// over the poles. `None` where there is nothing any more.
    pub fn direction(&self, point: DVec2) -> Option<DVec3> {
        self.ray(point).map(|ray| ray.direction)
    }

    /// The same with derivatives by x and y of the lens plane, which are infinite at the rim of a ball and some lenses.
    pub fn ray(&self, point: DVec2) -> Option<Ray> {
        let DVec2 { x, y } = point;
        match *self {
            Self::Ball => {
                let z2 = 1.0 - point.length_squared();
                (z2 >= 0.0).then(|| ball(point, z2.sqrt()))
            }
            Self::Equirect => Some(on_latitude(PI * x, (PI * y).sin_cos(), PI)),
            Self::Cylinder { .. } => {
                let cos = (1.0 + (PI * y).powi(2)).sqrt().recip();
                Some(on_latitude(PI * x, (PI * y * cos, cos), PI * cos * cos))
            }
            Self::Mercator { .. } => {
                let cos = (PI * y).cosh().recip();
                Some(on_latitude(PI * x, ((PI * y).tanh(), cos), PI * cos))
            }
            Self::Perspective { fov } => {
                let tan = (0.5 * fov).tan();
                Some(window([x * tan, y * tan], [tan, tan]))
            }
            Self::Equiangular => {
                // Twice 90 degrees would be behind.
                let angles = [x * FRAC_PI_4, y * FRAC_PI_4];
                let sound = angles.iter().all(|angle| angle.abs() < FRAC_PI_2);
                let slopes = angles.map(|angle| FRAC_PI_4 * (1.0 + angle.tan().powi(2)));
                sound.then(|| window(angles.map(f64::tan), slopes))
            }
            _ => {
                let r = point.length();
                self.angle(r).map(|(phi, slope)| round(point, phi, slope))
            }
        }
    }

    /// Point of the lens plane at which a direction (right, up, forward; of any length but 0) is seen: the inverse of
    /// [`direction`](Self::direction).
    ///
    /// The point may lie beyond the picture; [`covers`](Self::covers) tells. Of panoramas it is the one with x in
    /// -1..=1. `None` where the law ends: at the poles of cylinder and Mercator, behind a window, beyond the
    /// steepest angle of a round lens, and right behind one (where all of a circle would do) or in front of a ball.
    pub fn point(&self, direction: DVec3) -> Option<DVec2> {
        let DVec3 { x, y, z } = direction;
        let across = x.hypot(y);
        match *self {
            Self::Ball => {
                let direction = direction.try_normalize()?;
                // 1 - z without cancellation.
                let ahead = if direction.z > 0.0 {
                    direction.truncate().length_squared() / (1.0 + direction.z)
                } else {
                    1.0 - direction.z
                };
                let half = DVec3::new(direction.x, direction.y, ahead).try_normalize()?;
                Some(half.truncate())
            }
            Self::Equirect => {
                let latitude = y.atan2(x.hypot(z));
                Some(DVec2::new(x.atan2(z), latitude) / PI)
            }
            Self::Cylinder { .. } | Self::Mercator { .. } => {
                let tan = y / x.hypot(z);
                let along = match self {
                    Self::Cylinder { .. } => tan,
                    _ => tan.asinh(),
                };
                along
                    .is_finite()
                    .then(|| DVec2::new(x.atan2(z), along) / PI)
            }
            Self::Perspective { fov } => {
                (z > 0.0).then(|| DVec2::new(x, y) / (z * (0.5 * fov).tan()))
            }
            Self::Equiangular => (z > 0.0).then(|| DVec2::new(x.atan2(z), y.atan2(z)) / FRAC_PI_4),
            _ => {
                let r = self.radius(across.atan2(z))?;
                if across == 0.0 {
                    return (z > 0.0).then_some(DVec2::ZERO);
                }
                Some(DVec2::new(x, y) * (r / across))
            }
        }
    }

    /// Of a round lens but the ball: angle from the axis at a radius, and its derivative.
    fn angle(&self, r: f64) -> Option<(f64, f64)> {
        let (phi, slope) = match *self {
            Self::Omnimax { .. } => OMNIMAX.at(r),
            Self::Polynomial(polynomial) => polynomial.at(r),
            Self::Domemaster { fov } => (r * 0.5 * fov, 0.5 * fov),
            Self::Fisheye { law, fov } => match law {
                FisheyeLaw::Equidistant => (r * 0.5 * fov, 0.5 * fov),
                FisheyeLaw::Equisolid => arcsine(r, (0.25 * fov).sin(), 2.0),
                FisheyeLaw::Stereographic => {
                    let scale = (0.25 * fov).tan();
                    let tan = r * scale;
                    (2.0 * tan.atan(), 2.0 * scale / (1.0 + tan * tan))
                }
                FisheyeLaw::Orthographic => arcsine(r, (0.5 * fov).sin(), 1.0),
            },
            _ => unreachable!("not a round lens"),
        };
        // A hair beyond half a turn is rounding at the circle of a lens that sees all.
        (phi <= PI + 1e-9 && slope > 0.0).then_some((phi, slope))
    }

    /// Of a round lens but the ball: radius at an angle from the axis, 0 to pi.
    fn radius(&self, phi: f64) -> Option<f64> {
        match *self {
            Self::Omnimax { .. } => solve(&OMNIMAX, phi),
            Self::Polynomial(polynomial) => solve(&polynomial, phi),
            Self::Domemaster { fov } => Some(phi / (0.5 * fov)),
            Self::Fisheye { law, fov } => match law {
                FisheyeLaw::Equidistant => Some(phi / (0.5 * fov)),
                FisheyeLaw::Equisolid => Some((0.5 * phi).sin() / (0.25 * fov).sin()),
                FisheyeLaw::Stereographic => {
                    (phi < PI).then(|| (0.5 * phi).tan() / (0.25 * fov).tan())
                }
                FisheyeLaw::Orthographic => {
                    (phi <= FRAC_PI_2).then(|| phi.sin() / (0.5 * fov).sin())
                }
            },
            _ => unreachable!("not a round lens"),
        }
    }
}

/// `factor * asin(r * scale)` and its derivative, which is infinite, or missing, where the arcsine ends.
fn arcsine(r: f64, scale: f64, factor: f64) -> (f64, f64) {
    let sin = r * scale;
    (
        factor * sin.asin(),
        factor * scale / (1.0 - sin * sin).sqrt(),
    )
}

/// The radius at which a polynomial has the value `phi`; `None` if it stops growing before.
fn solve(polynomial: &LensPolynomial, phi: f64) -> Option<f64> {
    // Grows from 0 to 1 at least; where it goes on to grow, directions beyond the circle have a place, too.
    let (mut low, mut high) = (0.0, 1.0);
    while polynomial.at(high).0 < phi {
        low = high;
        high += 1.0 / 64.0;
        if high > 2.0 || polynomial.at(high).1 <= 0.0 {
            return None;
        }
    }
    let mut r = 0.5 * (low + high);
    // Newton's method within a bracket: the bracket halves where a step would leave it.
    for _ in 0..100 {
        let (value, slope) = polynomial.at(r);
        if value < phi {
            low = r;
        } else {
            high = r;
        }
        let step = r - (value - phi) / slope;
        let next = if step > low && step < high {
            step
        } else {
            0.5 * (low + high)
        };
        if (next - r).abs() <= 1e-16 {
            return Some(next);
        }
        r = next;
    }
    Some(r)
}

/// Of a round lens, at a point of the lens plane with angle `phi` from the axis and its derivative by the radius.
fn round(point: DVec2, phi: f64, slope: f64) -> Ray {
    let DVec2 { x, y } = point;
    let r2 = point.length_squared();
    let (sin, cos) = phi.sin_cos();
    let r = r2.sqrt();
    // d = (x g, y g, cos phi) with g = sin(phi) / r, whose derivative along the radius is r q.
    let (g, q) = if r < AT_THE_AXIS {
        (slope, 0.0)
    } else {
        (sin / r, (cos * slope - sin / r) / r2)
    };
    Ray {
        direction: DVec3::new(x * g, y * g, cos),
        derivatives: [
            DVec3::new(g + x * x * q, x * y * q, -g * slope * x),
            DVec3::new(x * y * q, g + y * y * q, -g * slope * y),
        ],
    }
}

/// Of a panorama, from longitude, sine and cosine of the latitude, and the latitude's derivative by y.
fn on_latitude(longitude: f64, (sin, cos): (f64, f64), slope: f64) -> Ray {
    let (east, ahead) = longitude.sin_cos();
    Ray {
        direction: DVec3::new(cos * east, sin, cos * ahead),
        derivatives: [
            PI * DVec3::new(cos * ahead, 0.0, -cos * east),
            slope * DVec3::new(-sin * east, cos, -sin * ahead),
        ],
    }
}

/// Of a window, from the tangents of the angles and their derivatives.
fn window([a, b]: [f64; 2], slopes: [f64; 2]) -> Ray {
    let long = DVec3::new(a, b, 1.0);
    let inverse = long.length().recip();
    let direction = long * inverse;
    let along = |axis: DVec3, slope: f64| {
        // The part of the step across the direction.
        slope * inverse * (axis - direction * direction.dot(axis))
    };
    Ray {
        direction,
        derivatives: [along(DVec3::X, slopes[0]), along(DVec3::Y, slopes[1])],
    }
}

/// Of a mirror ball, whose normal at `point` is `(x, y, -z)`: the view's axis, mirrored.
fn ball(point: DVec2, z: f64) -> Ray {
    let DVec2 { x, y } = point;
    Ray {
        direction: DVec3::new(2.0 * z * x, 2.0 * z * y, 1.0 - 2.0 * z * z),
        derivatives: [
            DVec3::new(2.0 * z - 2.0 * x * x / z, -2.0 * x * y / z, 4.0 * x),
            DVec3::new(-2.0 * x * y / z, 2.0 * z - 2.0 * y * y / z, 4.0 * y),
        ],
    }
}
