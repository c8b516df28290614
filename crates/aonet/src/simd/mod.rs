//! Vector instructions: one source for every instruction set, chosen at run time.
//!
//! A session chooses its instructions by a [`Level`]. Inside of the crate, the trait `Simd` is a token of an instruction set with its
//! vectors and operations. `lanes::F`, `integers::U` and `lanes::Mask` wrap its vectors with operators, for code that reads
//! like a shader.

pub(crate) mod aligned;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
pub(crate) mod integers;
pub(crate) mod lanes;
pub(crate) mod level;
pub(crate) mod operations;
mod pair;
mod portable;
pub(crate) mod transpose;
mod values;
pub(crate) mod vector;
#[cfg(target_arch = "x86_64")]
mod x86;

pub(crate) use level::Isa;
pub use level::Level;
pub(crate) use operations::{Kernel, MAX_LANES, PIXEL_LANES, Simd};
pub(crate) use portable::Portable;
