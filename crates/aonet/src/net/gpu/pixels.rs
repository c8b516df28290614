//! A method that looks around every pixel.

use super::features::surface;
use super::options::{Options, Precision};
use super::pass::{Binding, Compiler, Pass, Recipe};
use super::shader::Shader;

/// Parameters that they all have. See [`crate::classic`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    pub(super) radius_scale: f32,
    pub(super) power: f32,
}

/// A shader without the method's own part.
pub(super) fn shader(of: (Precision, &Options), by: Reach) -> Shader {
    surface(of.0, of.1)
        .float("RADIUS_SCALE", by.radius_scale)
        .float("POWER", by.power)
        .part(include_str!("noise.wgsl"))
        .part(include_str!("pixels.wgsl"))
}

/// The dispatch over a frame of `size` (width, height) [px].
pub(super) fn pass(
    compiler: &Compiler,
    recipe: &Recipe<'_>,
    bindings: &[Binding<'_>],
    (width, height): (usize, usize),
) -> Pass {
    Pass::new(compiler, recipe, bindings, [width.div_ceil(8), height.div_ceil(8), 1])
}
