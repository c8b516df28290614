// Kernels applied while they are in registers.
//
// The weights of a pixel for one component of the normal are computed together: a block for each row of its window.

/// The pixels of the patches that a group has.
fn predict(group: u32, column: u32, first_row: u32) {
    for (var pixel = group; pixel < PATCH * PATCH; pixel += GROUPS) {
        // Zeros must be written: left to the declaration, SwiftShader makes them once and not for every pixel.
        var visibility = array<f32, CELLS>();
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
