// What all convolutions are told, read and write.

struct Conv {
    /// Cells of the output.
    size: vec2<u32>,
    /// Of four channels, of the input.
    blocks: u32,
    /// Of four channels, of the output.
    out_blocks: u32,
    /// Of each source: width, height, and the first of its blocks.
    sources: array<vec4<u32>, SOURCES>,
}

@group(0) @binding(0) var<uniform> conv: Conv;
/// See the packing of each kind of shader.
@group(0) @binding(1) var<storage, read> weights: array<real4>;
@group(0) @binding(2) var<storage, read> bias: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> output: array<real4>;
