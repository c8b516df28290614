//! The runtime for graphics processors: a [`Session`] encodes a model's passes into a command encoder of the caller.
//!
//! Activations are blocks of four channels, each an image of vectors, in 32- or 16-bit floats. What is fused is what
//! [`Plan`](super::plan::Plan) says: partition into the features, resampling and concatenation into the convolution that
//! reads them, the head and its kernels into one dispatch. All of it is WGSL within the default limits of WebGPU.

mod agtao;
mod context;
mod conv;
mod device;
mod features;
mod head;
mod image;
mod memory;
mod network;
#[cfg(not(target_arch = "wasm32"))]
mod offscreen;
mod options;
mod pass;
mod session;
mod shader;
#[cfg(test)]
mod tests;
mod view;

pub use device::Device;
#[cfg(not(target_arch = "wasm32"))]
pub use offscreen::Offscreen;
pub use options::{DepthEncoding, Frame, NormalEncoding, NormalSpace, Options, Precision};
pub use session::{Session, Timestamps};
pub use view::{Textures, View};
pub use wgpu;
