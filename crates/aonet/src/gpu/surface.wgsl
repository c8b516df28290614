// What the frame's textures show at a pixel, whatever their encoding.

struct Frame {
    /// The identity when normals are in view space already.
    view_from_normals: mat3x3<f32>,
    /// [px]
    size: vec2<u32>,
    /// What makes a distance of a stored depth: see decode_depth.
    depth_line: vec2<f32>,
    /// Height of a pixel [world units]: the first times the depth plus the second. One of them is 0.
    pixel_size: vec2<f32>,
    /// The place that the camera's axis meets [px from the upper left corner].
    centre: vec2<f32>,
    /// Width of a pixel over its height.
    aspect: f32,
    /// AO radius [world units].
    radius: f32,
    /// log2 of the radius at depth 1 [px].
    log2_radius_px: f32,
    /// Guard band (px): columns on the left and right, rows above and below. The picture is what lies inside.
    margin: vec2<u32>,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var normals: texture_2d<f32>;
@group(0) @binding(2) var depths: texture_2d<f32>;

struct Surface {
    /// View space, unit length; zero on the background.
    normal: vec3<f32>,
    /// Along -Z [world units].
    depth: f32,
    foreground: bool,
}

/// Meyer et al. 2010, On Floating-Point Normal Vectors: the octahedron unfolded.
fn octahedral(at: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(at.x) - abs(at.y);
    let fold = max(-z, 0.0);
    return vec3(at - select(vec2(-fold), vec2(fold), at >= vec2(0.0)), z);
}

/// Of any length.
fn decode_normal(stored: vec3<f32>) -> vec3<f32> {
    if (NORMALS == UNORM_NORMALS) {
        return 2.0 * stored - 1.0;
    }
    if (NORMALS == OCTAHEDRAL_NORMALS) {
        return octahedral(stored.xy);
    }
    if (NORMALS == OCTAHEDRAL_UNORM_NORMALS) {
        return octahedral(2.0 * stored.xy - 1.0);
    }
    return stored;
}

/// Along -Z [world units]. Layer 0 is the nearest surface; there are LAYERS of them.
fn depth_at(pixel: vec2<u32>, layer: u32) -> f32 {
    return decode_depth(stored_depth(pixel, layer));
}

fn surface_at(pixel: vec2<u32>) -> Surface {
    let depth = depth_at(pixel, 0u);
    let foreground = depth < BACKGROUND;
    let n = frame.view_from_normals * decode_normal(textureLoad(normals, pixel, 0).xyz);
    let unit = n / sqrt(max(dot(n, n), 1e-30));
    return Surface(select(vec3(0.0), unit, foreground), depth, foreground);
}
