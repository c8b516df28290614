//! Bent normals as a picture. See [`crate::search::bent`].

use crate::gpu::image::covering;
use crate::gpu::options::BentEncoding;
use crate::gpu::program::{Binding, BufferId, Dispatches, Draw};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::bent::{BEND, SHORTEST};

/// Adds what the draw needs to the list, of so many planes that a search with bent normals found.
pub(crate) fn draw(
    (found, planes): (BufferId, usize),
    encoding: BentEncoding,
    surface: Surface,
    list: &mut Dispatches,
) -> Draw {
    let shader = list.shader(&covering(shader(surface, encoding, planes).source()));
    Draw { shader, bindings: vec![Binding::Read(found)] }
}

/// The shader of the draw.
pub(crate) fn shader(surface: Surface, encoding: BentEncoding, planes: usize) -> Shader {
    surface
        .shader()
        .number("BEND_PLANE", planes - BEND)
        .float("SHORTEST", SHORTEST)
        .flag("HALVED", encoding == BentEncoding::Unorm)
        .part(include_str!("bent_normals.wgsl"))
}
