//! Convolutions on cooperative matrices: their shaders and the order of their weights.

use crate::gpu::matrices::Matrices;
use crate::gpu::matrix_shader::unrolled;
use crate::gpu::shader::Shader;
use crate::net::gpu::conv::filters::Filters;
use crate::net::gpu::conv::kind::Kind;
use crate::net::gpu::memory::BLOCK;

const LOAD_CELLS: &str = "let cells_{r} = cells_at(first_cell + {r}u * TILE_WIDTH * BLOCKS, BLOCKS);\n";
const LOAD_FILTERS: &str = "let filters_{t} = filters_at(first_filter + {t}u * MATRIX);\n";
/// The driver chooses which invocation holds which part of a sum, so sums go through memory.
const STORE: &str = "workgroupBarrier();
stage(sum_{r}_{t}, wave * MATRIX, BLOCKS);
workgroupBarrier();
write(first + vec2(0u, {r}u), first_block + {t}u * BLOCKS, wave, lane);
";

impl Kind {
    /// The shader on matrices, for numbers of rows of cells of a subgroup and of matrices of outputs of a workgroup.
    pub(crate) fn matrix_shader(&self, matrices: Matrices, counts: [usize; 2]) -> Shader {
        let [rows, tiles] = counts;
        let products = [
            unrolled(LOAD_CELLS, [rows, 1]),
            unrolled(LOAD_FILTERS, [1, tiles]),
            unrolled("sum_{r}_{t} = multiply_add(cells_{r}, filters_{t}, sum_{r}_{t});\n", counts),
        ];
        let main = include_str!("conv_matrix.wgsl")
            .replace("//SUMS", &unrolled("var sum_{r}_{t} = MatrixC();\n", counts))
            .replace("//PRODUCTS", &products.concat())
            .replace("//STORES", &unrolled(STORE, counts));
        // Where workgroups are few, they wait less often for inputs; elsewhere small ones side by side hide the wait. On an H100
        // 2 takes 0.9 of the time of 1 on coarse levels, and 1.5 times as long on the finest.
        let depth = if rows == 1 { 2 } else { 1 };
        let begin = matrices
            .shader()
            .number("ROWS", rows)
            .number("TILES", tiles)
            .number("PACKED", self.tile / matrices.side)
            .number("DEPTH", depth);
        self.around(begin, &main)
    }
}

impl Filters {
    /// By tile of outputs, SIDE inputs, tap, matrix of outputs: matrices of inputs by outputs, column by column.
    pub(crate) fn as_matrices(&self, weight: &[f32], matrices: Matrices, tile: usize) -> Vec<f32> {
        let (side, tiles) = (matrices.side, tile / matrices.side);
        let steps = (self.blocks() * BLOCK).div_ceil(side);
        let mut packed = vec![0.0; self.outputs.div_ceil(tile) * steps * self.taps * tile * side];
        self.place(weight, |value, tap, [input, output]| {
            let line = (output / tile * steps + input / side) * self.taps + tap;
            let matrix = line * tiles + output % tile / side;
            packed[(matrix * side + output % side) * side + input % side] = value;
        });
        packed
    }
}
