//! Weights of a convolution in the order in which its inner loops read them.

use super::aligned::Aligned;
use super::level::Isa;
use super::ring::Input;
use crate::error::Result;
use crate::net::plan::Layout;
use std::ops::Range;

/// Output channels that are computed together.
#[derive(Debug)]
pub(super) struct Group {
    /// Vectors of channels.
    pub(super) vectors: usize,
    /// Channels of each of the inputs that they see, whole blocks of a blocked one.
    pub(super) inputs: Vec<Range<usize>>,
    /// By input, block of input channels, row and column of the filter, input channel, output channel.
    pub(super) weights: Aligned,
    /// By output channel.
    pub(super) bias: Aligned,
}

/// All weights of a convolution of `size` x `size` taps in `groups`, from OIHW `weight`.
///
/// # Errors
/// When there is not enough memory.
pub(super) fn pack(
    (weight, bias): (&[f32], &[f32]),
    inputs: &[Input],
    [size, groups]: [usize; 2],
    isa: Isa,
) -> Result<Vec<Group>> {
    let in_channels = inputs.iter().map(|i| i.buffer.channels).sum::<usize>();
    let filters = Filters {
        weight,
        bias,
        taps: size * size,
        outputs: bias.len() / groups,
        inputs: in_channels / groups,
    };
    let vectors = bias.len().div_ceil(isa.lanes());
    // Vectors of different groups see different inputs.
    let split = if groups == 1 { split_vectors(vectors, isa) } else { vec![1; vectors] };
    let mut first = 0;
    let group = |vectors: usize| {
        let channels = first..bias.len().min(first + vectors * isa.lanes());
        first = channels.end;
        filters.pack_group(inputs, (isa.lanes(), vectors), channels)
    };
    split.into_iter().map(group).collect()
}

/// Splits `count` vectors of output channels into groups of one to three.
pub(super) fn split_vectors(count: usize, isa: Isa) -> Vec<usize> {
    // Three vectors leave room for 8 pixels with 24 accumulators; with 12, pairs of 6 pixels are better.
    let widest = if isa.accumulators() >= 24 && count.is_multiple_of(3) { 3 } else { 2 };
    (0..count).step_by(widest).map(|first| widest.min(count - first)).collect()
}

/// Filters as the model has them.
struct Filters<'a> {
    weight: &'a [f32],
    bias: &'a [f32],
    /// Of a filter.
    taps: usize,
    /// Output and input channels of a group.
    outputs: usize,
    inputs: usize,
}

impl Filters<'_> {
    /// Input channels that an output channel sees.
    fn seen(&self, output: usize) -> Range<usize> {
        let first = output / self.outputs * self.inputs;
        first..first + self.inputs
    }

    /// What input `i` weighs in output `o` at a tap: nothing outside its group.
    fn weight(&self, (o, i): (usize, usize), tap: usize) -> f32 {
        let seen = self.seen(o);
        match seen.contains(&i) {
            true => self.weight[(o * self.inputs + i - seen.start) * self.taps + tap],
            false => 0.0,
        }
    }

    /// Weights of some output channels. Channels that do not exist weigh nothing.
    fn pack_group(
        &self,
        inputs: &[Input],
        (lanes, vectors): (usize, usize),
        channels: Range<usize>,
    ) -> Result<Group> {
        let wide = vectors * lanes;
        let mut packed_bias = Aligned::zeros(wide)?;
        packed_bias[..channels.len()].copy_from_slice(&self.bias[channels.clone()]);
        let seen = self.seen(channels.start).start..self.seen(channels.end - 1).end;
        let mut first_in = 0;
        let ranges: Vec<_> = inputs.iter().map(|input| part(input, &seen, &mut first_in, lanes)).collect();
        let lines = ranges.iter().map(|(_, range)| range.len()).sum::<usize>() * self.taps;
        let mut packed = Aligned::zeros(lines * wide)?;
        let mut lines = packed.chunks_exact_mut(wide);
        for (input, (first_in, range)) in inputs.iter().zip(&ranges) {
            let block = match input.buffer.layout {
                Layout::Planar => range.end.max(1),
                Layout::Blocked => lanes,
            };
            for first in range.clone().step_by(block) {
                for tap in 0..self.taps {
                    for i in first..range.end.min(first + block) {
                        let line = lines.next().expect("a line for every input channel and tap");
                        for (value, o) in line.iter_mut().zip(channels.clone()) {
                            *value = self.weight((o, first_in + i), tap);
                        }
                    }
                }
            }
        }
        let inputs = ranges.into_iter().map(|(_, range)| range).collect();
        Ok(Group { vectors, inputs, weights: packed, bias: packed_bias })
    }
}

/// The first channel of `input` among those of all inputs, and its channels that hold the `seen` ones: all of a planar
/// input, whole blocks of a blocked one.
fn part(input: &Input, seen: &Range<usize>, first_in: &mut usize, lanes: usize) -> (usize, Range<usize>) {
    let (first, channels) = (*first_in, input.buffer.channels);
    *first_in += channels;
    let [start, end] = [seen.start, seen.end].map(|c| c.saturating_sub(first).min(channels));
    let range = match input.buffer.layout {
        Layout::Planar => 0..channels,
        Layout::Blocked if start == end => 0..0,
        Layout::Blocked => start / lanes * lanes..end.next_multiple_of(lanes).min(channels),
    };
    (first, range)
}
