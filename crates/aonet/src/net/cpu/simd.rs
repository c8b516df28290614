//! Vectors of f32, one source for every instruction set.
#![allow(unsafe_code, reason = "vector instructions")]

/// A set of vector instructions. A value of an implementing type is the proof that the machine has them.
pub(super) trait Simd: Copy {
    /// `LANES` values.
    type V: Copy;
    /// Values in a vector.
    const LANES: usize;
    /// Vectors that a loop can accumulate into, leaving registers for its operands.
    const ACCUMULATORS: usize;

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
pub(super) trait Kernel {
    /// Does the work.
    fn run<S: Simd>(self, simd: S);
}

/// Plain arrays: SSE2 or NEON, or whatever the compiler makes of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Portable;

impl Simd for Portable {
    type V = [f32; 4];
    const LANES: usize = 4;
    const ACCUMULATORS: usize = 8;

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

#[cfg(target_arch = "x86_64")]
pub(super) mod x86 {
    use super::{Kernel, Simd};
    use std::arch::x86_64::*;

    /// AVX2 and FMA.
    #[derive(Debug, Clone, Copy)]
    pub(in super::super) struct Avx2(());

    /// AVX-512F.
    #[derive(Debug, Clone, Copy)]
    pub(in super::super) struct Avx512(());

    impl Avx2 {
        pub(in super::super) fn detect() -> Option<Self> {
            (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")).then_some(Self(()))
        }

        pub(in super::super) fn run(self, kernel: impl Kernel) {
            #[target_feature(enable = "avx2,fma")]
            fn with_features(simd: Avx2, kernel: impl Kernel) {
                kernel.run(simd);
            }
            // SAFETY: `self` exists only if `detect` found the features.
            unsafe { with_features(self, kernel) }
        }
    }

    impl Avx512 {
        pub(in super::super) fn detect() -> Option<Self> {
            is_x86_feature_detected!("avx512f").then_some(Self(()))
        }

        pub(in super::super) fn run(self, kernel: impl Kernel) {
            #[target_feature(enable = "avx512f")]
            fn with_features(simd: Avx512, kernel: impl Kernel) {
                kernel.run(simd);
            }
            // SAFETY: `self` exists only if `detect` found the feature.
            unsafe { with_features(self, kernel) }
        }
    }

    /// Implements [`Simd`] for a vector type from its intrinsics.
    macro_rules! simd {
        ($name:ty, $v:ty, $lanes:literal, $accumulators:literal,
         $set1:ident, $load:ident, $store:ident, $fmadd:ident, $add:ident, $mul:ident, $max:ident) => {
            impl Simd for $name {
                type V = $v;
                const LANES: usize = $lanes;
                const ACCUMULATORS: usize = $accumulators;

                #[inline(always)]
                fn splat(self, value: f32) -> $v {
                    // SAFETY: `self` exists only if the instructions do.
                    unsafe { $set1(value) }
                }
                #[inline(always)]
                fn load(self, from: &[f32]) -> $v {
                    let from: &[f32; $lanes] = from.first_chunk().expect("a vector");
                    // SAFETY: `self` exists only if the instructions do; the array has all lanes.
                    unsafe { $load(from.as_ptr()) }
                }
                #[inline(always)]
                fn store(self, v: $v, to: &mut [f32]) {
                    let to: &mut [f32; $lanes] = to.first_chunk_mut().expect("a vector");
                    // SAFETY: `self` exists only if the instructions do; the array has all lanes.
                    unsafe { $store(to.as_mut_ptr(), v) }
                }
                #[inline(always)]
                fn mul_add(self, a: $v, b: $v, c: $v) -> $v {
                    // SAFETY: `self` exists only if the instructions do.
                    unsafe { $fmadd(a, b, c) }
                }
                #[inline(always)]
                fn add(self, a: $v, b: $v) -> $v {
                    // SAFETY: `self` exists only if the instructions do.
                    unsafe { $add(a, b) }
                }
                #[inline(always)]
                fn mul(self, a: $v, b: $v) -> $v {
                    // SAFETY: `self` exists only if the instructions do.
                    unsafe { $mul(a, b) }
                }
                #[inline(always)]
                fn max(self, a: $v, b: $v) -> $v {
                    // SAFETY: `self` exists only if the instructions do.
                    unsafe { $max(a, b) }
                }
            }
        };
    }

    simd!(
        Avx2,
        __m256,
        8,
        12,
        _mm256_set1_ps,
        _mm256_loadu_ps,
        _mm256_storeu_ps,
        _mm256_fmadd_ps,
        _mm256_add_ps,
        _mm256_mul_ps,
        _mm256_max_ps
    );
    simd!(
        Avx512,
        __m512,
        16,
        24,
        _mm512_set1_ps,
        _mm512_loadu_ps,
        _mm512_storeu_ps,
        _mm512_fmadd_ps,
        _mm512_add_ps,
        _mm512_mul_ps,
        _mm512_max_ps
    );
}
