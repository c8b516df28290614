// Normals of both layers, one word a pixel. CPU twin: search/surfels.rs.

@group(1) @binding(0) var<storage, read_write> first_surfels: array<u32>;

/// A vector of unit length. Normalised twice: the square of a small length is no float.
fn unit(v: vec3<f32>) -> vec3<f32> {
    let largest = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if (largest < 1e-30) {
        return vec3(0.0);
    }
    return normalize(v / largest);
}

/// Whether depth is straight from a neighbour over a pixel to the other one.
fn straight(before: f32, here: f32, after: f32) -> bool {
    let to = here - before;
    let on = after - here;
    return abs(to - on) <= (abs(to) + abs(on)) * BEND + here * ROUGHNESS;
}

/// View-space position of a pixel beside one, and its depth.
fn beside(pixel: vec2<u32>, step: vec2<i32>) -> vec4<f32> {
    let at = vec2<u32>(vec2<i32>(pixel) + step);
    let depth = min(depth_at(at, 0u), BACKGROUND);
    return vec4(position_at(vec2<f32>(at), depth), depth);
}

/// Unit normal of the first layer: from depth where depth is straight over the pixel, else from the frame.
fn first_normal(pixel: vec2<u32>) -> vec3<f32> {
    let surface = surface_at(pixel);
    if (!surface.foreground || any(pixel == vec2(0u)) || any(pixel + 1u == frame.size)) {
        return surface.normal;
    }
    let left = beside(pixel, vec2(-1, 0));
    let right = beside(pixel, vec2(1, 0));
    let above = beside(pixel, vec2(0, -1));
    let below = beside(pixel, vec2(0, 1));
    let found = cross(unit(below.xyz - above.xyz), unit(right.xyz - left.xyz));
    let is_straight = straight(left.w, surface.depth, right.w) && straight(above.w, surface.depth, below.w);
    if (is_straight && dot(found, found) >= LEAST_SPREAD) {
        return unit(found);
    }
    return surface.normal;
}

/// Ten bits for each component of a unit vector.
fn packed(normal: vec3<f32>) -> u32 {
    let bits = vec3<u32>(round(clamp(normal, vec3(-1.0), vec3(1.0)) * LENGTH + LENGTH));
    return (bits.x << 20u) | (bits.y << 10u) | bits.z;
}

@compute @workgroup_size(TILE_WIDTH, TILE_HEIGHT)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= frame.size.x || id.y >= frame.size.y) {
        return;
    }
    let i = id.y * frame.size.x + id.x;
    first_surfels[i] = packed(first_normal(id.xy));
    pack_behind(id.xy, i);
}
