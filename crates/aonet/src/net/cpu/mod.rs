//! The CPU runtime: a [`Session`] runs a model at one size, with threads and vector instructions, and without
//! allocating.
//!
//! Activations are f32. Blocked images keep as many channels side by side as a vector has lanes; a convolution
//! broadcasts one input value at a time to vectors of output channels.

mod calibration;
mod context;
mod conv;
mod conv_tile;
mod conv_weights;
mod dot;
#[cfg(target_arch = "x86_64")]
mod dot_x86;
mod features;
mod guide_window;
mod head;
mod head_weights;
mod image;
mod kernel_predict;
mod packing;
mod patch_head;
mod patch_merge;
pub(crate) mod peak;
mod precision;
mod recipe;
mod resample;
mod ring;
mod search;
mod session;
#[cfg(test)]
mod tests;
mod winograd;
mod winograd_squares;
pub(crate) mod winograd_transforms;
mod winograd_weights;

pub use precision::Precision;
pub use session::{Options, Session};
