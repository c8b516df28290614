//! Weights of the head's 1x1 convolution in the order in which its inner loops read them.

use super::packing::{self, Steps};
use super::patch_head::{CELLS, GROUP};
use super::recipe::{Parameters, Recipe};
use crate::error::Result;
use crate::net::config::KernelWeights;
use crate::net::neighbours;
use crate::net::plan::{Buffer, HeadStep};
use crate::simd::aligned::Aligned;

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
        // With AVX2, whose registers do not hold the sums, cells take 0.93 to 0.95 of the time of pixels.
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
}
