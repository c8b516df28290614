// Coarser depth for far taps: means of four that prefer the farthest. CPU twin: search/pyramid.rs.
// Intel's XeGTAO 1.30, XeGTAO_DepthMIPFilter. A workgroup makes all levels of 16x16 pixels.

@group(1) @binding(0) var<uniform> levels: Levels;
@group(1) @binding(1) var<storage, read_write> coarse: array<f32>;

/// The last level that was made of these pixels.
var<workgroup> tile: array<f32, 64>;

fn mean(four: vec4<f32>) -> f32 {
    let farthest = max(max(four.x, four.y), max(four.z, four.w));
    let range = frame.radius * RANGE;
    let weights = saturate((range - (farthest - four)) / (range * SOFT));
    return dot(four, weights) / dot(weights, vec4(1.0));
}

fn tile_at(cell: vec2<u32>, first: vec2<u32>) -> f32 {
    let at = min(cell - first, vec2(7u));
    return tile[at.y * 8u + at.x];
}

fn write(level: u32, cell: vec2<u32>, value: f32) {
    if (all(cell < level_size(level))) {
        coarse[levels.first[level - 1u] + cell.y * levels.width[level - 1u] + cell.x] = value;
    }
}

@compute @workgroup_size(8, 8)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    var cell = group.xy * 8u + local.xy;
    var low = 2u * cell;
    var high = min(low + 1u, frame.size - 1u);
    low = min(low, high);
    var value = mean(vec4(
        depth_at(low, 0u),
        depth_at(vec2(high.x, low.y), 0u),
        depth_at(vec2(low.x, high.y), 0u),
        depth_at(high, 0u),
    ));
    write(1u, cell, value);
    for (var level = 2u; level <= COARSER; level++) {
        tile[index] = value;
        workgroupBarrier();
        // First cells of the workgroup in the finer level and in this one; fewer and fewer invocations have one.
        let finer = group.xy * (32u >> level);
        let side = 16u >> level;
        cell = group.xy * side + local.xy;
        low = 2u * cell;
        high = min(low + 1u, level_size(level - 1u) - 1u);
        low = min(low, high);
        let four = vec4(
            tile_at(low, finer),
            tile_at(vec2(high.x, low.y), finer),
            tile_at(vec2(low.x, high.y), finer),
            tile_at(high, finer),
        );
        workgroupBarrier();
        // What the others compute is not used.
        value = mean(four);
        if (all(local.xy < vec2(side))) {
            write(level, cell, value);
        }
    }
}
