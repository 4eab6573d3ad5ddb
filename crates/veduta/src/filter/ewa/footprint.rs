use super::lanes::{LANES, Vector};
use super::{Ewa, Profile};

/// The Gaussian alone above, the round profile alone below, of the squared minor radius of a footprint in texels.
const BLEND: [f32; 2] = [1.5, 3.0];

/// Ellipses of eight pixels in the texture: where each lies, how far it reaches, and its equation.
///
/// A texel at a distance of (U, V) from the centre is at `q = a U^2 + b U V + c V^2`, which is below 1 inside.
#[derive(Clone, Copy)]
pub(crate) struct Footprints {
    /// Centre, texels from the base; texels' centres are at whole numbers.
    pub centre: [[f32; LANES]; 2],
    /// `a`, `b` and `c`.
    pub equation: [[f32; LANES]; 3],
    /// First column and row inside, from the base.
    pub first: [[i32; LANES]; 2],
    /// Of that first texel, from the centre.
    pub start: [[f32; LANES]; 2],
    /// How many columns and rows there may be inside.
    pub count: [[i32; LANES]; 2],
    /// Column and row of the texel nearest to the centre, from the base.
    pub middle: [[i32; LANES]; 2],
    /// Share of the profile of radius 2.
    pub round: [f32; LANES],
    /// Largest half extent of the box around, texels.
    pub reach: [f32; LANES],
    /// Squared minor radius of the pixel in the texture before anything is added, texels.
    pub minor: [f32; LANES],
}

impl Footprints {
    /// From the centres and the derivatives of u and v by x and by y: `[ux, vx, uy, vy]`.
    ///
    /// The pixel's circle becomes the ellipse `U^T S^-1 U < 1`, with S = J J^T. Of its squared radii, the variance that
    /// the texels have already (`variance` each, of a radius 1 is 1/4) is subtracted, and they are made 1 at least, so
    /// that there is a texel inside. The paper has neither.
    #[inline(always)]
    pub fn new<V: Vector>(
        token: V::Token,
        ewa: &Ewa,
        variance: f32,
        centre: [V; 2],
        [ux, vx, uy, vy]: [V; 4],
    ) -> Self {
        let all = |value: f32| V::all(token, value);
        let (zero, one) = (all(0.0), all(1.0));
        let s11 = ux.mul_add(ux, uy * uy);
        let s12 = ux.mul_add(vx, uy * vy);
        let s22 = vx.mul_add(vx, vy * vy);
        // Eigenvalues: squared radii.
        let mean = (s11 + s22) * all(0.5);
        let half = (s11 - s22) * all(0.5);
        let spread = half.mul_add(half, s12 * s12).sqrt();
        let major = mean + spread;
        let minor = (mean - spread).max(zero);
        let round = match ewa.profile {
            Profile::Auto => {
                let [low, high] = BLEND;
                let share = (all(high) - minor) * all(1.0 / (high - low));
                share.min(one).max(zero)
            }
            Profile::Gaussian => zero,
            _ => one,
        };
        let subtracted = (one - round) * all(4.0 * variance);
        let (n1, n2) = ((major - subtracted).max(one), (minor - subtracted).max(one));
        // The matrix with these eigenvalues and the same axes; a circle has no axes.
        let turn = ((n1 - n2) * all(0.5)).over(spread.max(all(1e-9)));
        let t11 = turn.mul_add(s11 - minor, n2);
        let t12 = turn * s12;
        let t22 = turn.mul_add(s22 - minor, n2);
        let squared = zero.below(round, all(4.0), one);
        let scale = one.over(n1 * n2 * squared);
        // No closures from here on: what the compiler does not inline has no vector instructions.
        let [u, v] = centre;
        let (du, dv) = ((t11 * squared).sqrt(), (t22 * squared).sqrt());
        let (first_u, first_v) = ((u - du).floor() + one, (v - dv).floor() + one);
        let (count_u, count_v) = ((u + du).ceil() - first_u, (v + dv).ceil() - first_v);
        let (a, b, c) = (t22 * scale, t12 * scale * all(-2.0), t11 * scale);
        Self {
            centre: [u.array(), v.array()],
            equation: [a.array(), b.array(), c.array()],
            first: [first_u.whole(), first_v.whole()],
            start: [(first_u - u).array(), (first_v - v).array()],
            count: [count_u.whole(), count_v.whole()],
            middle: [
                (u + all(0.5)).floor().whole(),
                (v + all(0.5)).floor().whole(),
            ],
            round: round.array(),
            reach: du.max(dv).array(),
            minor: minor.array(),
        }
    }
}
