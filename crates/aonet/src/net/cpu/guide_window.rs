//! The normals that the kernels of a few neighbouring cells weigh.

use crate::net::kernel::{FIRST_TAP, GUIDE_CHANNELS, WINDOW};
use crate::net::plan::{Buffer, HALO};

/// Side of the square of pixels that the kernels of one patch reach.
pub(super) fn window_side(patch: usize) -> usize {
    patch + WINDOW - 1
}

/// Normal components of that square.
pub(super) fn window_len(patch: usize) -> usize {
    window_side(patch) * window_side(patch) * GUIDE_CHANNELS
}

/// Where the normals are.
#[derive(Clone, Copy)]
pub(super) struct GuideWindow<'a> {
    /// The partitioned features.
    pub(super) guide: &'a [f32],
    pub(super) buffer: &'a Buffer,
    /// Side of a patch (px).
    pub(super) patch: usize,
    /// Row of cells.
    pub(super) y: usize,
    /// First cell.
    pub(super) x: usize,
}

impl GuideWindow<'_> {
    /// Copies, for each pixel of the square and each component, the values of `cells` cells; edges repeat.
    #[inline(always)]
    pub(super) fn copy_to(&self, out: &mut [f32], cells: usize) {
        match self.patch {
            1 => self.copy::<1>(out, cells),
            2 => self.copy::<2>(out, cells),
            4 => self.copy::<4>(out, cells),
            8 => self.copy::<8>(out, cells),
            patch => unreachable!("patches of {patch}"),
        }
    }

    #[inline(always)]
    fn copy<const PATCH: usize>(&self, out: &mut [f32], cells: usize) {
        let Buffer { width, height, .. } = *self.buffer;
        let pitch = width + 2 * HALO;
        let mut lines = out.chunks_exact_mut(cells);
        for dy in 0..window_side(PATCH) {
            let y = clamped::<PATCH>(self.y, dy, height);
            let row = &self.guide[y / PATCH * self.buffer.row_len()..][..self.buffer.row_len()];
            for dx in 0..window_side(PATCH) {
                let x = clamped::<PATCH>(self.x, dx, width);
                let before = self.x == 0 && dx < FIRST_TAP.unsigned_abs();
                let inside = !before && x / PATCH + cells <= width;
                for (c, out) in lines.by_ref().take(GUIDE_CHANNELS).enumerate() {
                    let first = (c * PATCH + y % PATCH) * PATCH * pitch + HALO;
                    if inside {
                        out.copy_from_slice(&row[first + x % PATCH * pitch + x / PATCH..][..cells]);
                        continue;
                    }
                    for (cell, out) in out.iter_mut().enumerate() {
                        let x = clamped::<PATCH>(self.x + cell, dx, width);
                        *out = row[first + x % PATCH * pitch + x / PATCH];
                    }
                }
            }
        }
    }
}

/// Pixel `offset` of the window of a cell, clamped to an image of `cells` cells.
#[inline(always)]
fn clamped<const PATCH: usize>(cell: usize, offset: usize, cells: usize) -> usize {
    let position = (cell * PATCH + offset) as isize + FIRST_TAP;
    position.clamp(0, (cells * PATCH) as isize - 1) as usize
}
