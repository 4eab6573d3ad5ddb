use crate::DVec2;

/// An affine function `a x + b y + c` of the image plane.
///
/// Nearness planes are of this kind, and so is the difference of two of them, whose zero is the
/// line in which the planes cross.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Affine {
    /// Change per unit of x.
    pub a: f64,
    /// Change per unit of y.
    pub b: f64,
    /// Value at the origin.
    pub c: f64,
}

impl Affine {
    /// The function `a x + b y + c`.
    pub const fn new(a: f64, b: f64, c: f64) -> Self {
        Self { a, b, c }
    }

    /// The value at `point`.
    #[inline(always)]
    pub fn at(&self, point: DVec2) -> f64 {
        self.a * point.x + self.b * point.y + self.c
    }

    /// `self - other`, exactly antisymmetric: `f.minus(g).at(p) == -g.minus(f).at(p)` bit for bit,
    /// so that two faces compared from either side agree which one is nearer.
    #[inline(always)]
    pub fn minus(&self, other: &Affine) -> Affine {
        Affine::new(self.a - other.a, self.b - other.b, self.c - other.c)
    }

    /// `-self`.
    #[inline(always)]
    pub fn negated(&self) -> Affine {
        Affine::new(-self.a, -self.b, -self.c)
    }
}
