//! See [`crate::net::Op::Conv`], with the pooling, upsampling and concatenation before it.

use super::bands::{Band, Workers};
use super::conv_tile::{Lines, MAX_PIXELS, Tile};
use super::conv_weights::{self, Group};
use super::level::Isa;
use super::resample::repeat_ends;
use super::ring::{Input, Ring};
use super::simd::{Kernel, Simd};
use crate::error::Result;
use crate::net::graph::Activation;
use crate::net::plan::{Buffer, HALO, Layout, Plan, Source};
use crate::net::weights::Weights;

/// Rows of input that a row of output sees.
const ROWS: usize = 3;

/// A convolution with its weights in the order in which they are used.
#[derive(Debug)]
pub(super) struct Conv {
    inputs: Vec<Input>,
    groups: Vec<Group>,
    output: Buffer,
    size: usize,
    slope: f32,
}

/// Name, inputs, output, filter size and groups, and activation of [`crate::net::plan::Step::Conv`].
pub(super) type ConvStep<'a> = (&'a str, &'a [Source], usize, [usize; 2], Activation);

impl Conv {
    /// # Errors
    /// When there is not enough memory.
    pub(super) fn new(plan: &Plan, weights: &Weights, isa: Isa, step: ConvStep<'_>) -> Result<Self> {
        let (name, sources, output, [size, groups], activation) = step;
        let output = plan.buffers[output].clone();
        let input = |s: &Source| {
            let buffer = plan.buffers[s.buffer].clone();
            let read_as = (buffer.layout, output.width);
            Input::new(buffer, s.resample, read_as)
        };
        let inputs: Vec<_> = sources.iter().map(input).collect();
        let weight = &weights.get(&format!("{name}.weight")).values;
        let bias = &weights.get(&format!("{name}.bias")).values;
        let groups = conv_weights::pack((weight, bias), &inputs, [size, groups], isa)?;
        Ok(Self { inputs, groups, output, size, slope: activation.slope() })
    }

    /// Values of scratch memory that a thread needs.
    pub(super) fn scratch_len(&self) -> usize {
        self.inputs.iter().map(|input| input.ring_len(ROWS)).sum()
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

struct ConvBand<'a> {
    conv: &'a Conv,
    sources: &'a [&'a [f32]],
    band: Band<'a>,
}

impl Kernel for ConvBand<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { conv, sources, band } = self;
        let (first_ring, second_ring) = band.scratch.split_at_mut(conv.inputs[0].ring_len(ROWS));
        let mut rings = [Ring::<ROWS>::new(first_ring), Ring::<ROWS>::new(second_ring)];
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
                    channels: 0..input.buffer.channels,
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
            let seen = [0, 1].map(|i| {
                let i = i.min(inputs.len() - 1);
                Lines { channels: group.inputs[i].clone(), ..inputs[i] }
            });
            let inputs = &seen[..inputs.len()];
            let tile = Tile { inputs, weights, bias, slope: self.slope, size: self.size, width };
            match group.vectors {
                1 => tiles::<S, 1>(simd, &tile, now),
                2 => tiles::<S, 2>(simd, &tile, now),
                3 if const { S::ACCUMULATORS >= 24 } => tiles::<S, 3>(simd, &tile, now),
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
