//! Convolutions. See [`crate::net::Op::Conv`].

mod conv_matrix;

use crate::gpu::options::Kernels;
use crate::gpu::program::{Arithmetic, Binding, Contents, Dispatch, Dispatches, floats};
use crate::gpu::shader::Shader;
use crate::net::gpu::memory::{BLOCK, blocks};
use crate::net::gpu::network::Sized;
use crate::net::graph::{Activation, LEAKY_SLOPE};
use crate::net::plan::{BufferId, Plan, Resample, Source};
use crate::net::weights::Weights;

/// Outputs of an invocation.
const OUTPUTS: usize = 8;
/// Groups of that many outputs that a workgroup computes at most: they share the inputs. guess: more would leave few
/// workgroups for coarse levels.
const MAX_GROUPS: usize = 4;
/// Columns and rows of a workgroup's invocations.
pub(crate) const TILE: [usize; 2] = [16, 2];
/// Workgroups below which a dispatch is cut finer. guess: two for each multiprocessor of a large device.
const ENOUGH_WORKGROUPS: usize = 256;
/// The binding of the first source.
const FIRST_SOURCE: usize = 4;

/// A convolution with its weights.
#[derive(Debug)]
pub(crate) struct Conv {
    name: String,
    sources: Vec<Source>,
    output: BufferId,
    kind: Kind,
    /// Workgroups that share out the outputs.
    tiles: usize,
    weights: Contents,
    bias: Contents,
}

/// What the shader of a convolution is made for.
#[derive(Debug, Clone)]
pub(crate) struct Kind {
    pub(crate) sources: Vec<Resample>,
    /// Side of the filter.
    pub(crate) size: usize,
    pub(crate) activation: Activation,
    /// Outputs of a workgroup.
    pub(crate) tile: usize,
}

