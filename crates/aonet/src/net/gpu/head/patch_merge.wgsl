// A head without kernels: its outputs are the values of a cell, plane by plane and pixel of the patch by pixel, four at a time.
// CPU twin: cpu/patch_merge.rs.

/// The values that a group has.
fn predict(group: u32, column: u32, first_row: u32) {
    for (var first = 4u * group; first < VALUES; first += 4u * GROUPS) {
        var values = outputs(first / 4u, column, first_row);
        for (var cell = 0u; cell < CELLS; cell++) {
            for (var k = 0u; k < 4u; k++) {
                if (first + k < VALUES) {
                    write(first + k, column, first_row + cell, values[cell][k]);
                }
            }
        }
    }
}
