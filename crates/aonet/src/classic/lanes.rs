//! Sixteen neighbouring pixels at once. Methods read like a shader: one pixel's work, in every lane.

#![allow(clippy::needless_range_loop, reason = "loops over the lanes of several arrays become vectors")]

use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2, LN_2, LOG2_E, PI};
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};

/// Pixels that are computed together.
pub(crate) const LANES: usize = 16;

/// A number of every pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub(crate) struct F(pub(crate) [f32; LANES]);

/// A condition of every pixel: all bits or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(align(64))]
pub(crate) struct Mask(pub(crate) [u32; LANES]);

#[inline(always)]
fn map(a: F, f: impl Fn(f32) -> f32) -> F {
    let mut out = [0.0; LANES];
    for i in 0..LANES {
        out[i] = f(a.0[i]);
    }
    F(out)
}

#[inline(always)]
fn zip(a: F, b: F, f: impl Fn(f32, f32) -> f32) -> F {
    let mut out = [0.0; LANES];
    for i in 0..LANES {
        out[i] = f(a.0[i], b.0[i]);
    }
    F(out)
}

#[inline(always)]
fn compare(a: F, b: F, f: impl Fn(f32, f32) -> bool) -> Mask {
    let mut out = [0; LANES];
    for i in 0..LANES {
        out[i] = if f(a.0[i], b.0[i]) { u32::MAX } else { 0 };
    }
    Mask(out)
}

impl From<f32> for F {
    #[inline(always)]
    fn from(value: f32) -> Self {
        Self([value; LANES])
    }
}

/// Operators between lanes, and between lanes and one number.
macro_rules! operator {
    ($trait:ident, $name:ident, $op:tt) => {
        impl<T: Into<F>> $trait<T> for F {
            type Output = F;
            #[inline(always)]
            fn $name(self, other: T) -> F {
                zip(self, other.into(), |a, b| a $op b)
            }
        }
        impl $trait<F> for f32 {
            type Output = F;
            #[inline(always)]
            fn $name(self, other: F) -> F {
                zip(self.into(), other, |a, b| a $op b)
            }
        }
    };
}
operator!(Add, add, +);
operator!(Sub, sub, -);
operator!(Mul, mul, *);
operator!(Div, div, /);

impl<T: Into<F>> AddAssign<T> for F {
    #[inline(always)]
    fn add_assign(&mut self, other: T) {
        *self = *self + other;
    }
}

impl<T: Into<F>> SubAssign<T> for F {
    #[inline(always)]
    fn sub_assign(&mut self, other: T) {
        *self = *self - other;
    }
}

impl<T: Into<F>> MulAssign<T> for F {
    #[inline(always)]
    fn mul_assign(&mut self, other: T) {
        *self = *self * other;
    }
}

impl Neg for F {
    type Output = F;
    #[inline(always)]
    fn neg(self) -> F {
        map(self, |a| -a)
    }
}

impl F {
    /// `first`, `first` + 1, ...
    #[inline(always)]
    pub(crate) fn counting_from(first: f32) -> Self {
        let mut out = [0.0; LANES];
        for i in 0..LANES {
            out[i] = first + i as f32;
        }
        Self(out)
    }

    /// The smaller one; the other one where this is NaN.
    #[inline(always)]
    pub(crate) fn min(self, other: impl Into<F>) -> Self {
        zip(self, other.into(), |a, b| if a < b { a } else { b })
    }

    /// The larger one; the other one where this is NaN.
    #[inline(always)]
    pub(crate) fn max(self, other: impl Into<F>) -> Self {
        zip(self, other.into(), |a, b| if a > b { a } else { b })
    }

    /// Into [0, 1]; NaN becomes 0.
    #[inline(always)]
    pub(crate) fn saturate(self) -> Self {
        self.max(0.0).min(1.0)
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        map(self, f32::abs)
    }

