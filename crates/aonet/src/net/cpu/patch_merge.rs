//! From the pixels of patches to rows of the image. See [`crate::net::graph::Op::PatchMerge`].

use super::head_weights::{Order, VECTORS};
use crate::net::neighbours::UNIT;
use crate::net::plan::CHANNEL_BLOCK;
use crate::simd::transpose::{self, four};
use std::slice::ChunksExact;

/// Pixels of a line of the cells that are written together, at most: those of the widest vectors and patches.
const MOST_PIXELS: usize = VECTORS * CHANNEL_BLOCK * 8;

/// Neighbouring cells of a row of cells, as patches of pixels.
pub(super) struct Cells<'a> {
    /// With cells side by side: for each plane and pixel of a patch, its value in every cell, visibility, or a correction and weights of
    /// shares. With pixels side by side: for each cell, the visibility of the pixels of its patch.
    pub(super) values: &'a [f32],
    /// Which of them lie side by side.
    pub(super) order: Order,
    /// Index of the first cell.
    pub(super) first: usize,
    pub(super) count: usize,
    /// Side of a patch (px).
    pub(super) patch: usize,
}

/// What a search found, and what corrects it. See [`crate::net::graph::Op::Correct`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Base<'a> {
    /// Of the frame, plane by plane in every line.
    pub(super) found: &'a [f32],
    /// Values from one line to the next.
    pub(super) row_len: usize,
    /// The line of the frame that is the first one here.
    pub(super) first: usize,
    /// The correction, and weights of shares.
    pub(super) planes: usize,
    /// Rows and columns to the neighbours, whose weights follow.
    pub(super) neighbours: &'a [[isize; 2]],
}

/// The lines of pixels of a row of cells.
pub(super) struct Lines<'a> {
    /// Where the visibility is written.
    pub(super) image: &'a mut [f32],
    pub(super) depth: &'a [f32],
    /// What a search found, if it is corrected.
    pub(super) base: Option<Base<'a>>,
    /// Of a line (px).
    pub(super) width: usize,
}

impl Lines<'_> {
    /// Writes the visibility of cells: [0, 1], 1 where the depth is infinite.
    #[inline(always)]
    pub(super) fn write(&mut self, cells: &Cells<'_>) {
        let (width, patch, count) = (self.width, cells.patch, cells.count);
        let first = cells.first * patch;
        let last = width.min(first + count * patch);
        let lines = self.image.chunks_exact_mut(width).zip(self.depth.chunks_exact(width));
        for (dy, (line, depth)) in lines.enumerate() {
            let (line, depth) = (&mut line[first..last], &depth[first..last]);
            cells.write(0, dy, line);
            if let Some(base) = self.base {
                base.correct(line, (first, width), (cells, dy));
            }
            for (value, depth) in line.iter_mut().zip(depth) {
                // NaN, from weights so large that sums overflow, becomes 0.
                let visibility = if *value > 0.0 { value.min(1.0) } else { 0.0 };
                *value = if *depth == f32::INFINITY { 1.0 } else { visibility };
            }
        }
    }
}

