// What the filter after a search reads.

@group(1) @binding(1) var<storage, read> found: array<f32>;

fn number_at(pixel: vec2<u32>, plane: u32) -> f32 {
    return found[index_of(pixel, plane)];
}

/// What is added to a filtered number.
fn base_at(pixel: vec2<u32>) -> f32 {
    return 0.0;
}
