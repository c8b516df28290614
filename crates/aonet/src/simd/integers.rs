//! Vectors of 32-bit integers, with operators: indices and bits.

pub(crate) use super::values::U;
use super::values::{F, Mask};
use crate::simd::Simd;
use std::ops::{Add, BitAnd, BitOr, Mul, Neg, Shl, Shr, Sub};

impl<S: Simd> U<S> {
    /// The instruction set that computes it.
    #[inline(always)]
    pub(crate) fn simd(self) -> S {
        self.0
    }

    #[cfg(test)]
    pub(crate) fn array(self) -> Vec<u32> {
        self.float_of_bits().array().into_iter().map(f32::to_bits).collect()
    }

    /// Signed integers as floats.
    #[inline(always)]
    pub(crate) fn float(self) -> F<S> {
        F(self.0, self.0.float(self.1))
    }

    #[inline(always)]
    pub(crate) fn float_of_bits(self) -> F<S> {
        F(self.0, self.0.float_of_bits(self.1))
    }

    /// The values at these indices; an index beyond the end reads the last value.
    #[inline(always)]
    pub(crate) fn gather(self, values: &[f32]) -> F<S> {
        F(self.0, self.0.gather(values, self.1))
    }

    /// Whether it is less, both unsigned.
    #[inline(always)]
    pub(crate) fn lt(self, other: impl Integer<S>) -> Mask<S> {
        Mask(self.0, self.0.lt_u(self.1, other.integer_lanes(self.0).1))
    }

    /// How many bits are set.
    #[inline(always)]
    pub(crate) fn count_ones(self) -> Self {
        let pairs = (self & 0x5555_5555) + ((self >> 1) & 0x5555_5555);
        let fours = (pairs & 0x3333_3333) + ((pairs >> 2) & 0x3333_3333);
        let bytes = (fours + (fours >> 4)) & 0x0f0f_0f0f;
        (bytes * 0x0101_0101) >> 24
    }
}

/// Integers of every lane, or one for all.
pub(crate) trait Integer<S: Simd>: Copy {
    fn integer_lanes(self, simd: S) -> U<S>;
}

impl<S: Simd> Integer<S> for U<S> {
    #[inline(always)]
    fn integer_lanes(self, _: S) -> U<S> {
        self
    }
}

impl<S: Simd> Integer<S> for u32 {
    #[inline(always)]
    fn integer_lanes(self, simd: S) -> U<S> {
        U(simd, simd.splat_u(self))
    }
}

impl<S: Simd> Neg for U<S> {
    type Output = U<S>;
    #[inline(always)]
    fn neg(self) -> U<S> {
        0.integer_lanes(self.0) - self
    }
}

macro_rules! integer_operator {
    ($($trait:ident, $name:ident, $op:ident;)+) => {
        $(impl<S: Simd, T: Integer<S>> $trait<T> for U<S> {
            type Output = U<S>;
            #[inline(always)]
            fn $name(self, other: T) -> U<S> {
                U(self.0, self.0.$op(self.1, other.integer_lanes(self.0).1))
            }
        })+
    };
}
integer_operator! {
    Add, add, add_u;
    Sub, sub, sub_u;
    Mul, mul, mul_u;
    BitAnd, bitand, and_u;
    BitOr, bitor, or_u;
    Shl, shl, shl_u;
    Shr, shr, shr_u;
}
