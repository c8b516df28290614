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
mod tests {
    use super::*;
    use crate::simd::{Isa, Kernel, Level, Simd};

    /// Calls a check with every instruction set of this machine.
    macro_rules! everywhere {
        ($name:ident, $check:ident) => {
            #[test]
            fn $name() {
                struct Check;
                impl Kernel for Check {
                    fn run<S: Simd>(self, simd: S) {
                        $check(simd);
                    }
                }
                for level in Level::available() {
                    Isa::new(level).unwrap().run(Check);
                    Isa::new(level).unwrap().run_on_pixels(Check);
                    Isa::new(level).unwrap().run_on_chains(Check);
                }
            }
        };
    }
    everywhere!(functions_are_as_exact_as_they_say, functions);
    everywhere!(nan_and_negative_numbers_have_an_index, indices);
    everywhere!(masks_choose, masks);
    everywhere!(indices_beyond_the_end_read_the_last_value, gathers);
    everywhere!(a_store_writes_as_many_as_there_is_room_for, partial_stores);
    everywhere!(bits_are_counted_and_shifted_out, bits);

    fn over<S: Simd>(simd: S, range: std::ops::RangeInclusive<f32>, check: impl Fn(f32, usize, F<S>)) {
        let (low, high) = (*range.start(), *range.end());
        for block in 0..=1000 {
            let x = low + (high - low) * block as f32 / 1000.0;
            let values: [f32; MAX_LANES] = std::array::from_fn(|i| (x + i as f32 * 1e-3).min(high));
            (0..S::LANES).for_each(|i| check(values[i], i, F::load(simd, &values)));
        }
    }

    fn functions<S: Simd>(simd: S) {
        over(simd, 0.0..=PI, |x, i, lanes| {
            let (c, s) = lanes.cos_sin_of_half_turn();
            assert!((c.array()[i] - x.cos()).abs() < 4e-6 && (s.array()[i] - x.sin()).abs() < 4e-6, "{x}");
        });
        over(simd, -1.0..=1.0, |x, i, lanes| {
            assert!((lanes.acos().array()[i] - x.acos()).abs() < 8e-5, "{x}");
        });
        over(simd, -20.0..=20.0, |x, i, lanes| {
            assert!((lanes.exp2().array()[i] / x.exp2() - 1.0).abs() < 1e-5, "{x}");
        });
        over(simd, 1e-3..=9.0, |x, i, lanes| {
            assert!((lanes.log2().array()[i] - x.log2()).abs() < 2e-5, "{x}");
            assert!((lanes.inverse_sqrt().array()[i] * x.sqrt() - 1.0).abs() < 1e-6, "{x}");
            assert!((lanes.rough_inverse_sqrt().array()[i] * x.sqrt() - 1.0).abs() < 1e-4, "{x}");
        });
        over(simd, 0.0..=9000.0, |x, i, lanes| {
            assert!((lanes.fract().array()[i] - x.fract()).abs() < 1e-6, "{x}");
            assert_eq!(lanes.index(5000).array()[i], x.round_ties_even().min(5000.0) as u32);
        });
        assert_eq!(F::new(simd, 0.0).exp2().array()[0], 1.0);
        let signed = F::new(simd, 2.0).with_sign_of(F::new(simd, -0.0));
        assert_eq!((signed.array()[3], signed.abs().array()[3]), (-2.0, 2.0));
    }

    fn indices<S: Simd>(simd: S) {
        let mut lanes = [0.0; MAX_LANES];
        lanes[..4].copy_from_slice(&[f32::NAN, -3.0, 1e30, 7.4]);
        assert_eq!(F::load(simd, &lanes).index(9).array()[..4], [0, 0, 9, 7]);
    }

    fn masks<S: Simd>(simd: S) {
        let (i, half) = (F::counting_from(simd, 0.0), S::LANES as f32 / 2.0);
        let chosen = (i.lt(1.0) | !i.le(half)).select(-1.0, i).array();
        let expected = |i: usize| if i < 1 || i as f32 > half { -1.0 } else { i as f32 };
        assert_eq!(chosen, (0..S::LANES).map(expected).collect::<Vec<_>>());
        let chosen = (i.lt(half) & i.le(half - 2.0)).select(1.0, 0.0).array();
        let expected = |i: usize| if i as f32 <= half - 2.0 { 1.0 } else { 0.0 };
        assert_eq!(chosen, (0..S::LANES).map(expected).collect::<Vec<_>>());
        for lane in 0..S::LANES {
            let one = F::counting_from(simd, 0.0) - lane as f32;
            assert!((one.lt(0.5) & F::new(simd, -0.5).lt(one)).any());
        }
        assert!(!i.lt(0.0).any());
    }

    fn gathers<S: Simd>(simd: S) {
        let values: Vec<f32> = (0..12).map(|v| v as f32 * 10.0).collect();
        let indices = F::counting_from(simd, 10.0).index(99);
        assert_eq!(indices.gather(&values).array()[..4], [100.0, 110.0, 110.0, 110.0]);
        let indices = F::counting_from(simd, 0.0).index(99);
        let all: Vec<f32> = (0..S::LANES).map(|i| values[i.min(11)]).collect();
        assert_eq!(indices.gather(&values).array(), all);
        assert_eq!((indices * u32::MAX).gather(&values).array()[..2], [0.0, 110.0]);
        let fours = F(simd, simd.load_fours(&values, |i| 8 - i)).array();
        let expected: Vec<f32> = (0..S::LANES).map(|i| values[8 - i / 4 + i % 4]).collect();
        assert_eq!(fours, expected);
        let triples: [[f32; 3]; MAX_LANES] =
            std::array::from_fn(|i| [i as f32, 100.0 + i as f32, -(i as f32)]);
        let [x, y, z] = simd.load_triples(&triples).map(|v| F(simd, v).array());
        let found: Vec<_> = (0..S::LANES).map(|i| [x[i], y[i], z[i]]).collect();
        assert_eq!(found, triples[..S::LANES]);
    }

    fn bits<S: Simd>(simd: S) {
        let count = F::counting_from(simd, 30.0).index(99);
        let one = F::counting_from(simd, 1.0).index(1);
        assert_eq!((one << count).array()[..4], [1 << 30, 1 << 31, 0, 0]);
        // Unsigned, -3 is large.
        let below = |first: f32| F::counting_from(simd, first).round().lt(2).select(1.0, 0.0).array();
        assert_eq!(below(-3.0)[..4], [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(below(-1.0)[..4], [0.0, 1.0, 1.0, 0.0]);
        assert_eq!((((one << count) + u32::MAX) >> 1).count_ones().array()[..4], [29, 30, 31, 31]);
    }

    fn partial_stores<S: Simd>(simd: S) {
        for len in 0..=MAX_LANES {
            let mut to = vec![-1.0; len];
            F::counting_from(simd, 5.0).store(&mut to);
            let expected: Vec<f32> =
                (0..len).map(|i| if i < S::LANES { 5.0 + i as f32 } else { -1.0 }).collect();
            assert_eq!(to, expected);
        }
    }
}
