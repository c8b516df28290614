// Nearest and farthest depth of the foreground: positive floats are ordered as their bits are. CPU twin:
// net/features.rs, depth_range.

/// Bits of the nearest depth, inverted, and of the farthest; both 0 before.
@group(1) @binding(0) var<storage, read_write> range: array<atomic<u32>, 2>;

var<workgroup> of_workgroup: array<atomic<u32>, 2>;

@compute @workgroup_size(TILE_WIDTH, TILE_HEIGHT)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) index: u32) {
    if (index < 2u) {
        atomicStore(&of_workgroup[index], 0u);
    }
    workgroupBarrier();
    let depth = depth_at(min(id.xy, frame.size - 1u), 0u);
    if (depth < BACKGROUND) {
        atomicMax(&of_workgroup[0], ~bitcast<u32>(depth));
        atomicMax(&of_workgroup[1], bitcast<u32>(depth));
    }
    workgroupBarrier();
    if (index < 2u) {
        atomicMax(&range[index], atomicLoad(&of_workgroup[index]));
    }
}
