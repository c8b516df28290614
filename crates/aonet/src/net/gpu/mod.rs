//! The runtime for graphics processors: with the feature `gpu`, `Session` encodes a model's passes into the caller's command encoder.
//!
//! Activations are blocks of four channels, each an image of vectors, in 32- or 16-bit floats. What is fused is what
//! [`Plan`](crate::net::plan::Plan) says: partition into the features, resampling and concatenation into the convolution that
//! reads them, the head and its kernels into one dispatch. All of it is WGSL within the default limits of WebGPU.
//!
//! `search::gpu::ClassicSession` is the same for the classic methods, all but NNAO.
//!
//! ```no_run
//! # #[cfg(feature = "gpu")]
//! # mod engine {
//! use aonet::Size;
//! use aonet::gpu::{FrameNumbers, Options, FrameViews, wgpu};
//! use aonet::net::gpu::Session;
//! use aonet::net::{Model, shipped};
//!
//! fn once(device: &wgpu::Device, queue: &wgpu::Queue) -> aonet::Result<Session> {
//!     let model = Model::from_bytes(shipped::BALANCED)?;
//!     Session::new((device, queue), &model, Size::px(1280, 720), Options::default())
//! }
//!
//! fn frame(session: &Session, of: FrameViews<'_>, frame: &FrameNumbers, encoder: &mut wgpu::CommandEncoder) -> aonet::Result<()> {
//!     // A view can be kept for as long as the textures are the same.
//!     let view = session.bind(of)?;
//!     session.encode(encoder, &view, frame)
//! }
//! # }
//! ```

mod context;
mod conv;
mod features;
mod grids;
mod head;
mod memory;
mod network;
#[cfg(feature = "gpu")]
mod session;
#[cfg(all(test, feature = "gpu", target_os = "linux"))]
mod statistics;
pub(crate) mod survey;
#[cfg(all(test, feature = "gpu"))]
mod tests;
mod tiles;
#[cfg(all(test, feature = "gpu"))]
pub(crate) mod valid;

pub use network::Network;

/// A network and its memory on a device, for frames of one size.
#[cfg(feature = "gpu")]
pub type Session = crate::gpu::Session<Network>;
