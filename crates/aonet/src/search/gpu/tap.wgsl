// Taps of a search into the pyramid: far ones into coarser levels. CPU twin: search/pyramid.rs.

@group(1) @binding(1) var<uniform> levels: Levels;
@group(1) @binding(2) var<storage, read> coarse: array<f32>;

/// View-space position of the cell around a pixel that is `pixels` away.
fn tap(pixel: vec2<f32>, pixels: f32) -> vec3<f32> {
    let ratio = clamp(pixels * INVERSE_NEAR, 0.5, f32(1u << COARSER) * 0.5);
    // The exponent of a number in [1/2, 1) is 126 with its bias.
    let level = (bitcast<u32>(ratio) >> 23u) - 126u;
    if (level == 0u) {
        return position_at(pixel, depth_at(vec2<u32>(pixel), 0u));
    }
    let cell = vec2<u32>(pixel) >> vec2(level);
    let depth = coarse[levels.first[level - 1u] + cell.y * levels.width[level - 1u] + cell.x];
    let side = f32(1u << level);
    // Half a cell less half a pixel.
    return position_at(vec2<f32>(cell) * side + 0.5 * (side - 1.0), depth);
}
