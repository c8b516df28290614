//! AVX-512F: sixteen lanes.
#![allow(unsafe_code, reason = "vector instructions")]

use super::operations::{Kernel, Simd, last_index};
use super::transpose;
use super::x86::{FasterGather, Gather, by_instruction, four, instruction_is_faster};
use std::arch::x86_64::*;

static GATHER: FasterGather = FasterGather::new();

/// AVX-512F.
#[derive(Debug, Clone, Copy)]
pub struct Avx512(());

const LANES: usize = 16;

impl Avx512 {
    pub(crate) fn detect() -> Option<Self> {
        #[target_feature(enable = "avx512f")]
        fn measure(simd: Avx512) -> bool {
            instruction_is_faster(simd)
        }
        let simd = is_x86_feature_detected!("avx512f").then_some(Self(()))?;
        // SAFETY: the processor has the instructions.
        GATHER.measure(|| unsafe { measure(simd) });
        Some(simd)
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

impl Simd for Avx512 {
    type F = __m512;
    type U = __m512i;
    type M = __mmask16;
    const LANES: usize = LANES;
    const ACCUMULATORS: usize = 24;

    #[inline(always)]
    fn splat(self, value: f32) -> __m512 {
        // SAFETY: `self` exists only if the instructions do.
        unsafe { _mm512_set1_ps(value) }
    }
    #[inline(always)]
    fn load(self, from: &[f32]) -> __m512 {
        let from: &[f32; LANES] = from.first_chunk().expect("a vector");
        // SAFETY: `self` exists only if the instructions do; the array has all lanes.
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, v: __m512, to: &mut [f32]) {
        let to: &mut [f32; LANES] = to.first_chunk_mut().expect("a vector");
        // SAFETY: `self` exists only if the instructions do; the array has all lanes.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), v) }
    }
    #[inline(always)]
    fn and(self, a: __mmask16, b: __mmask16) -> __mmask16 {
        a & b
    }
    #[inline(always)]
    fn or(self, a: __mmask16, b: __mmask16) -> __mmask16 {
        a | b
    }
    #[inline(always)]
    fn not(self, a: __mmask16) -> __mmask16 {
        !a
    }
    #[inline(always)]
    fn any(self, a: __mmask16) -> bool {
        a != 0
    }
    #[inline(always)]
    fn splat_u(self, value: u32) -> __m512i {
        // SAFETY: `self` exists only if the instructions do.
        unsafe { _mm512_set1_epi32(value as i32) }
    }
    by_instruction! {
        add(a: F, b: F) -> F = _mm512_add_ps(a, b);
        sub(a: F, b: F) -> F = _mm512_sub_ps(a, b);
        mul(a: F, b: F) -> F = _mm512_mul_ps(a, b);
        div(a: F, b: F) -> F = _mm512_div_ps(a, b);
        mul_add(a: F, b: F, c: F) -> F = _mm512_fmadd_ps(a, b, c);
        min(a: F, b: F) -> F = _mm512_min_ps(a, b);
        max(a: F, b: F) -> F = _mm512_max_ps(a, b);
        sqrt(a: F) -> F = _mm512_sqrt_ps(a);
        inverse_sqrt(a: F) -> F = {
            // Fourteen bits and a step of Newton's method.
            let y = _mm512_rsqrt14_ps(a);
            let half = _mm512_mul_ps(_mm512_mul_ps(a, _mm512_set1_ps(0.5)), y);
            _mm512_mul_ps(y, _mm512_fnmadd_ps(half, y, _mm512_set1_ps(1.5)))
        };
        rough_inverse_sqrt(a: F) -> F = _mm512_rsqrt14_ps(a);
        lt(a: F, b: F) -> M = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b);
        le(a: F, b: F) -> M = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b);
        select(m: M, a: F, b: F) -> F = _mm512_mask_blend_ps(m, b, a);
        add_u(a: U, b: U) -> U = _mm512_add_epi32(a, b);
        sub_u(a: U, b: U) -> U = _mm512_sub_epi32(a, b);
        mul_u(a: U, b: U) -> U = _mm512_mullo_epi32(a, b);
        lt_u(a: U, b: U) -> M = _mm512_cmplt_epu32_mask(a, b);
        and_u(a: U, b: U) -> U = _mm512_and_si512(a, b);
        or_u(a: U, b: U) -> U = _mm512_or_si512(a, b);
        shl_u(a: U, by: U) -> U = _mm512_sllv_epi32(a, by);
        shr_u(a: U, by: U) -> U = _mm512_srlv_epi32(a, by);
        bits(a: F) -> U = _mm512_castps_si512(a);
        float_of_bits(a: U) -> F = _mm512_castsi512_ps(a);
        round(a: F) -> U = _mm512_cvtps_epi32(a);
        float(a: U) -> F = _mm512_cvtepi32_ps(a);
    }
    #[inline(always)]
    fn gather(self, values: &[f32], at: __m512i) -> __m512 {
        GATHER.gather(self, values, at)
    }
    #[inline(always)]
    fn load_fours(self, from: &[f32], at: impl Fn(usize) -> usize) -> __m512 {
        let fours = [
            transpose::four(from, at(0)),
            transpose::four(from, at(1)),
            transpose::four(from, at(2)),
            transpose::four(from, at(3)),
        ];
        // SAFETY: `self` exists only if the instructions do; each array has four values.
        unsafe {
            let v = _mm512_castps128_ps512(_mm_loadu_ps(fours[0].as_ptr()));
            let v = _mm512_insertf32x4::<1>(v, _mm_loadu_ps(fours[1].as_ptr()));
            let v = _mm512_insertf32x4::<2>(v, _mm_loadu_ps(fours[2].as_ptr()));
            _mm512_insertf32x4::<3>(v, _mm_loadu_ps(fours[3].as_ptr()))
        }
    }
    #[inline(always)]
    fn load_triples(self, triples: &[[f32; 3]]) -> [__m512; 3] {
        // By component, what `pick` takes.
        const PLACES: [[[i32; LANES]; 2]; 3] = {
            let mut places = [[[0; LANES]; 2]; 3];
            let mut i = 0;
            while i < 3 * LANES {
                let (lane, c) = (i / 3, i % 3);
                let early = i < 2 * LANES;
                places[c][0][lane] = if early { i as i32 } else { 0 };
                places[c][1][lane] = if early { lane as i32 } else { (i - LANES) as i32 };
                i += 1;
            }
            places
        };
        let triples: &[[f32; 3]; LANES] = triples.first_chunk().expect("a vector of triples");
        let from = triples.as_flattened().as_ptr();
        // SAFETY: `self` exists only if the instructions do; the triples are three vectors.
        let parts = unsafe {
            [_mm512_loadu_ps(from), _mm512_loadu_ps(from.add(LANES)), _mm512_loadu_ps(from.add(2 * LANES))]
        };
        [pick(self, parts, &PLACES[0]), pick(self, parts, &PLACES[1]), pick(self, parts, &PLACES[2])]
    }
}

