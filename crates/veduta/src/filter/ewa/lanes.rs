//! Eight numbers at once.
//!
//! Each operation is one of IEEE arithmetic in each lane, and multiplications with additions are fused, so that results
//! are the same whether [`Plain`] does them or AVX2 instructions. (Left to itself, the compiler cut the plain lanes into
//! pairs, which took twice as long as these instructions do.)

use pulp::NullaryFnOnce;
use std::ops::{Add, Mul, Sub};

/// How many lanes.
pub(crate) const LANES: usize = 8;

/// Eight `f32`.
pub(crate) trait Vector:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// Proof that the machine has the instructions.
    type Token: Copy;

    /// Eight numbers.
    fn of(token: Self::Token, lanes: [f32; LANES]) -> Self;

    /// The lanes' numbers.
    fn array(self) -> [f32; LANES];

    /// Eight times the same.
    fn all(token: Self::Token, value: f32) -> Self;

    /// `self * factor + summand`, rounded once.
    fn mul_add(self, factor: Self, summand: Self) -> Self;

    /// The larger of two; `other` where one is not a number.
    fn max(self, other: Self) -> Self;

    /// The smaller of two; `other` where one is not a number.
    fn min(self, other: Self) -> Self;

    fn sqrt(self) -> Self;

    fn over(self, divisor: Self) -> Self;

    fn floor(self) -> Self;

    fn ceil(self) -> Self;

    /// `yes` in lanes below `bound`, `no` in others.
    fn below(self, bound: Self, yes: Self, no: Self) -> Self;

    /// Whether the numbers of all lanes are `bound` or less.
    fn all_at_most(self, bound: Self) -> bool;

    /// The numbers without what follows the point; `i32::MIN` for those that no `i32` is.
    fn whole(self) -> [i32; LANES];

    /// Lane `k` of the first half four times, and lane `k` of the second.
    fn spread(self, k: usize) -> Self;

    /// In the first four lanes what the halves of `a` sum up to, in the others the same of `b`.
    fn halves(a: Self, b: Self) -> Self;

    /// In each lane the sum of the four of its half, summed by neighbours first.
    fn quarters(self) -> Self;

    /// The first of a slice's numbers.
    ///
    /// # Panics
    /// If there are fewer than eight.
    #[inline(always)]
    fn load(token: Self::Token, from: &[f32]) -> Self {
        let first: &[f32; LANES] = from.first_chunk().expect("eight numbers");
        Self::of(token, *first)
    }

    /// 0, 1, 2 … 7.
    #[inline(always)]
    fn count(token: Self::Token) -> Self {
        Self::of(token, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
    }

    /// Two texels.
    ///
    /// # Panics
    /// If there are not two.
    #[inline(always)]
    fn two(token: Self::Token, texels: &[[f32; 4]]) -> Self {
        Self::load(token, texels.as_flattened())
    }

    /// The polynomial with these coefficients, lowest power first, at the lanes' numbers.
    #[inline(always)]
    fn polynomial<const N: usize>(self, token: Self::Token, coefficients: &[f32; N]) -> Self {
        let mut value = Self::all(token, coefficients[N - 1]);
        for k in (0..N - 1).rev() {
            value = value.mul_add(self, Self::all(token, coefficients[k]));
        }
        value
    }
}

/// What is done with vectors, whatever they are; `run` is to be inlined.
pub(crate) trait Work {
    type Output;

    fn run<V: Vector>(self, token: V::Token) -> Self::Output;
}

/// Does it with the vector instructions that the machine has.
pub(crate) fn vectorized<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(token) = pulp::x86::V3::try_new() {
        return token.vectorize(avx2::On { token, work });
    }
    work.run::<Plain>(())
}

/// Lanes in plain code.
#[derive(Clone, Copy)]
pub(crate) struct Plain(pub [f32; LANES]);

impl Plain {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|k| f(self.0[k], other.0[k])))
    }
}

impl Add for Plain {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl Sub for Plain {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Plain {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Vector for Plain {
    type Token = ();

    #[inline(always)]
    fn of((): (), lanes: [f32; LANES]) -> Self {
        Self(lanes)
    }

    #[inline(always)]
    fn array(self) -> [f32; LANES] {
        self.0
    }

