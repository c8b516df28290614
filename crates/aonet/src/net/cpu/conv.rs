//! See [`crate::net::graph::Op::Conv`], with the pooling, upsampling and concatenation before it.

use super::context::Context;
use super::conv_tile::{Lines, Tile};
use super::conv_weights::{self, FilterShape, Group};
use super::dot::{Dot, DotKernel};
use super::precision::Arithmetic;
use super::recipe::Recipe;
use super::resample::repeat_ends;
use super::ring::{self, Input, Ring};
use crate::error::Result;
use crate::net::plan::{Buffer, ConvStep, HALO};
use crate::simd::Simd;
use crate::threads::Band;

/// Rows of input that a row of output sees.
const ROWS: usize = 3;

/// A convolution with its weights in the order in which they are used.
#[derive(Debug)]
pub(super) struct Conv {
    arithmetic: Arithmetic,
    inputs: Vec<Input>,
    groups: Vec<Group>,
    output: Buffer,
    size: usize,
    slope: f32,
}

impl Conv {
    /// # Errors
    /// When there is not enough memory.
    pub(super) fn new(recipe: &Recipe<'_>, step: &ConvStep) -> Result<Self> {
        let ConvStep { name, sources, activation, .. } = step;
        let (size, groups) = (step.size, step.groups);
        let output = recipe.plan.buffers[step.output].clone();
        // Groups are narrow: packed words of channels would be mostly empty.
        let arithmetic =
            if groups == 1 { recipe.arithmetic } else { Arithmetic::F32(recipe.arithmetic.isa()) };
        let inputs = recipe.inputs(sources, output.width, arithmetic)?;
        let shape = FilterShape { size, groups };
        let groups = conv_weights::pack(recipe.parameters(name), &inputs, shape, arithmetic)?;
        Ok(Self { arithmetic, inputs, groups, output, size, slope: activation.slope() })
    }

    /// Values of scratch memory that a thread needs.
    pub(super) fn scratch_len(&self) -> usize {
        self.inputs.iter().map(|input| input.ring_len(ROWS)).sum()
    }

    /// Runs over the arena.
    pub(super) fn run(&self, context: Context<'_>) {
        let Context { workers, arena, .. } = context;
        let (out, sources) = ring::borrow(arena, &self.output, &self.inputs);
        workers.for_each_band(out, self.output.row_len(), |band| {
            self.arithmetic.run(ConvBand { conv: self, sources: &sources[..self.inputs.len()], band });
        });
    }
}

struct ConvBand<'a> {
    conv: &'a Conv,
    sources: &'a [&'a [f32]],
    band: Band<'a>,
}

impl DotKernel for ConvBand<'_> {
    #[inline(always)]
    fn run<D: Dot>(self, dot: D) {
        let Self { conv, sources, band } = self;
        let (first_ring, second_ring) = band.scratch.split_at_mut(conv.inputs[0].ring_len(ROWS));
        let second = conv.inputs.last().expect("a convolution has inputs");
        let mut rings = [Ring::new(&conv.inputs[0], first_ring), Ring::new(second, second_ring)];
        for (i, out) in band.values.chunks_exact_mut(conv.output.row_len()).enumerate() {
            let y = band.first + i;
            let rows = [y.saturating_sub(1), y, (y + 1).min(conv.output.height - 1)];
            for ((input, source), ring) in conv.inputs.iter().zip(sources).zip(&mut rings) {
                ring.fill(dot, input, source, rows);
            }
            let lines = [0, 1].map(|i| {
                let i = i.min(conv.inputs.len() - 1);
                let input = &conv.inputs[i];
                Lines {
                    rows: rows.map(|y| rings[i].row(input, sources[i], y)),
                    channels: 0..input.buffer.channels,
                }
            });
            conv.row(dot, &lines[..conv.inputs.len()], out);
        }
    }
}

impl Conv {
    #[inline(always)]
    fn row<D: Dot>(&self, dot: D, inputs: &[Lines<'_>], out: &mut [f32]) {
        let width = self.output.width;
        let pitch = (width + 2 * HALO) * D::Simd::LANES;
        let mut rest = &mut *out;
        for group in &self.groups {
            let (now, later) = rest.split_at_mut(group.vectors * pitch);
            let seen = [0, 1].map(|i| {
                let i = i.min(inputs.len() - 1);
                Lines { channels: group.inputs[i].clone(), ..inputs[i] }
            });
            let inputs = &seen[..inputs.len()];
            let tile = Tile { inputs, group, slope: self.slope, size: self.size, width };
            match group.vectors {
                1 => tile.row::<D, 1>(dot, now),
                2 => tile.row::<D, 2>(dot, now),
                3 if const { D::Simd::ACCUMULATORS >= 24 } => tile.row::<D, 3>(dot, now),
                n => unreachable!("a group of {n} vectors"),
            }
            rest = later;
        }
        repeat_ends(dot.simd(), out, width);
    }
}
