//! AVX2 and AVX-512.
#![allow(unsafe_code, reason = "vector instructions")]

use crate::simd::{Kernel, Simd};
use std::arch::x86_64::*;

/// AVX2 and FMA.
#[derive(Debug, Clone, Copy)]
pub struct Avx2(());

/// AVX-512F.
#[derive(Debug, Clone, Copy)]
pub struct Avx512(());

impl Avx2 {
    pub(crate) fn detect() -> Option<Self> {
        (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")).then_some(Self(()))
    }

    pub(crate) fn run(self, kernel: impl Kernel) {
        #[target_feature(enable = "avx2,fma")]
        fn with_features(simd: Avx2, kernel: impl Kernel) {
            kernel.run(simd);
        }
        // SAFETY: `self` exists only if `detect` found the features.
        unsafe { with_features(self, kernel) }
    }
}

impl Avx512 {
    pub(crate) fn detect() -> Option<Self> {
        is_x86_feature_detected!("avx512f").then_some(Self(()))
    }

    pub(crate) fn run(self, kernel: impl Kernel) {
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
            type Wide = Self;
            const LANES: usize = $lanes;
            const ACCUMULATORS: usize = $accumulators;

            #[inline(always)]
            fn wide(self) -> Self {
                self
            }
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