    /// Square root; 0 below 0.
    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        map(self.max(0.0), f32::sqrt)
    }

    #[inline(always)]
    pub(crate) fn lt(self, other: impl Into<F>) -> Mask {
        compare(self, other.into(), |a, b| a < b)
    }

    #[inline(always)]
    pub(crate) fn le(self, other: impl Into<F>) -> Mask {
        compare(self, other.into(), |a, b| a <= b)
    }

    /// The part after the point, of numbers in [0, 2^22).
    #[inline(always)]
    pub(crate) fn fract(self) -> Self {
        let rounded = self.round();
        let rest = self - rounded;
        rest.lt(0.0).select(rest + 1.0, rest)
    }

    /// The nearest whole number, of numbers in [0, 2^22).
    #[inline(always)]
    pub(crate) fn round(self) -> Self {
        map(self, |a| (a + ROUNDING) - ROUNDING)
    }

    /// The same as an index of at most `last`, which is below 2^22; numbers below 0 and NaN become 0.
    #[inline(always)]
    pub(crate) fn index(self, last: usize) -> [u32; LANES] {
        let clamped = self.max(0.0).min(last as f32);
        let mut out = [0; LANES];
        for i in 0..LANES {
            // Casts of floats saturate, which costs more.
            out[i] = (clamped.0[i] + ROUNDING).to_bits() - ROUNDING.to_bits();
        }
        out
    }

    /// Cosine and sine of angles in [0, pi]; off by less than 4e-6.
    // Taylor series of the sine up to x^11 on [-pi/2, pi/2].
    #[inline(always)]
    pub(crate) fn cos_sin_of_half_turn(self) -> (Self, Self) {
        (-(self - FRAC_PI_2).small_sine(), self.min(PI - self).small_sine())
    }

    #[inline(always)]
    fn small_sine(self) -> Self {
        let s = self * self;
        let tail = 1.0 / 120.0 + s * (-1.0 / 5040.0 + s * (1.0 / 362_880.0 - s * (1.0 / 39_916_800.0)));
        self * (1.0 + s * (-1.0 / 6.0 + s * tail))
    }

    /// Arc cosine [rad], off by less than 7e-5. Abramowitz and Stegun 1964, 4.4.45.
    #[inline(always)]
    pub(crate) fn acos(self) -> Self {
        let t = self.abs().min(1.0);
        let series = 1.570_728_8 + t * (-0.212_114_4 + t * (0.074_261_0 + t * -0.018_729_3));
        let positive = (1.0 - t).sqrt() * series;
        self.lt(0.0).select(PI - positive, positive)
    }

    /// Logarithm to base two, off by less than 1e-4; for normal numbers above 0.
    // atanh series of the mantissa in [sqrt(1/2), sqrt(2)).
    #[inline(always)]
    pub(crate) fn log2(self) -> Self {
        let (mut exponent, mut mantissa) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let bits = self.0[i].to_bits().wrapping_sub(FRAC_1_SQRT_2.to_bits());
            exponent[i] = ((bits as i32) >> 23) as f32;
            mantissa[i] = f32::from_bits((bits & 0x007f_ffff) + FRAC_1_SQRT_2.to_bits());
        }
        let t = (F(mantissa) - 1.0) / (F(mantissa) + 1.0);
        let s = t * t;
        F(exponent) + t * (2.0 * LOG2_E) * (1.0 + s * (1.0 / 3.0 + s * (1.0 / 5.0 + s * (1.0 / 7.0))))
    }

    /// Two to the power of it, off by less than 2e-4 of the result; for numbers in [-126, 126].
    #[inline(always)]
    pub(crate) fn exp2(self) -> Self {
        let x = self.max(-126.0).min(126.0);
        let mut out = [0.0; LANES];
        for i in 0..LANES {
            let whole = (x.0[i] + 1.5 * ROUNDING) - 1.5 * ROUNDING;
            let f = x.0[i] - whole;
            let series = 1.0 + f * (LN_2 + f * (0.240_227 + f * (0.055_504 + f * 0.009_618)));
            let exponent = (x.0[i] + 1.5 * ROUNDING).to_bits() << 23;
            out[i] = f32::from_bits(series.to_bits().wrapping_add(exponent));
        }
        F(out)
    }
}

/// Beyond it floats have no fraction.
const ROUNDING: f32 = 8_388_608.0;

impl Mask {
    /// `a` where it holds, `b` elsewhere.
    #[inline(always)]
    pub(crate) fn select(self, a: impl Into<F>, b: impl Into<F>) -> F {
        let (a, b): (F, F) = (a.into(), b.into());
        let mut out = [0.0; LANES];
        for i in 0..LANES {
            out[i] = if self.0[i] != 0 { a.0[i] } else { b.0[i] };
        }
        F(out)
    }

    /// Whether it holds for every pixel.
    #[inline(always)]
    pub(crate) fn all(self) -> bool {
        let mut all = u32::MAX;
        for i in 0..LANES {
            all &= self.0[i];
        }
        all != 0
    }
}

