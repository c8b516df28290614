//! What sessions on graphics processors share: devices, shaders, dispatches, and the textures and numbers of a frame.

pub(crate) mod image;
pub(crate) mod matrices;
pub(crate) mod options;
pub(crate) mod shader;
pub(crate) mod surface;
pub(crate) mod wgpu_30;

pub use matrices::Matrices;
pub use options::{DepthEncoding, Frame, Kernels, NormalEncoding, NormalSpace, Options, Precision};
pub use wgpu;
pub use wgpu_30::chain::Timestamps;
pub use wgpu_30::cover::{cleared, cover_pipeline};
#[cfg(not(target_arch = "wasm32"))]
pub use wgpu_30::device::wait;
pub use wgpu_30::device::{Device, scoped};
#[cfg(not(target_arch = "wasm32"))]
pub use wgpu_30::offscreen::Offscreen;
pub use wgpu_30::view::{Textures, View};
