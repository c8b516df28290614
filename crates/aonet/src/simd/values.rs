//! Vectors of one value in every lane, each beside the token of its instruction set. [`super::lanes`] and [`super::integers`] have
//! their operators.

use crate::simd::Simd;

/// A float in every lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct F<S: Simd>(pub(super) S, pub(super) S::F);

/// A condition in every lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mask<S: Simd>(pub(super) S, pub(super) S::M);

/// An integer in every lane; it wraps around.
#[derive(Debug, Clone, Copy)]
pub(crate) struct U<S: Simd>(pub(super) S, pub(super) S::U);
