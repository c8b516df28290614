// Every subgroup of a workgroup multiplies the same two matrices.

@group(0) @binding(0) var<storage, read> factors: array<vec4<f16>>;
@group(0) @binding(1) var<storage, read_write> products: array<vec4<f32>>;

const BLOCKS: u32 = SIDE / 4u;
const MATRIX: u32 = SIDE * BLOCKS;

@compute @workgroup_size(INVOCATIONS)
fn main(@builtin(subgroup_id) wave: u32) {
    let a = coopLoadT<MatrixA>(&factors[0], BLOCKS);
    let b = coopLoadT<MatrixB>(&factors[MATRIX], BLOCKS);
    coopStoreT(coopMultiplyAdd(a, b, MatrixC()), &products[wave * MATRIX], BLOCKS);
}
