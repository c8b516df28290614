//! The CPU runtime: a [`Session`] runs a model at one size, with threads and vector instructions, and without
//! allocating.
//!
//! Activations are f32. Blocked images keep as many channels side by side as a vector has lanes; a convolution
//! broadcasts one input value at a time to vectors of output channels.

mod aligned;
mod bands;
mod conv;
mod conv_tile;
mod features;
mod head;
mod kernel_predict;
mod level;
mod pool;
mod resample;
mod session;
mod simd;

pub use level::Level;
pub use session::Session;
