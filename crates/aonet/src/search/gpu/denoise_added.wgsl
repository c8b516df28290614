// What the filter over the correction of a search reads. CPU twin: net/cpu/search.rs, Smooth.

/// What the network computed, pixel of the patch by pixel.
@group(1) @binding(1) var<storage, read> raw: array<f32>;
/// What the search found.
@group(1) @binding(2) var<storage, read> base: array<f32>;
/// Columns and rows of patches.
@group(1) @binding(3) var<uniform> cells: vec2<u32>;

/// How much of the correction stays when the visibility is kept in [0, 1].
fn number_at(pixel: vec2<u32>, plane: u32) -> f32 {
    let cell = pixel / PATCH;
    let of_patch = pixel.y % PATCH * PATCH + pixel.x % PATCH;
    let value = raw[(of_patch * cells.y + cell.y) * cells.x + cell.x] + base_at(pixel);
    // NaN, from weights so large that sums overflow, becomes 0.
    return select(0.0, min(value, 1.0), value > 0.0) - base_at(pixel);
}

fn base_at(pixel: vec2<u32>) -> f32 {
    return base[pixel.y * frame.size.x + pixel.x];
}
