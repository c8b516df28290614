//! The filter after a search. See `crate::search::denoise`.

use crate::gpu::program::{Binding, BufferId, Dispatch, Dispatches};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::Denoise;

/// Adds the dispatch that filters the first buffer into the second, both HxW.
pub(crate) fn push(
    shader: Shader,
    [found, filtered]: [BufferId; 2],
    (width, height): (usize, usize),
    list: &mut Dispatches,
) {
    let workgroups = [width.div_ceil(16), height.div_ceil(8), 1];
    let dispatch = Dispatch { label: "denoise", shader, sees_frame: true, workgroups };
    list.push(&dispatch, &[Binding::Write(filtered), Binding::Read(found)]);
}

/// Its shader.
pub(crate) fn shader(surface: Surface, by: Denoise) -> Shader {
    surface.shader().float("PLANE", by.plane).float("NORMAL", by.normal).part(include_str!("denoise.wgsl"))
}
