//! Vector instructions: one source for every instruction set, chosen at run time.

pub(crate) mod integers;
mod kernel;
pub(crate) mod lanes;
mod level;
pub(crate) mod vector;
mod wide;
#[cfg(target_arch = "x86_64")]
mod wide_x86;
#[cfg(target_arch = "x86_64")]
pub(crate) mod x86;

pub(crate) use kernel::Portable;
pub use kernel::{Kernel, Simd};
pub use level::{Isa, Level};
pub use wide::{WIDE, Wide};
