// What the filter after a search reads.

@group(1) @binding(1) var<storage, read> found: array<f32>;

fn values_at(pixel: vec2<u32>) -> array<f32, PLANES> {
    var values: array<f32, PLANES>;
    for (var c = 0u; c < PLANES; c++) {
        values[c] = found[index_of(pixel, c)];
    }
    return values;
}

fn store(pixel: vec2<u32>, values: array<f32, PLANES>) {
    for (var c = 0u; c < PLANES; c++) {
        filtered[index_of(pixel, c)] = values[c];
    }
}
