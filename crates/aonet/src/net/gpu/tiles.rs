//! How images of cells are cut into workgroups.

use crate::frame::size::Size;

/// Columns and rows of a workgroup's invocations.
pub(crate) const TILE: [usize; 2] = [16, 2];

/// Workgroups below which a dispatch is cut finer. guess: two for each multiprocessor of a large device.
const ENOUGH_WORKGROUPS: usize = 256;

/// Rows of an invocation for an image of cells. There are fewer rows where there would be too few workgroups.
pub(crate) fn rows(cells: Size, tiles: usize) -> usize {
    let enough =
        |rows: &usize| workgroups(cells, *rows, tiles).iter().product::<usize>() >= ENOUGH_WORKGROUPS;
    [4, 2].into_iter().find(enough).unwrap_or(1)
}

/// Workgroups for an image of cells.
pub(crate) fn workgroups(cells: Size, rows: usize, tiles: usize) -> [usize; 3] {
    [cells.width().div_ceil(TILE[0]), cells.height().div_ceil(TILE[1] * rows), tiles]
}
