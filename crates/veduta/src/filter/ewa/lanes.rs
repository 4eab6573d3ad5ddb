//! Eight numbers at once, in plain code that the compiler turns into vector instructions.
//!
//! Each operation is one of IEEE arithmetic in each lane, and multiplications with additions are fused by name, so that
//! results are the same whatever instructions they become.

use std::ops::{Add, Mul, Sub};

/// How many lanes.
pub(crate) const LANES: usize = 8;

/// Eight `f32`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Lanes(pub [f32; LANES]);

impl Lanes {
    /// 0, 1, 2 … 7.
    pub const COUNT: Self = Self([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);

    #[inline(always)]
    pub fn all(value: f32) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    pub fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|k| f(self.0[k], other.0[k])))
    }

    #[inline(always)]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self(std::array::from_fn(|k| f(self.0[k])))
    }

    /// `self * factor + summand`, rounded once.
    #[inline(always)]
    pub fn mul_add(self, factor: Self, summand: Self) -> Self {
        Self(std::array::from_fn(|k| {
            self.0[k].mul_add(factor.0[k], summand.0[k])
        }))
    }

    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        // As one instruction does it; `f32::max` has cases for what is not a number.
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }

    #[inline(always)]
    pub fn recip(self) -> Self {
        self.map(|x| 1.0 / x)
    }

    /// The first of a slice's numbers.
    ///
    /// # Panics
    /// If there are fewer than eight.
    #[inline(always)]
    pub fn load(from: &[f32]) -> Self {
        let first: &[f32; LANES] = from.first_chunk().expect("eight numbers");
        Self(*first)
    }

    /// The polynomial with these coefficients, lowest power first, at the lanes' numbers.
    #[inline(always)]
    pub fn polynomial<const N: usize>(self, coefficients: &[f32; N]) -> Self {
        let mut value = Self::all(coefficients[N - 1]);
        for k in (0..N - 1).rev() {
            value = value.mul_add(self, Self::all(coefficients[k]));
        }
        value
    }
}

impl Add for Lanes {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl Sub for Lanes {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

/// The sums over the lanes of four, in an order that vector instructions follow.
#[inline(always)]
pub(crate) fn sums(of: [Lanes; 4]) -> [f32; 4] {
    // Halves, then quarters, then the last two.
    let halves: [[f32; 4]; 4] = of.map(|Lanes(x)| std::array::from_fn(|k| x[k] + x[k + 4]));
    let quarters = halves.map(|x| [x[0] + x[2], x[1] + x[3]]);
    quarters.map(|x| x[0] + x[1])
}
