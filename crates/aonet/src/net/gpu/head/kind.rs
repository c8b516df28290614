//! The shader of a head.

use crate::gpu::program::Arithmetic;
use crate::gpu::shader::Shader;
use crate::net::config::KernelWeights;
use crate::net::gpu::memory::{BLOCK, blocks};
use crate::net::gpu::tiles::TILE;
use crate::net::kernel::{FIRST_TAP, WINDOW};
use crate::net::neighbours;

/// Invocations that divide the pixels of a patch among them, at most.
const MAX_GROUPS: usize = 4;

/// What the shader of a head depends on.
#[derive(Debug, Clone)]
pub(crate) struct HeadKind {
    /// Side of a patch (px).
    pub(crate) patch: usize,
    pub(crate) kernel: KernelWeights,
    /// Values for each pixel; 1 with kernels.
    pub(crate) planes: usize,
    /// Distances of the neighbours whose weights it has besides (px).
    pub(crate) neighbours: Vec<usize>,
}

/// The shader of a head, for a number of cells of an invocation.
pub(crate) fn shader(arithmetic: Arithmetic, kind: &HeadKind, cells: usize) -> Shader {
    let HeadKind { patch, kernel, planes, ref neighbours } = *kind;
    let begin = |groups: usize| {
        Shader::new(arithmetic.precision)
            .with_kernels(arithmetic.kernels)
            .tile(TILE)
            .number("CELLS", cells)
            .number("GROUPS", groups.min(MAX_GROUPS))
            .number("OUT_BLOCKS", out_blocks(kind))
    };
    let outputs = include_str!("outputs.wgsl");
    match kernel {
        KernelWeights::Off if !neighbours.is_empty() => begin(patch * patch)
            .number("PATCH", patch)
            .number("PLANES", planes)
            .float("UNIT", neighbours::UNIT)
            .part(include_str!("head.wgsl"))
            .part(outputs)
            .part(&include_str!("neighbours.wgsl").replace("//NEIGHBOURS", &mixed(planes, neighbours))),
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

/// A line for every neighbour, whose weights follow so many planes.
fn mixed(planes: usize, distances: &[usize]) -> String {
    let line = |(k, [down, right]): (usize, [isize; 2])| {
        let (block, component) = ((planes + k) / BLOCK, ["x", "y", "z", "w"][(planes + k) % BLOCK]);
        format!(
            "mixed += values[{block}u * CELLS + cell].{component} * (found_at(x + {right}, y + {down}) - here);\n"
        )
    };
    neighbours::offsets(distances).into_iter().enumerate().map(line).collect()
}

/// The beginning of a shader that applies kernels.
pub(crate) fn with_kernels(begin: Shader, HeadKind { patch, kernel, .. }: &HeadKind) -> Shader {
    begin
        .number("PATCH", *patch)
        .flag("SOFTMAX", *kernel == KernelWeights::Softmax)
        .part(&format!("const FIRST_TAP: i32 = {FIRST_TAP};"))
        .part(include_str!("head.wgsl"))
        .part(include_str!("kernels.wgsl"))
}

/// Blocks of four outputs that are computed together: a kernel for one component of the normal, all that a pixel with neighbours has,
/// or four pixels.
pub(crate) fn out_blocks(kind: &HeadKind) -> usize {
    match kind.kernel {
        KernelWeights::Off if !kind.neighbours.is_empty() => {
            blocks(kind.planes + neighbours::count(&kind.neighbours))
        }
        KernelWeights::Off => 1,
        KernelWeights::Linear | KernelWeights::Softmax => WINDOW * WINDOW / BLOCK,
    }
}
