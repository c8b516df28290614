// Matrices that a subgroup holds: an extension of wgpu's. A matrix of inputs comes from `cells`, one of filters from `weights`, and
// sums go to `found`, all of which hold blocks of four channels.

/// Subgroup and lane.
fn mine(wave: u32, lane: u32, index: u32) -> vec2<u32> {
    return vec2(wave, lane);
}

/// Cells by inputs, `stride` blocks from row to row.
fn cells_at(first: u32, stride: u32) -> MatrixA {
    return coopLoadT<MatrixA>(&cells[first], stride);
}

/// Inputs by outputs, column by column: a lane reads inputs that lie side by side.
fn filters_at(first: u32) -> MatrixB {
    return coopLoad<MatrixB>(&weights[first], SIDE / 4u);
}

fn multiply_add(cells: MatrixA, filters: MatrixB, sums: MatrixC) -> MatrixC {
    return coopMultiplyAdd(cells, filters, sums);
}

/// Cells by outputs, `stride` blocks from row to row.
fn stage(sums: MatrixC, first: u32, stride: u32) {
    coopStoreT(sums, &found[first], stride);
}
