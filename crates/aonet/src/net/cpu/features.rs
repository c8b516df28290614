//! Features of a frame, padded and partitioned into patches. See [`crate::net::graph::Op::PatchPartition`].

use super::context::Context;
use super::resample::repeat_ends;
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::frame::size::Size;
use crate::net::config::Features;
use crate::net::features::FeatureRows;
use crate::net::plan::{Buffer, HALO, Layout};
use crate::simd::{Kernel, PIXEL_LANES, Simd};
use crate::threads::Band;

/// Writes the features into a buffer.
#[derive(Debug)]
pub(super) struct PartitionFeatures {
    pub(super) size: Size,
    pub(super) patch: usize,
    /// What the search found, where a channel shows it.
    pub(super) search: Option<Buffer>,
    pub(super) output: Buffer,
}

impl PartitionFeatures {
    /// Values of scratch memory that a thread needs: lines of pixels that become channels together.
    pub(super) fn scratch_len(&self) -> usize {
        let lines = if self.output.layout == Layout::Blocked { PIXEL_LANES.div_ceil(self.patch) } else { 1 };
        lines * self.output.width * self.patch
    }

    /// Runs over the arena.
    pub(super) fn run(&self, context: Context<'_>, features: &Features, gbuffer: &GBuffer, params: AoParams) {
        let Context { isa, workers, arena } = context;
        let search = self.search.as_ref().map_or(0..0, Buffer::range);
        let [output, search] =
            arena.get_disjoint_mut([self.output.range(), search]).expect("live buffers do not overlap");
        let features = FeatureRows::new(features, gbuffer, params, search);
        workers.for_each_band(output, self.output.row_len(), |band| {
            isa.run(FeatureBand { step: self, features: &features, band });
        });
    }

    /// Writes a line of pixels: row `dy` of the patches of row `y`, of feature `c`, each with its last pixel repeated.
    #[inline(always)]
    fn line(&self, features: &FeatureRows<'_>, y: usize, [c, dy]: [usize; 2], line: &mut [f32]) {
        let (width, height) = (self.size.width(), self.size.height());
        features.write(c, (y * self.patch + dy).min(height - 1), &mut line[..width]);
        let last = line[width - 1];
        line[width..].fill(last);
    }

    /// Writes row `y` of cells as planes.
    #[inline(always)]
    fn planar(&self, features: &FeatureRows<'_>, y: usize, line: &mut [f32], row: &mut [f32]) {
        let (patch, pitch) = (self.patch, self.output.width + 2 * HALO);
        // One line of pixels becomes `patch` planes.
        for (i, planes) in row.chunks_exact_mut(patch * pitch).enumerate() {
            self.line(features, y, [i / patch, i % patch], line);
            for (dx, plane) in planes.chunks_exact_mut(pitch).enumerate() {
                let of_phase = line[dx..].iter().step_by(patch);
                plane[HALO..].iter_mut().zip(of_phase).for_each(|(cell, value)| *cell = *value);
                plane[0] = plane[HALO];
                plane[pitch - 1] = plane[pitch - 1 - HALO];
            }
        }
    }

    /// Writes row `y` of cells in blocks. The channels of a block are `RUN` columns of a few lines of a patch.
    #[inline(always)]
    fn blocked<S: Simd, const RUN: usize>(
        &self,
        simd: S,
        features: &FeatureRows<'_>,
        y: usize,
        (lines, row): (&mut [f32], &mut [f32]),
    ) {
        let (patch, width) = (self.patch, self.output.width);
        let lines = &mut lines[..S::LANES / RUN * width * patch];
        for (i, block) in row.chunks_exact_mut((width + 2 * HALO) * S::LANES).enumerate() {
            let first = i * S::LANES;
            if first.is_multiple_of(patch) {
                for (j, line) in lines.chunks_exact_mut(width * patch).enumerate() {
                    let dy = first / patch + j;
                    self.line(features, y, [dy / patch, dy % patch], line);
                }
            }
            let cells = block[HALO * S::LANES..].chunks_exact_mut(S::LANES).take(width);
            for (x, cell) in cells.enumerate() {
                for (j, channels) in cell.chunks_exact_mut(RUN).enumerate() {
                    channels.copy_from_slice(&lines[(j * width + x) * patch + first % patch..][..RUN]);
                }
            }
        }
        repeat_ends(simd, row, width);
    }
}

struct FeatureBand<'a> {
    step: &'a PartitionFeatures,
    features: &'a FeatureRows<'a>,
    band: Band<'a>,
}

impl Kernel for FeatureBand<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Band { first, values, scratch } = self.band;
        let lines = &mut scratch[..self.step.scratch_len()];
        for (i, row) in values.chunks_exact_mut(self.step.output.row_len()).enumerate() {
            let y = first + i;
            match (self.step.output.layout, self.step.patch.min(S::LANES)) {
                (Layout::Blocked, 8) => self.step.blocked::<S, 8>(simd, self.features, y, (lines, row)),
                (Layout::Blocked, 4) => self.step.blocked::<S, 4>(simd, self.features, y, (lines, row)),
                (Layout::Blocked, 2) => self.step.blocked::<S, 2>(simd, self.features, y, (lines, row)),
                (Layout::Blocked, _) => self.step.blocked::<S, 1>(simd, self.features, y, (lines, row)),
                _ => self.step.planar(self.features, y, lines, row),
            }
        }
    }
}
