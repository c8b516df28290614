//! AVX-512's sums of packed products: BF16 and VNNI.
#![allow(unsafe_code, reason = "vector instructions")]

use super::dot::{Dot, DotKernel};
use crate::simd::Simd;
use crate::simd::avx512::Avx512;
use std::arch::x86_64::*;

/// AVX-512 BF16.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bf16(Avx512);

/// AVX-512 VNNI: activations from 0 to 255, weights from -127 to 127.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vnni(Avx512);

impl Bf16 {
    pub(super) fn detect() -> Option<Self> {
        Some(Self(Avx512::detect().filter(|_| is_x86_feature_detected!("avx512bf16"))?))
    }

    pub(super) fn run(self, kernel: impl DotKernel) {
        #[target_feature(enable = "avx512f,avx512bf16")]
        fn with_features(dot: Bf16, kernel: impl DotKernel) {
            kernel.run(dot);
        }
        // SAFETY: `self` exists only if `detect` found the features.
        unsafe { with_features(self, kernel) }
    }
}

impl Vnni {
    pub(super) fn detect() -> Option<Self> {
        Some(Self(Avx512::detect().filter(|_| is_x86_feature_detected!("avx512vnni"))?))
    }

    pub(super) fn run(self, kernel: impl DotKernel) {
        #[target_feature(enable = "avx512f,avx512vnni")]
        fn with_features(dot: Vnni, kernel: impl DotKernel) {
            kernel.run(dot);
        }
        // SAFETY: `self` exists only if `detect` found the features.
        unsafe { with_features(self, kernel) }
    }
}

/// Vectors of words as integers.
macro_rules! words {
    () => {
        type Simd = Avx512;
        type Words = __m512i;

        #[inline(always)]
        fn simd(self) -> Avx512 {
            self.0
        }
        #[inline(always)]
        fn splat(self, word: f32) -> __m512i {
            // SAFETY: `self` exists only if the instructions do.
            unsafe { _mm512_set1_epi32(word.to_bits() as i32) }
        }
        #[inline(always)]
        fn load(self, words: &[f32]) -> __m512i {
            let words: &[f32; 16] = words.first_chunk().expect("a vector");
            // SAFETY: `self` exists only if the instructions do; the array has all lanes.
            unsafe { _mm512_loadu_si512(words.as_ptr().cast()) }
        }
    };
}

impl Dot for Bf16 {
    words!();
    type Sums = __m512;
    const PACKED: usize = 2;

    #[inline(always)]
    fn zero(self) -> __m512 {
        self.0.splat(0.0)
    }
    #[inline(always)]
    fn add(self, activations: __m512i, weights: __m512i, sums: __m512) -> __m512 {
        // SAFETY: `self` exists only if the instructions do; both types are 32 numbers of 16 bits.
        unsafe {
            let (a, w) = (
                std::mem::transmute::<__m512i, __m512bh>(activations),
                std::mem::transmute::<__m512i, __m512bh>(weights),
            );
            _mm512_dpbf16_ps(sums, a, w)
        }
    }
    #[inline(always)]
    fn finish(self, sums: __m512, _: __m512, bias: __m512) -> __m512 {
        self.0.add(sums, bias)
    }
    #[inline(always)]
    fn pack(self, values: __m512, _: &[f32], _: &[f32], words: &mut [f32]) {
        let words: &mut [f32; 8] = words.first_chunk_mut().expect("half a vector");
        // SAFETY: `self` exists only if the instructions do; the array has room for 16 numbers of 16 bits.
        unsafe {
            let packed = std::mem::transmute::<__m256bh, __m256i>(_mm512_cvtneps_pbh(values));
            _mm256_storeu_si256(words.as_mut_ptr().cast(), packed);
        }
    }
}

impl Dot for Vnni {
    words!();
    type Sums = __m512i;
    const PACKED: usize = 4;

    #[inline(always)]
    fn zero(self) -> __m512i {
        // SAFETY: `self` exists only if the instructions do.
        unsafe { _mm512_setzero_si512() }
    }
    #[inline(always)]
    fn add(self, activations: __m512i, weights: __m512i, sums: __m512i) -> __m512i {
        // SAFETY: `self` exists only if the instructions do.
        unsafe { _mm512_dpbusd_epi32(sums, activations, weights) }
    }
    #[inline(always)]
    fn finish(self, sums: __m512i, scale: __m512, bias: __m512) -> __m512 {
        // SAFETY: `self` exists only if the instructions do.
        let sums = unsafe { _mm512_cvtepi32_ps(sums) };
        self.0.mul_add(sums, scale, bias)
    }
    #[inline(always)]
    fn pack(self, values: __m512, per_step: &[f32], zero: &[f32], words: &mut [f32]) {
        let words: &mut [f32; 4] = words.first_chunk_mut().expect("a quarter of a vector");
        let steps = self.0.mul_add(values, self.0.load(per_step), self.0.load(zero));
        // The instruction that narrows takes its numbers as unsigned: nothing may be below 0.
        let steps = self.0.max(steps, self.0.splat(0.0));
        // SAFETY: `self` exists only if the instructions do; the array has room for 16 bytes.
        unsafe {
            let bytes = _mm512_cvtusepi32_epi8(_mm512_cvtps_epi32(steps));
            _mm_storeu_si128(words.as_mut_ptr().cast(), bytes);
        }
    }
}