    #[inline(always)]
    fn all((): (), value: f32) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, summand: Self) -> Self {
        let of = |k: usize| self.0[k].mul_add(factor.0[k], summand.0[k]);
        Self(std::array::from_fn(of))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        self.zip(divisor, |a, b| a / b)
    }

    #[inline(always)]
    fn floor(self) -> Self {
        Self(self.0.map(f32::floor))
    }

    #[inline(always)]
    fn ceil(self) -> Self {
        Self(self.0.map(f32::ceil))
    }

    #[inline(always)]
    fn below(self, bound: Self, yes: Self, no: Self) -> Self {
        let of = |k: usize| {
            if self.0[k] < bound.0[k] {
                yes.0[k]
            } else {
                no.0[k]
            }
        };
        Self(std::array::from_fn(of))
    }

    #[inline(always)]
    fn all_at_most(self, bound: Self) -> bool {
        (0..LANES).all(|k| self.0[k] <= bound.0[k])
    }

    #[inline(always)]
    fn whole(self) -> [i32; LANES] {
        // The next number below is one of i32's.
        const BEYOND: f32 = 2_147_483_648.0;
        let whole = |x: f32| {
            if (-BEYOND..BEYOND).contains(&x) {
                x as i32
            } else {
                i32::MIN
            }
        };
        self.0.map(whole)
    }

    #[inline(always)]
    fn spread(self, k: usize) -> Self {
        let (low, high) = (self.0[k], self.0[4 + k]);
        Self([low, low, low, low, high, high, high, high])
    }

    #[inline(always)]
    fn halves(Self(a): Self, Self(b): Self) -> Self {
        let of = |k: usize| {
            if k < 4 {
                a[k] + a[k + 4]
            } else {
                b[k - 4] + b[k]
            }
        };
        Self(std::array::from_fn(of))
    }

    #[inline(always)]
    fn quarters(self) -> Self {
        let [a, b, c, d, e, f, g, h] = self.0;
        let [low, high] = [(a + b) + (c + d), (e + f) + (g + h)];
        Self([low, low, low, low, high, high, high, high])
    }
}

/// Lanes in registers of AVX2.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{Add, LANES, Mul, NullaryFnOnce, Sub, Vector, Work};
    use pulp::x86::V3;
    use pulp::{cast, f32x8};

    /// Work that is to be compiled for these instructions.
    pub(super) struct On<W> {
        pub token: V3,
        pub work: W,
    }

    impl<W: Work> NullaryFnOnce for On<W> {
        type Output = W::Output;

        #[inline(always)]
        fn call(self) -> W::Output {
            self.work.run::<Avx2>(self.token)
        }
    }

    #[derive(Clone, Copy)]
    pub(super) struct Avx2 {
        token: V3,
        lanes: f32x8,
    }

    impl Avx2 {
        #[inline(always)]
        fn with(self, lanes: f32x8) -> Self {
            Self { lanes, ..self }
        }
    }

    impl Add for Avx2 {
        type Output = Self;

        #[inline(always)]
        fn add(self, other: Self) -> Self {
            self.with(self.token.add_f32x8(self.lanes, other.lanes))
        }
    }

    impl Sub for Avx2 {
        type Output = Self;

        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            self.with(self.token.sub_f32x8(self.lanes, other.lanes))
        }
    }

