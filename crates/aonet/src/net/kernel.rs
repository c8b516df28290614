//! The kernels that a head predicts: weights of the normals around a pixel. AO-Net §3.3, Eq. 2.

/// Side of the kernel window (px). AO-Net §3.3.
pub const WINDOW: usize = 4;

/// Offset of the first tap from the pixel (px): a 4x4 window has no centre, ours covers -1..=2.
pub const FIRST_TAP: isize = -1;

/// Number of channels that kernels weigh: the normal.
pub const GUIDE_CHANNELS: usize = 3;

/// Kernel weights per pixel.
pub const TAPS: usize = WINDOW * WINDOW * GUIDE_CHANNELS;
