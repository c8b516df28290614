//! What the methods that look at points around a pixel share.

use crate::error::Result;
use crate::gpu::shader::Shader;
use crate::gpu::wgpu_30::context::Context;

/// Points in the unit ball; or directions, and places along them.
pub(crate) type Sample = [f32; 4];

/// The points in a buffer, which follows the method's output.
///
/// # Errors
/// Never: no method has more than a shader may see.
pub(crate) fn buffer(context: &Context, samples: &[Sample]) -> Result<wgpu::Buffer> {
    context.floats("samples", samples.as_flattened())
}

/// A shader that looks at so many points.
pub(crate) fn with_samples(shader: Shader, count: u32) -> Shader {
    shader.number("SAMPLES", count as usize).part(include_str!("hemisphere.wgsl"))
}
