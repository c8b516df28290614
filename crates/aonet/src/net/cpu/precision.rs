//! In which numbers a session multiplies.

#[cfg(target_arch = "x86_64")]
use super::dot::Dot;
use super::dot::{DotKernel, Exact};
use crate::error::{Error, Result};
use crate::simd::{Isa, Level};
use crate::simd::{Kernel, Simd};

/// The numbers that convolutions multiply. Sums, and everything between convolutions, are f32 (or exact).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// Nothing is rounded: every machine.
    #[default]
    F32,
    /// Inputs and weights are rounded to bfloat16: AVX-512 BF16.
    Bf16,
    /// Inputs are rounded to 256 steps a channel and weights to 255 an output: AVX-512 VNNI, and a model that knows its
    /// ranges ([`Model::ranges`](crate::net::Model::ranges)).
    Int8,
}

impl Precision {
    /// The fastest one of this machine that costs no quality: bf16 where there are instructions for it, else f32. On the
    /// validation frames of the shipped networks, bf16 loses less than 0.01 dB and integers up to 0.03 dB.
    pub fn fastest() -> Self {
        Self::available().filter(|precision| *precision != Self::Int8).last().unwrap_or_default()
    }

    /// The precisions that this machine has instructions for.
    pub fn available() -> impl Iterator<Item = Self> {
        let has = |precision: &Self| Arithmetic::new(Level::best(), *precision).is_ok();
        [Self::F32, Self::Bf16, Self::Int8].into_iter().filter(has)
    }
}

impl std::fmt::Display for Precision {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::F32 => "f32",
            Self::Bf16 => "bf16",
            Self::Int8 => "int8",
        })
    }
}

impl std::str::FromStr for Precision {
    type Err = Error;
    fn from_str(name: &str) -> Result<Self> {
        let all = [Self::F32, Self::Bf16, Self::Int8];
        let found = all.into_iter().find(|precision| precision.to_string() == name);
        found.ok_or_else(|| Error::value("precision", "f32, bf16 or int8", name))
    }
}

/// A precision and a level that this machine has been found to have.
#[derive(Debug, Clone, Copy)]
pub(super) enum Arithmetic {
    /// [`Precision::F32`].
    F32(Isa),
    /// [`Precision::Bf16`].
    #[cfg(target_arch = "x86_64")]
    Bf16(super::dot_x86::Bf16),
    /// [`Precision::Int8`].
    #[cfg(target_arch = "x86_64")]
    Int8(super::dot_x86::Vnni),
}

impl Arithmetic {
    /// # Errors
    /// When the machine has no instructions for them.
    pub(super) fn new(level: Level, precision: Precision) -> Result<Self> {
        #[cfg(target_arch = "x86_64")]
        use super::dot_x86::{Bf16, Vnni};
        let isa = Isa::new(level)?;
        match (precision, level) {
            (Precision::F32, _) => Some(Self::F32(isa)),
            #[cfg(target_arch = "x86_64")]
            (Precision::Bf16, Level::Avx512) => Bf16::detect().map(Self::Bf16),
            #[cfg(target_arch = "x86_64")]
            (Precision::Int8, Level::Avx512) => Vnni::detect().map(Self::Int8),
            (Precision::Bf16 | Precision::Int8, _) => None,
        }
        .ok_or_else(|| {
            let expected = match precision {
                Precision::F32 => "any machine",
                Precision::Bf16 => "AVX-512 with BF16 for bf16",
                Precision::Int8 => "AVX-512 with VNNI for int8",
            };
            Error::value("vector instructions", expected, format!("a machine or level without: {level:?}"))
        })
    }

    /// The instructions for everything but products.
    pub(super) fn isa(self) -> Isa {
        match self {
            Self::F32(isa) => isa,
            #[cfg(target_arch = "x86_64")]
            Self::Bf16(dot) => Isa::Avx512(dot.simd()),
            #[cfg(target_arch = "x86_64")]
            Self::Int8(dot) => Isa::Avx512(dot.simd()),
        }
    }

    /// Words in a vector: the size of a block of channels.
    pub(super) fn lanes(self) -> usize {
        self.isa().lanes()
    }

    /// Vectors that a loop can accumulate into.
    pub(super) fn accumulators(self) -> usize {
        self.isa().accumulators()
    }

    /// Numbers in a word.
    pub(super) fn packed(self) -> usize {
        match self {
            Self::F32(_) => 1,
            #[cfg(target_arch = "x86_64")]
            Self::Bf16(_) => 2,
            #[cfg(target_arch = "x86_64")]
            Self::Int8(_) => 4,
        }
    }

    /// Runs a kernel with these instructions, which are not those of integers: no code is made for them.
    pub(super) fn run_floats(self, kernel: impl DotKernel) {
        match self {
            Self::F32(isa) => isa.run(OfExact(kernel)),
            #[cfg(target_arch = "x86_64")]
            Self::Bf16(dot) => dot.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Int8(_) => unreachable!("integers where there are only floats"),
        }
    }

    /// Runs a kernel with these instructions.
    pub(super) fn run(self, kernel: impl DotKernel) {
        match self {
            Self::F32(isa) => isa.run(OfExact(kernel)),
            #[cfg(target_arch = "x86_64")]
            Self::Bf16(dot) => dot.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Int8(dot) => dot.run(kernel),
        }
    }
}

struct OfExact<K>(K);

impl<K: DotKernel> Kernel for OfExact<K> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        self.0.run(Exact(simd));
    }
}
