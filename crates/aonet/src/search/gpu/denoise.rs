//! The filter after a search. See `crate::search::denoise`.

use crate::gpu::options::{Options, Precision};
use crate::gpu::shader::Shader;
use crate::gpu::surface::surface;
use crate::gpu::wgpu_30::pass::{Binding, Compiler, Pass, Recipe};
use crate::search::Denoise;

/// The dispatch that filters the first buffer into the second, both HxW.
pub(crate) fn pass(
    (compiler, shader): (&Compiler, Shader),
    [found, filtered]: [&wgpu::Buffer; 2],
    (width, height): (usize, usize),
) -> Pass {
    let recipe = Recipe { label: "denoise", shader, sees_frame: true };
    let bindings = [Binding::Write(filtered), Binding::Read(found)];
    Pass::new(compiler, &recipe, &bindings, [width.div_ceil(16), height.div_ceil(8), 1])
}

/// Its shader.
pub(crate) fn shader(of: (Precision, &Options), by: Denoise) -> Shader {
    surface(of.0, of.1).float("PLANE", by.plane).float("NORMAL", by.normal).part(include_str!("denoise.wgsl"))
}
