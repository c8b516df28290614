//! A tile of cells through a head that corrects every pixel by one value: the lanes of a vector are pixels of one patch, so that what the
//! search found beside them is weighed while the weights are in registers. See [`crate::net::graph::Op::Correct`].

use super::dot::Dot;
use super::head_weights::{HeadWeights, Order};
use super::patch_merge::{Base, Cells};
use crate::net::neighbours::UNIT;
use crate::net::plan::CHANNEL_BLOCK;
use crate::simd::Simd;

/// Cells that are computed together.
pub(super) const CELLS: usize = 4;
/// Vectors of outputs that are computed together.
pub(super) const GROUP: usize = 6;
/// Cells of a tile: as many as share the weights of a group of outputs while these are in the first cache.
const TILE: usize = 32;

/// Neighbouring cells of a row.
pub(super) struct PatchTile<'a> {
    pub(super) weights: &'a HeadWeights,
    /// The row of the head's input.
    pub(super) features: &'a [f32],
    /// What a search found, if it is corrected.
    pub(super) base: Option<Base<'a>>,
    /// Of the frame (px).
    pub(super) width: usize,
    /// Index of the first cell.
    pub(super) first: usize,
}

/// What the search found at the pixels of a tile and around them, row by row.
#[derive(Clone, Copy)]
struct Window<'a, const PATCH: usize> {
    found: &'a [f32],
    /// Values from one row to the next.
    pitch: usize,
    /// How far it reaches beyond the tile (px).
    reach: usize,
}

impl<const PATCH: usize> Window<'_, PATCH> {
    /// Vector `part` of the pixels that lie `down` and `right` of a cell's.
    #[inline(always)]
    fn patch<S: Simd>(&self, simd: S, cell: usize, part: usize, [down, right]: [isize; 2]) -> S::F {
        let corner = self.reach.wrapping_add_signed(down) * self.pitch
            + (self.reach + cell * PATCH).wrapping_add_signed(right);
        let four = |i: usize| {
            let pixel = part * S::LANES + 4 * i;
            corner + pixel / PATCH * self.pitch + pixel % PATCH
        };
        simd.load_fours(self.found, four)
    }
}

/// The pixels of a tile, patch by patch.
struct Pixels<'a, const PATCH: usize> {
    window: Window<'a, PATCH>,
    /// What the search found there.
    found: &'a mut [f32],
    /// Visibility, as far as it is computed.
    values: &'a mut [f32],
}

impl<const PATCH: usize> Pixels<'_, PATCH> {
    /// Adds a vector of outputs of the convolution to the cells from `first` on: corrections, or weights of one neighbour.
    #[inline(always)]
    fn add<D: Dot>(
        &mut self,
        dot: D,
        head: &HeadWeights,
        (vector, sums): (usize, &[D::Sums; CELLS]),
        first: usize,
    ) {
        let (simd, lanes) = (dot.simd(), D::Simd::LANES);
        let parts = PATCH * PATCH / lanes;
        let (plane, part) = (vector / parts, vector % parts);
        let (scale, bias) =
            (simd.load(&head.scales[vector * lanes..]), simd.load(&head.biases[vector * lanes..]));
        for (c, sums) in sums.iter().enumerate() {
            let output = dot.finish(*sums, scale, bias);
            let at = ((first + c) * parts + part) * lanes;
            let (found, values) = (&mut self.found[at..][..lanes], &mut self.values[at..][..lanes]);
            let value = if plane == 0 {
                let here = self.window.patch(simd, first + c, part, [0, 0]);
                simd.store(here, found);
                simd.add(output, here)
            } else {
                let there = self.window.patch(simd, first + c, part, head.neighbours[plane - 1]);
                let more = simd.sub(there, simd.load(found));
                simd.add(simd.load(values), simd.mul(simd.mul(simd.splat(UNIT), output), more))
            };
            simd.store(value, values);
        }
    }
}

