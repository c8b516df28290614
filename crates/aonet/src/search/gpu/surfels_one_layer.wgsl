// Normals of frames with one layer.

/// Normal of what a pixel shows, LENGTH times as long. Components are whole numbers, as on the CPU.
fn surfel(pixel: vec2<u32>, layer: u32) -> vec3<f32> {
    return round(surface_at(pixel).normal * LENGTH);
}