impl Conv {
    pub(crate) fn new(
        arithmetic: Arithmetic,
        plan: &Plan,
        weights: &Weights,
        (name, sources, output, [size, groups], activation): (
            &str,
            &[Source],
            BufferId,
            [usize; 2],
            Activation,
        ),
    ) -> Self {
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
            name: name.to_owned(),
            sources: sources.to_vec(),
            output,
            kind: Kind { sources: sources.iter().map(|s| s.resample).collect(), size, activation, tile },
            tiles,
            weights: arithmetic.reals(&packed),
            bias: floats(&bias),
        }
    }

    /// Outputs of a workgroup: the same for all, as few as that takes.
    fn tile(arithmetic: Arithmetic, outputs: usize) -> usize {
        let (unit, most) = match arithmetic.kernels {
            Kernels::Matrices(matrices) => (matrices.side, matrices.max_tiles()),
            Kernels::Plain | Kernels::Subgroups => (OUTPUTS, MAX_GROUPS),
        };
        let units = outputs.div_ceil(unit);
        units.div_ceil(units.div_ceil(most)) * unit
    }

    /// Adds the dispatch for a plan.
    pub(crate) fn push(&self, sized: &Sized<'_>, list: &mut Dispatches) {
        let output = &sized.plan.buffers[self.output];
        let cells = (output.width, output.height);
        let rows = match sized.arithmetic.kernels {
            Kernels::Matrices(matrices) => matrices.rows(cells, self.tiles),
            Kernels::Plain | Kernels::Subgroups => rows(cells, self.tiles),
        };
        self.push_of_rows(sized, rows, list);
    }

    /// The same with so many rows an invocation.
    pub(crate) fn push_of_rows(&self, sized: &Sized<'_>, rows: usize, list: &mut Dispatches) {
        let Sized { arithmetic, plan, memory, .. } = *sized;
        let output = &plan.buffers[self.output];
        let mut bindings = vec![
            Binding::Uniform(list.uniform(&self.name, &self.shape(plan))),
            Binding::Read(list.filled(&self.name, &self.weights)),
            Binding::Read(list.filled(&self.name, &self.bias)),
            Binding::Write(memory.of(self.output)),
        ];
        bindings.extend(self.sources.iter().map(|s| Binding::Read(memory.of(s.buffer))));
        let cells = (output.width, output.height);
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

impl Kind {
    /// The shader for so many rows an invocation.
    pub(crate) fn shader(&self, arithmetic: Arithmetic, rows: usize) -> Shader {
        let begin = Shader::new(arithmetic.precision)
            .with_kernels(arithmetic.kernels)
            .tile(TILE)
            .number("ROWS", rows)
            .number("GROUPS", self.tile / OUTPUTS);
        self.around(begin, include_str!("conv.wgsl")).part(match arithmetic.kernels {
            Kernels::Subgroups => include_str!("filters_subgroup.wgsl"),
            Kernels::Plain | Kernels::Matrices(_) => include_str!("filters.wgsl"),
        })
    }

    /// A shader of the convolution: constants, `main`, and how it reads its sources.
    pub(crate) fn around(&self, begin: Shader, main: &str) -> Shader {
        let mut shader = begin
            .number("SIZE", self.size)
            .number("SOURCES", self.sources.len())
            .number("FIRST_SOURCE", FIRST_SOURCE)
            .flag("LEAKY", self.activation == Activation::LeakyRelu)
            .float("LEAKY_SLOPE", LEAKY_SLOPE)
            .part(include_str!("buffers.wgsl"))
            .part(main);
        let mut read = String::from("fn fetch(block: u32, cell: vec2<i32>) -> vec4<f32> {\n");
        for (i, resample) in self.sources.iter().enumerate() {
            let (pool, upsample) = match resample {
                Resample::None => (1, false),
                Resample::AvgPool(side) => (*side, false),
                Resample::Upsample2 => (1, true),
            };
            shader = shader
                .part(&format!("const POOL_{i}: i32 = {pool};"))
                .flag(&format!("UPSAMPLE_{i}"), upsample)
                .part(&include_str!("resample.wgsl").replace("NTH", &i.to_string()));
            let call = format!("return read_{i}(block - conv.sources[{i}].z, cell);");
            read += &match i + 1 < self.sources.len() {
                true => format!("    if (block < conv.sources[{}].z) {{ {call} }}\n", i + 1),
                false => format!("    {call}\n}}"),
            };
        }
        shader.part(&read)
    }
}

/// Rows of an invocation: fewer where there would be too few workgroups.
pub(crate) fn rows(cells: (usize, usize), tiles: usize) -> usize {
    let enough =
        |rows: &usize| workgroups(cells, *rows, tiles).iter().product::<usize>() >= ENOUGH_WORKGROUPS;
    [4, 2].into_iter().find(enough).unwrap_or(1)
}

/// Workgroups for images of cells (width, height).
pub(crate) fn workgroups((width, height): (usize, usize), rows: usize, tiles: usize) -> [usize; 3] {
    [width.div_ceil(TILE[0]), height.div_ceil(TILE[1] * rows), tiles]
}

/// The shape of a convolution's weights.
pub(crate) struct Filters {
    /// Channels of each source.
    sources: Vec<usize>,
    pub(crate) outputs: usize,
    pub(crate) taps: usize,
    /// Of the convolution: channels of other groups get filters of zeros.
    groups: usize,
}

impl Filters {
    /// By tile of outputs, block of inputs, tap, input of the block, output of the tile. Sources begin with a block.
    fn packed(&self, weight: &[f32], tile: usize) -> Vec<f32> {
        let in_blocks = self.blocks();
        let mut packed = vec![0.0; self.outputs.div_ceil(tile) * in_blocks * BLOCK * self.taps * tile];
        self.place(weight, |value, tap, [input, output]| {
            let block = output / tile * in_blocks + input / BLOCK;
            let line = (block * self.taps + tap) * BLOCK + input % BLOCK;
            packed[line * tile + output % tile] = value;
        });
        packed
    }

    /// Blocks of inputs.
    pub(crate) fn blocks(&self) -> usize {
        self.sources.iter().map(|channels| blocks(*channels)).sum()
    }

    /// Calls `put` with every weight, its tap, its input among the blocks of the sources, and its output.
    pub(crate) fn place(&self, weight: &[f32], mut put: impl FnMut(f32, usize, [usize; 2])) {
        let mut place = Vec::new();
        let mut in_blocks = 0;
        for channels in &self.sources {
            place.extend((0..*channels).map(|c| in_blocks * BLOCK + c));
            in_blocks += blocks(*channels);
        }
        let inputs = place.len() / self.groups;
        for (i, value) in weight.iter().enumerate() {
            let (tap, i) = (i % self.taps, i / self.taps);
            let (input, output) = (i % inputs, i / inputs);
            let input = place[output / (self.outputs / self.groups) * inputs + input];
            put(*value, tap, [input, output]);
        }
    }
}
