//! Ambient occlusion of ray-traced quality in screen space: a small neural network maps a frame's
//! normals and depth ([`GBuffer`]) to visibility ([`AoImage`]) in one frame.
//!
//! This crate is what ships inside a program: it knows no scene, no file path, no clock.

pub mod ao_image;
pub mod camera;
pub mod classic;
pub mod error;
pub mod gbuffer;
pub mod metrics;
pub mod net;

pub use ao_image::{AoImage, AoParams};
pub use camera::{Camera, Projection};
pub use error::{Error, Result};
pub use gbuffer::GBuffer;

/// The README's program compiles.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
