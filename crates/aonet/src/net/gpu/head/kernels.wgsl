// Kernels over the normals: AO-Net §3.3, Eq. 2. CPU twin: cpu/kernel_predict.rs.

/// The partitioned features; the first three are the normal.
@group(0) @binding(5) var<storage, read> guide: array<real>;

/// Whether neither rows nor columns of a patch share bits of a channel's number.
const SEPARABLE: bool = (PATCH & (PATCH - 1u)) == 0u;

/// Where component c of the normal of a pixel is.
fn place(c: u32, column: u32, row: u32) -> u32 {
    let channel = (c * PATCH + row % PATCH) * PATCH + column % PATCH;
    let cell = (channel / 4u * head.size.y + row / PATCH) * head.size.x + column / PATCH;
    return cell * 4u + channel % 4u;
}

/// Component c of the normals of a row of a window; columns are numbers, or where they are in a row.
fn normals(c: u32, columns: vec4<u32>, row: u32) -> vec4<f32> {
    let first = place(c, 0u, row);
    var values: vec4<f32>;
    for (var k = 0u; k < 4u; k++) {
        if (SEPARABLE) {
            values[k] = f32(guide[first + columns[k]]);
        } else {
            values[k] = f32(guide[place(c, columns[k], row)]);
        }
    }
    return values;
}

/// What the weights say of one component of the normals around a pixel.
fn weigh(rows: array<vec4<f32>, 4>, c: u32, x: u32, y: u32) -> f32 {
    var kernel = rows;
    let last = vec2<i32>(head.size * PATCH) - 1;
    var columns = vec4<u32>(clamp(vec4(i32(x) + FIRST_TAP) + vec4(0, 1, 2, 3), vec4(0), vec4(last.x)));
    if (SEPARABLE) {
        for (var k = 0u; k < 4u; k++) {
            columns[k] = place(0u, columns[k], 0u);
        }
    }
    var largest = 0.0;
    if (SOFTMAX) {
        let pairs = max(max(kernel[0], kernel[1]), max(kernel[2], kernel[3]));
        largest = max(max(pairs.x, pairs.y), max(pairs.z, pairs.w));
    }
    var sum = 0.0;
    var total = 0.0;
    for (var ky = 0u; ky < 4u; ky++) {
        var weights = kernel[ky];
        if (SOFTMAX) {
            weights = exp(weights - largest);
            total += dot(weights, vec4(1.0));
        }
        let row = u32(clamp(i32(y + ky) + FIRST_TAP, 0, last.y));
        sum += dot(weights, normals(c, columns, row));
    }
    return select(sum, sum / total, SOFTMAX);
}
