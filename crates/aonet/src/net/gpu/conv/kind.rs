//! The shader of a convolution.

use crate::gpu::options::{Kernels, Precision};
use crate::gpu::program::Arithmetic;
use crate::gpu::shader::Shader;
use crate::net::gpu::memory::BLOCK;
use crate::net::gpu::tiles::{TILE, WORKGROUP_BYTES};
use crate::net::graph::{Activation, LEAKY_SLOPE};
use crate::net::plan::Resample;

/// Outputs of an invocation.
pub(crate) const OUTPUTS: usize = 8;
/// Blocks of inputs in workgroup memory at most.
const MOST_BLOCKS: usize = 4;
/// The binding of the first source.
const FIRST_SOURCE: usize = 4;

/// What the shader of a convolution depends on.
#[derive(Debug, Clone)]
pub(crate) struct Kind {
    pub(crate) sources: Vec<Resample>,
    /// Side of the filter.
    pub(crate) size: usize,
    pub(crate) activation: Activation,
    /// Outputs of a workgroup.
    pub(crate) tile: usize,
}

impl Kind {
    /// The shader for a number of rows of an invocation.
    pub(crate) fn shader(&self, arithmetic: Arithmetic, rows: usize) -> Shader {
        // Programs of files may run in the other precision: only the head of a shader depends on it.
        let [single, half] =
            [Precision::F32, Precision::F16].map(|p| self.depth(p, arithmetic.kernels, rows));
        let begin = Shader::new(arithmetic.precision)
            .with_kernels(arithmetic.kernels)
            .tile(TILE)
            .number("ROWS", rows)
            .number("GROUPS", self.tile / OUTPUTS)
            .part(&format!("const DEPTH: u32 = select({single}u, {half}u, HALF);"));
        self.around(begin, include_str!("conv.wgsl")).part(match arithmetic.kernels {
            Kernels::Subgroups => include_str!("filters_subgroup.wgsl"),
            Kernels::Plain | Kernels::Matrices(_) => include_str!("filters.wgsl"),
        })
    }

    /// Blocks of inputs in workgroup memory at the same time: coarse levels, whose workgroups are few, wait less often.
    fn depth(&self, precision: Precision, kernels: Kernels, rows: usize) -> usize {
        let border = self.size / 2 * 2;
        let cells = (TILE[0] + border) * (TILE[1] * rows + border);
        let filters = if kernels == Kernels::Subgroups { 0 } else { self.size * self.size * self.tile };
        (WORKGROUP_BYTES / ((cells + filters) * BLOCK * precision.bytes())).clamp(1, MOST_BLOCKS)
    }

    /// Completes a shader: the constants of the convolution, `main`, and how it reads its sources.
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
