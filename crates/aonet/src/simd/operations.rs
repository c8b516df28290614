//! One set of operations for every instruction set: what kernels and work on pixels are written with.

use super::transpose::four;
use std::fmt::Debug;

/// Lanes of [`Isa::run_on_pixels`](super::Isa::run_on_pixels), and the most that a single vector has.
pub(crate) const PIXEL_LANES: usize = 16;
/// The most lanes that kernels work with: those of a pair of the longest vectors.
pub const MAX_LANES: usize = 2 * PIXEL_LANES;

/// A set of vector instructions. A value of an implementing type is the proof that the machine has them.
///
/// A vector holds [`Simd::LANES`] floats, integers or conditions.
// Intrinsics, one by one: where arrays were left for the compiler to turn into vectors, two fifths of the time of GTAO
// and its filter went to instructions for single lanes (`perf annotate`).
pub trait Simd: Copy + Debug {
    /// A vector of floats.
    type F: Copy + Debug;
    /// A vector of 32-bit integers; they wrap around.
    type U: Copy + Debug;
    /// A vector of conditions.
    type M: Copy + Debug;
    /// Values in a vector.
    const LANES: usize;
    /// Vectors that a loop can accumulate into, leaving registers for its operands.
    const ACCUMULATORS: usize;

    /// The same value in all lanes.
    fn splat(self, value: f32) -> Self::F;
    /// The first `LANES` values of a slice that has them.
    fn load(self, from: &[f32]) -> Self::F;
    /// Four values from each of `LANES / 4` places of a slice, given by index.
    #[inline(always)]
    fn load_fours(self, from: &[f32], at: impl Fn(usize) -> usize) -> Self::F {
        let mut all = [0.0; MAX_LANES];
        for (i, to) in all[..Self::LANES].chunks_exact_mut(4).enumerate() {
            to.copy_from_slice(four(from, at(i)));
        }
        self.load(&all)
    }
    /// Writes the first `LANES` values of a slice that has them.
    fn store(self, v: Self::F, to: &mut [f32]);
    /// Returns a + b.
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns a - b.
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns a * b.
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns a / b.
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns a * b + c, rounded once or twice.
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `a` where it is less, else `b`.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a` where it is greater, else `b`.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Square root of numbers not below 0.
    fn sqrt(self, a: Self::F) -> Self::F;
    /// One over the square root of numbers above 1e-37; the relative error is below 1e-6.
    fn inverse_sqrt(self, a: Self::F) -> Self::F;
    /// The same with a relative error below 1e-4.
    #[inline(always)]
    fn rough_inverse_sqrt(self, a: Self::F) -> Self::F {
        self.inverse_sqrt(a)
    }

    /// Whether a < b.
    fn lt(self, a: Self::F, b: Self::F) -> Self::M;
    /// Whether a <= b.
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    /// Whether both hold.
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    /// Whether one of them holds.
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// Whether it does not hold.
    fn not(self, a: Self::M) -> Self::M;
    /// Whether it holds in any lane.
    fn any(self, a: Self::M) -> bool;
    /// `a` where the condition holds, `b` elsewhere.
    fn select(self, m: Self::M, a: Self::F, b: Self::F) -> Self::F;

    /// The same integer in all lanes.
    fn splat_u(self, value: u32) -> Self::U;
    /// Returns a + b.
    fn add_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// Returns a - b.
    fn sub_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// Returns a * b.
    fn mul_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// Whether a < b, both unsigned.
    fn lt_u(self, a: Self::U, b: Self::U) -> Self::M;
    /// Bitwise and.
    fn and_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// Bitwise or.
    fn or_u(self, a: Self::U, b: Self::U) -> Self::U;
    /// Shifts left; a shift by 32 or more returns 0.
    fn shl_u(self, a: Self::U, by: Self::U) -> Self::U;
    /// Shifts right; a shift by 32 or more returns 0.
    fn shr_u(self, a: Self::U, by: Self::U) -> Self::U;
    /// The bits of floats.
    fn bits(self, a: Self::F) -> Self::U;
    /// The floats with these bits.
    fn float_of_bits(self, a: Self::U) -> Self::F;
    /// The nearest signed integers of floats in [-2^22, 2^22].
    fn round(self, a: Self::F) -> Self::U;
    /// Signed integers in [-2^22, 2^22] as floats.
    fn float(self, a: Self::U) -> Self::F;

    /// The values at these indices; an index beyond the end reads the last value.
    ///
    /// # Panics
    /// When there are no values.
    fn gather(self, values: &[f32], at: Self::U) -> Self::F;

    /// The first `LANES` triples of a slice that has them, as one vector for each of the three components.
    #[inline(always)]
    fn load_triples(self, triples: &[[f32; 3]]) -> [Self::F; 3] {
        let mut components = [[0.0; MAX_LANES]; 3];
        let triples = &triples[..Self::LANES];
        for (i, triple) in triples.iter().enumerate() {
            for c in 0..3 {
                components[c][i] = triple[c];
            }
        }
        [self.load(&components[0]), self.load(&components[1]), self.load(&components[2])]
    }
}

/// Work that is written once for all instruction sets. `run` and all it calls must be `#[inline(always)]`.
pub trait Kernel {
    /// Does the work.
    fn run<S: Simd>(self, simd: S);
}

/// The last index that a gather may read.
///
/// # Panics
/// When there are no values.
#[inline(always)]
pub(super) fn last_index(values: &[f32]) -> u32 {
    assert!(!values.is_empty(), "values to gather");
    // Vector instructions take indices as signed.
    (values.len() - 1).min(i32::MAX as usize) as u32
}
