//! The 1x1 convolution at the end and the image that it gives, in one dispatch. See [`crate::net::graph::Op::KernelPredict`];
//! AO-Net §3.3, Eq. 2.

pub(crate) mod kernel_predict_matrix;
pub(crate) mod kind;

use crate::gpu::matrices::Matrices;
use crate::gpu::program::{self, Arithmetic, Binding, Contents, Dispatch, Dispatches, Grid, Number, floats};
use crate::net::config::KernelWeights;
use crate::net::gpu::context::Context;
use crate::net::gpu::grids::Grids;
use crate::net::gpu::memory::{BLOCK, blocks};
use crate::net::gpu::tiles;
use crate::net::kernel::{GUIDE_CHANNELS, TAPS, WINDOW};
use crate::net::neighbours;
use crate::net::plan::{BufferId, HeadStep, Plan};
use crate::net::weights::Weights;
use kernel_predict_matrix as matrix;
use kind::{HeadKind, out_blocks, shader};

/// Cells of an invocation that applies kernels, at most. Compiled for RDNA 3, 4 take 252 registers with half floats, and 2
/// take 120: less to do while memory is waited for counts more than a tenth of the instructions.
const MAX_CELLS: usize = 2;

/// The last step of a network.
#[derive(Debug)]
pub(crate) struct Head {
    name: String,
    input: BufferId,
    guide: BufferId,
    /// What a search found, where its neighbours are weighed.
    found: Option<BufferId>,
    kind: HeadKind,
    /// The matrices that it is computed with, if any.
    matrices: Option<Matrices>,
    weights: Contents,
    bias: Contents,
}

impl Head {
    /// Packs the weights of a step of a plan.
    pub(crate) fn new(arithmetic: Arithmetic, plan: &Plan, weights: &Weights, step: &HeadStep) -> Self {
        let HeadStep { ref name, input, guide, patch, kernel, planes, ref neighbours, base } = *step;
        let kind = HeadKind { patch, kernel, planes, neighbours: neighbours.clone() };
        let order = order(&kind);
        let weight = &weights.get(&format!("{name}.weight")).values;
        let bias = &weights.get(&format!("{name}.bias")).values;
        let channels = plan.buffers[input].channels;
        let value = |output: Option<usize>, input: usize| match output {
            Some(output) if input < channels => weight[output * channels + input],
            Some(_) | None => 0.0,
        };
        let matrices = matrix::suits(arithmetic.kernels, channels, kernel);
        let packed = match matrices {
            Some(matrices) => {
                let kernels = order.len() / (WINDOW * WINDOW);
                matrix::packed(matrices, (kernels, channels), |output, i| value(order[output], i))
            }
            None => packed(&order, (out_blocks(&kind) * BLOCK, blocks(channels)), value),
        };
        let bias: Vec<_> = order.iter().map(|output| output.map_or(0.0, |o| bias[o])).collect();
        let (name, weights, bias) = (name.clone(), arithmetic.reals(&packed), floats(&bias));
        let found = base.filter(|_| !kind.neighbours.is_empty());
        Self { name, input, guide, found, kind, matrices, weights, bias }
    }

    /// Values that it writes.
    pub(crate) fn raw_len(&self, grids: &Grids) -> Number {
        grids.padded.count() * self.kind.planes.into()
    }

    /// Adds the dispatch; `raw` gets the values of each pixel, plane by plane and pixel of the patch by pixel.
    pub(crate) fn push(&self, context: &Context<'_>, raw: program::BufferId, list: &mut Dispatches) {
        let Context { arithmetic, plan, memory, grids, .. } = *context;
        let (cells, channels) = (grids.of(self.input), plan.buffers[self.input].channels);
        let frame = self.found.map_or(cells, |found| grids.of(found));
        let sides = |grid: &Grid| [grid.width.clone(), grid.height.clone()];
        let shape = [sides(cells), [blocks(channels).into(), 0.into()], sides(frame)].into_iter().flatten();
        let mut bindings = vec![
            Binding::Uniform(list.uniform("head", shape)),
            Binding::Read(list.reals(&self.name, &self.weights, arithmetic.precision.bytes())),
            Binding::Read(list.filled(&self.name, &self.bias)),
            Binding::Write(raw),
            Binding::Read(memory.of(self.input)),
        ];
        match self.kind.kernel {
            KernelWeights::Off => {}
            KernelWeights::Linear | KernelWeights::Softmax => {
                bindings.push(Binding::Read(memory.of(self.guide)))
            }
        }
        bindings.extend(self.found.map(|found| Binding::Read(memory.of(found))));
        let plain = |rows: usize| (shader(arithmetic, &self.kind, rows), tiles::workgroups(cells, rows, 1));
        let variants = match self.matrices {
            Some(matrices) => {
                vec![(matrix::shader(matrices, channels, &self.kind), matrices.workgroups(cells, 1, 1))]
            }
            None => cells_each(&self.kind).map(plain).collect(),
        };
        list.push(Dispatch { label: "head", sees_frame: false, variants }, &bindings);
    }
}

/// Cells of an invocation, to choose from.
fn cells_each(kind: &HeadKind) -> impl Iterator<Item = usize> + use<> {
    let most = match kind.kernel {
        KernelWeights::Off if kind.neighbours.is_empty() => usize::MAX,
        KernelWeights::Off | KernelWeights::Linear | KernelWeights::Softmax => MAX_CELLS,
    };
    tiles::ROWS.into_iter().filter(move |rows| *rows <= most)
}

/// By `group` of outputs that are computed together, block of inputs, block of outputs, input of the block.
fn packed(
    order: &[Option<usize>],
    (group, in_blocks): (usize, usize),
    value: impl Fn(Option<usize>, usize) -> f32,
) -> Vec<f32> {
    let mut packed = Vec::new();
    for outputs in order.chunks_exact(group) {
        for block in 0..in_blocks {
            for outputs in outputs.chunks_exact(BLOCK) {
                for input in block * BLOCK..(block + 1) * BLOCK {
                    packed.extend(outputs.iter().map(|output| value(*output, input)));
                }
            }
        }
    }
    packed
}

/// The outputs of the convolution for so many values of a cell, in the order in which they are computed; none for places that are
/// left over.
fn order(kind: &HeadKind) -> Vec<Option<usize>> {
    let pixels = kind.patch * kind.patch;
    let values = pixels * kind.planes;
    match kind.kernel {
        KernelWeights::Off if !kind.neighbours.is_empty() => {
            let planes = kind.planes + neighbours::count(&kind.neighbours);
            let of_pixel = |pixel: usize| {
                (0..out_blocks(kind) * BLOCK)
                    .map(move |plane| (plane < planes).then_some(plane * pixels + pixel))
            };
            (0..pixels).flat_map(of_pixel).collect()
        }
        KernelWeights::Off => {
            (0..values.next_multiple_of(BLOCK)).map(|o| (o < values).then_some(o)).collect()
        }
        KernelWeights::Linear | KernelWeights::Softmax => {
            let of_component = |c: usize| (c..TAPS).step_by(GUIDE_CHANNELS);
            let of_pixel =
                |p: usize| (0..GUIDE_CHANNELS).flat_map(of_component).map(move |k| Some(p * TAPS + k));
            (0..values).flat_map(of_pixel).collect()
        }
    }
}
