//! The shader of a head.

use crate::gpu::program::Arithmetic;
use crate::gpu::shader::Shader;
use crate::net::config::KernelWeights;
use crate::net::gpu::memory::{BLOCK, blocks};
use crate::net::gpu::tiles::TILE;
use crate::net::kernel::{FIRST_TAP, WINDOW};

/// Invocations that divide the pixels of a patch among them, at most.
const MAX_GROUPS: usize = 4;

/// What the shader of a head depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeadKind {
    /// Side of a patch (px).
    pub(crate) patch: usize,
    pub(crate) kernel: KernelWeights,
    /// Values for each pixel; 1 with kernels.
    pub(crate) planes: usize,
}

/// The shader of a head, for a number of cells of an invocation.
pub(crate) fn shader(arithmetic: Arithmetic, kind: HeadKind, cells: usize) -> Shader {
    let HeadKind { patch, kernel, planes } = kind;
    let begin = |groups: usize| {
        Shader::new(arithmetic.precision)
            .with_kernels(arithmetic.kernels)
            .tile(TILE)
            .number("CELLS", cells)
            .number("GROUPS", groups.min(MAX_GROUPS))
            .number("OUT_BLOCKS", out_blocks(kernel))
    };
    let outputs = include_str!("outputs.wgsl");
    match kernel {
        KernelWeights::Off => {
            let values = patch * patch * planes;
            let begin = begin(blocks(values)).number("VALUES", values);
            begin.part(include_str!("head.wgsl")).part(outputs).part(include_str!("patch_merge.wgsl"))
        }
        KernelWeights::Linear | KernelWeights::Softmax => {
            with_kernels(begin(patch * patch), kind).part(outputs).part(include_str!("kernel_predict.wgsl"))
        }
    }
}

/// The beginning of a shader that applies kernels.
pub(crate) fn with_kernels(begin: Shader, HeadKind { patch, kernel, .. }: HeadKind) -> Shader {
    begin
        .number("PATCH", patch)
        .flag("SOFTMAX", kernel == KernelWeights::Softmax)
        .part(&format!("const FIRST_TAP: i32 = {FIRST_TAP};"))
        .part(include_str!("head.wgsl"))
        .part(include_str!("kernels.wgsl"))
}

/// Blocks of four outputs that are computed together: a kernel for one component of the normal, or four pixels.
pub(crate) fn out_blocks(kernel: KernelWeights) -> usize {
    match kernel {
        KernelWeights::Off => 1,
        KernelWeights::Linear | KernelWeights::Softmax => WINDOW * WINDOW / BLOCK,
    }
}
