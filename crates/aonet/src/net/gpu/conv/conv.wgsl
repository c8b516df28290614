// A convolution and what is around it: its tile is resampled and concatenated while it is loaded. CPU twin: cpu/conv.rs.
//
// A workgroup computes 16 columns and 2 * ROWS rows of cells, GROUPS * 8 output channels. An invocation computes ROWS
// cells of a column, 8 channels; all of a GROUP read the same filters at the same time. DEPTH blocks of four input
// channels at a time go through workgroup memory: cells with their border, and, without subgroups, their filters.

const BORDER: u32 = SIZE / 2u;
const TILE: vec2<u32> = vec2(TILE_WIDTH, TILE_HEIGHT * ROWS);
/// Columns of the tile with its border.
const WIDTH: u32 = TILE.x + 2u * BORDER;
const TILE_LEN: u32 = WIDTH * (TILE.y + 2u * BORDER);
/// Blocks of four outputs of a workgroup.
const OUT_BLOCKS: u32 = 2u * GROUPS;
/// Filters of a block of inputs: by tap, input of the block, block of outputs of the tile.
const FILTER_LEN: u32 = SIZE * SIZE * 4u * OUT_BLOCKS;
const INVOCATIONS: u32 = TILE_WIDTH * TILE_HEIGHT * GROUPS;

var<workgroup> tile: array<real4, TILE_LEN * DEPTH>;

/// Loads blocks of inputs of the tile.
fn load_tile(first: u32, blocks: u32, group: vec3<u32>, index: u32) {
    let origin = vec2<i32>(group.xy * TILE) - i32(BORDER);
    let last = vec2<i32>(conv.size) - 1;
    for (var i = index; i < TILE_LEN * blocks; i += INVOCATIONS) {
        let place = i % TILE_LEN;
        let cell = origin + vec2<i32>(vec2(place % WIDTH, place / WIDTH));
        tile[i] = real4(fetch(first + i / TILE_LEN, clamp(cell, vec2(0), last)));
    }
}

/// Adds what the loaded block number `block` gives to a group of outputs; `first` is the first filter of all loaded blocks.
fn accumulate(first: u32, block: u32, group: u32, local: vec2<u32>, sums: ptr<function, array<real4, 2u * ROWS>>) {
    for (var dx = 0u; dx < SIZE; dx++) {
        var column: array<real4, ROWS + 2u * BORDER>;
        for (var r = 0u; r < ROWS + 2u * BORDER; r++) {
            column[r] = tile[block * TILE_LEN + (local.y * ROWS + r) * WIDTH + local.x + dx];
        }
        for (var dy = 0u; dy < SIZE; dy++) {
            for (var o = 0u; o < 2u; o++) {
                let i = block * FILTER_LEN + (dy * SIZE + dx) * 4u * OUT_BLOCKS + group * 2u + o;
                let w0 = filter_at(first, i);
                let w1 = filter_at(first, i + OUT_BLOCKS);
                let w2 = filter_at(first, i + 2u * OUT_BLOCKS);
                let w3 = filter_at(first, i + 3u * OUT_BLOCKS);
                for (var r = 0u; r < ROWS; r++) {
                    let v = column[r + dy];
                    var sum = (*sums)[2u * r + o];
                    sum = fma(w0, real4(v.x), sum);
                    sum = fma(w1, real4(v.y), sum);
                    sum = fma(w2, real4(v.z), sum);
                    (*sums)[2u * r + o] = fma(w3, real4(v.w), sum);
                }
            }
        }
    }
}

@compute @workgroup_size(TILE_WIDTH, TILE_HEIGHT, GROUPS)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    // Halves are added up over one block of inputs only.
    var sums: array<real4, 2u * ROWS>;
    var totals: array<vec4<f32>, 2u * ROWS>;
    let mine = together(local.z);
    for (var loaded = 0u; loaded < conv.blocks; loaded += DEPTH) {
        let blocks = min(DEPTH, conv.blocks - loaded);
        let first = (group.z * conv.blocks + loaded) * FILTER_LEN;
        workgroupBarrier();
        load_tile(loaded, blocks, group, index);
        load_filters(first, FILTER_LEN * blocks, index);
        workgroupBarrier();
        for (var block = 0u; block < blocks; block++) {
            if (mine.whole) {
                accumulate(first, block, mine.group, local.xy, &sums);
            } else {
                accumulate(first, block, local.z, local.xy, &sums);
            }
            if (HALF) {
                for (var i = 0u; i < 2u * ROWS; i++) {
                    totals[i] += vec4<f32>(sums[i]);
                    sums[i] = real4();
                }
            }
        }
    }
    let x = group.x * TILE_WIDTH + local.x;
    for (var i = 0u; i < 2u * ROWS; i++) {
        let y = (group.y * TILE_HEIGHT + local.y) * ROWS + i / 2u;
        let block = (group.z * GROUPS + local.z) * 2u + i % 2u;
        if (x < conv.size.x && y < conv.size.y && block < conv.out_blocks) {
            var value = totals[i] + vec4<f32>(sums[i]) + bias[block];
            if (LEAKY) {
                value = max(value, LEAKY_SLOPE * value);
            }
            output[(block * conv.size.y + y) * conv.size.x + x] = real4(value);
        }
    }
}
