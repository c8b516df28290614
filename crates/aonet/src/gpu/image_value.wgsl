/// The visibility that a network computed for a pixel, in [0, 1].
fn value_at(pixel: vec2<u32>) -> f32 {
    let cell = pixel / PATCH;
    let of_patch = pixel.y % PATCH * PATCH + pixel.x % PATCH;
    let of_cell = cell.y * cells.x + cell.x;
    var value = f32(raw[of_patch * cells.y * cells.x + of_cell]FIRST_CHANNEL);
    // CORRECTION planes: what is added to the visibility, and weights of the shares.
    let found = pixel.y * frame.size.x + pixel.x;
    if (CORRECTION > 0u) {
        value += base[found];
    }
    for (var plane = 1u; plane < CORRECTION; plane++) {
        let weight = raw[(plane * PATCH * PATCH + of_patch) * cells.y * cells.x + of_cell];
        value += f32(weightFIRST_CHANNEL) * base[plane * frame.size.x * frame.size.y + found];
    }
    // NaN, from weights so large that sums overflow, becomes 0.
    return select(0.0, min(value, 1.0), value > 0.0);
}
