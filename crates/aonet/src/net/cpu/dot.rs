//! Sums of products of numbers that are packed into 32-bit words: one f32, two bf16 or four integers.
//!
//! Packed words lie in memory of f32. Copies of an f32 keep all of its bits, signalling NaN included, on every target but
//! those with x87 registers, where nothing is packed. Arithmetic would not: words are copied, loaded and nothing else.

use crate::simd::Simd;

/// One way to multiply and add. A value of an implementing type is the proof that the machine has the instructions.
pub(super) trait Dot: Copy {
    /// For everything else.
    type Simd: Simd;
    /// A vector of words.
    type Words: Copy;
    /// A sum for each of them.
    type Sums: Copy;
    /// Numbers in a word.
    const PACKED: usize;

    /// The instructions for everything else.
    fn simd(self) -> Self::Simd;
    /// The same word in all lanes.
    fn splat(self, word: f32) -> Self::Words;
    /// The first words of a slice that has a vector of them.
    fn load(self, words: &[f32]) -> Self::Words;
    /// Nothing yet.
    fn zero(self) -> Self::Sums;
    /// `sums` plus the products of all numbers of the words.
    fn add(self, activations: Self::Words, weights: Self::Words, sums: Self::Sums) -> Self::Sums;
    /// The sums as numbers: `scale` times them plus `bias`; a scale of 1 where numbers are what they stand for.
    fn finish(
        self,
        sums: Self::Sums,
        scale: <Self::Simd as Simd>::F,
        bias: <Self::Simd as Simd>::F,
    ) -> <Self::Simd as Simd>::F;
    /// Packs a vector of numbers; integers are `per_step` times the number plus `zero`, from 0 to 255.
    fn pack(self, values: <Self::Simd as Simd>::F, per_step: &[f32], zero: &[f32], words: &mut [f32]);
}

/// Work that is written once for all ways to multiply. `run` and all it calls must be `#[inline(always)]`.
pub(super) trait DotKernel {
    /// Does the work.
    fn run<D: Dot>(self, dot: D);
}

/// A number a word, nothing rounded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Exact<S>(pub(super) S);

impl<S: Simd> Dot for Exact<S> {
    type Simd = S;
    type Words = S::F;
    type Sums = S::F;
    const PACKED: usize = 1;

    #[inline(always)]
    fn simd(self) -> S {
        self.0
    }
    #[inline(always)]
    fn splat(self, word: f32) -> S::F {
        self.0.splat(word)
    }
    #[inline(always)]
    fn load(self, words: &[f32]) -> S::F {
        self.0.load(words)
    }
    #[inline(always)]
    fn zero(self) -> S::F {
        self.0.splat(0.0)
    }
    #[inline(always)]
    fn add(self, activations: S::F, weights: S::F, sums: S::F) -> S::F {
        self.0.mul_add(activations, weights, sums)
    }
    #[inline(always)]
    fn finish(self, sums: S::F, _: S::F, bias: S::F) -> S::F {
        self.0.add(sums, bias)
    }
    #[inline(always)]
    fn pack(self, values: S::F, _: &[f32], _: &[f32], words: &mut [f32]) {
        self.0.store(values, words);
    }
}
