//! The network as a value: a [`Model`] is a [`ModelConfig`] and its weights; a session of a backend runs it.
//!
//! [`cpu`] is the runtime; with the feature `gpu`, [`gpu`] is another. Both give the same image.

mod arch;
pub(crate) mod config;
pub mod cpu;
pub(crate) mod features;
pub mod gpu;
pub(crate) mod graph;
pub(crate) mod kernel;
pub(crate) mod model;
pub(crate) mod naive;
pub(crate) mod neighbours;
pub(crate) mod plan;
#[cfg(feature = "weights")]
pub mod shipped;
pub(crate) mod weights;

pub use config::{Arch, Axis, Channel, Features, KernelWeights, ModelConfig, Output, SearchConfig, Skips};
pub use model::{Model, Ranges, TrainingFacts, WeightFormat};