impl BitAnd for Mask {
    type Output = Mask;
    #[inline(always)]
    fn bitand(self, other: Mask) -> Mask {
        let mut out = [0; LANES];
        for i in 0..LANES {
            out[i] = self.0[i] & other.0[i];
        }
        Mask(out)
    }
}

impl BitOr for Mask {
    type Output = Mask;
    #[inline(always)]
    fn bitor(self, other: Mask) -> Mask {
        let mut out = [0; LANES];
        for i in 0..LANES {
            out[i] = self.0[i] | other.0[i];
        }
        Mask(out)
    }
}

impl Not for Mask {
    type Output = Mask;
    #[inline(always)]
    fn not(self) -> Mask {
        let mut out = [0; LANES];
        for i in 0..LANES {
            out[i] = !self.0[i];
        }
        Mask(out)
    }
}

/// A vector of every pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct V3 {
    pub(crate) x: F,
    pub(crate) y: F,
    pub(crate) z: F,
}

impl V3 {
    #[inline(always)]
    pub(crate) fn new(x: impl Into<F>, y: impl Into<F>, z: impl Into<F>) -> Self {
        Self { x: x.into(), y: y.into(), z: z.into() }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> F {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[cfg(test)]
    pub(crate) fn cross(self, o: Self) -> Self {
        Self {
            x: self.y * o.z - self.z * o.y,
            y: self.z * o.x - self.x * o.z,
            z: self.x * o.y - self.y * o.x,
        }
    }

    /// Unit length; of a zero vector, zero.
    #[inline(always)]
    pub(crate) fn normalized(self) -> Self {
        self * (1.0 / self.dot(self).max(1e-36).sqrt())
    }
}

impl Add for V3 {
    type Output = V3;
    #[inline(always)]
    fn add(self, o: V3) -> V3 {
        V3 { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl Sub for V3 {
    type Output = V3;
    #[inline(always)]
    fn sub(self, o: V3) -> V3 {
        V3 { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl<T: Into<F>> Mul<T> for V3 {
    type Output = V3;
    #[inline(always)]
    fn mul(self, by: T) -> V3 {
        let by = by.into();
        V3 { x: self.x * by, y: self.y * by, z: self.z * by }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn over(range: std::ops::RangeInclusive<f32>, check: impl Fn(f32, usize, F)) {
        let (low, high) = (*range.start(), *range.end());
        for block in 0..=1000 {
            let x = low + (high - low) * block as f32 / 1000.0;
            let lanes = F(std::array::from_fn(|i| (x + i as f32 * 1e-3).min(high)));
            (0..LANES).for_each(|i| check(lanes.0[i], i, lanes));
        }
    }

    #[test]
    fn functions_are_as_exact_as_they_say() {
        over(0.0..=PI, |x, i, lanes| {
            let (c, s) = lanes.cos_sin_of_half_turn();
            assert!((c.0[i] - x.cos()).abs() < 4e-6 && (s.0[i] - x.sin()).abs() < 4e-6, "{x}");
        });
        over(-1.0..=1.0, |x, i, lanes| assert!((lanes.acos().0[i] - x.acos()).abs() < 8e-5, "{x}"));
        over(-20.0..=20.0, |x, i, lanes| {
            assert!((lanes.exp2().0[i] / x.exp2() - 1.0).abs() < 2e-4, "{x}");
        });
        over(1e-3..=9.0, |x, i, lanes| assert!((lanes.log2().0[i] - x.log2()).abs() < 1e-4, "{x}"));
        over(0.0..=9000.0, |x, i, lanes| {
            assert!((lanes.fract().0[i] - x.fract()).abs() < 1e-6, "{x}");
            assert_eq!(lanes.index(5000)[i], x.round_ties_even().min(5000.0) as u32);
        });
    }

    #[test]
    fn nan_and_negative_numbers_have_an_index() {
        let lanes = F([f32::NAN, -3.0, 1e30, 7.4, 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0.]);
        assert_eq!(lanes.index(9)[..4], [0, 0, 9, 7]);
    }

    #[test]
    fn masks_choose() {
        let (one, two) = (F::from(1.0), F::counting_from(0.0));
        let chosen = (two.lt(2.0) | !two.le(14.0)).select(one, two);
        assert_eq!(chosen.0[..4], [1.0, 1.0, 2.0, 3.0]);
        assert_eq!(chosen.0[14..], [14.0, 1.0]);
        assert!(two.lt(16.0).all() && !two.lt(15.0).all() && !(two.lt(1.0) & two.le(0.0)).all());
    }
}
