//! Vectors of neighbouring pixels, with operators. Methods read like a shader: the work of one pixel, in every lane.

use super::values::U;
pub(crate) use super::values::{F, Mask};
use crate::simd::{MAX_LANES, Simd};
use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};

/// Floats of every lane, or one for all.
pub(crate) trait Number<S: Simd>: Copy {
    fn lanes(self, simd: S) -> F<S>;
}

impl<S: Simd> Number<S> for F<S> {
    #[inline(always)]
    fn lanes(self, _: S) -> F<S> {
        self
    }
}

impl<S: Simd> Number<S> for f32 {
    #[inline(always)]
    fn lanes(self, simd: S) -> F<S> {
        F(simd, simd.splat(self))
    }
}

/// Operators between lanes, and between lanes and one number.
macro_rules! operator {
    ($trait:ident, $name:ident) => {
        impl<S: Simd, T: Number<S>> $trait<T> for F<S> {
            type Output = F<S>;
            #[inline(always)]
            fn $name(self, other: T) -> F<S> {
                F(self.0, self.0.$name(self.1, other.lanes(self.0).1))
            }
        }
        impl<S: Simd> $trait<F<S>> for f32 {
            type Output = F<S>;
            #[inline(always)]
            fn $name(self, other: F<S>) -> F<S> {
                self.lanes(other.0).$name(other)
            }
        }
    };
    ($trait:ident, $name:ident, $op:tt) => {
        impl<S: Simd, T: Number<S>> $trait<T> for F<S> {
            #[inline(always)]
            fn $name(&mut self, other: T) {
                *self = *self $op other;
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);
operator!(AddAssign, add_assign, +);
operator!(SubAssign, sub_assign, -);
operator!(MulAssign, mul_assign, *);

impl<S: Simd> Neg for F<S> {
    type Output = F<S>;
    #[inline(always)]
    fn neg(self) -> F<S> {
        -0.0 - self
    }
}

impl<S: Simd> F<S> {
    /// The same number in every lane.
    #[inline(always)]
    pub(crate) fn new(simd: S, value: f32) -> Self {
        value.lanes(simd)
    }

    #[inline(always)]
    pub(crate) fn load(simd: S, from: &[f32]) -> Self {
        Self(simd, simd.load(from))
    }

    /// Writes the first values, as many as `to` has, all lanes at most.
    #[inline(always)]
    pub(crate) fn store(self, to: &mut [f32]) {
        if to.len() >= S::LANES {
            return self.0.store(self.1, to);
        }
        let mut all = [0.0; MAX_LANES];
        self.0.store(self.1, &mut all);
        to.copy_from_slice(&all[..to.len()]);
    }

    /// `first`, `first` + 1, ...
    #[inline(always)]
    pub(crate) fn counting_from(simd: S, first: f32) -> Self {
        const COUNT: [f32; MAX_LANES] = {
            let mut count = [0.0; MAX_LANES];
            let mut i = 0;
            while i < MAX_LANES {
                count[i] = i as f32;
                i += 1;
            }
            count
        };
        Self::load(simd, &COUNT) + first
    }

    /// All lanes.
    #[cfg(test)]
    pub(crate) fn array(self) -> Vec<f32> {
        let mut all = vec![0.0; S::LANES];
        self.store(&mut all);
        all
    }

    /// The instruction set that computes it.
    #[inline(always)]
    pub(crate) fn simd(self) -> S {
        self.0
    }

    /// This times `by` plus `plus`.
    #[inline(always)]
    pub(crate) fn mul_add(self, by: impl Number<S>, plus: impl Number<S>) -> Self {
        Self(self.0, self.0.mul_add(self.1, by.lanes(self.0).1, plus.lanes(self.0).1))
    }

    /// The smaller one; the other one where this is NaN.
    #[inline(always)]
    pub(crate) fn min(self, other: impl Number<S>) -> Self {
        Self(self.0, self.0.min(self.1, other.lanes(self.0).1))
    }

    /// The larger one; the other one where this is NaN.
    #[inline(always)]
    pub(crate) fn max(self, other: impl Number<S>) -> Self {
        Self(self.0, self.0.max(self.1, other.lanes(self.0).1))
    }

    /// Into [0, 1]; NaN becomes 0.
    #[inline(always)]
    pub(crate) fn saturate(self) -> Self {
        self.max(0.0).min(1.0)
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        (self.bits() & 0x7fff_ffff).float_of_bits()
    }

    /// Its size with the sign of `other`, zero's included.
    #[inline(always)]
    pub(crate) fn with_sign_of(self, other: Self) -> Self {
        ((self.bits() & 0x7fff_ffff) | (other.bits() & 0x8000_0000)).float_of_bits()
    }

    /// Square root; 0 below 0.
    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self(self.0, self.0.sqrt(self.max(0.0).1))
    }

    /// One over the square root, of numbers above 1e-37.
    #[inline(always)]
    pub(crate) fn inverse_sqrt(self) -> Self {
        Self(self.0, self.0.inverse_sqrt(self.1))
    }

    /// The same, off by less than 1e-4 of it.
    #[inline(always)]
    pub(crate) fn rough_inverse_sqrt(self) -> Self {
        Self(self.0, self.0.rough_inverse_sqrt(self.1))
    }

    #[inline(always)]
    pub(crate) fn lt(self, other: impl Number<S>) -> Mask<S> {
        Mask(self.0, self.0.lt(self.1, other.lanes(self.0).1))
    }

    #[inline(always)]
    pub(crate) fn le(self, other: impl Number<S>) -> Mask<S> {
        Mask(self.0, self.0.le(self.1, other.lanes(self.0).1))
    }

    /// The part after the point, of numbers in [0, 2^22).
    #[inline(always)]
    pub(crate) fn fract(self) -> Self {
        let rest = self - self.round().float();
        rest.lt(0.0).select(rest + 1.0, rest)
    }

    /// The nearest whole number, of numbers in [-2^22, 2^22].
    #[inline(always)]
    pub(crate) fn round(self) -> U<S> {
        U(self.0, self.0.round(self.1))
    }

    /// The nearest whole number of at most `last`, which is below 2^22; numbers below 0 and NaN become 0.
    #[inline(always)]
    pub(crate) fn index(self, last: usize) -> U<S> {
        self.max(0.0).min(last as f32).round()
    }

    #[inline(always)]
    pub(crate) fn bits(self) -> U<S> {
        U(self.0, self.0.bits(self.1))
    }

    /// `c0` + `c1` x + `c2` x² + ...
    #[inline(always)]
    pub(crate) fn polynomial<const N: usize>(self, coefficients: [f32; N]) -> Self {
        let mut sum = Self::new(self.0, coefficients[N - 1]);
        for i in (0..N - 1).rev() {
            sum = sum.mul_add(self, coefficients[i]);
        }
        sum
    }

    /// Cosine and sine of angles in [0, pi]; off by less than 4e-6.
    // Taylor series of the sine up to x^11 on [-pi/2, pi/2].
    #[inline(always)]
    pub(crate) fn cos_sin_of_half_turn(self) -> (Self, Self) {
        ((FRAC_PI_2 - self).small_sine(), self.min(PI - self).small_sine())
    }

    #[inline(always)]
    fn small_sine(self) -> Self {
        const SERIES: [f32; 6] =
            [1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0, -1.0 / 39_916_800.0];
        self * (self * self).polynomial(SERIES)
    }

    /// Arc cosine (rad), off by less than 7e-5. Abramowitz and Stegun 1964, 4.4.45.
    #[inline(always)]
    pub(crate) fn acos(self) -> Self {
        let t = self.abs().min(1.0);
        let positive =
            (1.0 - t).sqrt() * t.polynomial([1.570_728_8, -0.212_114_4, 0.074_261_0, -0.018_729_3]);
        self.lt(0.0).select(PI - positive, positive)
    }

    /// Logarithm to base two, off by less than 2e-5; for normal numbers above 0.
    #[inline(always)]
    pub(crate) fn log2(self) -> Self {
        // Minimax over mantissas in [sqrt(1/2), sqrt(2)), less 1.
        const SERIES: [f32; 5] = [1.442_578, -0.720_241_8, 0.486_686_2, -0.394_575_4, 0.252_660_3];
        // With the exponent's bias, so that the shift sees no sign.
        let bits = self.bits() + ((127 << 23) - FRAC_1_SQRT_2.to_bits());
        let exponent = (bits >> 23).float() - 127.0;
        let mantissa = ((bits & 0x007f_ffff) + FRAC_1_SQRT_2.to_bits()).float_of_bits() - 1.0;
        mantissa.mul_add(mantissa.polynomial(SERIES), exponent)
    }

    /// Two to the power of it, off by less than 1e-5 of the result and exact for 0; for numbers in [-126, 126].
    #[inline(always)]
    pub(crate) fn exp2(self) -> Self {
        // Minimax over [-1/2, 1/2].
        const SERIES: [f32; 5] = [1.0, 0.693_124_2, 0.240_241, 0.055_906_4, 0.009_582_9];
        let x = self.max(-126.0).min(126.0);
        let whole = x.round();
        let series = (x - whole.float()).polynomial(SERIES);
        (series.bits() + (whole << 23)).float_of_bits()
    }
}

impl<S: Simd> Mask<S> {
    /// Whether it holds in any lane.
    #[inline(always)]
    pub(crate) fn any(self) -> bool {
        self.0.any(self.1)
    }

    /// `a` where it holds, `b` elsewhere.
    #[inline(always)]
    pub(crate) fn select(self, a: impl Number<S>, b: impl Number<S>) -> F<S> {
        F(self.0, self.0.select(self.1, a.lanes(self.0).1, b.lanes(self.0).1))
    }
}

impl<S: Simd> BitAnd for Mask<S> {
    type Output = Mask<S>;
    #[inline(always)]
    fn bitand(self, other: Mask<S>) -> Mask<S> {
        Mask(self.0, self.0.and(self.1, other.1))
    }
}

impl<S: Simd> BitOr for Mask<S> {
    type Output = Mask<S>;
    #[inline(always)]
    fn bitor(self, other: Mask<S>) -> Mask<S> {
        Mask(self.0, self.0.or(self.1, other.1))
    }
}

impl<S: Simd> Not for Mask<S> {
    type Output = Mask<S>;
    #[inline(always)]
    fn not(self) -> Mask<S> {
        Mask(self.0, self.0.not(self.1))
    }
}

#[cfg(test)]
mod tests;
