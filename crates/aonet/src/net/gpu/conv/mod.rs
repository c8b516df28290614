//! Convolutions. See [`crate::net::graph::Op::Conv`].

mod conv_matrix;
mod filters;
mod kind;

use crate::gpu::options::Kernels;
use crate::gpu::program::{Arithmetic, Binding, Contents, Dispatch, Dispatches, floats};
use crate::net::gpu::context::Context;
use crate::net::gpu::memory::blocks;
use crate::net::gpu::tiles::{rows, workgroups};
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

    /// Adds the dispatch for a plan.
    pub(crate) fn push(&self, context: &Context<'_>, list: &mut Dispatches) {
        let output = &context.plan.buffers[self.output];
        let cells = output.size();
        let rows = match context.arithmetic.kernels {
            Kernels::Matrices(matrices) => matrices.rows(cells, self.tiles),
            Kernels::Plain | Kernels::Subgroups => rows(cells, self.tiles),
        };
        self.push_of_rows(context, rows, list);
    }

    /// Adds the dispatch with a number of rows of an invocation.
    pub(crate) fn push_of_rows(&self, context: &Context<'_>, rows: usize, list: &mut Dispatches) {
        let Context { arithmetic, plan, memory, .. } = *context;
        let output = &plan.buffers[self.output];
        let mut bindings = vec![
            Binding::Uniform(list.uniform(&self.name, &self.shape(plan))),
            Binding::Read(list.filled(&self.name, &self.weights)),
            Binding::Read(list.filled(&self.name, &self.bias)),
            Binding::Write(memory.of(self.output)),
        ];
        bindings.extend(self.sources.iter().map(|s| Binding::Read(memory.of(s.buffer))));
        let cells = output.size();
        let (shader, workgroups) = match arithmetic.kernels {
            Kernels::Matrices(matrices) => {
                (self.kind.matrix_shader(matrices, rows), matrices.workgroups(cells, rows, self.tiles))
            }
            Kernels::Plain | Kernels::Subgroups => {
                (self.kind.shader(arithmetic, rows), workgroups(cells, rows, self.tiles))
            }
        };
        list.push(&Dispatch { label: &self.name, shader, sees_frame: false, workgroups }, &bindings);
    }

    /// The struct `Conv` of `buffers.wgsl`.
    fn shape(&self, plan: &Plan) -> Vec<usize> {
        let output = &plan.buffers[self.output];
        let (mut sources, mut first) = (vec![], 0);
        for source in &self.sources {
            let from = &plan.buffers[source.buffer];
            sources.extend([from.width, from.height, first, 0]);
            first += blocks(from.channels);
        }
        let header = [output.width, output.height, first, blocks(output.channels)];
        [&header[..], &sources].concat()
    }
}
