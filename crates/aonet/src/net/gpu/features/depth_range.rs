//! The range of depths of a frame's foreground.

use crate::gpu::program::{Binding, BufferId, Dispatch, Dispatches, Grid};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;

/// Columns and rows of a workgroup.
const TILE: [usize; 2] = [16, 16];

/// Adds the dispatch that finds the range; returns its buffer.
pub(crate) fn push(surface: Surface, list: &mut Dispatches) -> BufferId {
    let range = list.cleared("depth range", 2 * size_of::<u32>());
    let dispatch = Dispatch {
        label: "depth range",
        sees_frame: true,
        variants: vec![(shader(surface), Grid::FRAME.workgroups(TILE, 1))],
    };
    list.push(dispatch, &[Binding::Write(range)]);
    range
}

/// Its shader.
pub(crate) fn shader(surface: Surface) -> Shader {
    surface.shader().tile(TILE).part(include_str!("depth_range.wgsl"))
}