    impl Mul for Avx2 {
        type Output = Self;

        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            self.with(self.token.mul_f32x8(self.lanes, other.lanes))
        }
    }

    impl Vector for Avx2 {
        type Token = V3;

        #[inline(always)]
        fn of(token: V3, lanes: [f32; LANES]) -> Self {
            let lanes = cast(lanes);
            Self { token, lanes }
        }

        #[inline(always)]
        fn array(self) -> [f32; LANES] {
            cast(self.lanes)
        }

        #[inline(always)]
        fn all(token: V3, value: f32) -> Self {
            let lanes = token.splat_f32x8(value);
            Self { token, lanes }
        }

        #[inline(always)]
        fn mul_add(self, factor: Self, summand: Self) -> Self {
            let Self { token, lanes } = self;
            self.with(token.mul_add_f32x8(lanes, factor.lanes, summand.lanes))
        }

        #[inline(always)]
        fn max(self, other: Self) -> Self {
            let Self { token, lanes } = self;
            self.with(cast(
                token.avx._mm256_max_ps(cast(lanes), cast(other.lanes)),
            ))
        }

        #[inline(always)]
        fn min(self, other: Self) -> Self {
            let Self { token, lanes } = self;
            self.with(cast(
                token.avx._mm256_min_ps(cast(lanes), cast(other.lanes)),
            ))
        }

        #[inline(always)]
        fn sqrt(self) -> Self {
            self.with(self.token.sqrt_f32x8(self.lanes))
        }

        #[inline(always)]
        fn over(self, divisor: Self) -> Self {
            self.with(self.token.div_f32x8(self.lanes, divisor.lanes))
        }

        #[inline(always)]
        fn floor(self) -> Self {
            self.with(cast(self.token.avx._mm256_floor_ps(cast(self.lanes))))
        }

        #[inline(always)]
        fn ceil(self) -> Self {
            self.with(cast(self.token.avx._mm256_ceil_ps(cast(self.lanes))))
        }

        #[inline(always)]
        fn below(self, bound: Self, yes: Self, no: Self) -> Self {
            let Self { token, lanes } = self;
            let mask = token.cmp_lt_f32x8(lanes, bound.lanes);
            self.with(token.select_f32x8(mask, yes.lanes, no.lanes))
        }

        #[inline(always)]
        fn all_at_most(self, bound: Self) -> bool {
            let mask = self.token.cmp_le_f32x8(self.lanes, bound.lanes);
            self.token.avx._mm256_movemask_ps(cast(mask)) == 0xff
        }

        #[inline(always)]
        fn whole(self) -> [i32; LANES] {
            cast(self.token.avx._mm256_cvttps_epi32(cast(self.lanes)))
        }

        #[inline(always)]
        fn spread(self, k: usize) -> Self {
            let (avx, lanes) = (self.token.avx, cast(self.lanes));
            self.with(cast(match k {
                0 => avx._mm256_permute_ps::<0x00>(lanes),
                1 => avx._mm256_permute_ps::<0x55>(lanes),
                2 => avx._mm256_permute_ps::<0xaa>(lanes),
                _ => avx._mm256_permute_ps::<0xff>(lanes),
            }))
        }

        #[inline(always)]
        fn halves(a: Self, b: Self) -> Self {
            let avx = a.token.avx;
            let low = avx._mm256_permute2f128_ps::<0x20>(cast(a.lanes), cast(b.lanes));
            let high = avx._mm256_permute2f128_ps::<0x31>(cast(a.lanes), cast(b.lanes));
            a.with(a.token.add_f32x8(cast(low), cast(high)))
        }

        #[inline(always)]
        fn quarters(self) -> Self {
            let avx = self.token.avx;
            let pairs = avx._mm256_hadd_ps(cast(self.lanes), cast(self.lanes));
            self.with(cast(avx._mm256_hadd_ps(pairs, pairs)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation on numbers of all kinds.
    struct All([f32; LANES], [f32; LANES]);

    impl Work for All {
        type Output = Vec<[u32; LANES]>;

        #[inline(always)]
        fn run<V: Vector>(self, token: V::Token) -> Self::Output {
            let (a, b) = (V::of(token, self.0), V::load(token, &self.1));
            let large = V::of(token, self.1.map(|x| x * 1e8));
            let as_numbers = |whole: [i32; LANES]| V::of(token, whole.map(|x| x as f32));
            let is_at_most = V::all(token, f32::from(u8::from(a.all_at_most(b))));
            let results = [
                a + b,
                a.mul_add(b, a),
                a.max(b),
                a.min(b),
                a.sqrt(),
                a.over(b),
                a.floor(),
                b.ceil(),
                a.below(b, V::count(token), V::all(token, 2.5)),
                b.polynomial(token, &[0.3, -1.7, 0.1]),
                as_numbers(a.whole()),
                as_numbers(large.whole()),
                is_at_most,
                a.spread(1),
                V::halves(a, b),
                b.quarters(),
            ];
            results.map(|v| v.array().map(f32::to_bits)).to_vec()
        }
    }

    #[test]
    fn instructions_and_plain_code_give_the_same_bits() {
        let mut seed = 1_u32;
        let mut any = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 65_536.0 - 40.0
        };
        for _ in 0..1000 {
            let a = std::array::from_fn(|_| any().abs());
            let b = std::array::from_fn(|_| any());
            assert_eq!(
                vectorized(All(a, b)),
                All(a, b).run::<Plain>(()),
                "{a:?} {b:?}"
            );
        }
    }
}
