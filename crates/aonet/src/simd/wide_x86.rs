//! Sixteen values in one register of AVX-512 or in two of AVX2.
#![allow(unsafe_code, reason = "vector instructions")]

use super::wide::{WIDE, Wide, last_place};
use super::x86::{Avx2, Avx512};
use std::arch::x86_64::*;

/// Implements operations by one instruction.
macro_rules! whole {
    ($($name:ident($($arg:ident: $from:ident),+) -> $to:ident = $value:expr;)+) => {
        $(#[inline(always)]
        fn $name(self, $($arg: Self::$from),+) -> Self::$to {
            // SAFETY: `self` exists only if the instructions do.
            unsafe { $value }
        })+
    };
}

/// Implements operations by one instruction for each half.
macro_rules! halves {
    ($($name:ident($($arg:ident: $from:ident),+) -> $to:ident = $value:expr;)+) => {
        $(#[inline(always)]
        fn $name(self, $($arg: Self::$from),+) -> Self::$to {
            // No closure: it would have to be inlined before its instructions can be.
            let low = {
                $(let $arg = $arg[0];)+
                // SAFETY: `self` exists only if the instructions do.
                unsafe { $value }
            };
            let high = {
                $(let $arg = $arg[1];)+
                // SAFETY: `self` exists only if the instructions do.
                unsafe { $value }
            };
            [low, high]
        })+
    };
}

impl Wide for Avx512 {
    type F = __m512;
    type U = __m512i;
    type M = __mmask16;

    #[inline(always)]
    fn splat(self, value: f32) -> __m512 {
        // SAFETY: `self` exists only if the instructions do.
        unsafe { _mm512_set1_ps(value) }
    }
    #[inline(always)]
    fn load(self, from: &[f32; WIDE]) -> __m512 {
        // SAFETY: `self` exists only if the instructions do; the array has all values.
        unsafe { _mm512_loadu_ps(from.as_ptr()) }
    }
    #[inline(always)]
    fn array(self, v: __m512) -> [f32; WIDE] {
        let mut to = [0.0; WIDE];
        // SAFETY: `self` exists only if the instructions do; the array has room for all values.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), v) };
        to
    }
    #[inline(always)]
    fn both(self, a: __mmask16, b: __mmask16) -> __mmask16 {
        a & b
    }
    #[inline(always)]
    fn either(self, a: __mmask16, b: __mmask16) -> __mmask16 {
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
    whole! {
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
        let last = self.splat_u(last_place(values));
        let from = values.as_ptr();
        let mut places = [0; WIDE];
        // SAFETY: `self` exists only if the instructions do; no place is beyond the last one.
        unsafe {
            _mm512_storeu_si512(places.as_mut_ptr().cast(), _mm512_min_epu32(at, last));
            let v = _mm512_castps128_ps512(four(from, &places[..4]));
            let v = _mm512_insertf32x4::<1>(v, four(from, &places[4..8]));
            let v = _mm512_insertf32x4::<2>(v, four(from, &places[8..12]));
            _mm512_insertf32x4::<3>(v, four(from, &places[12..]))
        }
    }
    #[inline(always)]
    fn thirds(self, triples: &[[f32; 3]; WIDE]) -> [__m512; 3] {
        // By component, what `third` takes.
        const PLACES: [[[i32; WIDE]; 2]; 3] = {
            let mut places = [[[0; WIDE]; 2]; 3];
            let mut i = 0;
            while i < 3 * WIDE {
                let (lane, c) = (i / 3, i % 3);
                let early = i < 2 * WIDE;
                places[c][0][lane] = if early { i as i32 } else { 0 };
                places[c][1][lane] = if early { lane as i32 } else { (i - WIDE) as i32 };
                i += 1;
            }
            places
        };
        let from = triples.as_flattened().as_ptr();
        // SAFETY: `self` exists only if the instructions do; the triples are three vectors.
        let parts = unsafe {
            [_mm512_loadu_ps(from), _mm512_loadu_ps(from.add(WIDE)), _mm512_loadu_ps(from.add(2 * WIDE))]
        };
        [third(self, parts, &PLACES[0]), third(self, parts, &PLACES[1]), third(self, parts, &PLACES[2])]
    }
}

/// Values of three vectors: those at the first places in the first two, then those in what that gives and the third.
#[inline(always)]
fn third(_: Avx512, [a, b, c]: [__m512; 3], [first, then]: &[[i32; WIDE]; 2]) -> __m512 {
    // SAFETY: the token exists only if the instructions do; the places are one vector each.
    unsafe {
        let early = _mm512_permutex2var_ps(a, _mm512_loadu_si512(first.as_ptr().cast()), b);
        _mm512_permutex2var_ps(early, _mm512_loadu_si512(then.as_ptr().cast()), c)
    }
}

/// Four values at places in memory.
///
/// # Safety
/// There must be values at them.
#[inline(always)]
unsafe fn four(from: *const f32, at: &[u32]) -> __m128 {
    // SAFETY: every machine has these instructions; the caller's promise.
    unsafe {
        let [a, b, c, d] = [at[0] as usize, at[1] as usize, at[2] as usize, at[3] as usize];
        let (a, b) = (_mm_load_ss(from.add(a)), _mm_load_ss(from.add(b)));
        let (c, d) = (_mm_load_ss(from.add(c)), _mm_load_ss(from.add(d)));
        _mm_movelh_ps(_mm_unpacklo_ps(a, b), _mm_unpacklo_ps(c, d))
    }
}

impl Wide for Avx2 {
    type F = [__m256; 2];
    type U = [__m256i; 2];
    type M = [__m256; 2];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::F {
        // SAFETY: `self` exists only if the instructions do.
        [unsafe { _mm256_set1_ps(value) }; 2]
    }
    #[inline(always)]
    fn load(self, from: &[f32; WIDE]) -> Self::F {
        let from = from.as_ptr();
        // SAFETY: `self` exists only if the instructions do; the array has all values.
        unsafe { [_mm256_loadu_ps(from), _mm256_loadu_ps(from.add(8))] }
    }
    #[inline(always)]
    fn array(self, v: Self::F) -> [f32; WIDE] {
        let mut to = [0.0; WIDE];
        // SAFETY: `self` exists only if the instructions do; the array has room for all values.
        unsafe {
            _mm256_storeu_ps(to.as_mut_ptr(), v[0]);
            _mm256_storeu_ps(to.as_mut_ptr().add(8), v[1]);
        }
        to
    }
    #[inline(always)]
    fn any(self, a: Self::M) -> bool {
        // SAFETY: `self` exists only if the instructions do.
        unsafe { _mm256_movemask_ps(_mm256_or_ps(a[0], a[1])) != 0 }
    }
    #[inline(always)]
    fn splat_u(self, value: u32) -> Self::U {
        // SAFETY: `self` exists only if the instructions do.
        [unsafe { _mm256_set1_epi32(value as i32) }; 2]
    }
    halves! {
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
        both(a: M, b: M) -> M = _mm256_and_ps(a, b);
        either(a: M, b: M) -> M = _mm256_or_ps(a, b);
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
    fn gather(self, values: &[f32], at: Self::U) -> Self::F {
        let last = self.splat_u(last_place(values));
        // SAFETY: `self` exists only if the instructions do; no place is beyond the last one.
        unsafe {
            let low = _mm256_i32gather_ps::<4>(values.as_ptr(), _mm256_min_epu32(at[0], last[0]));
            let high = _mm256_i32gather_ps::<4>(values.as_ptr(), _mm256_min_epu32(at[1], last[1]));
            [low, high]
        }
    }
}
