//! What crosses the border to C, as `include/aonet.h` declares it. The tests compare both.

use std::ffi::{c_char, c_int, c_void};

/// `AonetError`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Code {
    /// No error.
    Ok = 0,
    /// An argument, a field or a pixel is out of its range.
    InvalidArgument = 1,
    /// Weights cannot be read, or are not a network.
    InvalidWeights = 2,
    /// This machine has no instructions for the chosen precision.
    UnsupportedHardware = 3,
    /// There is not enough memory.
    OutOfMemory = 4,
    /// The session cannot run.
    InvalidOperation = 5,
    /// A mistake in this library.
    Internal = 6,
}

/// `AonetSessionOptions`.
#[repr(C)]
#[derive(Debug)]
pub struct SessionOptions {
    pub(crate) struct_size: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) margin_x: usize,
    pub(crate) margin_y: usize,
    pub(crate) method: *const c_char,
    pub(crate) weights_path: *const c_char,
    pub(crate) weights: *const c_void,
    pub(crate) weights_size: usize,
    pub(crate) threads: usize,
    /// `AonetPrecision`, which may hold any number.
    pub(crate) precision: c_int,
}

/// `AonetInputImage`. Strides are in bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub(crate) struct InputImage {
    pub(crate) data: *const f32,
    pub(crate) pixel_stride: isize,
    pub(crate) row_stride: isize,
}

/// `AonetOutputImage`. Strides are in bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutputImage {
    pub(crate) data: *mut f32,
    pub(crate) pixel_stride: isize,
    pub(crate) row_stride: isize,
}

/// `AonetFrame`.
#[repr(C)]
#[derive(Debug)]
pub struct Frame {
    pub(crate) struct_size: usize,
    pub(crate) depth: InputImage,
    pub(crate) normal: InputImage,
    pub(crate) second_depth: InputImage,
    pub(crate) visibility: OutputImage,
    pub(crate) clip_from_view: *const f32,
    pub(crate) view_from_world: *const f32,
    pub(crate) fov_y: f32,
    pub(crate) radius: f32,
}
