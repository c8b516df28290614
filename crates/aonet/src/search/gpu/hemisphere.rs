//! What the methods that look at points around a pixel share.

use crate::gpu::program::{BufferId, Dispatches, floats};
use crate::gpu::shader::Shader;

/// Points in the unit ball; or directions, and places along them.
pub(crate) type Sample = [f32; 4];

/// Adds a buffer of the points, which follows the method's output.
pub(crate) fn buffer(samples: &[Sample], list: &mut Dispatches) -> BufferId {
    list.filled("samples", &floats(samples.as_flattened()))
}

/// A shader that looks at so many points.
pub(crate) fn with_samples(shader: Shader, count: u32) -> Shader {
    shader.number("SAMPLES", count as usize).part(include_str!("hemisphere.wgsl"))
}
