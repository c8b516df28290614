//! Normals of both layers, one word a pixel. See `crate::search::surfels`.

use crate::gpu::options::Layers;
use crate::gpu::program::{Binding, BufferId, Dispatches, Grid};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::gpu::pixels;
use crate::search::surfels::{BEND, LEAST_SPREAD, LENGTH, ROUGHNESS};

/// Adds the dispatch that packs them into buffers of its own, one a layer; what a search then binds after its output.
pub(crate) fn push(surface: Surface, list: &mut Dispatches) -> Vec<Binding> {
    let mut buffer = || list.storage("surfels", Grid::FRAME.count() * size_of::<u32>().into());
    let buffers: Vec<_> = (0..surface.textures.layers.count()).map(|_| buffer()).collect();
    push_into(&buffers, surface, list);
    read(&buffers, surface).collect()
}

/// The same into buffers of one word a pixel for each layer; that of an absent layer is left alone.
pub(crate) fn push_into(buffers: &[BufferId], surface: Surface, list: &mut Dispatches) {
    let bindings: Vec<_> = of_layers(buffers, surface).map(Binding::Write).collect();
    pixels::push("surfels", shader(surface), &bindings, list);
}

/// What a search binds after its output.
pub(crate) fn read(buffers: &[BufferId], surface: Surface) -> impl Iterator<Item = Binding> {
    of_layers(buffers, surface).map(Binding::Read)
}

/// The buffers of the layers that frames have.
fn of_layers(buffers: &[BufferId], surface: Surface) -> impl Iterator<Item = BufferId> {
    buffers.iter().copied().take(surface.textures.layers.count())
}

/// The shader that packs them.
pub(crate) fn shader(surface: Surface) -> Shader {
    surface
        .shader()
        .tile(pixels::TILE)
        .float("LENGTH", LENGTH)
        .float("BEND", BEND)
        .float("ROUGHNESS", ROUGHNESS)
        .float("LEAST_SPREAD", LEAST_SPREAD)
        .part(match surface.textures.layers {
            Layers::One => include_str!("surfels_nothing_behind.wgsl"),
            Layers::Two => include_str!("surfels_behind.wgsl"),
        })
        .part(include_str!("surfels.wgsl"))
}

/// A search that reads the normals of every layer.
pub(crate) fn with_normals(search: Shader, layers: Layers) -> Shader {
    let words = match layers {
        Layers::One => include_str!("surfels_one_layer.wgsl"),
        Layers::Two => include_str!("surfels_two_layers.wgsl"),
    };
    search.float("LENGTH", LENGTH).part(words).part(include_str!("surfel.wgsl"))
}
