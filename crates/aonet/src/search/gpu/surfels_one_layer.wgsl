// Normals of frames with one layer.

@group(1) @binding(1) var<storage, read> first_surfels: array<u32>;

/// Word of what a pixel shows.
fn surfel_word(i: u32, layer: u32) -> u32 {
    return first_surfels[i];
}
