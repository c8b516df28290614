//! A method that looks around every pixel.

use crate::gpu::program::{Binding, BufferId, Dispatch, Dispatches};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::noise;

/// Columns and rows of a workgroup.
const TILE: [usize; 2] = [8, 8];

/// Parameters that they all have. See [`crate::search`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    pub(crate) radius_scale: f32,
    pub(crate) power: f32,
}

/// A shader without the method's own part.
pub(crate) fn shader(surface: Surface, by: Reach) -> Shader {
    surface
        .shader()
        .float("RADIUS_SCALE", by.radius_scale)
        .float("POWER", by.power)
        .tile(TILE)
        .number("NOISE_TILE", noise::TILE)
        .part(include_str!("noise.wgsl"))
        .part(include_str!("pixels.wgsl"))
}

/// Adds a buffer for one number a pixel.
pub(crate) fn visibility(list: &mut Dispatches, label: &str, (width, height): (usize, usize)) -> BufferId {
    list.storage(label, width * height * size_of::<f32>())
}

/// Adds the dispatch of a shader, with its label, over a frame of `size` (width, height) (px).
pub(crate) fn push(
    (label, shader): (&str, Shader),
    bindings: &[Binding],
    (width, height): (usize, usize),
    list: &mut Dispatches,
) {
    let workgroups = [width.div_ceil(TILE[0]), height.div_ceil(TILE[1]), 1];
    list.push(&Dispatch { label, shader, sees_frame: true, workgroups }, bindings);
}
