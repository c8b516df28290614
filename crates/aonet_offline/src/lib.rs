//! What needs a scene, a disk or a gradient: scenes, ray-traced reference, frames, datasets,
//! evaluation and training. Data flows one way: scene -> G-buffer -> AO -> table.

mod adam;
pub mod ao_file;
pub mod atomic_file;
pub mod backend;
pub mod calibrate;
pub mod dataset;
pub mod error;
pub mod eval;
mod exr_file;
pub mod flicker;
pub mod frame;
pub mod gbuffer;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod nnao;
pub mod onnx;
pub mod paper;
pub mod picture;
pub mod plot;
pub mod preset;
mod random;
pub mod reference;
pub mod scene;
pub mod sensitivity;
pub mod table;
pub mod timing;
pub mod trace;
#[cfg(feature = "train")]
pub mod train;
pub mod tune;
pub mod view;

pub use error::{Error, Result};
pub use scene::Scene;
pub use view::View;
