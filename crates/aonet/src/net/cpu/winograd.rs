//! 3x3 convolution by Winograd's minimal filtering: a quarter of the multiplications. See [`crate::net::graph::Op::Conv`].
//!
//! Inputs become vectors of products' factors square by square, a few squares at a time so that they stay in the caches;
//! then every one of the 36 products is a small matrix multiplication over the channels.

use super::context::Context;
use super::dot::{Dot, DotKernel, Exact};
use super::precision::Arithmetic;
use super::recipe::Recipe;
use super::resample::repeat_ends;
use super::ring::{self, Input, Ring};
use super::winograd_squares::{Factors, Lines, Outputs, Squares};
use super::winograd_transforms::{IN, OUT, PRODUCTS};
use super::winograd_weights::{self, Group};
use crate::error::Result;
use crate::net::plan::{Buffer, CHANNEL_BLOCK, ConvStep, HALO, Plan};
use crate::simd::Simd;
use crate::threads::Band;

/// Most squares of a row that are transformed together: with 64 channels their factors and products take 0.4 MiB.
const MAX_SQUARES: usize = 24;

/// Fewest channels in and out for which the transforms cost less than they save. Outputs are computed by vectors, whether full or not.
const MIN_CHANNELS: [usize; 2] = [16, 8];

/// Bands per thread: finer than others, because they are cut at every fourth row only.
const BANDS_PER_THREAD: usize = 16;

/// A convolution with its weights transformed.
#[derive(Debug)]
pub(super) struct Winograd {
    arithmetic: Arithmetic,
    inputs: Vec<Input>,
    groups: Vec<Group>,
    output: Buffer,
    slope: f32,
    /// Channels of every block of every input.
    block_channels: Vec<usize>,
}

/// Whether a convolution is faster this way.
pub(super) fn pays(plan: &Plan, step: &ConvStep) -> bool {
    let in_channels = step.sources.iter().map(|source| plan.buffers[source.buffer].channels).sum::<usize>();
    let out_channels = plan.buffers[step.output].channels;
    let [least_in, least_out] = MIN_CHANNELS;
    step.size == 3 && step.groups == 1 && in_channels >= least_in && out_channels >= least_out
}

impl Winograd {
    /// # Errors
    /// When there is not enough memory.
    pub(super) fn new(recipe: &Recipe<'_>, step: &ConvStep) -> Result<Self> {
        let ConvStep { name, sources, activation, .. } = step;
        let arithmetic = recipe.arithmetic;
        let lanes = arithmetic.lanes();
        let output = recipe.plan.buffers[step.output].clone();
        let inputs = recipe.inputs(sources, output.width, Arithmetic::F32(arithmetic.isa()))?;
        let blocks = |input: &Input| {
            let channels = input.buffer.channels;
            (0..channels).step_by(lanes).map(move |first| lanes.min(channels - first))
        };
        let block_channels: Vec<_> = inputs.iter().flat_map(blocks).collect();
        let groups = winograd_weights::pack(recipe.parameters(name), &block_channels, arithmetic)?;
        Ok(Self { arithmetic, inputs, groups, output, slope: activation.slope(), block_channels })
    }

    /// Values of scratch memory that a thread needs.
    pub(super) fn scratch_len(&self) -> usize {
        let rings = self.inputs.iter().map(|input| input.ring_len(IN)).sum::<usize>();
        let vectors = self.block_channels.len() + self.out_vectors();
        rings + PRODUCTS * (vectors * self.squares() * self.arithmetic.lanes() + 2 * CHANNEL_BLOCK)
    }

    fn out_vectors(&self) -> usize {
        self.groups.iter().map(|group| group.vectors).sum()
    }

    /// Squares that are transformed together, at most.
    fn squares(&self) -> usize {
        let all = self.output.width.div_ceil(OUT);
        all.div_ceil(all.div_ceil(MAX_SQUARES))
    }

    /// Runs over the arena.
    pub(super) fn run(&self, context: Context<'_>) {
        let Context { workers, arena, .. } = context;
        let (out, sources) = ring::borrow(arena, &self.output, &self.inputs);
        let band_rows =
            self.output.height.div_ceil(workers.threads() * BANDS_PER_THREAD).next_multiple_of(OUT);
        workers.for_each_band_of(out, band_rows, self.output.row_len(), |band| {
            self.arithmetic.run_floats(WinogradBand {
                conv: self,
                sources: &sources[..self.inputs.len()],
                band,
            });
        });
    }
}

struct WinogradBand<'a> {
    conv: &'a Winograd,
    sources: &'a [&'a [f32]],
    band: Band<'a>,
}

impl DotKernel for WinogradBand<'_> {
    #[inline(always)]
    fn run<D: Dot>(self, dot: D) {
        let Self { conv, sources, band } = self;
        let (first_ring, rest) = band.scratch.split_at_mut(conv.inputs[0].ring_len(IN));
        let second_len = conv.inputs.get(1).map_or(0, |input| input.ring_len(IN));
        let (second_ring, squares) = rest.split_at_mut(second_len);
        let second = conv.inputs.last().expect("a convolution has inputs");
        let mut rings = [Ring::new(&conv.inputs[0], first_ring), Ring::new(second, second_ring)];
        for (i, out) in band.values.chunks_mut(OUT * conv.output.row_len()).enumerate() {
            let y = band.first + i * OUT;
            let rows = std::array::from_fn(|i| (y + i).saturating_sub(HALO).min(conv.output.height - 1));
            for ((input, source), ring) in conv.inputs.iter().zip(sources).zip(&mut rings) {
                ring.fill(Exact(dot.simd()), input, source, rows);
            }
            let inputs = [0, 1].map(|i| {
                let i = i.min(conv.inputs.len() - 1);
                rows.map(|y| rings[i].row(&conv.inputs[i], sources[i], y))
            });
            conv.rows(dot, &inputs[..conv.inputs.len()], squares, out);
        }
    }
}

impl Winograd {
    /// Up to four rows of output, from six of every input.
    #[inline(always)]
    fn rows<D: Dot>(&self, dot: D, inputs: &[Lines<'_>], scratch: &mut [f32], out: &mut [f32]) {
        let width = self.output.width;
        let all = width.div_ceil(OUT);
        let chunks = all.div_ceil(MAX_SQUARES);
        for chunk in 0..chunks {
            let [first, end] = [chunk, chunk + 1].map(|chunk| chunk * all / chunks);
            let squares = Squares { first, count: end - first, width };
            let mut factors = Factors::new::<D>(scratch, &self.block_channels, squares);
            let mut first_block = 0;
            for (lines, input) in inputs.iter().zip(&self.inputs) {
                let blocks = first_block..first_block + input.buffer.channels.div_ceil(D::Simd::LANES);
                first_block = blocks.end;
                factors.fill(dot, lines, blocks);
            }
            let (factors, mut products) = factors.then_products::<D>(self.out_vectors());
            let mut first_vector = 0;
            for group in &self.groups {
                products.fill(dot, &factors, group, first_vector);
                first_vector += group.vectors;
            }
            let output = Outputs { groups: &self.groups, slope: self.slope, row_len: self.output.row_len() };
            products.write(dot.simd(), &output, out);
        }
        for row in out.chunks_exact_mut(self.output.row_len()) {
            repeat_ends(dot.simd(), row, width);
        }
    }
}
