// Draws a picture of sRGB values on a target of any size.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var smoothly: sampler;

/// IEC 61966-2-1.
fn decoded(encoded: vec3<f32>) -> vec3<f32> {
    return select(pow((encoded + 0.055) / 1.055, vec3(2.4)), encoded / 12.92, encoded <= vec3(0.04045));
}

/// `uv` is that of aonet's cover.wgsl.
@fragment
fn main(@location(0) uv: vec2<f32>) -> @location(0) vec4<f32> {
    let colour = textureSampleLevel(picture, smoothly, uv, 0.0).xyz;
    if (TARGET_ENCODES) {
        return vec4(decoded(colour), 1.0);
    }
    return vec4(colour, 1.0);
}
