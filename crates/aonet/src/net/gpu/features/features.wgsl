// Features of the frame, padded and partitioned into patches: see Op::PatchPartition. CPU twin: cpu/features.rs.
//
// An invocation writes four pixels of the patch of a cell: a block of four channels for every feature. Without patches,
// it writes all features of its pixel.

@group(1) @binding(0) var<uniform> cells: vec2<u32>;
@group(1) @binding(1) var<storage, read_write> output: array<real4>;

fn projected_radius(s: Surface) -> f32 {
    let log2_depth = select(0.0, log2(s.depth), perspective());
    let radius = select(LOG2_PX_LOW, frame.log2_radius_px - log2_depth, s.foreground);
    return (clamp(radius, LOG2_PX_LOW, LOG2_PX_HIGH) - LOG2_PX_MEAN) * LOG2_PX_SCALE;
}

fn write(block: u32, cell: vec2<u32>, value: vec4<f32>) {
    output[(block * cells.y + cell.y) * cells.x + cell.x] = real4(value);
}

@compute @workgroup_size(TILE_WIDTH, TILE_HEIGHT)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= cells.x || id.y >= cells.y) {
        return;
    }
    let last = frame.size - 1u;
    if (PATCH == 1u) {
        let pixel = min(id.xy, last);
        var features = features_of(surface_at(pixel), pixel);
        for (var block = 0u; block < (FEATURES + 3u) / 4u; block++) {
            var value: vec4<f32>;
            for (var k = 0u; k < min(4u, FEATURES - 4u * block); k++) {
                value[k] = features[4u * block + k];
            }
            write(block, id.xy, value);
        }
        return;
    }
    var columns: array<vec4<f32>, FEATURES>;
    for (var k = 0u; k < 4u; k++) {
        let of_patch = 4u * id.z + k;
        let pixel = min(id.xy * PATCH + vec2(of_patch % PATCH, of_patch / PATCH), last);
        var features = features_of(surface_at(pixel), pixel);
        for (var c = 0u; c < FEATURES; c++) {
            columns[c][k] = features[c];
        }
    }
    for (var c = 0u; c < FEATURES; c++) {
        write(c * (PATCH * PATCH / 4u) + id.z, id.xy, columns[c]);
    }
}
