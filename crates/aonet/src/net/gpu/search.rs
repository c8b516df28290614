//! What the methods that look for occluders in slices share.

use super::options::{Options, Precision};
use super::pixels::{self, Reach};
use super::shader::Shader;

/// A shader without the method's own part: so many slices and taps on each side of them.
pub(super) fn shader(of: (Precision, &Options), (slices, steps): (u32, u32), reach: Reach) -> Shader {
    pixels::shader(of, reach)
        .number("SLICES", slices as usize)
        .number("STEPS", steps as usize)
        .part(include_str!("slice.wgsl"))
        .part(include_str!("search.wgsl"))
}
