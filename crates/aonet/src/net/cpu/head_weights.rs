//! Weights of the head's 1x1 convolution in the order in which its inner loops read them.

use super::dot::Dot;
use super::packing::{self, Steps};
use super::patch_head::{CELLS, GROUP};
use super::recipe::{Parameters, Recipe};
use crate::error::Result;
use crate::net::config::KernelWeights;
use crate::net::neighbours;
use crate::net::plan::{Buffer, CHANNEL_BLOCK, HALO, HeadStep};
use crate::simd::Simd;
use crate::simd::aligned::Aligned;
use crate::simd::transpose::{self, four};

/// Vectors of cells that are computed together.
pub(super) const VECTORS: usize = 2;

/// The 1x1 convolution, and what its outputs are.
#[derive(Debug)]
pub(super) struct HeadWeights {
    pub(super) input: Buffer,
    /// Of the input's integers.
    pub(super) steps: Steps,
    /// Side of a patch (px).
    pub(super) patch: usize,
    pub(super) kernel: KernelWeights,
    /// Values for each pixel, but for the weights of neighbours.
    pub(super) planes: usize,
    /// Rows and columns to the neighbours.
    pub(super) neighbours: Vec<[isize; 2]>,
    /// Which outputs lie side by side.
    pub(super) order: Order,
    /// By group of outputs, word of input channels, output of the group.
    pub(super) weights: Aligned,
    /// What a sum is worth, for each output, whole groups.
    pub(super) scales: Aligned,
    /// One for each output, whole groups.
    pub(super) biases: Aligned,
}

/// What the lanes of a vector are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// Cells: for kernels, for several values a pixel, for patches of fewer than four pixels a row, and with few registers.
    Cells,
    /// Pixels of a patch. See [`super::patch_head`].
    Pixels,
}

impl HeadWeights {
    /// # Errors
    /// When there is not enough memory, or the ranges of integers are not known.
    pub(super) fn new(recipe: &Recipe<'_>, step: &HeadStep) -> Result<Self> {
        let HeadStep { ref name, patch, kernel, planes, .. } = *step;
        let arithmetic = recipe.arithmetic;
        let Parameters { weight, bias } = recipe.parameters(name);
        let steps = recipe.steps(step.input, arithmetic)?;
        let input = recipe.plan.buffers[step.input].clone();
        let outputs = step.outputs();
        // With AVX2, whose registers do not hold the sums, pixels take 1.08 of the time of cells.
        let sums_fit = arithmetic.accumulators() >= CELLS * GROUP;
        let order = match kernel {
            KernelWeights::Off if planes == 1 && patch >= 4 && sums_fit => Order::Pixels,
            _ => Order::Cells,
        };
        // Outputs of a group.
        let group = match order {
            Order::Cells => arithmetic.accumulators() / VECTORS,
            Order::Pixels => GROUP * arithmetic.lanes(),
        };
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
        let neighbours = neighbours::offsets(&step.neighbours);
        Ok(Self { input, steps, patch, kernel, planes, neighbours, order, weights, scales, biases })
    }

    /// Packs the input of `count` cells, a multiple of four, from cell `start` of a row of features on. `out` has a line for each word of
    /// channels, with a word for each cell. Cells beyond the image repeat the last one.
    #[inline(always)]
    pub(super) fn pack<D: Dot>(
        &self,
        dot: D,
        features: &[f32],
        (start, count): (usize, usize),
        out: &mut [f32],
    ) {
        let (lanes, words) = (D::Simd::LANES, D::Simd::LANES / D::PACKED);
        let width = self.input.width;
        let blocks = features.chunks_exact((width + 2 * HALO) * lanes);
        for (i, (block, out)) in blocks.zip(out.chunks_exact_mut(words * count)).enumerate() {
            let Steps { per_unit, zero } = &self.steps;
            let (per_unit, zero) = (&per_unit[i * lanes..], &zero[i * lanes..]);
            for cell in (0..count).step_by(4) {
                let mut pixels = [[0.0; CHANNEL_BLOCK]; 4];
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    let x = (start + cell + i).min(width - 1) + HALO;
                    dot.pack(dot.simd().load(&block[x * lanes..]), per_unit, zero, pixel);
                }
                // What lies beyond the words is 0, and is not copied.
                for (first, lines) in out.chunks_mut(4 * count).enumerate() {
                    let word = |i: usize| four(&pixels[i], 4 * first);
                    let columns = transpose::columns([word(0), word(1), word(2), word(3)]);
                    for (line, column) in lines.chunks_exact_mut(count).zip(&columns) {
                        line[cell..cell + 4].copy_from_slice(column);
                    }
                }
            }
        }
    }
}
