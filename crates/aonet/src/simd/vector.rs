//! Vectors of three components, one in every lane.

use crate::simd::Simd;
use crate::simd::lanes::{F, Mask, Number};
use std::ops::{Add, Mul, Sub};

/// A vector of three components in every lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct V3<S: Simd> {
    pub(crate) x: F<S>,
    pub(crate) y: F<S>,
    pub(crate) z: F<S>,
}

impl<S: Simd> V3<S> {
    /// The same vector in every lane.
    #[cfg(test)]
    pub(crate) fn new(simd: S, [x, y, z]: [f32; 3]) -> Self {
        Self { x: F::new(simd, x), y: F::new(simd, y), z: F::new(simd, z) }
    }

    #[inline(always)]
    /// The first `LANES` triples of a slice that has them.
    pub(crate) fn from_triples(simd: S, triples: &[[f32; 3]]) -> Self {
        let [x, y, z] = simd.load_triples(triples);
        Self { x: F(simd, x), y: F(simd, y), z: F(simd, z) }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> F<S> {
        self.x.mul_add(other.x, self.y.mul_add(other.y, self.z * other.z))
    }

    /// This times `by` plus `plus`.
    #[inline(always)]
    pub(crate) fn mul_add(self, by: impl Number<S>, plus: Self) -> Self {
        Self { x: self.x.mul_add(by, plus.x), y: self.y.mul_add(by, plus.y), z: self.z.mul_add(by, plus.z) }
    }

    /// One of two, lane by lane.
    #[inline(always)]
    pub(crate) fn choose(first: Mask<S>, [a, b]: [Self; 2]) -> Self {
        Self { x: first.select(a.x, b.x), y: first.select(a.y, b.y), z: first.select(a.z, b.z) }
    }

    #[inline(always)]
    pub(crate) fn cross(self, o: Self) -> Self {
        Self {
            x: self.y * o.z - self.z * o.y,
            y: self.z * o.x - self.x * o.z,
            z: self.x * o.y - self.y * o.x,
        }
    }
}

impl<S: Simd> Add for V3<S> {
    type Output = V3<S>;
    #[inline(always)]
    fn add(self, o: V3<S>) -> V3<S> {
        V3 { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl<S: Simd> Sub for V3<S> {
    type Output = V3<S>;
    #[inline(always)]
    fn sub(self, o: V3<S>) -> V3<S> {
        V3 { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl<S: Simd, T: Number<S>> Mul<T> for V3<S> {
    type Output = V3<S>;
    #[inline(always)]
    fn mul(self, by: T) -> V3<S> {
        V3 { x: self.x * by, y: self.y * by, z: self.z * by }
    }
}
