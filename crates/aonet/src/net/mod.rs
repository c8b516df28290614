//! The network as a value: a [`ModelConfig`] builds a [`Graph`] once; the backends interpret it.
//!
//! [`naive`] is the oracle: plain loops, no tricks. [`cpu`] is the runtime; with the feature `gpu`, `gpu` is another. All
//! give the same image.

pub mod arch;
pub mod config;
pub mod cpu;
pub mod features;
pub mod gpu;
pub mod graph;
pub mod kernel;
pub mod model;
pub mod naive;
pub mod plan;
#[cfg(feature = "weights")]
pub mod shipped;
pub mod weights;

pub use config::{Arch, Axis, Channel, Features, KernelWeights, ModelConfig, Output, SearchConfig, Skips};
pub use graph::{Activation, Graph, Node, Op, ParamSpec, ValueId};
pub use model::{Model, TrainingFacts};
pub use weights::{Tensor, Weights};
