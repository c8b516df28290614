// Looks around one pixel of every patch. CPU twin: search/survey.rs.

/// Blocks of four values of every cell.
@group(1) @binding(0) var<storage, read_write> surveyed: array<real4>;

@compute @workgroup_size(TILE_WIDTH, TILE_HEIGHT)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let cells = (frame.size + ALIGNMENT - 1u) / ALIGNMENT * (ALIGNMENT / PATCH);
    if (id.x >= cells.x || id.y >= cells.y) {
        return;
    }
    let pixel = min(id.xy * PATCH + PATCH / 2u, frame.size - 1u);
    let surface = surface_at(pixel);
    var values: array<vec4<f32>, BLOCKS>;
    if (surface.foreground) {
        let planes = planes_at(pixel_of(pixel, surface), noise_at(id.xy));
        for (var c = 0u; c < SHARES; c++) {
            values[c / 4u][c % 4u] = planes[c + 1u];
        }
    }
    values[SHARES / 4u][SHARES % 4u] = f32(LAYERS - 1u);
    for (var block = 0u; block < BLOCKS; block++) {
        surveyed[(block * cells.y + id.y) * cells.x + id.x] = real4(values[block]);
    }
}
