//! What methods on graphics processors share: programs, shaders, and the textures and numbers of a frame.
//!
//! A method describes a [`Program`] for one size, without any graphics interface. With the feature `gpu`, a session runs it
//! on wgpu.

pub(crate) mod image;
pub(crate) mod matrices;
pub(crate) mod matrix_shader;
pub(crate) mod options;
pub mod program;
pub(crate) mod shader;
pub(crate) mod surface;
pub(crate) mod uniforms;
#[cfg(feature = "gpu")]
pub(crate) mod wgpu_30;

pub use matrices::Matrices;
pub use options::{
    BentEncoding, DepthEncoding, FrameNumbers, Kernels, Layers, NormalEncoding, NormalSpace, Precision,
    ProgramOptions, TextureEncoding,
};
pub use program::{Describe, Program, Template};
#[cfg(feature = "gpu")]
pub use wgpu;
#[cfg(feature = "gpu")]
pub use wgpu_30::chain::Timestamps;
#[cfg(feature = "gpu")]
pub use wgpu_30::device::Device;
#[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
pub use wgpu_30::offscreen::Offscreen;
#[cfg(feature = "gpu")]
pub use wgpu_30::options::Options;
#[cfg(feature = "gpu")]
pub use wgpu_30::session::Session;
#[cfg(feature = "gpu")]
pub use wgpu_30::view::{BoundFrame, FrameViews};
