//! Programs on wgpu, version 30.

pub mod bind;
pub(crate) mod chain;
pub(crate) mod cover;
pub(crate) mod device;
pub(crate) mod errors;
pub(crate) mod host;
mod matrices;
#[cfg(not(target_arch = "wasm32"))]
pub(crate) mod matrix_trial;
#[cfg(not(target_arch = "wasm32"))]
pub(crate) mod offscreen;
pub(crate) mod options;
pub(crate) mod session;
pub(crate) mod view;
