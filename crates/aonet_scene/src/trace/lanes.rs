//! Eight floats at once: one source for every instruction set, so that all give the same hits.
//!
//! Each operation rounds as IEEE 754 says, `mul_add` and `mul_sub` once; `min` and `max` return `b` where either is NaN.
#![allow(unsafe_code, reason = "vector instructions")]

/// Children of a node and triangles of a leaf.
pub(super) const WIDTH: usize = 8;

/// Eight floats, aligned for vector loads.
#[repr(C, align(32))]
#[derive(Debug, Clone, Copy)]
pub(super) struct Row(pub(super) [f32; WIDTH]);

/// Eight lanes of `f32` and comparisons between them.
///
/// # Safety
/// Functions may only run if the machine has the implementation's instruction set.
pub(super) trait Lanes: Copy {
    /// One truth value a lane.
    type Mask: Copy;
    unsafe fn splat(x: f32) -> Self;
    unsafe fn load(row: &Row) -> Self;
    unsafe fn store(self) -> Row;
    unsafe fn sub(self, b: Self) -> Self;
    unsafe fn add(self, b: Self) -> Self;
    unsafe fn mul(self, b: Self) -> Self;
    unsafe fn div(self, b: Self) -> Self;
    /// `self * b + c`, rounded once.
    unsafe fn mul_add(self, b: Self, c: Self) -> Self;
    /// `self * b - c`, rounded once.
    unsafe fn mul_sub(self, b: Self, c: Self) -> Self;
    unsafe fn min(self, b: Self) -> Self;
    unsafe fn max(self, b: Self) -> Self;
    /// Magnitude of `self`, sign of `self` times sign of `sign`.
    unsafe fn xor_sign(self, sign: Self) -> Self;
    unsafe fn abs(self) -> Self;
    unsafe fn le(self, b: Self) -> Self::Mask;
    unsafe fn lt(self, b: Self) -> Self::Mask;
    unsafe fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Bit `i` is lane `i`.
    unsafe fn bits(mask: Self::Mask) -> u32;
    /// Bit `i` of word `k` is bit `k` of byte `i`.
    unsafe fn transpose(bytes: &[u8; 64]) -> [u64; WIDTH];
}

/// Works everywhere.
#[derive(Clone, Copy)]
pub(super) struct Scalar([f32; WIDTH]);

impl Scalar {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }

    #[inline(always)]
    fn compare(self, b: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        (0..WIDTH).fold(0, |m, i| m | u32::from(f(self.0[i], b.0[i])) << i)
    }
}

