// What matrices.wgsl says in plain words, for tests on devices without matrices: LANES invocations in a row share out the
// places of a matrix.

/// Places of a lane: whole blocks, for no two lanes may write parts of one.
const PART: u32 = SIDE * SIDE / LANES;

/// Where it begins, and blocks from row to row.
alias MatrixA = vec2<u32>;
alias MatrixB = u32;
alias MatrixC = array<f32, PART>;

var<private> lane_of: u32;

fn mine(wave: u32, lane: u32, index: u32) -> vec2<u32> {
    lane_of = index % LANES;
    return vec2(index / LANES, lane_of);
}

fn cells_at(first: u32, stride: u32) -> MatrixA {
    return vec2(first, stride);
}

fn filters_at(first: u32) -> MatrixB {
    return first;
}

fn multiply_add(a: MatrixA, b: MatrixB, sums: MatrixC) -> MatrixC {
    var result = sums;
    for (var i = 0u; i < PART; i++) {
        let row = (lane_of * PART + i) / SIDE;
        let column = (lane_of * PART + i) % SIDE;
        for (var k = 0u; k < SIDE; k++) {
            let value = cells[a.x + row * a.y + k / 4u][k % 4u];
            result[i] += f32(value) * f32(weights[b + column * (SIDE / 4u) + k / 4u][k % 4u]);
        }
    }
    return result;
}

fn stage(sums: MatrixC, first: u32, stride: u32) {
    for (var i = 0u; i < PART; i += 4u) {
        let row = (lane_of * PART + i) / SIDE;
        let column = (lane_of * PART + i) % SIDE;
        found[first + row * stride + column / 4u] = vec4(sums[i], sums[i + 1u], sums[i + 2u], sums[i + 3u]);
    }
}
