//! What sessions on graphics processors share: devices, shaders, dispatches, and the textures and numbers of a frame.

pub(crate) mod chain;
pub(crate) mod context;
pub(crate) mod cover;
pub(crate) mod device;
pub(crate) mod image;
pub(crate) mod matrices;
#[cfg(not(target_arch = "wasm32"))]
pub(crate) mod matrix_trial;
#[cfg(not(target_arch = "wasm32"))]
mod offscreen;
pub(crate) mod options;
pub(crate) mod pass;
pub(crate) mod shader;
pub(crate) mod surface;
pub(crate) mod view;

pub use chain::Timestamps;
pub use cover::{cleared, cover_pipeline};
#[cfg(not(target_arch = "wasm32"))]
pub use device::wait;
pub use device::{Device, scoped};
pub use matrices::Matrices;
#[cfg(not(target_arch = "wasm32"))]
pub use offscreen::Offscreen;
pub use options::{DepthEncoding, Frame, Kernels, NormalEncoding, NormalSpace, Options, Precision};
pub use view::{Textures, View};
pub use wgpu;
