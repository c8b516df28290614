//! See [`crate::net::Op::Conv`], with the pooling, upsampling and concatenation before it.

use super::aligned::Aligned;
use super::bands::{Band, Workers};
use super::conv_tile::{Lines, MAX_PIXELS, Tile};
use super::level::Isa;
use super::resample::{avg_pool2, repeat_ends, upsample2};
use super::simd::{Kernel, Simd};
use crate::error::Result;
use crate::net::graph::{Activation, LEAKY_SLOPE};
use crate::net::plan::{Buffer, HALO, Layout, Plan, Resample, Source};
use crate::net::weights::Weights;

/// Rows of resampled input that a thread keeps.
const RING: usize = 3;

/// A convolution with its weights in the order in which they are used.
#[derive(Debug)]
pub(super) struct Conv {
    inputs: Vec<Input>,
    groups: Vec<Group>,
    output: Buffer,
    size: usize,
    slope: f32,
}

#[derive(Debug)]
struct Input {
    buffer: Buffer,
    resample: Resample,
    /// Length of a row after resampling.
    row_len: usize,
}

/// Output channels that are computed together.
#[derive(Debug)]
struct Group {
    /// Vectors of channels.
    vectors: usize,
    weights: Aligned,
    bias: Aligned,
}

/// Name, inputs, output, filter size and activation of [`crate::net::plan::Step::Conv`].
pub(super) type ConvStep<'a> = (&'a str, &'a [Source], usize, usize, Activation);

impl Conv {
    /// # Errors
    /// When there is not enough memory.
    pub(super) fn new(plan: &Plan, weights: &Weights, isa: Isa, step: ConvStep<'_>) -> Result<Self> {
        let (name, sources, output, size, activation) = step;
        let output = plan.buffers[output].clone();
        let inputs: Vec<_> = sources
            .iter()
            .map(|source| {
                let buffer = plan.buffers[source.buffer].clone();
                let row_len = Buffer { width: output.width, ..buffer.clone() }.row_len();
                Input { buffer, resample: source.resample, row_len }
            })
            .collect();
        let weight = &weights.get(&format!("{name}.weight")).values;
        let bias = &weights.get(&format!("{name}.bias")).values;
        let lanes = isa.lanes();
        let mut groups = Vec::new();
        let mut first = 0;
        for vectors in split_vectors(output.channels.div_ceil(lanes), isa) {
            let channels = first..output.channels.min(first + vectors * lanes);
            groups.push(pack((weight, bias), &inputs, (size, lanes, vectors), channels.clone())?);
            first = channels.end;
        }
        let slope = match activation {
            Activation::Linear => 1.0,
            Activation::LeakyRelu => LEAKY_SLOPE,
        };
        Ok(Self { inputs, groups, output, size, slope })
    }

    /// Values of scratch memory that a thread needs.
    pub(super) fn scratch_len(&self) -> usize {
        self.inputs
            .iter()
            .map(|input| if input.resample == Resample::None { 0 } else { RING * input.row_len })
            .sum()
    }

    /// Runs over the arena.
    pub(super) fn run(&self, isa: Isa, workers: &mut Workers, arena: &mut [f32]) {
        let range = |i: usize| self.inputs.get(i).map_or(0..0, |input| input.buffer.range());
        let [out, first, second] = arena
            .get_disjoint_mut([self.output.range(), range(0), range(1)])
            .expect("live buffers do not overlap");
        let sources = [&*first, &*second];
        workers.for_each_band(out, self.output.row_len(), |band| {
            isa.run(ConvBand { conv: self, sources: &sources[..self.inputs.len()], band });
        });
    }
}

/// Splits `count` vectors of output channels into groups of one to three.
fn split_vectors(count: usize, isa: Isa) -> Vec<usize> {
    // Three vectors leave room for 8 pixels with 24 accumulators; with 12, pairs of 6 pixels are better.
    let widest = if isa.accumulators() >= 24 && count.is_multiple_of(3) { 3 } else { 2 };
    (0..count).step_by(widest).map(|first| widest.min(count - first)).collect()
}

/// Weights of some output channels: by input, block of input channels, row and column of the filter, input
/// channel, output channel. Channels that do not exist weigh nothing.
fn pack(
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

struct ConvBand<'a> {
    conv: &'a Conv,
    sources: &'a [&'a [f32]],
    band: Band<'a>,
}

