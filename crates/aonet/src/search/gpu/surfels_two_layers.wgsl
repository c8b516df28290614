// Normals of frames with two layers.

@group(1) @binding(1) var<storage, read> first_surfels: array<u32>;
@group(1) @binding(2) var<storage, read> second_surfels: array<u32>;

/// Word of what a pixel shows in a layer.
fn surfel_word(i: u32, layer: u32) -> u32 {
    if (layer == 1u) {
        return second_surfels[i];
    }
    return first_surfels[i];
}
