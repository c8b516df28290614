//! Convolutions. See [`crate::net::graph::Op::Conv`].

mod conv_matrix;
mod filters;
mod kind;

use crate::gpu::options::Kernels;
use crate::gpu::program::{Arithmetic, Binding, Contents, Dispatch, Dispatches, Number, floats};
use crate::net::gpu::context::Context;
use crate::net::gpu::memory::blocks;
use crate::net::gpu::tiles::{ROWS, workgroups};
use crate::net::plan::{BufferId, ConvStep, Plan, Source};
use crate::net::weights::Weights;
use filters::Filters;
pub(crate) use kind::Kind;
use kind::OUTPUTS;

/// Groups of that many outputs that a workgroup computes at most: they share the inputs. guess: more would leave few
/// workgroups for coarse levels.
const MAX_GROUPS: usize = 4;

/// A convolution with its weights.
#[derive(Debug)]
pub(crate) struct Conv {
    name: String,
    sources: Vec<Source>,
    output: BufferId,
    kind: Kind,
    /// Workgroups that divide the outputs among them.
    tiles: usize,
    weights: Contents,
    bias: Contents,
}

impl Conv {
    /// Packs the weights of a step of a plan.
    pub(crate) fn new(arithmetic: Arithmetic, plan: &Plan, weights: &Weights, step: &ConvStep) -> Self {
        let ConvStep { ref name, ref sources, output, size, groups, activation } = *step;
        let outputs = plan.buffers[output].channels;
        let filters = Filters {
            sources: sources.iter().map(|s| plan.buffers[s.buffer].channels).collect(),
            outputs,
            taps: size * size,
            groups,
        };
        let weight = &weights.get(&format!("{name}.weight")).values;
        let mut bias = weights.get(&format!("{name}.bias")).values.clone();
        let tile = Self::tile(arithmetic, outputs);
        let tiles = outputs.div_ceil(tile);
        bias.resize(tiles * tile, 0.0);
        let packed = match arithmetic.kernels {
            Kernels::Matrices(matrices) => filters.as_matrices(weight, matrices, tile),
            Kernels::Plain | Kernels::Subgroups => filters.packed(weight, tile),
        };
        Self {
            name: name.clone(),
            sources: sources.clone(),
            output,
            kind: Kind { sources: sources.iter().map(|s| s.resample).collect(), size, activation, tile },
            tiles,
            weights: arithmetic.reals(&packed),
            bias: floats(&bias),
        }
    }

    /// Outputs of a workgroup: the same for all workgroups, and as few as possible.
    fn tile(arithmetic: Arithmetic, outputs: usize) -> usize {
        let (unit, most) = match arithmetic.kernels {
            Kernels::Matrices(matrices) => (matrices.side, matrices.max_tiles()),
            Kernels::Plain | Kernels::Subgroups => (OUTPUTS, MAX_GROUPS),
        };
        let units = outputs.div_ceil(unit);
        units.div_ceil(units.div_ceil(most)) * unit
    }

    /// Adds the dispatch.
    pub(crate) fn push(&self, context: &Context<'_>, list: &mut Dispatches) {
        self.push_of_shapes(context, &self.shapes(context.arithmetic.kernels), list);
    }

    /// Shapes of workgroups: rows of an invocation, and workgroups that share the outputs of a tile. The first that gives enough
    /// workgroups is the best.
    pub(crate) fn shapes(&self, kernels: Kernels) -> Vec<[usize; 2]> {
        match kernels {
            Kernels::Plain | Kernels::Subgroups => ROWS.map(|rows| [rows, 1]).to_vec(),
            Kernels::Matrices(matrices) => {
                // Where workgroups are few, each computes a single matrix of outputs.
                let all = self.kind.tile / matrices.side;
                let mut shapes = vec![[2, 1], [2, all], [1, all]];
                shapes.dedup();
                shapes
            }
        }
    }

    /// Adds the dispatch with these shapes to choose from: see [`Self::shapes`].
    pub(crate) fn push_of_shapes(&self, context: &Context<'_>, shapes: &[[usize; 2]], list: &mut Dispatches) {
        let Context { arithmetic, memory, grids, .. } = *context;
        let mut bindings = vec![
            Binding::Uniform(list.uniform(&self.name, self.shape(context))),
            Binding::Read(list.reals(&self.name, &self.weights, arithmetic.precision.bytes())),
            Binding::Read(list.filled(&self.name, &self.bias)),
            Binding::Write(memory.of(self.output)),
        ];
        bindings.extend(self.sources.iter().map(|s| Binding::Read(memory.of(s.buffer))));
        let cells = grids.of(self.output);
        let variant = |&[rows, shares]: &[usize; 2]| match arithmetic.kernels {
            Kernels::Matrices(matrices) => {
                let counts = [rows, self.kind.tile / matrices.side / shares];
                (
                    self.kind.matrix_shader(matrices, counts),
                    matrices.workgroups(cells, rows, self.tiles * shares),
                )
            }
            Kernels::Plain | Kernels::Subgroups => {
                (self.kind.shader(arithmetic, rows), workgroups(cells, rows, self.tiles))
            }
        };
        let variants = shapes.iter().map(variant).collect();
        list.push(Dispatch { label: &self.name, sees_frame: false, variants }, &bindings);
    }

    /// The struct `Conv` of `buffers.wgsl`.
    fn shape(&self, Context { plan, grids, .. }: &Context<'_>) -> Vec<Number> {
        let sides = |tensor: BufferId| {
            let cells = grids.of(tensor);
            [cells.width.clone(), cells.height.clone()]
        };
        let (mut sources, mut first) = (vec![], 0);
        for source in &self.sources {
            sources.extend(sides(source.buffer).into_iter().chain([first.into(), 0.into()]));
            first += blocks(plan.buffers[source.buffer].channels);
        }
        let out_blocks = blocks(plan.buffers[self.output].channels);
        let header = sides(self.output).into_iter().chain([first.into(), out_blocks.into()]);
        header.chain(sources).collect()
    }
}
