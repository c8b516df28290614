//! Cooperative matrices: the invocations of a subgroup multiply small matrices together, on units made for that (tensor
//! cores, matrix cores).

use crate::frame::size::Size;

/// Subgroups of a workgroup.
pub(crate) const WAVES: usize = 4;
/// Channels that a workgroup computes at most: with two rows of cells and a side of 16, eight sums a subgroup.
const MAX_CHANNELS: usize = 64;
/// Workgroups below which a dispatch is cut finer. guess: two for each multiprocessor of a large device.
const ENOUGH_WORKGROUPS: usize = 256;

/// The products of matrices that a device computes: squares of half floats, summed in 32 bits.
///
/// They need features of the device, one of which is experimental in wgpu. `Device` uses them only after a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Matrices {
    /// Rows and columns: 8 or 16.
    pub(crate) side: usize,
    /// Invocations of a subgroup.
    pub(crate) lanes: usize,
    /// Whether shaders spell the products out, so that any device can run them.
    #[cfg(test)]
    pub(crate) spelt_out: bool,
}

impl Matrices {
    /// Invocations of a workgroup.
    pub(crate) fn invocations(self) -> usize {
        WAVES * self.lanes
    }

    /// Matrices of outputs of a workgroup at most.
    pub(crate) fn max_tiles(self) -> usize {
        MAX_CHANNELS / self.side
    }

    /// Rows of cells of a subgroup, for an image of cells and a number of tiles of channels. There are fewer rows where
    /// there would be too few workgroups.
    pub(crate) fn rows(self, cells: Size, tiles: usize) -> usize {
        let enough = self.workgroups(cells, 2, tiles).iter().product::<usize>() >= ENOUGH_WORKGROUPS;
        if enough { 2 } else { 1 }
    }

    /// Workgroups for an image of cells.
    pub(crate) fn workgroups(self, cells: Size, rows: usize, tiles: usize) -> [usize; 3] {
        [cells.width().div_ceil(self.side), cells.height().div_ceil(WAVES * rows), tiles]
    }
}
