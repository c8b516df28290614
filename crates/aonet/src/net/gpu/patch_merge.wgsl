// A head without kernels: its outputs are the pixels of the patches, four at a time. CPU twin: cpu/patch_merge.rs.

@compute @workgroup_size(16, 2, GROUPS)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let column = group.x * 16u + local.x;
    let first_row = (group.y * 2u + local.y) * CELLS;
    for (var first = 4u * local.z; first < PATCH * PATCH; first += 4u * GROUPS) {
        var pixels = outputs(first / 4u, column, first_row);
        for (var cell = 0u; cell < CELLS; cell++) {
            for (var k = 0u; k < 4u; k++) {
                if (first + k < PATCH * PATCH) {
                    write(first + k, column, first_row + cell, pixels[cell][k]);
                }
            }
        }
    }
}
