//! Multiplications that wait for nothing: what convolutions are measured against.

use super::dot::{Dot, DotKernel};
use super::precision::Arithmetic;
use super::session::Options;
use crate::error::Result;
use crate::simd::Simd;
use std::hint::black_box;

/// Sums that do not wait for one another: as many as hide the latency of a multiplication (4 cycles, two of them begun in
/// each) and leave registers for the operands at every level.
const SUMS: usize = 12;

/// Multiplies and adds in registers, `rounds` times each of a dozen sums, on the calling thread; returns the number of
/// operations, two for each product. For whoever has a clock: what instructions and precision allow at most.
///
/// # Errors
/// When the machine does not have the instructions.
pub fn multiply_add(options: Options, rounds: u32) -> Result<f64> {
    let mut operations = 0.0;
    let arithmetic = Arithmetic::new(options.level, options.precision)?;
    arithmetic.run(MultiplyAdd { rounds, operations: &mut operations });
    Ok(operations)
}

struct MultiplyAdd<'a> {
    rounds: u32,
    operations: &'a mut f64,
}

impl DotKernel for MultiplyAdd<'_> {
    #[inline(always)]
    fn run<D: Dot>(self, dot: D) {
        let (activations, weights) = (dot.splat(black_box(0.5)), dot.splat(black_box(0.25)));
        // Different values, unknown to the compiler: equal sums would be one.
        let mut sums = [dot.zero(); SUMS];
        for (i, sum) in sums.iter_mut().enumerate() {
            *sum = dot.add(dot.splat(black_box(i as f32)), weights, *sum);
        }
        for _ in 0..self.rounds {
            for sum in &mut sums {
                *sum = dot.add(activations, weights, *sum);
            }
        }
        let (simd, mut last) = (dot.simd(), vec![0.0; D::Simd::LANES]);
        for sum in sums {
            simd.store(dot.finish(sum, simd.splat(1.0), simd.splat(0.0)), black_box(&mut last));
        }
        *self.operations = f64::from(self.rounds) * (2 * SUMS * D::Simd::LANES * D::PACKED) as f64;
    }
}

#[cfg(test)]
mod tests {
    use super::super::Precision;
    use super::*;
    use crate::simd::Level;

    #[test]
    fn wider_vectors_and_narrower_numbers_are_more_operations() {
        let count = |level, precision| multiply_add(Options { threads: 1, level, precision }, 3).unwrap();
        assert_eq!(count(Level::Portable, Precision::F32), (3 * 2 * SUMS * 4) as f64);
        let numbers = |precision| match precision {
            Precision::F32 => 1,
            Precision::Bf16 => 2,
            Precision::Int8 => 4,
        };
        let f32 = count(Level::best(), Precision::F32);
        for precision in Precision::available() {
            assert_eq!(count(Level::best(), precision), f32 * f64::from(numbers(precision)), "{precision}");
        }
        let bf16 = Options { threads: 1, level: Level::Portable, precision: Precision::Bf16 };
        assert!(multiply_add(bf16, 1).is_err());
    }
}
