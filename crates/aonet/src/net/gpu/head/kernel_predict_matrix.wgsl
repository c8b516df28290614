// Kernels from products of cooperative matrices: cells of a row by inputs, times inputs by the weights of a pixel for one
// component of the normal. The plain twin is kernel_predict.wgsl.
//
// A workgroup computes SIDE columns and WAVES rows of cells, a subgroup one of these rows, PIXELS of a patch at a time.

/// Blocks of four channels of a row of a matrix.
const BLOCKS: u32 = SIDE / 4u;
const MATRIX: u32 = SIDE * BLOCKS;
/// Blocks of four inputs, of four weights of a kernel.
const IN_BLOCKS: u32 = STEPS * BLOCKS;
const TAP_BLOCKS: u32 = 4u;
const TAP_MATRICES: u32 = TAP_BLOCKS / BLOCKS;

var<workgroup> cells: array<vec4<f16>, WAVES * SIDE * IN_BLOCKS>;
var<workgroup> found: array<vec4<f32>, WAVES * PIXELS * SIDE * TAP_BLOCKS>;

/// Loads the cells of a subgroup, channel by channel.
fn load(column: u32, row: u32, wave: u32, lane: u32) {
    for (var i = lane; i < SIDE * IN_BLOCKS; i += LANES) {
        let place = min(vec2(column + i % SIDE, row), head.size - 1u);
        let block = i / SIDE;
        // What is no number must not meet a weight of zero.
        var values = vec4<f16>();
        if (block < head.blocks) {
            values = input[(block * head.size.y + place.y) * head.size.x + place.x];
        }
        cells[(wave * SIDE + i % SIDE) * IN_BLOCKS + block] = values;
    }
}

@compute @workgroup_size(INVOCATIONS)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
    @builtin(subgroup_id) subgroup: u32,
    @builtin(subgroup_invocation_id) invocation: u32,
) {
    let place = mine(subgroup, invocation, index);
    let wave = place.x;
    let lane = place.y;
    let column = group.x * SIDE;
    let row = group.y * WAVES + wave;
    load(column, row, wave, lane);
    workgroupBarrier();
    let first = wave * SIDE * IN_BLOCKS;
//CELLS
    // Lanes that are left over repeat the work of others.
    let cell = lane % SIDE;
    let which = lane / SIDE % PIXELS;
    for (var pixel = 0u; pixel < PATCH * PATCH; pixel += PIXELS) {
        let of_lane = min(pixel + which, PATCH * PATCH - 1u);
        var visibility = 0.0;
        for (var c = 0u; c < 3u; c++) {
            workgroupBarrier();
            for (var p = 0u; p < PIXELS; p++) {
                let kernel = min(pixel + p, PATCH * PATCH - 1u) * 3u + c;
                let place = (wave * PIXELS + p) * SIDE * TAP_BLOCKS;
                for (var t = 0u; t < TAP_MATRICES; t++) {
                    let filters = (kernel * TAP_MATRICES + t) * STEPS * MATRIX;
                    var sum = MatrixC();
//PRODUCTS
                    stage(sum, place + t * BLOCKS, TAP_BLOCKS);
                }
            }
            workgroupBarrier();
            let place = ((wave * PIXELS + which) * SIDE + cell) * TAP_BLOCKS;
            var kernel: array<vec4<f32>, 4>;
            for (var k = 0u; k < 4u; k++) {
                kernel[k] = found[place + k] + bias[(of_lane * 3u + c) * TAP_BLOCKS + k];
            }
            let x = (column + cell) * PATCH + of_lane % PATCH;
            visibility += weigh(kernel, c, x, row * PATCH + of_lane / PATCH) / 3.0;
        }
        write(of_lane, column + cell, row, visibility);
    }
}
