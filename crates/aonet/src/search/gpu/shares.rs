//! Shares of light as a picture.

use crate::gpu::image::covering;
use crate::gpu::program::{Binding, BufferId, Dispatches, Draw};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::{PLANES, Share};

/// Adds what the draw needs to the list.
pub(crate) fn draw(found: BufferId, surface: Surface, list: &mut Dispatches) -> Draw {
    let shader = list.shader(&covering(shader(surface).source()));
    Draw { shader, bindings: vec![Binding::Read(found)] }
}

/// The shader of the draw.
pub(crate) fn shader(surface: Surface) -> Shader {
    let colour = |share: Share| {
        let [r, g, b] = share.colour().map(|channel| f32::from(channel) / 255.0);
        format!("vec3({r:?}f, {g:?}f, {b:?}f)")
    };
    let colours = Share::ALL.map(colour).join(", ");
    surface
        .shader()
        .number("PLANES", PLANES)
        .part(&format!("const COLOURS = array<vec3<f32>, {PLANES}>({colours});"))
        .part(include_str!("shares.wgsl"))
}
