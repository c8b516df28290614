//! What the instruction sets of x86-64 share.
#![allow(unsafe_code, reason = "vector instructions")]

use super::operations::{MAX_LANES, Simd};
use std::arch::x86_64::*;
use std::hint::black_box;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Implements operations by one expression of instructions each.
macro_rules! by_instruction {
    ($($name:ident($($arg:ident: $from:ident),+) -> $to:ident = $value:expr;)+) => {
        $(#[inline(always)]
        fn $name(self, $($arg: Self::$from),+) -> Self::$to {
            // SAFETY: `self` exists only if the instructions do.
            unsafe { $value }
        })+
    };
}
pub(super) use by_instruction;

/// Instructions with two ways to gather. Both read the same values.
pub(super) trait Gather: Simd {
    /// [`Simd::gather`] by the instruction for it.
    fn gather_by_instruction(self, values: &[f32], at: Self::U) -> Self::F;
    /// [`Simd::gather`] by one load for each value.
    fn gather_by_loads(self, values: &[f32], at: Self::U) -> Self::F;
}

/// Which of two ways to gather is faster on this processor: by loads, until it is measured.
// docs/decisions/simd.md has the times.
pub(super) struct FasterGather {
    measured: Once,
    by_instruction: AtomicBool,
}

impl FasterGather {
    pub(super) const fn new() -> Self {
        Self { measured: Once::new(), by_instruction: AtomicBool::new(false) }
    }

    /// Asks whether the instruction is faster, the first time only.
    pub(super) fn measure(&self, instruction_is_faster: impl FnOnce() -> bool) {
        self.measured.call_once(|| self.by_instruction.store(instruction_is_faster(), Ordering::Relaxed));
    }

    #[inline(always)]
    pub(super) fn gather<S: Gather>(&self, simd: S, values: &[f32], at: S::U) -> S::F {
        match self.by_instruction.load(Ordering::Relaxed) {
            true => simd.gather_by_instruction(values, at),
            false => simd.gather_by_loads(values, at),
        }
    }
}

/// Whether gathers from the first cache take less time by the instruction: the least times of several runs.
#[inline(always)]
pub(super) fn instruction_is_faster<S: Gather>(simd: S) -> bool {
    const RUNS: usize = 6;
    const ROUNDS: u32 = 200;
    let values = black_box([1.0; 1 << 10]);
    let within = simd.splat_u(values.len() as u32 - 1);
    let mut least = [Duration::MAX; 2];
    for run in 0..2 * RUNS {
        let start = Instant::now();
        let (mut sum, mut at) = (simd.splat(0.0), simd.splat_u(black_box(5)));
        for round in 0..ROUNDS {
            at = simd.and_u(simd.add_u(at, simd.splat_u(37 * round)), within);
            let found = match run % 2 {
                0 => simd.gather_by_instruction(&values, at),
                _ => simd.gather_by_loads(&values, at),
            };
            sum = simd.add(sum, found);
        }
        let mut to = [0.0; MAX_LANES];
        simd.store(sum, black_box(&mut to));
        least[run % 2] = least[run % 2].min(start.elapsed());
    }
    least[0] < least[1]
}

/// Loads four values by index.
///
/// # Safety
/// The indices must be inside of the memory that `from` points to.
#[inline(always)]
pub(super) unsafe fn four(from: *const f32, at: &[u32]) -> __m128 {
    // SAFETY: every machine has these instructions; the caller's promise.
    unsafe {
        let [a, b, c, d] = [at[0] as usize, at[1] as usize, at[2] as usize, at[3] as usize];
        let (a, b) = (_mm_load_ss(from.add(a)), _mm_load_ss(from.add(b)));
        let (c, d) = (_mm_load_ss(from.add(c)), _mm_load_ss(from.add(d)));
        _mm_movelh_ps(_mm_unpacklo_ps(a, b), _mm_unpacklo_ps(c, d))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{avx2::Avx2, avx512::Avx512};
    use super::*;

    #[inline(always)]
    fn both<S: Gather>(simd: S, values: &[f32], indices: &[u32; MAX_LANES]) -> [[f32; MAX_LANES]; 2] {
        let mut found = [[0.0; MAX_LANES]; 2];
        let bits = indices.map(f32::from_bits);
        for first in (0..MAX_LANES).step_by(S::LANES) {
            let at = simd.bits(simd.load(&bits[first..]));
            simd.store(simd.gather_by_instruction(values, at), &mut found[0][first..]);
            simd.store(simd.gather_by_loads(values, at), &mut found[1][first..]);
        }
        found
    }

    #[target_feature(enable = "avx512f")]
    fn both_of_avx512(simd: Avx512, values: &[f32], indices: &[u32; MAX_LANES]) -> [[f32; MAX_LANES]; 2] {
        both(simd, values, indices)
    }

    #[target_feature(enable = "avx2,fma")]
    fn both_of_avx2(simd: Avx2, values: &[f32], indices: &[u32; MAX_LANES]) -> [[f32; MAX_LANES]; 2] {
        both(simd, values, indices)
    }

    #[test]
    fn both_ways_gather_the_same_values() {
        let values: Vec<f32> = (0..300).map(|i| i as f32).collect();
        let edges = [299, 300, u32::MAX];
        let indices =
            std::array::from_fn(|i| if i % 5 == 4 { edges[i / 5 % edges.len()] } else { i as u32 * 9 });
        let expected = indices.map(|i| i.min(299) as f32);
        if let Some(simd) = Avx512::detect() {
            // SAFETY: the processor has the instructions.
            assert_eq!(unsafe { both_of_avx512(simd, &values, &indices) }, [expected; 2]);
        }
        if let Some(simd) = Avx2::detect() {
            // SAFETY: the processor has the instructions.
            assert_eq!(unsafe { both_of_avx2(simd, &values, &indices) }, [expected; 2]);
        }
    }
}
