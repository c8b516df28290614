//! Weights of a convolution in the order in which its inner loops read them.

use super::packing::{self, Quantized};
use super::precision::Arithmetic;
use super::recipe::Parameters;
use super::ring::Input;
use crate::error::Result;
use crate::simd::aligned::Aligned;
use std::ops::Range;

/// Output channels that are computed together.
#[derive(Debug)]
pub(super) struct Group {
    /// Vectors of channels.
    pub(super) vectors: usize,
    /// Channels of each of the inputs that they see, whole blocks.
    pub(super) inputs: Vec<Range<usize>>,
    /// By input, block of input channels, row and column of the filter, word of input channels, output channel.
    pub(super) weights: Aligned,
    /// By output channel: what a sum is worth.
    pub(super) scale: Aligned,
    /// By output channel.
    pub(super) bias: Aligned,
}

/// Size and groups of a convolution's filters.
#[derive(Debug, Clone, Copy)]
pub(super) struct FilterShape {
    /// Side of a filter.
    pub(super) size: usize,
    pub(super) groups: usize,
}

/// All weights of a convolution.
///
/// # Errors
/// When there is not enough memory.
pub(super) fn pack(
    parameters: Parameters<'_>,
    inputs: &[Input],
    shape: FilterShape,
    arithmetic: Arithmetic,
) -> Result<Vec<Group>> {
    let filters = Filters::new(parameters, inputs, shape, arithmetic);
    let (bias, groups) = (parameters.bias, shape.groups);
    let lanes = arithmetic.lanes();
    let vectors = bias.len().div_ceil(lanes);
    // Vectors of different groups see different inputs.
    let split = if groups == 1 { split_vectors(vectors, arithmetic) } else { vec![1; vectors] };
    let mut first = 0;
    let group = |vectors: usize| {
        let channels = first..bias.len().min(first + vectors * lanes);
        first = channels.end;
        filters.pack_group(inputs, vectors, channels)
    };
    split.into_iter().map(group).collect()
}

/// Splits `count` vectors of output channels into groups of one to three.
pub(super) fn split_vectors(count: usize, arithmetic: Arithmetic) -> Vec<usize> {
    // Three vectors leave room for 8 pixels with 24 accumulators; with 12, pairs of 6 pixels are better.
    let widest = if arithmetic.accumulators() >= 24 && count.is_multiple_of(3) { 3 } else { 2 };
    (0..count).step_by(widest).map(|first| widest.min(count - first)).collect()
}

/// Filters as the model has them, or as integers.
struct Filters {
    /// OIHW.
    weights: Vec<f32>,
    outputs: Vec<Quantized>,
    /// Of a filter.
    taps: usize,
    /// Output and input channels of a group.
    group: [usize; 2],
    arithmetic: Arithmetic,
}

impl Filters {
    fn new(parameters: Parameters<'_>, inputs: &[Input], shape: FilterShape, arithmetic: Arithmetic) -> Self {
        let Parameters { weight, bias } = parameters;
        let (taps, groups) = (shape.size * shape.size, shape.groups);
        let in_channels = inputs.iter().map(|i| i.buffer.channels).sum::<usize>();
        let group = [bias.len() / groups, in_channels / groups];
        let mut weights = weight.to_vec();
        let outputs = weights.chunks_exact_mut(group[1] * taps).zip(bias).map(|(weights, bias)| {
            let channels = inputs.iter().flat_map(|i| (0..i.buffer.channels).map(|c| (&i.packing.steps, c)));
            packing::quantize(arithmetic, weights, *bias, channels.flat_map(|c| std::iter::repeat_n(c, taps)))
        });
        let outputs = outputs.collect();
        Self { weights, outputs, taps, group, arithmetic }
    }

    /// Input channels that an output channel sees.
    fn seen(&self, output: usize) -> Range<usize> {
        let [outputs, inputs] = self.group;
        let first = output / outputs * inputs;
        first..first + inputs
    }

    /// Weight of input `i` in output `o` at a tap: 0 outside its group.
    fn weight(&self, o: usize, i: usize, tap: usize) -> f32 {
        let seen = self.seen(o);
        match seen.contains(&i) {
            true => self.weights[(o * self.group[1] + i - seen.start) * self.taps + tap],
            false => 0.0,
        }
    }

    /// Weights of some output channels. Channels that do not exist weigh nothing.
    fn pack_group(&self, inputs: &[Input], vectors: usize, channels: Range<usize>) -> Result<Group> {
        let (lanes, packed) = (self.arithmetic.lanes(), self.arithmetic.packed());
        let wide = vectors * lanes;
        let (mut scale, mut bias) = (Aligned::zeros(wide)?, Aligned::zeros(wide)?);
        for (i, output) in self.outputs[channels.clone()].iter().enumerate() {
            (scale[i], bias[i]) = (output.scale, output.bias);
        }
        let seen = self.seen(channels.start).start..self.seen(channels.end - 1).end;
        let mut first_in = 0;
        let ranges: Vec<_> = inputs.iter().map(|input| part(input, &seen, &mut first_in, lanes)).collect();
        let words = |range: &Range<usize>| range.len().div_ceil(packed);
        let lines = ranges.iter().map(|(_, range)| words(range)).sum::<usize>() * self.taps;
        let mut weights = Aligned::zeros(lines * wide)?;
        let mut lines = weights.chunks_exact_mut(wide);
        for (first_in, range) in &ranges {
            for first in range.clone().step_by(lanes) {
                let block = first..range.end.min(first + lanes);
                for tap in 0..self.taps {
                    for i in block.clone().step_by(packed) {
                        let line = lines.next().expect("a line for every word of input channels and tap");
                        for (word, o) in line.iter_mut().zip(channels.clone()) {
                            let numbers = (i..block.end).map(|i| self.weight(o, first_in + i, tap));
                            *word = packing::word(self.arithmetic, numbers);
                        }
                    }
                }
            }
        }
        let inputs = ranges.into_iter().map(|(_, range)| range).collect();
        Ok(Group { vectors, inputs, weights, scale, bias })
    }
}

/// The first channel of `input` among those of all inputs, and whole blocks of its channels that hold the `seen` ones.
fn part(input: &Input, seen: &Range<usize>, first_in: &mut usize, lanes: usize) -> (usize, Range<usize>) {
    let (first, channels) = (*first_in, input.buffer.channels);
    *first_in += channels;
    let [start, end] = [seen.start, seen.end].map(|c| c.saturating_sub(first).min(channels));
    let range = match start == end {
        true => 0..0,
        false => start / lanes * lanes..end.next_multiple_of(lanes).min(channels),
    };
    (first, range)
}
