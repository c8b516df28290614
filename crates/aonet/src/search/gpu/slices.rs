//! What the methods that look for occluders in slices share.

use crate::gpu::options::{Options, Precision};
use crate::gpu::shader::Shader;
use crate::search::gpu::pixels::{self, Reach};

/// A shader without the method's own part: so many slices and taps on each side of them.
pub(crate) fn shader(of: (Precision, &Options), (slices, steps): (u32, u32), reach: Reach) -> Shader {
    pixels::shader(of, reach)
        .number("SLICES", slices as usize)
        .number("STEPS", steps as usize)
        .part(include_str!("slice.wgsl"))
        .part(include_str!("slices.wgsl"))
}