impl Gather for Avx512 {
    #[inline(always)]
    fn gather_by_instruction(self, values: &[f32], at: __m512i) -> __m512 {
        let last = self.splat_u(last_index(values));
        // SAFETY: `self` exists only if the instructions do; no index is beyond the last one.
        unsafe { _mm512_i32gather_ps::<4>(_mm512_min_epu32(at, last), values.as_ptr()) }
    }

    #[inline(always)]
    fn gather_by_loads(self, values: &[f32], at: __m512i) -> __m512 {
        let last = self.splat_u(last_index(values));
        let from = values.as_ptr();
        let mut indices = [0; LANES];
        // SAFETY: `self` exists only if the instructions do; no index is beyond the last one.
        unsafe {
            _mm512_storeu_si512(indices.as_mut_ptr().cast(), _mm512_min_epu32(at, last));
            let v = _mm512_castps128_ps512(four(from, &indices[..4]));
            let v = _mm512_insertf32x4::<1>(v, four(from, &indices[4..8]));
            let v = _mm512_insertf32x4::<2>(v, four(from, &indices[8..12]));
            _mm512_insertf32x4::<3>(v, four(from, &indices[12..]))
        }
    }
}

/// Picks values of three vectors: first some of `a` and `b`, then some of those and of `c`.
#[inline(always)]
fn pick(_: Avx512, [a, b, c]: [__m512; 3], [first, then]: &[[i32; LANES]; 2]) -> __m512 {
    // SAFETY: the token exists only if the instructions do; the places are one vector each.
    unsafe {
        let early = _mm512_permutex2var_ps(a, _mm512_loadu_si512(first.as_ptr().cast()), b);
        _mm512_permutex2var_ps(early, _mm512_loadu_si512(then.as_ptr().cast()), c)
    }
}
