//! Numbers as the bytes that shaders read.

use crate::gpu::options::{Kernels, Precision};
use half::f16;
use std::sync::Arc;

/// Bytes that a buffer starts with. Programs of one network share them.
pub(crate) type Contents = Arc<[u8]>;

/// Numbers and instructions to compute with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Arithmetic {
    pub(crate) precision: Precision,
    pub(crate) kernels: Kernels,
}

impl Arithmetic {
    /// 32-bit floats and what every device has.
    pub(crate) const PLAIN: Self = Self { precision: Precision::F32, kernels: Kernels::Plain };

    /// Weights in the precision of the activations.
    pub(crate) fn reals(self, values: &[f32]) -> Contents {
        match self.precision {
            Precision::F32 => floats(values),
            Precision::F16 => values.iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect(),
        }
    }
}

/// Numbers of 32 bits.
pub(crate) fn floats(values: &[f32]) -> Contents {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// Whole numbers of 32 bits.
pub(crate) fn words(values: &[u32]) -> Contents {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}
