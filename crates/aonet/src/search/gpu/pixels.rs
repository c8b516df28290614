//! A method that looks around every pixel.

use crate::gpu::program::{Binding, Dispatch, Dispatches, Grid};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::noise;

/// Columns and rows of a workgroup.
pub(crate) const TILE: [usize; 2] = [8, 8];

/// Parameters that they all have. See [`crate::search`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    pub(crate) radius_scale: f32,
    pub(crate) power: f32,
}

/// A shader without the method's own part, `visibility_at`.
pub(crate) fn shader(surface: Surface, by: Reach) -> Shader {
    of_planes(surface, by, 1).part(include_str!("visibility.wgsl"))
}

/// The same for a method that reports so many values for a pixel, with `planes_at`.
pub(crate) fn of_planes(surface: Surface, by: Reach, planes: usize) -> Shader {
    around(surface, by, planes).part(include_str!("every_pixel.wgsl"))
}

/// The same without an entry point, which chooses the pixels.
pub(crate) fn around(surface: Surface, by: Reach, planes: usize) -> Shader {
    surface
        .shader()
        .float("RADIUS_SCALE", by.radius_scale)
        .float("POWER", by.power)
        .tile(TILE)
        .number("NOISE_SIDE", noise::SIDE)
        .number("NOISE_COUNT", noise::COUNT)
        .number("NOISE_RIGHT", noise::STEPS[0])
        .number("NOISE_DOWN", noise::STEPS[1])
        .number("NOISE_FACTOR", noise::FACTOR)
        .float("NOISE_OFFSET", noise::OFFSET)
        .number("PLANES", planes)
        .part(include_str!("noise.wgsl"))
        .part(include_str!("pixels.wgsl"))
}

/// Adds the dispatch of a shader over a frame.
pub(crate) fn push(label: &str, shader: Shader, bindings: &[Binding], list: &mut Dispatches) {
    let variants = vec![(shader, Grid::FRAME.workgroups(TILE, 1))];
    list.push(Dispatch { label, sees_frame: true, variants }, bindings);
}
