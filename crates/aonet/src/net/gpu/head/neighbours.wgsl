// A head with weights of neighbours: all outputs of a pixel are computed together, PLANES values and then the weights.
// CPU twin: cpu/patch_merge.rs.

/// What a search found, plane by plane; the first one is the visibility.
@group(0) @binding(5) var<storage, read> found: array<f32>;

/// The visibility of a pixel of the frame, whose edges repeat.
fn found_at(x: i32, y: i32) -> f32 {
    let place = vec2<u32>(clamp(vec2(x, y), vec2(0), vec2<i32>(head.frame) - 1));
    return found[place.y * head.frame.x + place.x];
}

/// The pixels of the patches that a group has.
fn predict(group: u32, column: u32, first_row: u32) {
    for (var pixel = group; pixel < PATCH * PATCH; pixel += GROUPS) {
        var values = outputs(pixel, column, first_row);
        for (var cell = 0u; cell < CELLS; cell++) {
            let x = i32(column * PATCH + pixel % PATCH);
            let y = i32((first_row + cell) * PATCH + pixel / PATCH);
            let here = found_at(x, y);
            var mixed = 0.0;
            //NEIGHBOURS
            write(pixel, column, first_row + cell, values[cell].x + UNIT * mixed);
            for (var plane = 1u; plane < PLANES; plane++) {
                let value = values[plane / 4u * CELLS + cell][plane % 4u];
                write(plane * PATCH * PATCH + pixel, column, first_row + cell, value);
            }
        }
    }
}
