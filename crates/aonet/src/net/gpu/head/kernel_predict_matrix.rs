//! Kernels on cooperative matrices: their shader and the order of their weights.

use crate::gpu::matrices::Matrices;
use crate::gpu::matrix_shader::unrolled;
use crate::gpu::options::Kernels;
use crate::gpu::shader::Shader;
use crate::net::config::KernelWeights;
use crate::net::gpu::head::kind::{HeadKind, with_kernels};
use crate::net::kernel::WINDOW;

/// Inputs above which the plain shader is taken: a workgroup's cells and kernels would not fit its memory.
const MAX_CHANNELS: usize = 64;
/// Pixels of a patch whose kernels are in memory at a time at most.
const MAX_PIXELS: usize = 2;

const LOAD_CELLS: &str = "let cells_{r} = cells_at(first + {r}u * BLOCKS, IN_BLOCKS);\n";
const PRODUCT: &str = "sum = multiply_add(cells_{r}, filters_at(filters + {r}u * MATRIX), sum);\n";

/// The matrices to compute a head with, or none for heads that fit badly.
pub(crate) fn suits(kernels: Kernels, channels: usize, kernel: KernelWeights) -> Option<Matrices> {
    match (kernels, kernel) {
        (Kernels::Matrices(matrices), KernelWeights::Linear | KernelWeights::Softmax) => {
            Some(matrices).filter(|_| channels <= MAX_CHANNELS)
        }
        // Without kernels there are few products.
        (Kernels::Matrices(_), KernelWeights::Off) => None,
        (Kernels::Plain | Kernels::Subgroups, _) => None,
    }
}

/// The shader of kernels for a number of input channels.
pub(crate) fn shader(matrices: Matrices, channels: usize, kind: &HeadKind) -> Shader {
    let steps = channels.div_ceil(matrices.side);
    let main = include_str!("kernel_predict_matrix.wgsl")
        .replace("//CELLS", &unrolled(LOAD_CELLS, [steps, 1]))
        .replace("//PRODUCTS", &unrolled(PRODUCT, [steps, 1]));
    let begin = matrices
        .shader()
        .number("STEPS", steps)
        .number("PIXELS", (matrices.lanes / matrices.side).min(MAX_PIXELS));
    with_kernels(begin, kind).part(&main)
}

/// A 1x1 convolution's weights by kernel, SIDE outputs, SIDE inputs: matrices of inputs by outputs, column by column.
/// `value` returns the weight of an output of a kernel and an input.
pub(crate) fn packed(
    matrices: Matrices,
    (kernels, channels): (usize, usize),
    value: impl Fn(usize, usize) -> f32,
) -> Vec<f32> {
    let (side, steps) = (matrices.side, channels.div_ceil(matrices.side));
    let of_kernel = WINDOW * WINDOW;
    let mut packed = Vec::with_capacity(kernels * of_kernel * steps * side);
    for first in (0..kernels * of_kernel).step_by(side) {
        for step in 0..steps {
            for output in first..first + side {
                packed.extend((step * side..(step + 1) * side).map(|input| value(output, input)));
            }
        }
    }
    packed
}