impl Lanes for Scalar {
    type Mask = u32;
    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        Self([x; WIDTH])
    }
    #[inline(always)]
    unsafe fn load(row: &Row) -> Self {
        Self(row.0)
    }
    #[inline(always)]
    unsafe fn store(self) -> Row {
        Row(self.0)
    }
    #[inline(always)]
    unsafe fn sub(self, b: Self) -> Self {
        self.zip(b, |a, b| a - b)
    }
    #[inline(always)]
    unsafe fn add(self, b: Self) -> Self {
        self.zip(b, |a, b| a + b)
    }
    #[inline(always)]
    unsafe fn mul(self, b: Self) -> Self {
        self.zip(b, |a, b| a * b)
    }
    #[inline(always)]
    unsafe fn div(self, b: Self) -> Self {
        self.zip(b, |a, b| a / b)
    }
    #[inline(always)]
    unsafe fn mul_add(self, b: Self, c: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].mul_add(b.0[i], c.0[i])))
    }
    #[inline(always)]
    unsafe fn mul_sub(self, b: Self, c: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].mul_add(b.0[i], -c.0[i])))
    }
    #[inline(always)]
    unsafe fn min(self, b: Self) -> Self {
        self.zip(b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    unsafe fn max(self, b: Self) -> Self {
        self.zip(b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    unsafe fn xor_sign(self, sign: Self) -> Self {
        self.zip(sign, |a, s| f32::from_bits(a.to_bits() ^ (s.to_bits() & 0x8000_0000)))
    }
    #[inline(always)]
    unsafe fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    unsafe fn le(self, b: Self) -> u32 {
        self.compare(b, |a, b| a <= b)
    }
    #[inline(always)]
    unsafe fn lt(self, b: Self) -> u32 {
        self.compare(b, |a, b| a < b)
    }
    #[inline(always)]
    unsafe fn and(a: u32, b: u32) -> u32 {
        a & b
    }
    #[inline(always)]
    unsafe fn bits(mask: u32) -> u32 {
        mask
    }
    #[inline(always)]
    unsafe fn transpose(bytes: &[u8; 64]) -> [u64; WIDTH] {
        std::array::from_fn(|k| bytes.iter().rev().fold(0, |word, byte| word << 1 | u64::from(byte >> k & 1)))
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{Lanes, Row};
    use std::arch::x86_64::*;

    /// AVX2 and FMA.
    #[derive(Clone, Copy)]
    pub(in crate::trace) struct Avx2(__m256);

    // SAFETY of every block below: the trait's contract, AVX2 and FMA are there; `Row` is 32-byte aligned.
    #[allow(clippy::undocumented_unsafe_blocks, reason = "one contract for all, stated above")]
    impl Lanes for Avx2 {
        type Mask = __m256;
        #[inline(always)]
        unsafe fn splat(x: f32) -> Self {
            Self(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        unsafe fn load(row: &Row) -> Self {
            Self(unsafe { _mm256_load_ps(row.0.as_ptr()) })
        }
        #[inline(always)]
        unsafe fn store(self) -> Row {
            let mut row = Row([0.0; 8]);
            unsafe { _mm256_store_ps(row.0.as_mut_ptr(), self.0) };
            row
        }
        #[inline(always)]
        unsafe fn sub(self, b: Self) -> Self {
            Self(unsafe { _mm256_sub_ps(self.0, b.0) })
        }
        #[inline(always)]
        unsafe fn add(self, b: Self) -> Self {
            Self(unsafe { _mm256_add_ps(self.0, b.0) })
        }
        #[inline(always)]
        unsafe fn mul(self, b: Self) -> Self {
            Self(unsafe { _mm256_mul_ps(self.0, b.0) })
        }
        #[inline(always)]
        unsafe fn div(self, b: Self) -> Self {
            Self(unsafe { _mm256_div_ps(self.0, b.0) })
        }
        #[inline(always)]
        unsafe fn mul_add(self, b: Self, c: Self) -> Self {
            Self(unsafe { _mm256_fmadd_ps(self.0, b.0, c.0) })
        }
        #[inline(always)]
        unsafe fn mul_sub(self, b: Self, c: Self) -> Self {
            Self(unsafe { _mm256_fmsub_ps(self.0, b.0, c.0) })
        }
        #[inline(always)]
        unsafe fn min(self, b: Self) -> Self {
            Self(unsafe { _mm256_min_ps(self.0, b.0) })
        }
        #[inline(always)]
        unsafe fn max(self, b: Self) -> Self {
            Self(unsafe { _mm256_max_ps(self.0, b.0) })
        }
        #[inline(always)]
        unsafe fn xor_sign(self, sign: Self) -> Self {
            Self(unsafe { _mm256_xor_ps(self.0, _mm256_and_ps(sign.0, _mm256_set1_ps(-0.0))) })
        }
        #[inline(always)]
        unsafe fn abs(self) -> Self {
            Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
        }
        #[inline(always)]
        unsafe fn le(self, b: Self) -> __m256 {
            unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0) }
        }
        #[inline(always)]
        unsafe fn lt(self, b: Self) -> __m256 {
            unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, b.0) }
        }
        #[inline(always)]
        unsafe fn and(a: __m256, b: __m256) -> __m256 {
            unsafe { _mm256_and_ps(a, b) }
        }
        #[inline(always)]
        unsafe fn bits(mask: __m256) -> u32 {
            unsafe { _mm256_movemask_ps(mask) as u32 }
        }
        #[inline(always)]
        unsafe fn transpose(bytes: &[u8; 64]) -> [u64; 8] {
            unsafe {
                let half = |i: usize| _mm256_loadu_si256(bytes.as_ptr().add(32 * i).cast());
                let (mut lo, mut hi) = (half(0), half(1));
                let mut words = [0; 8];
                for k in (0..8).rev() {
                    let bits = |x| u64::from(_mm256_movemask_epi8(x) as u32);
                    words[k] = bits(lo) | bits(hi) << 32;
                    (lo, hi) = (_mm256_add_epi8(lo, lo), _mm256_add_epi8(hi, hi));
                }
                words
            }
        }
    }
}
