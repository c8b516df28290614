// Looks around one pixel of every patch. CPU twin: search/survey.rs.
//
// Few pixels look around, each far: SIDES invocations, along z, share the sides of a pixel's slices.

/// Blocks of four values of every cell.
@group(1) @binding(0) var<storage, read_write> surveyed: array<real4>;

const INVOCATIONS: u32 = TILE_WIDTH * TILE_HEIGHT;

var<workgroup> found: array<Light, INVOCATIONS * SIDES>;

@compute @workgroup_size(TILE_WIDTH, TILE_HEIGHT, SIDES)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let cells = (frame.size + ALIGNMENT - 1u) / ALIGNMENT * (ALIGNMENT / PATCH);
    let place = local.y * TILE_WIDTH + local.x;
    let pixel = min(id.xy * PATCH + PATCH / 2u, frame.size - 1u);
    let surface = surface_at(pixel);
    let looks = surface.foreground && id.x < cells.x && id.y < cells.y;
    if (looks) {
        let p = pixel_of(pixel, surface);
        var mine: Light;
        for (var side = local.z; side < 2u * SLICES; side += SIDES) {
            add_light(&mine, light_of(p, noise_at(id.xy), side / 2u, 1.0 - 2.0 * f32(side % 2u)));
        }
        found[local.z * INVOCATIONS + place] = mine;
    }
    workgroupBarrier();
    if (local.z > 0u || id.x >= cells.x || id.y >= cells.y) {
        return;
    }
    var values: array<vec4<f32>, BLOCKS>;
    if (looks) {
        var light: Light;
        for (var z = 0u; z < SIDES; z++) {
            add_light(&light, found[z * INVOCATIONS + place]);
        }
        let planes = planes_of(light);
        for (var c = 0u; c < SHARES; c++) {
            values[c / 4u][c % 4u] = planes[c + 1u];
        }
    }
    values[SHARES / 4u][SHARES % 4u] = f32(LAYERS - 1u);
    for (var block = 0u; block < BLOCKS; block++) {
        surveyed[(block * cells.y + id.y) * cells.x + id.x] = real4(values[block]);
    }
}
