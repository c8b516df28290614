//! Features of a frame, padded and partitioned into patches. See [`crate::net::graph::Op::PatchPartition`].

use super::context::Context;
use crate::frame::ao_image::AoParams;
use crate::frame::gbuffer::GBuffer;
use crate::frame::size::Size;
use crate::net::config::Features;
use crate::net::features::FeatureRows;
use crate::net::plan::{Buffer, HALO};
use crate::simd::{Kernel, Simd};
use crate::threads::Band;

/// Writes the features into a planar buffer.
#[derive(Debug)]
pub(super) struct PartitionFeatures {
    pub(super) size: Size,
    pub(super) patch: usize,
    /// What the search found, where a channel shows it.
    pub(super) search: Option<Buffer>,
    pub(super) output: Buffer,
}

impl PartitionFeatures {
    /// Values of scratch memory that a thread needs.
    pub(super) fn scratch_len(&self) -> usize {
        self.output.width * self.patch
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

    /// Writes row `y` of cells; `line` has room for a line of pixels.
    #[inline(always)]
    fn row(&self, features: &FeatureRows<'_>, y: usize, line: &mut [f32], row: &mut [f32]) {
        let (patch, width, height) = (self.patch, self.size.width(), self.size.height());
        let pitch = self.output.width + 2 * HALO;
        // One line of pixels becomes `patch` planes.
        for (i, planes) in row.chunks_exact_mut(patch * pitch).enumerate() {
            let (c, dy) = (i / patch, i % patch);
            features.write(c, (y * patch + dy).min(height - 1), &mut line[..width]);
            let last = line[width - 1];
            line[width..].fill(last);
            for (dx, plane) in planes.chunks_exact_mut(pitch).enumerate() {
                let of_phase = line[dx..].iter().step_by(patch);
                plane[HALO..].iter_mut().zip(of_phase).for_each(|(cell, value)| *cell = *value);
                plane[0] = plane[HALO];
                plane[pitch - 1] = plane[pitch - 1 - HALO];
            }
        }
    }
}

struct FeatureBand<'a> {
    step: &'a PartitionFeatures,
    features: &'a FeatureRows<'a>,
    band: Band<'a>,
}

impl Kernel for FeatureBand<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Band { first, values, scratch } = self.band;
        let line = &mut scratch[..self.step.scratch_len()];
        for (i, row) in values.chunks_exact_mut(self.step.output.row_len()).enumerate() {
            self.step.row(self.features, first + i, line, row);
        }
    }
}
