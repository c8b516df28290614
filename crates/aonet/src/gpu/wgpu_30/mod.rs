//! Sessions on wgpu, version 30.

pub(crate) mod chain;
pub(crate) mod context;
pub(crate) mod cover;
pub(crate) mod device;
#[cfg(not(target_arch = "wasm32"))]
pub(crate) mod matrix_trial;
#[cfg(not(target_arch = "wasm32"))]
pub(crate) mod offscreen;
pub(crate) mod pass;
pub(crate) mod view;
