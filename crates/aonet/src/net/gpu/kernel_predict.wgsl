// Kernels applied while they are in registers.
//
// The weights of a pixel for one component of the normal are computed together: a block for each row of its window.

@compute @workgroup_size(16, 2, GROUPS)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    let column = group.x * 16u + local.x;
    let first_row = (group.y * 2u + local.y) * CELLS;
    for (var pixel = local.z; pixel < PATCH * PATCH; pixel += GROUPS) {
        var visibility: array<f32, CELLS>;
        for (var c = 0u; c < 3u; c++) {
            var kernels = outputs(pixel * 3u + c, column, first_row);
            for (var cell = 0u; cell < CELLS; cell++) {
                let x = column * PATCH + pixel % PATCH;
                let y = (first_row + cell) * PATCH + pixel / PATCH;
                let kernel = array<vec4<f32>, 4>(
                    kernels[cell],
                    kernels[CELLS + cell],
                    kernels[2u * CELLS + cell],
                    kernels[3u * CELLS + cell],
                );
                visibility[cell] += weigh(kernel, c, x, y) / 3.0;
            }
        }
        for (var cell = 0u; cell < CELLS; cell++) {
            write(pixel, column, first_row + cell, visibility[cell]);
        }
    }
}