impl Base<'_> {
    /// Makes visibility of the correction in line `dy` of cells, from column `first` of the frame on.
    #[inline(always)]
    fn correct(&self, line: &mut [f32], (first, width): (usize, usize), (cells, dy): (&Cells<'_>, usize)) {
        let count = line.len();
        let own = &self.found[(self.first + dy) * self.row_len..];
        let here = &own[first..first + count];
        for (value, found) in line.iter_mut().zip(here) {
            *value += found;
        }
        if self.planes == 1 && self.neighbours.is_empty() {
            return;
        }
        let (mut weights, mut beside) = ([0.0; MOST_PIXELS], [0.0; MOST_PIXELS]);
        let weights = &mut weights[..count];
        for plane in 1..self.planes {
            cells.write(plane, dy, weights);
            let shares = &own[plane * width + first..][..count];
            for ((value, share), weight) in line.iter_mut().zip(shares).zip(&*weights) {
                *value += share * weight;
            }
        }
        for (k, [down, right]) in self.neighbours.iter().enumerate() {
            cells.write(self.planes + k, dy, weights);
            let there =
                self.neighbour((self.first + dy, first), [*down, *right], width, &mut beside[..count]);
            for ((value, (there, here)), weight) in line.iter_mut().zip(there.iter().zip(here)).zip(&*weights)
            {
                *value += UNIT * weight * (there - here);
            }
        }
    }

    /// What the search found `down` and `right` of pixels of a row, from column `first` on; edges repeat.
    #[inline(always)]
    fn neighbour<'a>(
        &'a self,
        (row, first): (usize, usize),
        [down, right]: [isize; 2],
        width: usize,
        beside: &'a mut [f32],
    ) -> &'a [f32] {
        let rows = self.found.len() / self.row_len;
        let row = row.saturating_add_signed(down).min(rows - 1);
        let line = &self.found[row * self.row_len..][..width];
        let from = first.checked_add_signed(right);
        if let Some(inside) = from.and_then(|from| line.get(from..from + beside.len())) {
            return inside;
        }
        for (i, value) in beside.iter_mut().enumerate() {
            *value = line[(first + i).saturating_add_signed(right).min(width - 1)];
        }
        beside
    }
}

impl Cells<'_> {
    /// Writes line `dy` of the patches of a plane.
    #[inline(always)]
    fn write(&self, plane: usize, dy: usize, line: &mut [f32]) {
        let (patch, count) = (self.patch, self.count);
        if self.order == Order::Pixels {
            return match patch {
                4 => copy::<4>(self.values, dy, line),
                8 => copy::<8>(self.values, dy, line),
                _ => unreachable!("patches of {patch}"),
            };
        }
        let first = (plane * patch + dy) * patch * count;
        let phases = self.values[first..][..patch * count].chunks_exact(count);
        match patch {
            1 => interleave::<1>(phases, line),
            2 => interleave::<2>(phases, line),
            4 => interleave::<4>(phases, line),
            8 => interleave::<8>(phases, line),
            _ => unreachable!("patches of {patch}"),
        }
    }
}

/// Row `dy` of each patch becomes its pixels.
#[inline(always)]
fn copy<const PATCH: usize>(patches: &[f32], dy: usize, line: &mut [f32]) {
    let mut rows = patches.as_chunks::<PATCH>().0.iter().skip(dy).step_by(PATCH);
    let (whole, rest) = line.as_chunks_mut::<PATCH>();
    whole.iter_mut().zip(&mut rows).for_each(|(to, row)| *to = *row);
    rest.iter_mut().zip(rows.next().into_iter().flatten()).for_each(|(to, value)| *to = *value);
}

/// Value `cell` of phase `dx` becomes pixel `cell * PATCH + dx`.
#[inline(always)]
fn interleave<const PATCH: usize>(phases: ChunksExact<'_, f32>, line: &mut [f32]) {
    let mut phase = [&[][..]; PATCH];
    phase.iter_mut().zip(phases).for_each(|(phase, values)| *phase = values);
    let (whole, rest) = line.as_chunks_mut::<PATCH>();
    let count = whole.len();
    assert!(count <= phase[0].len());
    let transposed = if PATCH.is_multiple_of(4) { count / 4 * 4 } else { 0 };
    let (fours, others) = whole.split_at_mut(transposed);
    for (i, cells) in fours.chunks_exact_mut(4).enumerate() {
        for dx in (0..PATCH).step_by(4) {
            let of_phase = |k: usize| four(phase[dx + k], 4 * i);
            let columns = transpose::columns([of_phase(0), of_phase(1), of_phase(2), of_phase(3)]);
            for (pixels, column) in cells.iter_mut().zip(&columns) {
                pixels[dx..dx + 4].copy_from_slice(column);
            }
        }
    }
    for (i, pixels) in others.iter_mut().enumerate() {
        for (pixel, values) in pixels.iter_mut().zip(&phase) {
            *pixel = values[transposed + i];
        }
    }
    rest.iter_mut().zip(&phase).for_each(|(pixel, values)| *pixel = values[count]);
}
