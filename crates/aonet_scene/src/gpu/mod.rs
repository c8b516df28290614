//! The reference on graphics processors: the rays of [`reference_ao`](crate::reference::reference_ao), traced by shaders.
//!
//! A [`Reference`] encodes rays into a command encoder of the caller and counts those that are open, pixel by pixel, until there
//! are enough of them: a renderer adds a few every frame, [`Offscreen`] all at once. Rays start at a
//! [`Surface`](crate::gbuffer::Surface), as on a CPU, or at a renderer's normals and depth. All shaders
//! stay within the default limits of WebGPU; scenes of more than 2.8 million triangles need larger bindings.
//!
//! ```no_run
//! use aonet::gpu::{DepthEncoding, FrameNumbers, wgpu};
//! use aonet_scene::gpu::{ReferenceOptions, Reference, SceneBuffers, SurfaceViews};
//! use aonet_scene::reference::Sampling;
//! use aonet_scene::trace::Tracer;
//!
//! fn once(device: &wgpu::Device, queue: &wgpu::Queue, tracer: &Tracer) -> aonet_scene::Result<Reference> {
//!     let scene = SceneBuffers::new((device, queue), tracer)?;
//!     Reference::new(&scene, aonet::Size::px(1280, 720), ReferenceOptions::default())
//! }
//!
//! /// Whenever the camera has moved. A view can be kept for as long as the textures are the same.
//! fn moved(reference: &mut Reference, of: SurfaceViews<'_>, frame: &FrameNumbers, encoder: &mut wgpu::CommandEncoder)
//!     -> aonet_scene::Result<()> {
//!     let view = reference.view(of)?;
//!     reference.start(encoder, &view, frame)
//! }
//!
//! /// Every frame: eight more rays a pixel.
//! fn frame(reference: &mut Reference, ao: &wgpu::TextureView, encoder: &mut wgpu::CommandEncoder)
//!     -> aonet_scene::Result<()> {
//!     reference.encode(encoder, 8, ao)
//! }
//! ```

mod image;
mod memory;
mod offscreen;
mod order;
mod program;
mod reference;
mod scene;
mod start;
#[cfg(test)]
mod tests;

pub use offscreen::Offscreen;
pub use reference::{RAYS_AT_ONCE, Reference, ReferenceOptions};
pub use scene::SceneBuffers;
pub use start::{BoundTextures, SurfaceViews};
