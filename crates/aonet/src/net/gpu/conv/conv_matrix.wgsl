// A convolution as products of cooperative matrices: cells of a row by input channels, times input by output channels.
// The plain twin is conv.wgsl.
//
// A workgroup computes SIDE columns and WAVES * ROWS rows of cells, TILES * SIDE output channels; a subgroup ROWS of
// these rows. DEPTH times SIDE input channels at a time go through workgroup memory, cell by cell; filters are read where
// they are, PACKED matrices of outputs side by side.

const BORDER: u32 = SIZE / 2u;
/// Blocks of four channels of a row of a matrix.
const BLOCKS: u32 = SIDE / 4u;
const MATRIX: u32 = SIDE * BLOCKS;
const TILE_WIDTH: u32 = SIDE + 2u * BORDER;
const TILE_LEN: u32 = TILE_WIDTH * (WAVES * ROWS + 2u * BORDER);

var<workgroup> cells: array<vec4<f16>, TILE_LEN * BLOCKS * DEPTH>;
var<workgroup> found: array<vec4<f32>, WAVES * MATRIX>;

/// Loads so many times SIDE channels of the tile.
fn load(step: u32, count: u32, group: vec3<u32>, index: u32) {
    let origin = vec2<i32>(vec2(group.x * SIDE, group.y * WAVES * ROWS)) - i32(BORDER);
    let last = vec2<i32>(conv.size) - 1;
    for (var i = index; i < TILE_LEN * BLOCKS * count; i += WAVES * LANES) {
        let place = i % TILE_LEN;
        let cell = origin + vec2<i32>(vec2(place % TILE_WIDTH, place / TILE_WIDTH));
        let loaded = i / TILE_LEN;
        let block = step * BLOCKS + loaded;
        // What is no number must not meet a filter of zeros.
        var values = vec4<f32>();
        if (block < conv.blocks) {
            values = fetch(block, clamp(cell, vec2(0), last));
        }
        cells[(loaded / BLOCKS * TILE_LEN + place) * BLOCKS + loaded % BLOCKS] = vec4<f16>(values);
    }
}

/// Writes the cells and channels that a subgroup has found.
fn write(first: vec2<u32>, first_block: u32, wave: u32, lane: u32) {
    for (var i = lane; i < MATRIX; i += LANES) {
        let x = first.x + i % SIDE;
        let block = first_block + i / SIDE;
        if (x < conv.size.x && first.y < conv.size.y && block < conv.out_blocks) {
            var value = found[wave * MATRIX + i % SIDE * BLOCKS + i / SIDE] + bias[block];
            if (LEAKY) {
                value = max(value, LEAKY_SLOPE * value);
            }
            output[(block * conv.size.y + first.y) * conv.size.x + x] = vec4<f16>(value);
        }
    }
}

@compute @workgroup_size(INVOCATIONS)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
    @builtin(subgroup_id) subgroup: u32,
    @builtin(subgroup_invocation_id) invocation: u32,
) {
    // Tiles of outputs may be narrower than what is packed, and what is packed wider than the outputs.
    if (group.z * TILES * BLOCKS >= conv.out_blocks) {
        return;
    }
    let place = mine(subgroup, invocation, index);
    let wave = place.x;
    let lane = place.y;
//SUMS
    let steps = (conv.blocks + BLOCKS - 1u) / BLOCKS;
    let packed = group.z * TILES / PACKED * steps;
    for (var step = 0u; step < steps; step += DEPTH) {
        let count = min(DEPTH, steps - step);
        workgroupBarrier();
        load(step, count, group, index);
        workgroupBarrier();
        for (var d = 0u; d < count; d++) {
            for (var tap = 0u; tap < SIZE * SIZE; tap++) {
                let first_row = d * TILE_LEN + (wave * ROWS + tap / SIZE) * TILE_WIDTH;
                let first_cell = (first_row + tap % SIZE) * BLOCKS;
                let line = (packed + step + d) * SIZE * SIZE + tap;
                let first_filter = (line * PACKED + group.z * TILES % PACKED) * MATRIX;
//PRODUCTS
            }
        }
    }
    let first = vec2(group.x * SIDE, (group.y * WAVES + wave) * ROWS);
    let first_block = group.z * TILES * BLOCKS;
//STORES
}
