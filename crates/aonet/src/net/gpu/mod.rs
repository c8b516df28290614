//! The runtime for graphics processors: a [`Session`] encodes a model's passes into a command encoder of the caller.
//!
//! Activations are blocks of four channels, each an image of vectors, in 32- or 16-bit floats. What is fused is what
//! [`Plan`](super::plan::Plan) says: partition into the features, resampling and concatenation into the convolution that
//! reads them, the head and its kernels into one dispatch. All of it is WGSL within the default limits of WebGPU.
//!
//! A [`ClassicSession`] is the same for the classic methods, all but NNAO.
//!
//! ```no_run
//! use aonet::net::gpu::{Frame, Options, Session, Textures, wgpu};
//! use aonet::net::{Model, shipped};
//!
//! fn once(device: &wgpu::Device, queue: &wgpu::Queue) -> aonet::Result<Session> {
//!     let model = Model::from_bytes(shipped::ANY_RADIUS)?;
//!     Session::new((device, queue), &model, (1280, 720), Options::default())
//! }
//!
//! fn frame(session: &Session, of: Textures<'_>, frame: &Frame, encoder: &mut wgpu::CommandEncoder) -> aonet::Result<()> {
//!     // A view can be kept for as long as the textures are the same.
//!     let view = session.view(of)?;
//!     session.encode(encoder, &view, frame)
//! }
//! ```

mod agtao;
mod chain;
mod classic;
mod context;
mod conv;
mod conv_matrix;
mod cover;
mod denoise;
mod device;
mod features;
mod gtao;
mod hbao;
mod head;
mod head_matrix;
mod hemisphere;
mod image;
mod matrices;
#[cfg(not(target_arch = "wasm32"))]
mod matrix_trial;
mod memory;
mod network;
#[cfg(not(target_arch = "wasm32"))]
mod offscreen;
mod options;
mod pass;
mod pixels;
mod pyramid;
mod search;
mod session;
mod shader;
mod ssao;
mod ssdo;
#[cfg(all(test, target_os = "linux"))]
mod statistics;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod valid;
mod vbao;
mod view;

pub use chain::Timestamps;
pub use classic::ClassicSession;
pub use cover::{cleared, cover_pipeline};
#[cfg(not(target_arch = "wasm32"))]
pub use device::wait;
pub use device::{Device, scoped};
pub use matrices::Matrices;
#[cfg(not(target_arch = "wasm32"))]
pub use offscreen::Offscreen;
pub use options::{DepthEncoding, Frame, Kernels, NormalEncoding, NormalSpace, Options, Precision};
pub use session::Session;
pub use view::{Textures, View};
pub use wgpu;
