//! Bent normals as a picture. See [`crate::search::bent`].

use crate::gpu::image::covering;
use crate::gpu::options::BentEncoding;
use crate::gpu::program::{Binding, BufferId, Dispatches, Draw};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::bent::SHORTEST;

/// Adds what the draw of visibility and bend needs to the list.
pub(crate) fn draw(found: BufferId, encoding: BentEncoding, surface: Surface, list: &mut Dispatches) -> Draw {
    let shader = list.shader(&covering(shader(surface, encoding).source()));
    Draw { shader, bindings: vec![Binding::Read(found)] }
}

/// The shader of the draw.
pub(crate) fn shader(surface: Surface, encoding: BentEncoding) -> Shader {
    surface
        .shader()
        .float("SHORTEST", SHORTEST)
        .flag("HALVED", encoding == BentEncoding::Unorm)
        .part(include_str!("bent_normals.wgsl"))
}