impl Kernel for ConvBand<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { conv, sources, band } = self;
        let (first_ring, second_ring) = band.scratch.split_at_mut(match conv.inputs[0].resample {
            Resample::None => 0,
            Resample::AvgPool2 | Resample::Upsample2 => RING * conv.inputs[0].row_len,
        });
        let mut rings = [Ring::new(first_ring), Ring::new(second_ring)];
        for (i, out) in band.values.chunks_exact_mut(conv.output.row_len()).enumerate() {
            let y = band.first + i;
            let rows = [y.saturating_sub(1), y, (y + 1).min(conv.output.height - 1)];
            for ((input, source), ring) in conv.inputs.iter().zip(sources).zip(&mut rings) {
                ring.fill(simd, input, source, (rows, conv.output.width));
            }
            let lines = [0, 1].map(|i| {
                let i = i.min(conv.inputs.len() - 1);
                let input = &conv.inputs[i];
                Lines {
                    rows: rows.map(|y| rings[i].row(input, sources[i], y)),
                    channels: input.buffer.channels,
                    planar: input.buffer.layout == Layout::Planar,
                }
            });
            conv.row(simd, &lines[..conv.inputs.len()], out);
        }
    }
}

impl Conv {
    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, inputs: &[Lines<'_>], out: &mut [f32]) {
        let width = self.output.width;
        let pitch = (width + 2 * HALO) * S::LANES;
        let mut rest = &mut *out;
        for group in &self.groups {
            let (now, later) = rest.split_at_mut(group.vectors * pitch);
            let (weights, bias) = (&*group.weights, &*group.bias);
            let tile = Tile { inputs, weights, bias, slope: self.slope, size: self.size, width };
            match group.vectors {
                1 => tiles::<S, 1>(simd, &tile, now),
                2 => tiles::<S, 2>(simd, &tile, now),
                3 => tiles::<S, 3>(simd, &tile, now),
                n => unreachable!("a group of {n} vectors"),
            }
            rest = later;
        }
        repeat_ends(simd, out, width);
    }
}

/// Covers a row with tiles of nearly equal width.
#[inline(always)]
fn tiles<S: Simd, const N: usize>(simd: S, tile: &Tile<'_>, out: &mut [f32]) {
    let most = MAX_PIXELS.min(S::ACCUMULATORS / N);
    let count = tile.width.div_ceil(most);
    let mut x = 0;
    for i in 0..count {
        let end = (i + 1) * tile.width / count;
        tile.run::<S, N>(simd, out, (x, end - x));
        x = end;
    }
}

/// The last resampled rows of an input: row y is in slot y mod 3.
struct Ring<'a> {
    values: &'a mut [f32],
    held: [usize; RING],
}

impl<'a> Ring<'a> {
    fn new(values: &'a mut [f32]) -> Self {
        Self { values, held: [usize::MAX; RING] }
    }

    /// Makes sure that the ring holds `rows` of the resampled input.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, input: &Input, source: &[f32], (rows, width): ([usize; 3], usize)) {
        if input.resample == Resample::None {
            return;
        }
        for y in rows {
            if self.held[y % RING] == y {
                continue;
            }
            self.held[y % RING] = y;
            let out = &mut self.values[y % RING * input.row_len..][..input.row_len];
            let last = input.buffer.height - 1;
            let row = |y: usize| &source[y.min(last) * input.buffer.row_len()..][..input.buffer.row_len()];
            match input.resample {
                Resample::AvgPool2 => avg_pool2(simd, [row(2 * y), row(2 * y + 1)], out, width),
                Resample::Upsample2 if y % 2 == 0 => {
                    upsample2(simd, [row(y / 2), row((y / 2).saturating_sub(1))], out, width);
                }
                Resample::Upsample2 => upsample2(simd, [row(y / 2), row(y / 2 + 1)], out, width),
                Resample::None => {}
            }
        }
    }

    /// Row `y` of the input after resampling.
    #[inline(always)]
    fn row<'s>(&'s self, input: &Input, source: &'s [f32], y: usize) -> &'s [f32] {
        match input.resample {
            Resample::None => &source[y * input.row_len..][..input.row_len],
            Resample::AvgPool2 | Resample::Upsample2 => {
                &self.values[y % RING * input.row_len..][..input.row_len]
            }
        }
    }
}
