//! The classic methods on graphics processors, all but NNAO.

pub(crate) mod agtao;
pub(crate) mod arcs;
pub(crate) mod bent;
pub(crate) mod denoise;
mod gtao;
mod hbao;
mod hemisphere;
mod method;
pub(crate) mod pixels;
mod pyramid;
#[cfg(feature = "gpu")]
mod session;
mod shares;
mod slices;
mod ssao;
mod ssdo;
pub(crate) mod surfels;
mod vbao;

pub use method::Method;

/// A classic method and its memory on a device, for frames of one size.
#[cfg(feature = "gpu")]
pub type ClassicSession = crate::gpu::Session<Method>;
