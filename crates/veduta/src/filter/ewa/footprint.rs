use super::lanes::{LANES, Lanes};
use super::{Ewa, Profile};

/// The Gaussian alone above, the sharp profile alone below, of the squared minor radius of a footprint in texels.
const BLEND: [f32; 2] = [1.5, 3.0];

/// Ellipses of eight pixels in the texture: where each lies, how far it reaches, and its equation.
///
/// A texel at a distance of (U, V) from the centre is at `q = a U^2 + b U V + c V^2`, which is below 1 inside.
#[derive(Clone, Copy)]
pub(crate) struct Footprints {
    /// Centre, texels from the base; texels' centres are at whole numbers.
    pub u: Lanes,
    pub v: Lanes,
    /// The equation.
    pub a: Lanes,
    pub b: Lanes,
    pub c: Lanes,
    /// First column and row inside, and how many there may be, from the base.
    pub first: [[i32; LANES]; 2],
    pub count: [[i32; LANES]; 2],
    /// Share of the sharp profile.
    pub sharp: Lanes,
    /// Largest half extent of the box around, texels.
    pub reach: Lanes,
    /// Squared minor radius of the pixel in the texture before anything is added, texels.
    pub minor: Lanes,
}

impl Footprints {
    /// From the centres and the derivatives of u and v by x and by y: `[ux, vx, uy, vy]`.
    ///
    /// The pixel's circle becomes the ellipse `U^T S^-1 U < 1`, with S = J J^T. Of its squared radii, the variance that
    /// the texels have already (`variance` each, of a radius 1 is 1/4) is subtracted, and they are made 1 at least, so
    /// that there is a texel inside. The paper has neither.
    #[inline(always)]
    pub fn new(ewa: &Ewa, variance: f32, [u, v]: [Lanes; 2], [ux, vx, uy, vy]: [Lanes; 4]) -> Self {
        let all = Lanes::all;
        let s11 = ux.mul_add(ux, uy * uy);
        let s12 = ux.mul_add(vx, uy * vy);
        let s22 = vx.mul_add(vx, vy * vy);
        // Eigenvalues: squared radii.
        let mean = (s11 + s22) * all(0.5);
        let half = (s11 - s22) * all(0.5);
        let spread = half.mul_add(half, s12 * s12).sqrt();
        let major = mean + spread;
        let minor = (mean - spread).max(all(0.0));
        let sharp = match ewa.profile {
            Profile::Auto => {
                let [low, high] = BLEND;
                ((all(high) - minor) * all(1.0 / (high - low)))
                    .min(all(1.0))
                    .max(all(0.0))
            }
            Profile::Gaussian => all(0.0),
            _ => all(1.0),
        };
        let subtracted = (all(1.0) - sharp) * all(4.0 * variance);
        let one = all(1.0);
        let (n1, n2) = ((major - subtracted).max(one), (minor - subtracted).max(one));
        // The matrix with these eigenvalues and the same axes.
        let turn = (n1 - n2).zip(
            spread,
            |n, spread| {
                if spread > 1e-9 { 0.5 * n / spread } else { 0.0 }
            },
        );
        let t11 = turn.mul_add(s11 - minor, n2);
        let t12 = turn * s12;
        let t22 = turn.mul_add(s22 - minor, n2);
        let squared = sharp.map(|sharp| if sharp > 0.0 { 4.0 } else { 1.0 });
        let scale = (n1 * n2 * squared).recip();
        let du = (t11 * squared).sqrt();
        let dv = (t22 * squared).sqrt();
        let first = |at: Lanes, reach: Lanes| (at - reach).map(|x| x.floor() + 1.0);
        let (first_u, first_v) = (first(u, du), first(v, dv));
        let count = |at: Lanes, reach: Lanes, first: Lanes| ((at + reach).map(f32::ceil)) - first;
        let (count_u, count_v) = (count(u, du, first_u), count(v, dv, first_v));
        Self {
            u,
            v,
            a: t22 * scale,
            b: t12 * scale * all(-2.0),
            c: t11 * scale,
            first: [whole(first_u), whole(first_v)],
            count: [whole(count_u), whole(count_v)],
            sharp,
            reach: du.max(dv),
            minor,
        }
    }
}

/// Lanes of whole numbers as such.
#[inline(always)]
fn whole(lanes: Lanes) -> [i32; LANES] {
    std::array::from_fn(|k| lanes.0[k] as i32)
}
