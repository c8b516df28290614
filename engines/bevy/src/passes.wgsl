struct Numbers {
    // Upper left corner of the camera's viewport (px of the target).
    corner: vec2i,
    // Power of visibility.
    intensity: f32,
}

@group(0) @binding(0) var<uniform> numbers: Numbers;
@group(0) @binding(1) var first: texture_2d<f32>;
@group(0) @binding(2) var second: texture_2d<f32>;

struct Surface {
    @location(0) normal: vec4f,
    @location(1) depth: f32,
}

@vertex
fn cover(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i / 2u) * 4.0 - 1.0, f32(i % 2u) * 4.0 - 1.0, 0.0, 1.0);
}

// Normal and depth of the viewport.
@fragment
fn crop(@builtin(position) at: vec4f) -> Surface {
    let pixel = vec2i(at.xy) + numbers.corner;
    return Surface(textureLoad(first, pixel, 0), textureLoad(second, pixel, 0).x);
}

@fragment
fn strengthen(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(pow(textureLoad(first, vec2i(at.xy), 0).x, numbers.intensity));
}
