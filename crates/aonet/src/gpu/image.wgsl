// The AO texture from what the network computed: in [0, 1], 1 on the background. CPU twin: cpu/image.rs.

@group(1) @binding(0) var<uniform> cells: vec2<u32>;
@group(1) @binding(1) var<storage, read> raw: array<RAW>;
/// What a search found, plane by plane, where the network corrects it; else unused.
@group(1) @binding(2) var<storage, read> base: array<f32>;

@fragment
fn main(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = min(vec2<u32>(place.xy) + frame.margin, frame.size - 1u);
    if (depth_at(pixel, 0u) >= BACKGROUND) {
        return vec4(1.0);
    }
    return vec4(value_at(pixel));
}
