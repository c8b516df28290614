//! Scenes and ray tracing: glTF and procedural scenes, cameras, G-buffers and the ray-traced reference AO.

pub mod atomic_file;
pub mod backend;
pub mod error;
pub mod exact_shares;
pub mod gbuffer;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod knowledge;
pub mod random;
pub mod reference;
pub mod scene;
pub mod staging;
pub mod trace;
pub mod view;

pub use error::{Error, Result};
pub use scene::Scene;
pub use view::View;
