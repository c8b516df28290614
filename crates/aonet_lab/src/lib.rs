//! The laboratory: frame files, datasets, evaluation, training, and the paper's tables and figures.
//! Data flows one way: scene -> G-buffer -> AO -> table.

mod adam;
pub mod ao_file;
pub mod bending;
pub mod bent_file;
pub mod calibrate;
pub mod dataset;
pub mod eval;
pub mod exact;
mod exr_file;
pub mod flicker;
pub mod frame;
pub mod ladder;
mod marching;
mod network_inputs;
pub mod nnao;
pub mod onnx;
pub mod paper;
pub mod picture;
pub mod plot;
pub mod preset;
pub mod sensitivity;
pub mod table;
pub mod timing;
#[cfg(feature = "train")]
pub mod train;
pub mod train_config;
pub mod tune;
