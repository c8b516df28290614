// Two numbers in [0, 1) for every pixel of a 64x64 tile, spread evenly over any neighbourhood. CPU twin: search/noise.rs.
// Index of the pixel along a Hilbert curve (Hilbert 1891) into the R2 sequence (Roberts 2018): what XeGTAO uses.

fn hilbert_index(pixel: vec2<u32>) -> u32 {
    var at = pixel % NOISE_TILE;
    var index = 0u;
    for (var side = NOISE_TILE / 2u; side > 0u; side /= 2u) {
        let right = u32((at.x & side) > 0u);
        let down = u32((at.y & side) > 0u);
        index += side * side * ((3u * right) ^ down);
        if (down == 0u) {
            if (right == 1u) {
                at = NOISE_TILE - 1u - at;
            }
            at = at.yx;
        }
    }
    return index;
}

fn noise_at(pixel: vec2<u32>) -> vec2<f32> {
    // Multiples of 1 over the plastic number and of its square, from 0.5, in units of 2^-32.
    let sequence = 0x80000000u + hilbert_index(pixel) * vec2(3242174889u, 2447445414u);
    return vec2<f32>(sequence >> vec2(8u)) * exp2(-24.0);
}
