// Normals of frames with two layers.

@group(1) @binding(1) var<storage, read> surfels: array<u32>;

/// Normal of what a pixel shows in a layer, LENGTH times as long. Components are whole numbers, as on the CPU.
fn surfel(pixel: vec2<u32>, layer: u32) -> vec3<f32> {
    if (layer == 1u) {
        let word = surfels[pixel.y * frame.size.x + pixel.x];
        return vec3<f32>((vec3(word) >> vec3(20u, 10u, 0u)) & vec3(1023u)) - LENGTH;
    }
    return round(surface_at(pixel).normal * LENGTH);
}
