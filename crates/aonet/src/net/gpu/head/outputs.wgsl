// The 1x1 convolution of CELLS cells of a column.
//
// A workgroup computes 16 columns and 2 * CELLS rows of cells; its GROUPS share out the pixels of the patches: a
// kind of head adds `predict`.

/// Halves are added up over so many blocks of inputs only.
const EXACT_BLOCKS: u32 = 8u;
const SUMS: u32 = OUT_BLOCKS * CELLS;

/// Blocks of outputs of a number of cells of a column, block by block.
fn outputs(which: u32, column: u32, first_row: u32) -> array<vec4<f32>, SUMS> {
    var sums: array<real4, SUMS>;
    var totals: array<vec4<f32>, SUMS>;
    for (var i = 0u; i < SUMS; i++) {
        totals[i] = bias[which * OUT_BLOCKS + i / CELLS];
    }
    for (var block = 0u; block < head.blocks; block++) {
        var values: array<real4, CELLS>;
        for (var c = 0u; c < CELLS; c++) {
            let row = min(first_row + c, head.size.y - 1u);
            values[c] = input[(block * head.size.y + row) * head.size.x + min(column, head.size.x - 1u)];
        }
        for (var o = 0u; o < OUT_BLOCKS; o++) {
            let first = ((which * head.blocks + block) * OUT_BLOCKS + o) * 4u;
            let w0 = weights[first];
            let w1 = weights[first + 1u];
            let w2 = weights[first + 2u];
            let w3 = weights[first + 3u];
            for (var c = 0u; c < CELLS; c++) {
                let v = values[c];
                var sum = sums[o * CELLS + c];
                sum = fma(w0, real4(v.x), sum);
                sum = fma(w1, real4(v.y), sum);
                sum = fma(w2, real4(v.z), sum);
                sums[o * CELLS + c] = fma(w3, real4(v.w), sum);
            }
        }
        if (HALF && block % EXACT_BLOCKS == EXACT_BLOCKS - 1u) {
            for (var i = 0u; i < SUMS; i++) {
                totals[i] += vec4<f32>(sums[i]);
                sums[i] = real4();
            }
        }
    }
    for (var i = 0u; i < SUMS; i++) {
        totals[i] += vec4<f32>(sums[i]);
    }
    return totals;
}

@compute @workgroup_size(TILE_WIDTH, TILE_HEIGHT, GROUPS)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let column = group.x * TILE_WIDTH + local.x;
    let first_row = (group.y * TILE_HEIGHT + local.y) * CELLS;
    let mine = together(local.z);
    if (mine.whole) {
        predict(mine.group, column, first_row);
    } else {
        predict(local.z, column, first_row);
    }
}
