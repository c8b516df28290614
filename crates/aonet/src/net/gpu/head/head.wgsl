// What heads are told, read and write. CPU twin: cpu/head.rs.

struct Head {
    /// Cells.
    size: vec2<u32>,
    /// Of four channels, of the input.
    blocks: u32,
    /// Pixels, which the cells may exceed, where neighbours are weighed.
    frame: vec2<u32>,
}

@group(0) @binding(0) var<uniform> head: Head;
/// See the packing of each kind of shader.
@group(0) @binding(1) var<storage, read> weights: array<real4>;
@group(0) @binding(2) var<storage, read> bias: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> raw: array<f32>;
@group(0) @binding(4) var<storage, read> input: array<real4>;

/// Writes a value of a cell. Images of one value of all cells follow one another.
fn write(which: u32, column: u32, row: u32, value: f32) {
    if (column < head.size.x && row < head.size.y) {
        raw[(which * head.size.y + row) * head.size.x + column] = value;
    }
}
