//! AVX2 and FMA: eight lanes.
#![allow(unsafe_code, reason = "vector instructions")]

use super::operations::{Kernel, Simd, last_index};
use super::x86::{FasterGather, Gather, by_instruction, four, instruction_is_faster};
use std::arch::x86_64::*;

static GATHER: FasterGather = FasterGather::new();

/// AVX2 and FMA.
#[derive(Debug, Clone, Copy)]
pub struct Avx2(());

const LANES: usize = 8;

impl Avx2 {
    pub(crate) fn detect() -> Option<Self> {
        #[target_feature(enable = "avx2,fma")]
        fn measure(simd: Avx2) -> bool {
            instruction_is_faster(simd)
        }
        let found = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        let simd = found.then_some(Self(()))?;
        // SAFETY: the processor has the instructions.
        GATHER.measure(|| unsafe { measure(simd) });
        Some(simd)
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

impl Simd for Avx2 {
    type F = __m256;
    type U = __m256i;
    type M = __m256;
    const LANES: usize = LANES;
    const ACCUMULATORS: usize = 12;

    #[inline(always)]
    fn splat(self, value: f32) -> __m256 {
        // SAFETY: `self` exists only if the instructions do.
        unsafe { _mm256_set1_ps(value) }
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> __m256 {
        let from: &[f32; LANES] = from.first_chunk().expect("a vector");
        // SAFETY: `self` exists only if the instructions do; the array has all lanes.
        unsafe { _mm256_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, v: __m256, to: &mut [f32]) {
        let to: &mut [f32; LANES] = to.first_chunk_mut().expect("a vector");
        // SAFETY: `self` exists only if the instructions do; the array has all lanes.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), v) }
    }
    #[inline(always)]
    fn any(self, a: __m256) -> bool {
        // SAFETY: `self` exists only if the instructions do.
        unsafe { _mm256_movemask_ps(a) != 0 }
    }
    #[inline(always)]
    fn splat_u(self, value: u32) -> __m256i {
        // SAFETY: `self` exists only if the instructions do.
        unsafe { _mm256_set1_epi32(value as i32) }
    }
    by_instruction! {
        add(a: F, b: F) -> F = _mm256_add_ps(a, b);
        sub(a: F, b: F) -> F = _mm256_sub_ps(a, b);
        mul(a: F, b: F) -> F = _mm256_mul_ps(a, b);
        div(a: F, b: F) -> F = _mm256_div_ps(a, b);
        mul_add(a: F, b: F, c: F) -> F = _mm256_fmadd_ps(a, b, c);
        min(a: F, b: F) -> F = _mm256_min_ps(a, b);
        max(a: F, b: F) -> F = _mm256_max_ps(a, b);
        sqrt(a: F) -> F = _mm256_sqrt_ps(a);
        inverse_sqrt(a: F) -> F = {
            // Twelve bits and a step of Newton's method.
            let y = _mm256_rsqrt_ps(a);
            let half = _mm256_mul_ps(_mm256_mul_ps(a, _mm256_set1_ps(0.5)), y);
            _mm256_mul_ps(y, _mm256_fnmadd_ps(half, y, _mm256_set1_ps(1.5)))
        };
        lt(a: F, b: F) -> M = _mm256_cmp_ps::<_CMP_LT_OQ>(a, b);
        le(a: F, b: F) -> M = _mm256_cmp_ps::<_CMP_LE_OQ>(a, b);
        and(a: M, b: M) -> M = _mm256_and_ps(a, b);
        or(a: M, b: M) -> M = _mm256_or_ps(a, b);
        not(a: M) -> M = _mm256_xor_ps(a, _mm256_castsi256_ps(_mm256_set1_epi32(-1)));
        select(m: M, a: F, b: F) -> F = _mm256_blendv_ps(b, a, m);
        add_u(a: U, b: U) -> U = _mm256_add_epi32(a, b);
        sub_u(a: U, b: U) -> U = _mm256_sub_epi32(a, b);
        mul_u(a: U, b: U) -> U = _mm256_mullo_epi32(a, b);
        lt_u(a: U, b: U) -> M = {
            // There is no comparison without a sign: a is not the larger one of the two.
            let not_less = _mm256_cmpeq_epi32(_mm256_max_epu32(a, b), a);
            _mm256_castsi256_ps(_mm256_xor_si256(not_less, _mm256_set1_epi32(-1)))
        };
        and_u(a: U, b: U) -> U = _mm256_and_si256(a, b);
        or_u(a: U, b: U) -> U = _mm256_or_si256(a, b);
        shl_u(a: U, by: U) -> U = _mm256_sllv_epi32(a, by);
        shr_u(a: U, by: U) -> U = _mm256_srlv_epi32(a, by);
        bits(a: F) -> U = _mm256_castps_si256(a);
        float_of_bits(a: U) -> F = _mm256_castsi256_ps(a);
        round(a: F) -> U = _mm256_cvtps_epi32(a);
        float(a: U) -> F = _mm256_cvtepi32_ps(a);
    }
    #[inline(always)]
    fn gather(self, values: &[f32], at: __m256i) -> __m256 {
        GATHER.gather(self, values, at)
    }
}

impl Gather for Avx2 {
    #[inline(always)]
    fn gather_by_instruction(self, values: &[f32], at: __m256i) -> __m256 {
        let last = self.splat_u(last_index(values));
        // SAFETY: `self` exists only if the instructions do; no index is beyond the last one.
        unsafe { _mm256_i32gather_ps::<4>(values.as_ptr(), _mm256_min_epu32(at, last)) }
    }

    #[inline(always)]
    fn gather_by_loads(self, values: &[f32], at: __m256i) -> __m256 {
        let last = self.splat_u(last_index(values));
        let from = values.as_ptr();
        let mut indices = [0; LANES];
        // SAFETY: `self` exists only if the instructions do; no index is beyond the last one.
        unsafe {
            _mm256_storeu_si256(indices.as_mut_ptr().cast(), _mm256_min_epu32(at, last));
            _mm256_set_m128(four(from, &indices[4..]), four(from, &indices[..4]))
        }
    }
}
