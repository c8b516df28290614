// What surfels.wgsl has packed.

/// Normal of what a pixel shows in a layer, LENGTH times as long.
fn surfel(pixel: vec2<u32>, layer: u32) -> vec3<f32> {
    let word = surfel_word(pixel.y * frame.size.x + pixel.x, layer);
    return vec3<f32>((vec3(word) >> vec3(20u, 10u, 0u)) & vec3(1023u)) - LENGTH;
}
