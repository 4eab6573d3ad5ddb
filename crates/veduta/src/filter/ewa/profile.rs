use super::lanes::Vector;

/// How an elliptical filter weighs texels, from its centre outwards.
///
/// A profile is a function of `q`, the squared distance from the centre in radii of the filter: 0 at the centre, 1
/// where it ends. So no root is taken of any texel's distance (Greene & Heckbert index their table in the same way).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Profile {
    /// Robidoux' where the picture is magnified or as fine as its source, the Gaussian where it is reduced, and a
    /// mixture in between: what to take unless one knows better.
    #[default]
    Auto,
    /// The paper's `exp(-2 q)`: no lobes below 0, soft.
    Gaussian,
    /// A profile of radius 2 fitted to give back box pixels from box texels. Its lobes below 0 are seen in linear light as
    /// dark lines beside bright edges.
    Sharp,
    /// Robidoux' cubic (B = 0.3782, C = 0.3109) as a radial function of radius 2: ImageMagick's default.
    Robidoux,
    /// Mitchell & Netravali's cubic as a radial function of radius 2.
    Mitchell,
}

/// Weights by `q`.
pub(crate) trait Weigh: Copy {
    /// Squared radius of the filter in units of the footprint's.
    const RADIUS_SQUARED: f32;

    /// Weights of eight texels; 0 from q = 1 on.
    fn weights<V: Vector>(&self, token: V::Token, q: V) -> V;
}

/// `exp(-2 q)` to 2e-5, as a polynomial.
const GAUSSIAN: [f32; 6] = [
    0.999_982_2,
    -1.998_683_3,
    1.984_040_2,
    -1.261_187_2,
    0.513_430_4,
    -0.102_262_49,
];

/// Integral of [`GAUSSIAN`] over q from 0 to 1: that of `exp(-2 q)`.
const GAUSSIAN_INTEGRAL: f32 = 0.432_332_36;

/// The Gaussian of the paper, alpha = 2, which ends at radius 1.
#[derive(Clone, Copy)]
pub(crate) struct Gaussian;

impl Weigh for Gaussian {
    const RADIUS_SQUARED: f32 = 1.0;

    #[inline(always)]
    fn weights<V: Vector>(&self, token: V::Token, q: V) -> V {
        gaussian(token, q)
    }
}

#[inline(always)]
fn gaussian<V: Vector>(token: V::Token, q: V) -> V {
    let bell = q.polynomial(token, &GAUSSIAN);
    q.below(V::all(token, 1.0), bell, V::all(token, 0.0))
}

/// A profile of radius 2: `(1 - q)^2` times a polynomial of q, so that it ends without an edge.
#[derive(Clone, Copy)]
pub(crate) struct Round {
    coefficients: [f32; 5],
}

impl Weigh for Round {
    const RADIUS_SQUARED: f32 = 4.0;

    #[inline(always)]
    fn weights<V: Vector>(&self, token: V::Token, q: V) -> V {
        let inside = (V::all(token, 1.0) - q).max(V::all(token, 0.0));
        q.polynomial(token, &self.coefficients) * (inside * inside)
    }
}

impl Round {
    /// [`Profile::Sharp`]: least squares over the frequencies below 0.45 of a texel, of what box texels filtered by
    /// it give against box pixels of 0.75 to 1.15 texels, aliases included.
    pub const SHARP: Self = Self {
        coefficients: [1.0, -3.412_729_4, -0.134_066_47, 7.609_821_4, -8.667_322],
    };
    /// [`Profile::Robidoux`], to 0.4 % of the peak.
    pub const ROBIDOUX: Self = Self {
        coefficients: [1.0, -5.551_991_5, 10.556_595, -9.634_962, 3.176_264],
    };
    /// [`Profile::Mitchell`], to 0.5 % of the peak.
    pub const MITCHELL: Self = Self {
        coefficients: [1.0, -5.686_46, 10.913_013, -10.039_917, 3.339_355_4],
    };

    /// That of a profile which is one of radius 2.
    #[inline(always)]
    pub fn of(profile: Profile) -> Self {
        match profile {
            Profile::Sharp => Self::SHARP,
            Profile::Mitchell => Self::MITCHELL,
            _ => Self::ROBIDOUX,
        }
    }

    /// The integral over q from 0 to 1.
    const fn integral(&self) -> f32 {
        let mut sum = 0.0;
        let mut k = 0;
        while k < 5 {
            // That of (1 - q)^2 q^k.
            let n = k as f32;
            sum += self.coefficients[k] * 2.0 / ((n + 1.0) * (n + 2.0) * (n + 3.0));
            k += 1;
        }
        sum
    }
}

/// Part [`Round::ROBIDOUX`], part [`Gaussian`], each of integral 1 before.
#[derive(Clone, Copy)]
pub(crate) struct Mixture {
    round: f32,
    gaussian: f32,
}

impl Mixture {
    /// With `share` of the round profile, 0 to 1.
    #[inline(always)]
    pub fn new(share: f32) -> Self {
        const ROUND: f32 = 1.0 / (Round::RADIUS_SQUARED * Round::ROBIDOUX.integral());
        Self {
            round: share * ROUND,
            gaussian: (1.0 - share) / GAUSSIAN_INTEGRAL,
        }
    }
}

impl Mixture {
    /// Factors of [`Round::ROBIDOUX`] and of the Gaussian.
    pub fn shares(&self) -> [f32; 2] {
        [self.round, self.gaussian]
    }
}

impl Weigh for Mixture {
    const RADIUS_SQUARED: f32 = Round::RADIUS_SQUARED;

    #[inline(always)]
    fn weights<V: Vector>(&self, token: V::Token, q: V) -> V {
        let round = Round::ROBIDOUX.weights(token, q) * V::all(token, self.round);
        let near = gaussian(token, q * V::all(token, Self::RADIUS_SQUARED));
        near.mul_add(V::all(token, self.gaussian), round)
    }
}
