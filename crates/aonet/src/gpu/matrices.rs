//! Cooperative matrices: the invocations of a subgroup multiply small matrices together, on units made for that (tensor
//! cores, matrix cores).

use crate::gpu::program::{Grid, Number};

/// Subgroups of a workgroup.
pub(crate) const WAVES: usize = 4;
/// Channels that a workgroup computes at most: with two rows of cells and a side of 16, four sums a subgroup. On an H100, 64
/// take 1.2 times as long.
const MAX_CHANNELS: usize = 32;

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

    /// Workgroups for an image of cells, with so many rows of a subgroup and tiles of channels.
    pub(crate) fn workgroups(self, cells: &Grid, rows: usize, tiles: usize) -> [Number; 3] {
        cells.workgroups([self.side, WAVES * rows], tiles)
    }
}
