//! The classic methods on graphics processors, all but NNAO.

pub(crate) mod agtao;
pub(crate) mod denoise;
mod gtao;
mod hbao;
mod hemisphere;
pub(crate) mod pixels;
mod pyramid;
mod session;
mod slices;
mod ssao;
mod ssdo;
mod vbao;

pub use session::ClassicSession;
