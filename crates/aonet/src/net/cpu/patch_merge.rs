//! From the pixels of patches to rows of the image. See [`crate::net::graph::Op::PatchMerge`].

use super::head_weights::VECTORS;
use crate::net::plan::CHANNEL_BLOCK;
use std::slice::ChunksExact;

/// Pixels of a line of the cells that are written together, at most: those of the widest vectors and patches.
const MOST_PIXELS: usize = VECTORS * CHANNEL_BLOCK * 8;

/// Neighbouring cells of a row of cells, as patches of pixels.
pub(super) struct Cells<'a> {
    /// For each plane and pixel of a patch, its value in every cell: visibility, or a correction and weights of shares.
    pub(super) values: &'a [f32],
    /// Index of the first cell.
    pub(super) first: usize,
    pub(super) count: usize,
    /// Side of a patch (px).
    pub(super) patch: usize,
}

/// The lines of pixels of a row of cells.
pub(super) struct Lines<'a> {
    /// Where the visibility is written.
    pub(super) image: &'a mut [f32],
    pub(super) depth: &'a [f32],
    /// What a search found, if it is corrected, plane by plane in every line, and the number of values from one line to the next.
    pub(super) base: Option<(&'a [f32], usize)>,
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
            if let Some((base, stride)) = self.base {
                let planes = base[dy * stride..].chunks(width).take(cells.planes());
                for (plane, found) in planes.enumerate() {
                    let pairs = line.iter_mut().zip(&found[first..last]);
                    if plane == 0 {
                        pairs.for_each(|(value, found)| *value += found);
                        continue;
                    }
                    let mut weights = [0.0; MOST_PIXELS];
                    cells.write(plane, dy, &mut weights[..last - first]);
                    pairs.zip(&weights).for_each(|((value, share), weight)| *value += share * weight);
                }
            }
            for (value, depth) in line.iter_mut().zip(depth) {
                // NaN, from weights so large that sums overflow, becomes 0.
                let visibility = if *value > 0.0 { value.min(1.0) } else { 0.0 };
                *value = if *depth == f32::INFINITY { 1.0 } else { visibility };
            }
        }
    }
}

impl Cells<'_> {
    /// Planes of values.
    #[inline(always)]
    fn planes(&self) -> usize {
        self.values.len() / (self.patch * self.patch * self.count)
    }

    /// Writes line `dy` of the patches of a plane.
    #[inline(always)]
    fn write(&self, plane: usize, dy: usize, line: &mut [f32]) {
        let (patch, count) = (self.patch, self.count);
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

/// Value `cell` of phase `dx` becomes pixel `cell * PATCH + dx`.
#[inline(always)]
fn interleave<const PATCH: usize>(phases: ChunksExact<'_, f32>, line: &mut [f32]) {
    let mut phase = [&[][..]; PATCH];
    phase.iter_mut().zip(phases).for_each(|(phase, values)| *phase = values);
    let (whole, rest) = line.as_chunks_mut::<PATCH>();
    assert!(whole.len() <= phase[0].len());
    for (cell, pixels) in whole.iter_mut().enumerate() {
        for (pixel, values) in pixels.iter_mut().zip(&phase) {
            *pixel = values[cell];
        }
    }
    rest.iter_mut().zip(&phase).for_each(|(pixel, values)| *pixel = values[whole.len()]);
}
