//! Screen-space ambient occlusion by a small neural network, trained on ray-traced references: it maps the normals and depth of one
//! frame ([`GBuffer`]) to visibility ([`AoImage`]).
//!
//! This crate is what ships inside a program: it knows no scene, no file path, no clock.

mod error;
pub mod frame;
pub mod gpu;
#[doc(hidden)]
pub mod internals;
pub mod metrics;
pub mod net;
mod random;
pub mod search;
pub mod simd;
mod threads;

pub use error::{Error, Result};
pub use frame::ao_image::{AoImage, AoParams};
pub use frame::bent_normals::BentNormals;
pub use frame::camera::{Camera, Projection};
pub use frame::coarse::CoarseDepth;
pub use frame::gbuffer::{GBuffer, SecondLayer};
pub use frame::size::Size;
pub use frame::window::{Margin, Window};
pub use glam;

/// The programs of README and guide compile.
#[cfg(all(doctest, feature = "weights"))]
#[doc = include_str!("../../../README.md")]
#[doc = include_str!("../../../docs/guide.md")]
struct Readme;
