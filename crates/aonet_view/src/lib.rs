//! A deferred renderer that shows ambient occlusion methods in motion and side by side, and its window.
//!
//! [`renderer`] knows a graphics device, `aonet` and scenes; no window, no file, no clock. It compiles for browsers.

pub mod renderer;
#[cfg(feature = "window")]
pub mod window;

pub use aonet_scene::{Error, Result};
pub use renderer::{FrameParams, Method, Renderer, Show};
