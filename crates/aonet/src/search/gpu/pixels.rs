//! A method that looks around every pixel.

use crate::gpu::options::{Options, Precision};
use crate::gpu::shader::Shader;
use crate::gpu::surface::surface;
use crate::gpu::wgpu_30::pass::{Binding, Compiler, Pass, Recipe};

/// Parameters that they all have. See [`crate::search`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    pub(crate) radius_scale: f32,
    pub(crate) power: f32,
}

/// A shader without the method's own part.
pub(crate) fn shader(of: (Precision, &Options), by: Reach) -> Shader {
    surface(of.0, of.1)
        .float("RADIUS_SCALE", by.radius_scale)
        .float("POWER", by.power)
        .part(include_str!("noise.wgsl"))
        .part(include_str!("pixels.wgsl"))
}

/// The dispatch over a frame of `size` (width, height) [px].
pub(crate) fn pass(
    compiler: &Compiler,
    recipe: &Recipe<'_>,
    bindings: &[Binding<'_>],
    (width, height): (usize, usize),
) -> Pass {
    Pass::new(compiler, recipe, bindings, [width.div_ceil(8), height.div_ceil(8), 1])
}
