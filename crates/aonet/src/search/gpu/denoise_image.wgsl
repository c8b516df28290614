// What the filter over a network's image reads. CPU twin: net/cpu/search.rs, Smooth.

/// What the network computed, pixel of the patch by pixel.
@group(1) @binding(1) var<storage, read> raw: array<f32>;
/// What the search found, plane by plane.
@group(1) @binding(2) var<storage, read> base: array<f32>;
/// Columns and rows of patches.
@group(1) @binding(3) var<uniform> cells: vec2<u32>;

/// What the search found and what the network added to it, or the image alone.
fn values_at(pixel: vec2<u32>) -> array<f32, PLANES> {
    var values: array<f32, PLANES>;
    values[PLANES - 1u] = value_at(pixel);
    if (PLANES > 1u) {
        values[0] = base[pixel.y * frame.size.x + pixel.x];
        values[PLANES - 1u] -= values[0];
    }
    return values;
}

fn store(pixel: vec2<u32>, values: array<f32, PLANES>) {
    var sum = 0.0;
    for (var c = 0u; c < PLANES; c++) {
        sum += values[c];
    }
    filtered[index_of(pixel, 0u)] = saturate(sum);
}