impl PatchTile<'_> {
    /// Values of scratch memory: the input's words, the window and the pixels.
    pub(super) fn scratch_len(head: &HeadWeights) -> usize {
        let (rows, pitch) = window_size(head.patch, reach(head));
        TILE * (head.input.channels.next_multiple_of(CHANNEL_BLOCK) + 2 * head.patch * head.patch)
            + rows * pitch
    }

    /// First cells of the tiles of a row.
    pub(super) fn firsts(cells: usize) -> impl Iterator<Item = usize> {
        (0..cells).step_by(TILE)
    }

    /// The visibility of the cells, not clamped.
    #[inline(always)]
    pub(super) fn run<'s, D: Dot>(&self, dot: D, scratch: &'s mut [f32]) -> Cells<'s> {
        assert!(D::Simd::ACCUMULATORS >= CELLS * GROUP, "registers for the sums");
        match self.weights.patch {
            4 => self.run_patches::<D, 4>(dot, scratch),
            8 => self.run_patches::<D, 8>(dot, scratch),
            patch => unreachable!("patches of {patch}"),
        }
    }

    #[inline(always)]
    fn run_patches<'s, D: Dot, const PATCH: usize>(&self, dot: D, scratch: &'s mut [f32]) -> Cells<'s> {
        let lanes = D::Simd::LANES;
        let HeadWeights { input, neighbours, weights, .. } = self.weights;
        let words = input.channels.div_ceil(D::PACKED);
        let pitch = input.channels.next_multiple_of(lanes) / D::PACKED;
        let count = (self.width.div_ceil(PATCH) - self.first).min(TILE);
        let reach = reach(self.weights);
        let (rows, columns) = window_size(PATCH, reach);
        let (packed, rest) = scratch.split_at_mut(TILE * pitch);
        let (window, rest) = rest.split_at_mut(rows * columns);
        let (found, rest) = rest.split_at_mut(TILE * PATCH * PATCH);
        let values = &mut rest[..TILE * PATCH * PATCH];
        for (i, packed) in packed.chunks_exact_mut(CELLS * pitch).take(count.div_ceil(CELLS)).enumerate() {
            let first = self.first + i * CELLS;
            self.weights.pack(dot, self.features, (first, CELLS), packed);
        }
        self.copy(window, (reach, columns));
        let window = Window { found: window, pitch: columns, reach };
        let mut pixels = Pixels::<PATCH> { window, found, values };
        let vectors = (1 + neighbours.len()) * PATCH * PATCH / lanes;
        for (group, weights) in weights.chunks_exact(GROUP * words * lanes).enumerate() {
            for first in (0..count).step_by(CELLS) {
                let mut sums = [[dot.zero(); CELLS]; GROUP];
                let (inputs, _) = packed[first * pitch..].as_chunks::<CELLS>();
                for (weights, inputs) in weights.chunks_exact(GROUP * lanes).zip(inputs) {
                    let mut values = [dot.splat(0.0); CELLS];
                    for c in 0..CELLS {
                        values[c] = dot.splat(inputs[c]);
                    }
                    for k in 0..GROUP {
                        let weight = dot.load(&weights[k * lanes..]);
                        for c in 0..CELLS {
                            sums[k][c] = dot.add(values[c], weight, sums[k][c]);
                        }
                    }
                }
                for (k, sums) in sums.iter().enumerate().take(vectors - group * GROUP) {
                    pixels.add(dot, self.weights, (group * GROUP + k, sums), first);
                }
            }
        }
        Cells { values: pixels.values, order: Order::Pixels, first: self.first, count, patch: PATCH }
    }

    /// Copies what the search found; edges repeat. Zeros if nothing is corrected.
    #[inline(always)]
    fn copy(&self, window: &mut [f32], (reach, columns): (usize, usize)) {
        let Some(Base { found, row_len, first: top, .. }) = self.base else {
            return window.fill(0.0);
        };
        let (last, left) = (found.len() / row_len - 1, self.first * self.weights.patch);
        for (y, to) in window.chunks_exact_mut(columns).enumerate() {
            let row = (top + y).saturating_sub(reach).min(last);
            let line = &found[row * row_len..][..self.width];
            let inside = left.checked_sub(reach).and_then(|from| line.get(from..from + columns));
            match inside {
                Some(inside) => to.copy_from_slice(inside),
                None => {
                    for (x, to) in to.iter_mut().enumerate() {
                        *to = line[(left + x).saturating_sub(reach).min(self.width - 1)];
                    }
                }
            }
        }
    }
}

/// How far the neighbours lie from a pixel, at most (px).
fn reach(head: &HeadWeights) -> usize {
    head.neighbours.iter().flatten().map(|offset| offset.unsigned_abs()).max().unwrap_or(0)
}

/// Rows and columns of a tile with its neighbours (px).
fn window_size(patch: usize, reach: usize) -> (usize, usize) {
    (patch + 2 * reach, TILE * patch + 2 * reach)
}
