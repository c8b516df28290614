// Kernels over the normals: AO-Net §3.3, Eq. 2. CPU twin: cpu/kernel_predict.rs.

/// The partitioned features; the first three are the normal.
@group(0) @binding(5) var<storage, read> guide: array<real>;

const FIRST_TAP: i32 = -1;

/// Component c of the normals of a row of the window of a pixel.
fn normals(c: u32, x: i32, y: i32) -> vec4<f32> {
    let last = vec2<i32>(head.size * PATCH) - 1;
    let row = u32(clamp(y, 0, last.y));
    var values: vec4<f32>;
    for (var k = 0; k < 4; k++) {
        let column = u32(clamp(x + k, 0, last.x));
        let channel = (c * PATCH + row % PATCH) * PATCH + column % PATCH;
        let cell = (channel / 4u * head.size.y + row / PATCH) * head.size.x + column / PATCH;
        values[k] = f32(guide[cell * 4u + channel % 4u]);
    }
    return values;
}

/// What the weights say of one component of the normals around a pixel.
fn weigh(rows: array<vec4<f32>, 4>, c: u32, x: u32, y: u32) -> f32 {
    var kernel = rows;
    let first = vec2(i32(x), i32(y)) + FIRST_TAP;
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
        sum += dot(weights, normals(c, first.x, first.y + i32(ky)));
    }
    return select(sum, sum / total, SOFTMAX);
}
