// Visibility to the power of an effect, into the texture that Godot's materials read.

/// The power, in x.
@group(0) @binding(0) var<uniform> intensity: vec4<f32>;
@group(0) @binding(1) var raw: texture_2d<f32>;
@group(0) @binding(2) var visibility: texture_storage_2d<r8unorm, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let pixel = invocation.xy;
    if (all(pixel < textureDimensions(visibility))) {
        textureStore(visibility, pixel, vec4(pow(textureLoad(raw, pixel, 0).x, intensity.x)));
    }
}
