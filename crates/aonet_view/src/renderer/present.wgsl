// A picture of sRGB values on a target of any size.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var smoothly: sampler;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    /// (0, 0) is the top left corner of the picture.
    @location(0) at: vec2<f32>,
}

/// A triangle that covers the target.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let clip = vec2(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    return Corner(vec4(clip, 0.0, 1.0), clip * vec2(0.5, -0.5) + 0.5);
}

/// IEC 61966-2-1.
fn decoded(encoded: vec3<f32>) -> vec3<f32> {
    return select(pow((encoded + 0.055) / 1.055, vec3(2.4)), encoded / 12.92, encoded <= vec3(0.04045));
}

@fragment
fn main(corner: Corner) -> @location(0) vec4<f32> {
    let colour = textureSampleLevel(picture, smoothly, corner.at, 0.0).xyz;
    if (TARGET_ENCODES) {
        return vec4(decoded(colour), 1.0);
    }
    return vec4(colour, 1.0);
}
