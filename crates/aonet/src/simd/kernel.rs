//! Vectors of f32, one source for every instruction set.

use crate::simd::Wide;

/// A set of vector instructions. A value of an implementing type is the proof that the machine has them.
pub trait Simd: Copy {
    /// `LANES` values.
    type V: Copy;
    /// Sixteen values.
    type Wide: Wide;
    /// Values in a vector.
    const LANES: usize;
    /// Vectors that a loop can accumulate into, leaving registers for its operands.
    const ACCUMULATORS: usize;

    /// The same instructions for sixteen values.
    fn wide(self) -> Self::Wide;
    /// The same value in all lanes.
    fn splat(self, value: f32) -> Self::V;
    /// The first `LANES` values of a slice that has them.
    fn load(self, from: &[f32]) -> Self::V;
    /// Writes the first `LANES` values of a slice that has them.
    fn store(self, v: Self::V, to: &mut [f32]);
    /// a * b + c.
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V;
    /// a + b.
    fn add(self, a: Self::V, b: Self::V) -> Self::V;
    /// a * b.
    fn mul(self, a: Self::V, b: Self::V) -> Self::V;
    /// The larger one, lane by lane.
    fn max(self, a: Self::V, b: Self::V) -> Self::V;
}

/// Work that is written once for all instruction sets. `run` and all it calls must be `#[inline(always)]`.
pub trait Kernel {
    /// Does the work.
    fn run<S: Simd>(self, simd: S);
}

/// Plain arrays: SSE2 or NEON, or whatever the compiler makes of them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable;

impl Simd for Portable {
    type V = [f32; 4];
    type Wide = Self;
    const LANES: usize = 4;
    const ACCUMULATORS: usize = 8;

    #[inline(always)]
    fn wide(self) -> Self {
        self
    }
    #[inline(always)]
    fn splat(self, value: f32) -> Self::V {
        [value; 4]
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> Self::V {
        *from.first_chunk().expect("a vector")
    }
    #[inline(always)]
    fn store(self, v: Self::V, to: &mut [f32]) {
        *to.first_chunk_mut().expect("a vector") = v;
    }
    #[inline(always)]
    fn mul_add(self, a: Self::V, b: Self::V, c: Self::V) -> Self::V {
        // Where the target has no fused instruction, `f32::mul_add` is a slow call.
        let fused = cfg!(any(target_feature = "fma", target_arch = "aarch64"));
        let one = |i: usize| if fused { a[i].mul_add(b[i], c[i]) } else { a[i] * b[i] + c[i] };
        [one(0), one(1), one(2), one(3)]
    }
    #[inline(always)]
    fn add(self, a: Self::V, b: Self::V) -> Self::V {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
    }
    #[inline(always)]
    fn mul(self, a: Self::V, b: Self::V) -> Self::V {
        [a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]]
    }
    #[inline(always)]
    fn max(self, a: Self::V, b: Self::V) -> Self::V {
        let one = |i: usize| if a[i] > b[i] { a[i] } else { b[i] };
        [one(0), one(1), one(2), one(3)]
    }
}
