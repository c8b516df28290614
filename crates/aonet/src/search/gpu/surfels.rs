//! Normals of the second layer, one word a pixel. See `crate::search::surfels`.

use crate::gpu::options::Layers;
use crate::gpu::program::{Binding, BufferId, Dispatches, Grid};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::gpu::pixels;
use crate::search::surfels::LENGTH;

/// Adds the dispatch that packs them, if frames have a second layer; what a search then binds after its output.
pub(crate) fn push(surface: Surface, list: &mut Dispatches) -> Option<Binding> {
    if surface.textures.layers == Layers::One {
        return None;
    }
    let surfels = list.storage("surfels", Grid::FRAME.count() * size_of::<u32>().into());
    push_into(surfels, surface, list);
    Some(Binding::Read(surfels))
}

/// The same into a buffer of one word a pixel, for frames with a second layer.
pub(crate) fn push_into(surfels: BufferId, surface: Surface, list: &mut Dispatches) {
    pixels::push("surfels", shader(surface), &[Binding::Write(surfels)], list);
}

/// The shader that packs them; it reads two layers.
pub(crate) fn shader(surface: Surface) -> Shader {
    surface.shader().tile(pixels::TILE).float("LENGTH", LENGTH).part(include_str!("surfels.wgsl"))
}

/// A search that reads the normals of every layer.
pub(crate) fn with_normals(search: Shader, layers: Layers) -> Shader {
    search.float("LENGTH", LENGTH).part(match layers {
        Layers::One => include_str!("surfels_one_layer.wgsl"),
        Layers::Two => include_str!("surfels_two_layers.wgsl"),
    })
}
