//! Which vector instructions a session uses.

use crate::error::{Error, Result};
use crate::simd::{Kernel, Portable, Simd, pair::Paired};
#[cfg(target_arch = "x86_64")]
use crate::simd::{avx2::Avx2, avx512::Avx512};

/// A set of vector instructions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Four lanes: SSE2 or NEON where the target has them, else arrays.
    Portable,
    /// AVX2 and FMA: eight lanes.
    Avx2,
    /// AVX-512F: sixteen lanes.
    Avx512,
}

impl Level {
    /// The levels that this machine has, slowest first.
    pub fn available() -> impl Iterator<Item = Self> {
        [Self::Portable, Self::Avx2, Self::Avx512].into_iter().filter(|level| Isa::new(*level).is_ok())
    }

    /// The fastest level that this machine has.
    pub fn best() -> Self {
        Self::available().last().unwrap_or(Self::Portable)
    }
}

/// A level that this machine has been found to have.
#[derive(Debug, Clone, Copy)]
pub enum Isa {
    /// [`Level::Portable`].
    Portable,
    /// [`Level::Avx2`].
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// [`Level::Avx512`].
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

impl Isa {
    /// The level's instructions.
    ///
    /// # Errors
    /// When the machine does not have the level.
    pub fn new(level: Level) -> Result<Self> {
        match level {
            Level::Portable => Some(Self::Portable),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => Avx2::detect().map(Self::Avx2),
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => Avx512::detect().map(Self::Avx512),
            #[cfg(not(target_arch = "x86_64"))]
            Level::Avx2 | Level::Avx512 => None,
        }
        .ok_or_else(|| Error::value("vector instructions", "a level of this machine", format!("{level:?}")))
    }

    /// Values in a vector: the size of a block of channels.
    pub(crate) fn lanes(self) -> usize {
        match self {
            Self::Portable => Portable::LANES,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => Avx2::LANES,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => Avx512::LANES,
        }
    }

    /// Vectors that a loop can accumulate into.
    pub fn accumulators(self) -> usize {
        match self {
            Self::Portable => Portable::ACCUMULATORS,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => Avx2::ACCUMULATORS,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => Avx512::ACCUMULATORS,
        }
    }

    /// Runs a kernel that works on pixels one by one, with sixteen lanes at every level.
    pub(crate) fn run_on_pixels(self, kernel: impl Kernel) {
        match self {
            Self::Portable => Paired(Paired(kernel)).run(Portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => simd.run(Paired(kernel)),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => simd.run(kernel),
        }
    }

    /// Runs a kernel with long chains of dependent operations for every pixel, on pairs of vectors: 8, 16 or 32 lanes.
    // The chains of two vectors hide each other's latency. docs/decisions/simd.md has the times.
    pub(crate) fn run_on_chains(self, kernel: impl Kernel) {
        match self {
            Self::Portable => Paired(kernel).run(Portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => simd.run(Paired(kernel)),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => simd.run(Paired(kernel)),
        }
    }

    /// Runs a kernel with these instructions.
    pub fn run(self, kernel: impl Kernel) {
        match self {
            Self::Portable => kernel.run(Portable),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => simd.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => simd.run(kernel),
        }
    }
}
