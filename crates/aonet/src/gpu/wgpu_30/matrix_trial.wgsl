// Every subgroup of a workgroup multiplies the same two matrices.

@group(0) @binding(0) var<storage, read> weights: array<vec4<f16>>;
@group(0) @binding(1) var<storage, read_write> products: array<vec4<f32>>;

const BLOCKS: u32 = SIDE / 4u;
const MATRIX: u32 = SIDE * BLOCKS;

var<workgroup> cells: array<vec4<f16>, MATRIX>;
var<workgroup> found: array<vec4<f32>, WAVES * MATRIX>;

@compute @workgroup_size(INVOCATIONS)
fn main(
    @builtin(local_invocation_index) index: u32,
    @builtin(subgroup_id) subgroup: u32,
    @builtin(subgroup_invocation_id) invocation: u32,
) {
    let wave = mine(subgroup, invocation, index).x;
    for (var i = index; i < MATRIX; i += INVOCATIONS) {
        cells[i] = weights[i];
    }
    workgroupBarrier();
    stage(multiply_add(cells_at(0u, BLOCKS), filters_at(MATRIX), MatrixC()), wave * MATRIX, BLOCKS);
    workgroupBarrier();
    for (var i = index; i < WAVES * MATRIX; i += INVOCATIONS) {
        products[i] = found[i];
    }
}
