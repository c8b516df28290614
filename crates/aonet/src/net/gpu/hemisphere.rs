//! What the methods that look at points around a pixel share.

use super::context::Context;
use super::shader::Shader;
use crate::error::Result;

/// Points in the unit ball; or directions, and places along them.
pub(super) type Sample = [f32; 4];

/// The points in a buffer, which follows the method's output.
///
/// # Errors
/// Never: no method has more than a shader may see.
pub(super) fn buffer(context: &Context, samples: &[Sample]) -> Result<wgpu::Buffer> {
    context.floats("samples", samples.as_flattened())
}

/// A shader that looks at so many points.
pub(super) fn with_samples(shader: Shader, count: u32) -> Shader {
    shader.number("SAMPLES", count as usize).part(include_str!("hemisphere.wgsl"))
}
