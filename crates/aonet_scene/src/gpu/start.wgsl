// Start points of the rays of a frame's pixels, on the triangle that a renderer's normals and depth show. After traverse.wgsl. CPU
// twin: Point of reference.rs, which knows the triangle.

struct Frame {
    world_from_view: mat4x3<f32>,
    /// [px]
    size: vec2<u32>,
    /// Converts a stored depth to a distance: see decode_depth.
    depth_line: vec2<f32>,
    /// Height of a pixel [world units]: the first times the depth plus the second. One of them is 0.
    pixel_size: vec2<f32>,
    /// The place that the camera's axis meets [px from the upper left corner].
    centre: vec2<f32>,
    /// Width of a pixel over its height.
    aspect: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(3) var<storage, read_write> origins: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> normals: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> geo_normals: array<vec4<f32>>;
@group(1) @binding(0) var normal_texture: texture_2d<f32>;
@group(1) @binding(1) var geo_normal_texture: texture_2d<f32>;
@group(1) @binding(2) var depth_texture: texture_2d<f32>;

/// How far a rasteriser may move a surface sideways [px]: Vulkan lets vertices snap to 1/16 of a pixel, so by half of it in x and
/// in y; and half as much again. Hardware snaps to 1/256, SwiftShader to 1/16, and WebGPU does not report it.
const SNAP: f32 = 1.0 / 16.0;
const EPSILON: f32 = 1.1920929e-7;
/// Relative error of a position: that of the depth and a dozen roundings of half a unit in the last place.
const POSITION_ERROR: f32 = 8.0 * EPSILON;

/// World space, unit length; zero where `normal_view` is.
fn to_world(normal_view: vec3<f32>) -> vec3<f32> {
    return frame.world_from_view * vec4(normal_view / sqrt(max(dot(normal_view, normal_view), 1e-30)), 0.0);
}

/// The point of a triangle next to `position`, moved along `geo_normal` by just more than rounding can move it back. CPU twin:
/// above of reference.rs, with doubles; here the projection errs in every component of the offset.
fn above(triangle: u32, position: vec3<f32>, geo_normal: vec3<f32>) -> vec3<f32> {
    let across = back_normal(triangle);
    let longest = max(abs(across.x), max(abs(across.y), abs(across.z)));
    let exact = normalize(across / longest);
    let offset = position - triangles[3u * triangle].xyz;
    let on_plane = position - exact * dot(exact, offset);
    let size = abs(triangles[3u * triangle + 1u].xyz) + abs(triangles[3u * triangle + 2u].xyz);
    let distance = EPSILON * dot(abs(on_plane) + 4.0 * size + 8.0 * abs(offset), abs(exact));
    return on_plane + select(exact, -exact, dot(exact, geo_normal) < 0.0) * distance;
}

/// Just above the triangle that a rasteriser drew at `position`, at most `reach` away: the first front with this normal,
/// else the first back. Without one, as beyond an edge, equally far above the position.
fn on_surface(position: vec3<f32>, geo_normal: vec3<f32>, reach: f32) -> vec3<f32> {
    let outside = position + reach * geo_normal;
    var triangle = met(Ray(outside, -geo_normal, 2.0 * reach), false);
    if (triangle == NOTHING) {
        triangle = met(Ray(position - reach * geo_normal, geo_normal, 2.0 * reach), false);
    }
    if (triangle == NOTHING) {
        return outside;
    }
    return above(triangle, position, geo_normal);
}

@compute @workgroup_size(16, 8)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= frame.size)) {
        return;
    }
    let i = id.y * frame.size.x + id.x;
    let depth = decode_depth(textureLoad(depth_texture, id.xy, 0).x);
    if (depth >= BACKGROUND) {
        normals[i] = vec4(0.0);
        return;
    }
    let pixel_size = frame.pixel_size.x * depth + frame.pixel_size.y;
    let position_view = position_at(vec2<f32>(id.xy), depth);
    let position = frame.world_from_view * vec4(position_view, 1.0);
    let geo_normal_view = textureLoad(geo_normal_texture, id.xy, 0).xyz;
    // Seen from behind, both normals are flipped.
    let towards_eye = select(-position_view, vec3(0.0, 0.0, 1.0), frame.pixel_size.x == 0.0);
    let side = select(1.0, -1.0, dot(geo_normal_view, towards_eye) < 0.0);
    let geo_normal = side * to_world(geo_normal_view);
    let error = POSITION_ERROR * (length(position) + length(position_view) + length(frame.world_from_view[3]));
    origins[i] = vec4(on_surface(position, geo_normal, error + SNAP * pixel_size), 0.0);
    normals[i] = vec4(side * to_world(textureLoad(normal_texture, id.xy, 0).xyz), 0.0);
    geo_normals[i] = vec4(geo_normal, 0.0);
}
