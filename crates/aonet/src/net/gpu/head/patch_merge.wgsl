// A head without kernels: its outputs are the pixels of the patches, four at a time. CPU twin: cpu/patch_merge.rs.

/// The pixels of the patches that a group has.
fn predict(group: u32, column: u32, first_row: u32) {
    for (var first = 4u * group; first < PATCH * PATCH; first += 4u * GROUPS) {
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
