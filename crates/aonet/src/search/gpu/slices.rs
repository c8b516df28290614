//! What the methods that look for occluders in slices share.

use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::gpu::pixels::{self, Reach};
use crate::search::slice::MOST_GRAZING;

/// A shader without the method's own part: so many slices and taps on each side of them.
pub(crate) fn shader(surface: Surface, (slices, steps): (u32, u32), reach: Reach) -> Shader {
    pixels::shader(surface, reach)
        .number("SLICES", slices as usize)
        .number("STEPS", steps as usize)
        .float("MOST_GRAZING", MOST_GRAZING)
        .part(include_str!("slice.wgsl"))
        .part(include_str!("slices.wgsl"))
}
