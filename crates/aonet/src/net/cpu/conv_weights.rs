//! Weights of a convolution in the order in which its inner loops read them.

use super::aligned::Aligned;
use super::level::Isa;
use super::ring::Input;
use crate::error::Result;
use crate::net::plan::Layout;

/// Output channels that are computed together.
#[derive(Debug)]
pub(super) struct Group {
    /// Vectors of channels.
    pub(super) vectors: usize,
    /// By input, block of input channels, row and column of the filter, input channel, output channel.
    pub(super) weights: Aligned,
    /// By output channel.
    pub(super) bias: Aligned,
}

/// All weights of a convolution of `size` x `size` taps, from OIHW `weight`.
///
/// # Errors
/// When there is not enough memory.
pub(super) fn pack(
    (weight, bias): (&[f32], &[f32]),
    inputs: &[Input],
    size: usize,
    isa: Isa,
) -> Result<Vec<Group>> {
    let mut first = 0;
    let group = |vectors: usize| {
        let channels = first..bias.len().min(first + vectors * isa.lanes());
        first = channels.end;
        pack_group((weight, bias), inputs, (size, isa.lanes(), vectors), channels)
    };
    split_vectors(bias.len().div_ceil(isa.lanes()), isa).into_iter().map(group).collect()
}

/// Splits `count` vectors of output channels into groups of one to three.
fn split_vectors(count: usize, isa: Isa) -> Vec<usize> {
    // Three vectors leave room for 8 pixels with 24 accumulators; with 12, pairs of 6 pixels are better.
    let widest = if isa.accumulators() >= 24 && count.is_multiple_of(3) { 3 } else { 2 };
    (0..count).step_by(widest).map(|first| widest.min(count - first)).collect()
}

/// Weights of some output channels. Channels that do not exist weigh nothing.
fn pack_group(
    (weight, bias): (&[f32], &[f32]),
    inputs: &[Input],
    (size, lanes, vectors): (usize, usize, usize),
    channels: std::ops::Range<usize>,
) -> Result<Group> {
    let taps = size * size;
    let (in_channels, wide) = (inputs.iter().map(|i| i.buffer.channels).sum::<usize>(), vectors * lanes);
    let mut packed = Aligned::zeros(in_channels * taps * wide)?;
    let mut packed_bias = Aligned::zeros(wide)?;
    packed_bias[..channels.len()].copy_from_slice(&bias[channels.clone()]);
    let mut lines = packed.chunks_exact_mut(wide);
    let mut first_in = 0;
    for input in inputs {
        let block = match input.buffer.layout {
            Layout::Planar => input.buffer.channels,
            Layout::Blocked => lanes,
        };
        for first in (0..input.buffer.channels).step_by(block) {
            let end = input.buffer.channels.min(first + block);
            for tap in 0..taps {
                for i in first_in + first..first_in + end {
                    let line = lines.next().expect("a line for every input channel and tap");
                    for (value, o) in line.iter_mut().zip(channels.clone()) {
                        *value = weight[(o * in_channels + i) * taps + tap];
                    }
                }
            }
        }
        first_in += input.buffer.channels;
    }
    Ok(Group { vectors, weights: packed, bias: packed_bias })
}
