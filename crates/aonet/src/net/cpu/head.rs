//! The 1x1 convolution, the kernels that it predicts and the image that they give, cell by cell: the kernels
//! are applied while they are in registers. See [`crate::net::Op::KernelPredict`]; AO-Net §3.3, Eq. 2.

use super::dot::{Dot, DotKernel};
use super::guide_window::GuideWindow;
use super::kernel_predict::Tile;
use super::packing::{self, Steps};
use super::patch_merge;
use super::precision::Arithmetic;
use super::recipe::Recipe;
use crate::error::Result;
use crate::frame::ao_image::AoImage;
use crate::frame::gbuffer::GBuffer;
use crate::net::config::KernelWeights;
use crate::net::plan::{Buffer, BufferId};
use crate::simd::Simd;
use crate::simd::aligned::Aligned;
use crate::threads::{Band, Workers};

/// Vectors of cells that are computed together.
pub(super) const VECTORS: usize = 2;

/// The last step of a network.
#[derive(Debug)]
pub(super) struct Head {
    arithmetic: Arithmetic,
    pub(super) input: Buffer,
    /// Of the input's integers.
    pub(super) steps: Steps,
    pub(super) guide: Buffer,
    pub(super) patch: usize,
    pub(super) kernel: KernelWeights,
    /// Visibility that the outputs are added to, if there is any.
    base: Option<Buffer>,
    /// By group of outputs, word of input channels, output of the group.
    pub(super) weights: Aligned,
    /// What a sum is worth, for each output, whole groups.
    pub(super) scales: Aligned,
    /// One for each output, whole groups.
    pub(super) biases: Aligned,
}

impl Head {
    /// # Errors
    /// When there is not enough memory, or the ranges of integers are not known.
    pub(super) fn new(
        recipe: &Recipe<'_>,
        (name, [input, guide], patch, kernel): (&str, [BufferId; 2], usize, KernelWeights),
        base: Option<BufferId>,
    ) -> Result<Self> {
        let arithmetic = recipe.arithmetic;
        let (weight, bias) = recipe.parameters(name);
        let steps = recipe.steps(input, arithmetic)?;
        let [input, guide] = [input, guide].map(|id| recipe.plan.buffers[id].clone());
        let outputs = patch * patch * kernel.outputs_per_pixel();
        let group = arithmetic.accumulators() / VECTORS;
        let padded = outputs.next_multiple_of(group);
        let words = input.channels.div_ceil(arithmetic.packed());
        let (mut scales, mut biases) = (Aligned::zeros(padded)?, Aligned::zeros(padded)?);
        let mut weights = Aligned::zeros(padded * words)?;
        for (o, (filter, bias)) in weight.chunks_exact(input.channels).zip(bias).enumerate() {
            let mut filter = filter.to_vec();
            let channels = (0..input.channels).map(|c| (&steps, c));
            let output = packing::quantize(arithmetic, &mut filter, *bias, channels);
            (scales[o], biases[o]) = (output.scale, output.bias);
            let first = o / group * group * words + o % group;
            for (w, numbers) in filter.chunks(arithmetic.packed()).enumerate() {
                weights[first + w * group] = packing::word(arithmetic, numbers.iter().copied());
            }
        }
        let base = base.map(|id| recipe.plan.buffers[id].clone());
        Ok(Self { arithmetic, input, steps, guide, patch, kernel, base, weights, scales, biases })
    }

    /// Values of scratch memory that a thread needs.
    pub(super) fn scratch_len(&self) -> usize {
        Tile::scratch_len(self, VECTORS * self.arithmetic.lanes())
    }

    /// Runs over the arena into the image.
    pub(super) fn run(
        &self,
        (workers, arena): (&mut Workers, &[f32]),
        (gbuffer, image): (&GBuffer, &mut AoImage),
    ) {
        let base = self.base.as_ref().map(|base| &arena[base.range()]);
        let (input, guide) = (&arena[self.input.range()], &arena[self.guide.range()]);
        let width = image.width();
        workers.for_each_band(image.visibility_mut(), width * self.patch, |band| {
            self.arithmetic.run(HeadBand { head: self, input, guide, gbuffer, base, band });
        });
    }
}

struct HeadBand<'a> {
    head: &'a Head,
    input: &'a [f32],
    guide: &'a [f32],
    gbuffer: &'a GBuffer<'a>,
    /// HxW visibility that the head corrects.
    base: Option<&'a [f32]>,
    band: Band<'a>,
}

impl DotKernel for HeadBand<'_> {
    #[inline(always)]
    fn run<D: Dot>(self, dot: D) {
        let Self { head, band, .. } = self;
        let width = self.gbuffer.width();
        let row_len = width * head.patch;
        let cells = width.div_ceil(head.patch);
        let depth = &self.gbuffer.depth()[band.first * row_len..];
        for (i, (image, depth)) in band.values.chunks_mut(row_len).zip(depth.chunks(row_len)).enumerate() {
            let y = band.first + i;
            let base = self.base.map(|base| &base[y * row_len..][..depth.len()]);
            let features = &self.input[y * head.input.row_len()..][..head.input.row_len()];
            for x in (0..cells).step_by(VECTORS * D::Simd::LANES) {
                let (buffer, patch) = (&head.guide, head.patch);
                let guide = GuideWindow { guide: self.guide, buffer, patch, y, x };
                let tile = Tile { head, features, guide };
                let visibility = match cells - x > D::Simd::LANES {
                    true => tile.run::<D, VECTORS>(dot, band.scratch),
                    false => tile.run::<D, 1>(dot, band.scratch),
                };
                patch_merge::write((image, depth, base), visibility, (patch, width, x));
            }
        }
    }
}
