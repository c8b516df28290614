// One of the sources of a convolution, number NTH, on the convolution's grid. CPU twin: cpu/resample.rs.
// POOL_NTH is the side of the squares that are averaged; UPSAMPLE_NTH doubles the source.

@group(0) @binding(FIRST_SOURCE + NTHu) var<storage, read> source_NTH: array<real4>;

/// A block of four channels of a cell of the source; its edge repeats.
fn at_NTH(block: u32, cell: vec2<i32>) -> vec4<f32> {
    let size = conv.sources[NTH].xy;
    let place = vec2<u32>(clamp(cell, vec2(0), vec2<i32>(size) - 1));
    return vec4<f32>(source_NTH[(block * size.y + place.y) * size.x + place.x]);
}

/// The same of a cell of the convolution's grid.
fn read_NTH(block: u32, cell: vec2<i32>) -> vec4<f32> {
    if (UPSAMPLE_NTH) {
        // Bilinear, pixel centres at half-integers: three quarters of the nearest, a quarter of the next.
        let near = cell / 2;
        let far = near + 2 * (cell % 2) - 1;
        let upper = 0.75 * at_NTH(block, near) + 0.25 * at_NTH(block, vec2(far.x, near.y));
        let lower = 0.75 * at_NTH(block, vec2(near.x, far.y)) + 0.25 * at_NTH(block, far);
        return 0.75 * upper + 0.25 * lower;
    }
    if (POOL_NTH == 1) {
        return at_NTH(block, cell);
    }
    var sum = vec4<f32>();
    for (var i = 0; i < POOL_NTH * POOL_NTH; i++) {
        sum += at_NTH(block, cell * POOL_NTH + vec2(i % POOL_NTH, i / POOL_NTH));
    }
    return sum / f32(POOL_NTH * POOL_NTH);
}
