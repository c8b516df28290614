//! The 1x1 convolution, the kernels that it predicts and the image that they give, cell by cell: the kernels
//! are applied while they are in registers. See [`crate::net::Op::KernelPredict`]; AO-Net §3.3, Eq. 2.

use super::aligned::Aligned;
use super::bands::{Band, Workers};
use super::guide_window::GuideWindow;
use super::kernel_predict::Tile;
use super::level::Isa;
use super::patch_merge;
use super::simd::{Kernel, Simd};
use crate::ao_image::AoImage;
use crate::error::Result;
use crate::gbuffer::GBuffer;
use crate::net::config::KernelWeights;
use crate::net::plan::{Buffer, Plan};
use crate::net::weights::Weights;

/// Vectors of cells that are computed together.
pub(super) const VECTORS: usize = 2;

/// The last step of a network.
#[derive(Debug)]
pub(super) struct Head {
    pub(super) input: Buffer,
    pub(super) guide: Buffer,
    pub(super) patch: usize,
    pub(super) kernel: KernelWeights,
    /// By group of outputs, input channel, output of the group.
    pub(super) weights: Aligned,
    /// One for each output, whole groups.
    pub(super) bias: Aligned,
}

impl Head {
    /// # Errors
    /// When there is not enough memory.
    pub(super) fn new(
        plan: &Plan,
        weights: &Weights,
        isa: Isa,
        (name, [input, guide], patch, kernel): (&str, [usize; 2], usize, KernelWeights),
    ) -> Result<Self> {
        let weight = &weights.get(&format!("{name}.weight")).values;
        let bias = &weights.get(&format!("{name}.bias")).values;
        let (input, guide) = (plan.buffers[input].clone(), plan.buffers[guide].clone());
        let outputs = patch * patch * kernel.outputs_per_pixel();
        let group = isa.accumulators() / VECTORS;
        let padded = outputs.next_multiple_of(group);
        let mut packed = Aligned::zeros(padded * input.channels)?;
        for o in 0..outputs {
            let first = o / group * group * input.channels + o % group;
            for c in 0..input.channels {
                packed[first + c * group] = weight[o * input.channels + c];
            }
        }
        let mut packed_bias = Aligned::zeros(padded)?;
        packed_bias[..outputs].copy_from_slice(bias);
        Ok(Self { input, guide, patch, kernel, weights: packed, bias: packed_bias })
    }

    /// Values of scratch memory that a thread needs.
    pub(super) fn scratch_len(&self, isa: Isa) -> usize {
        Tile::scratch_len(self, VECTORS * isa.lanes())
    }

    /// Runs over the arena into the image.
    pub(super) fn run(
        &self,
        isa: Isa,
        (workers, arena): (&mut Workers, &[f32]),
        (gbuffer, image): (&GBuffer, &mut AoImage),
        horizon_visibility: &[f32],
    ) {
        let base = (self.kernel == KernelWeights::Correction).then_some(horizon_visibility);
        let (input, guide) = (&arena[self.input.range()], &arena[self.guide.range()]);
        let width = image.width();
        workers.for_each_band(image.visibility_mut(), width * self.patch, |band| {
            isa.run(HeadBand { head: self, input, guide, gbuffer, base, band });
        });
    }
}

struct HeadBand<'a> {
    head: &'a Head,
    input: &'a [f32],
    guide: &'a [f32],
    gbuffer: &'a GBuffer,
    /// HxW visibility that the head corrects.
    base: Option<&'a [f32]>,
    band: Band<'a>,
}

impl Kernel for HeadBand<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { head, band, .. } = self;
        let width = self.gbuffer.width();
        let row_len = width * head.patch;
        let cells = width.div_ceil(head.patch);
        let depth = &self.gbuffer.depth()[band.first * row_len..];
        for (i, (image, depth)) in band.values.chunks_mut(row_len).zip(depth.chunks(row_len)).enumerate() {
            let y = band.first + i;
            let base = self.base.map(|base| &base[y * row_len..][..depth.len()]);
            let features = &self.input[y * head.input.row_len()..][..head.input.row_len()];
            for x in (0..cells).step_by(VECTORS * S::LANES) {
                let (buffer, patch) = (&head.guide, head.patch);
                let guide = GuideWindow { guide: self.guide, buffer, patch, y, x };
                let tile = Tile { head, features, guide };
                let visibility = match cells - x > S::LANES {
                    true => tile.run::<S, VECTORS>(simd, band.scratch),
                    false => tile.run::<S, 1>(simd, band.scratch),
                };
                patch_merge::write((image, depth, base), visibility, (patch, width, x));
            }
        }
    }
}
