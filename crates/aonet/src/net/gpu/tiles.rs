//! How images of cells are cut into workgroups.

use crate::gpu::program::{Grid, Number};

/// Columns and rows of a workgroup's invocations.
pub(crate) const TILE: [usize; 2] = [16, 2];

/// Workgroup memory that convolutions fill at most: three quarters of what every device has. On an H100 the rest costs more, for
/// fewer workgroups side by side, than it gives.
pub(crate) const WORKGROUP_BYTES: usize = 12288;

/// Rows of an invocation: many, or fewer where there would be too few workgroups.
pub(crate) const ROWS: [usize; 3] = [4, 2, 1];

/// Workgroups for an image of cells, with so many rows of an invocation and tiles of channels.
pub(crate) fn workgroups(cells: &Grid, rows: usize, tiles: usize) -> [Number; 3] {
    cells.workgroups([TILE[0], TILE[1] * rows], tiles)
}
