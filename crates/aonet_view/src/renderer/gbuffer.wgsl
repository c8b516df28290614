// The visible surface of every pixel and the one behind it, as the rays of aonet_scene::gbuffer find them. Triangles are drawn
// with reversed depth.

struct Camera {
    view_from_world: mat4x4<f32>,
    /// Clip from view space: of x and y; then z and w are lines of the distance along -Z.
    scale: vec2<f32>,
    z_line: vec2<f32>,
    w_line: vec2<f32>,
    /// Where the camera's axis is in clip space, for w = 1.
    axis: vec2<f32>,
    /// Least distance of the second layer behind the first [world units].
    separation: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> positions: array<f32>;
@group(0) @binding(2) var<storage, read> normals: array<f32>;
@group(0) @binding(3) var<storage, read> triangles: array<u32>;
@group(0) @binding(4) var<storage, read> albedos: array<f32>;
@group(0) @binding(5) var<storage, read> decals: array<Decal>;
@group(0) @binding(6) var images: texture_2d_array<f32>;
@group(0) @binding(7) var repeated: sampler;
@group(0) @binding(8) var repeated_along_u: sampler;
@group(0) @binding(9) var repeated_along_v: sampler;
@group(0) @binding(10) var single: sampler;
/// Of the first layer: distance along -Z [world units], 0 on the background.
@group(1) @binding(0) var first_depths: texture_2d<f32>;

/// The part of an image that a triangle shows.
struct Decal {
    /// Texture coordinates of its corners.
    uv: array<vec2<f32>, 3>,
    /// The layer in the lower half, then the wrap modes along u and v, two bits each. NONE: no image.
    number: u32,
}

const NONE: u32 = 0xffffffffu;
const REPEATS: u32 = 0u;
const MIRRORS: u32 = 2u;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    /// View space, towards the viewer, not of unit length.
    @location(0) normal: vec3<f32>,
    /// Distance along -Z [world units].
    @location(1) depth: f32,
    /// View space, towards the viewer; zero for a triangle without area.
    @location(2) @interpolate(flat) geo_normal: vec3<f32>,
    @location(3) @interpolate(flat) albedo: vec3<f32>,
    @location(4) uv: vec2<f32>,
    @location(5) @interpolate(flat) decal: u32,
}

struct Seen {
    @location(0) normal: vec4<f32>,
    @location(1) depth: f32,
    @location(2) albedo: vec4<f32>,
    @location(3) geo_normal: vec4<f32>,
}

struct SeenBehind {
    @location(0) normal: vec4<f32>,
    @location(1) depth: f32,
}

fn position_world(vertex: u32) -> vec3<f32> {
    return vec3(positions[3u * vertex], positions[3u * vertex + 1u], positions[3u * vertex + 2u]);
}

fn normal_world(vertex: u32) -> vec3<f32> {
    return vec3(normals[3u * vertex], normals[3u * vertex + 1u], normals[3u * vertex + 2u]);
}

fn direction_view(world: vec3<f32>) -> vec3<f32> {
    return (camera.view_from_world * vec4(world, 0.0)).xyz;
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = index / 3u;
    let a = position_world(triangles[3u * triangle]);
    let b = position_world(triangles[3u * triangle + 1u]);
    let c = position_world(triangles[3u * triangle + 2u]);
    let vertex = triangles[index];
    let seen = camera.view_from_world * vec4(position_world(vertex), 1.0);
    // The cross product of the longer edges is the most exact; all corners of a triangle choose the same ones.
    let across = cross(b - a, c - a);
    let longest = max(abs(across.x), max(abs(across.y), abs(across.z)));
    let front = select(vec3(0.0), direction_view(normalize(across / longest)), longest > 0.0);
    // The viewer is in front of the whole triangle or behind it.
    let from_viewer = select(vec3(0.0, 0.0, -1.0), (camera.view_from_world * vec4(a, 1.0)).xyz, camera.w_line.x > 0.0);
    let side = select(1.0, -1.0, dot(front, from_viewer) > 0.0);
    let depth = -seen.z;
    let zw = vec2(camera.z_line.x * depth + camera.z_line.y, camera.w_line.x * depth + camera.w_line.y);
    let albedo = vec3(albedos[3u * triangle], albedos[3u * triangle + 1u], albedos[3u * triangle + 2u]);
    // A scene without images has a single decal.
    let decal = min(triangle, arrayLength(&decals) - 1u);
    let uv = decals[decal].uv[index % 3u];
    let clip = vec4(camera.scale * seen.xy + camera.axis * zw.y, zw);
    let normal = side * direction_view(normal_world(vertex));
    return Corner(clip, normal, depth, side * front, albedo, uv, decals[decal].number);
}

/// An image at a place with its changes from pixel to pixel. Mirrors have no sampler: what they show lies between the edges.
fn shown(decal: u32, uv: vec2<f32>, along: array<vec2<f32>, 2>) -> vec3<f32> {
    let layer = decal & 0xffffu;
    let wrap = vec2((decal >> 16u) & 3u, (decal >> 18u) & 3u);
    let mirrored = 1.0 - abs(uv - 2.0 * floor(0.5 * uv) - 1.0);
    let at = select(uv, mirrored, wrap == vec2(MIRRORS));
    let repeats = wrap == vec2(REPEATS);
    if (all(repeats)) {
        return textureSampleGrad(images, repeated, at, layer, along[0], along[1]).xyz;
    }
    if (repeats.x) {
        return textureSampleGrad(images, repeated_along_u, at, layer, along[0], along[1]).xyz;
    }
    if (repeats.y) {
        return textureSampleGrad(images, repeated_along_v, at, layer, along[0], along[1]).xyz;
    }
    return textureSampleGrad(images, single, at, layer, along[0], along[1]).xyz;
}

/// View space, unit length.
fn shading_normal(at: Corner) -> vec3<f32> {
    // A shorter vector's direction is rounding noise, as for the rays.
    let has_direction = dot(at.normal, at.normal) > 1e-8;
    return normalize(select(at.geo_normal, at.normal, has_direction));
}

@fragment
fn main(at: Corner) -> Seen {
    // Derivatives have to be computed before invocations branch.
    let along = array(dpdx(at.uv), dpdy(at.uv));
    var albedo = at.albedo;
    if (at.decal != NONE) {
        albedo *= shown(at.decal, at.uv, along);
    }
    return Seen(vec4(shading_normal(at), 0.0), at.depth, vec4(albedo, 1.0), vec4(at.geo_normal, 0.0));
}

/// The second layer: the nearest surface that is far enough behind the first one.
@fragment
fn behind(at: Corner) -> SeenBehind {
    let first = textureLoad(first_depths, vec2<u32>(at.clip.xy), 0).x;
    // The distance is always above the rounding error of the first depth, as for the rays.
    if (first == 0.0 || at.depth < first + max(camera.separation, 1e-5 * first)) {
        discard;
    }
    return SeenBehind(vec4(shading_normal(at), 0.0), at.depth);
}
