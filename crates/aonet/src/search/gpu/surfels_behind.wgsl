// Normals of the second layer from its depth.

@group(1) @binding(1) var<storage, read_write> second_surfels: array<u32>;

/// A neighbour on the screen.
struct Neighbour {
    position: vec3<f32>,
    /// Difference in depth from the pixel; BACKGROUND where there is nothing, or no pixel.
    change: f32,
}

/// View-space position of a pixel of the second layer.
fn second_at(pixel: vec2<u32>, depth: f32) -> vec3<f32> {
    return position_at(vec2<f32>(pixel), depth);
}

/// The pixel beside one of a depth, in the layer that is nearer to it.
fn neighbour(pixel: vec2<u32>, step: vec2<i32>, here: f32) -> Neighbour {
    let at = vec2<i32>(pixel) + step;
    if (any(at < vec2(0)) || any(at >= vec2<i32>(frame.size))) {
        return Neighbour(vec3(0.0), BACKGROUND);
    }
    let depths = vec2(depth_at(vec2<u32>(at), 0u), depth_at(vec2<u32>(at), 1u));
    let depth = select(depths.y, depths.x, abs(depths.x - here) < abs(depths.y - here));
    if (depth >= BACKGROUND) {
        return Neighbour(vec3(0.0), BACKGROUND);
    }
    return Neighbour(second_at(vec2<u32>(at), depth), abs(depth - here));
}

/// From the neighbour before a pixel to the pixel, or from it to the one after it: the nearer in depth. Zero without both.
fn difference(before: Neighbour, here: vec3<f32>, after: Neighbour) -> vec3<f32> {
    if (before.change <= after.change) {
        return select(vec3(0.0), here - before.position, before.change < BACKGROUND);
    }
    return after.position - here;
}

/// Unit normal of the surface through a pixel of a depth and its neighbours, towards the viewer.
fn normal_of_depth(pixel: vec2<u32>, depth: f32) -> vec3<f32> {
    let here = second_at(pixel, depth);
    let left = neighbour(pixel, vec2(-1, 0), depth);
    let right = neighbour(pixel, vec2(1, 0), depth);
    let above = neighbour(pixel, vec2(0, -1), depth);
    let below = neighbour(pixel, vec2(0, 1), depth);
    let normal = cross(difference(above, here, below), difference(left, here, right));
    let length_one = unit(normal);
    return select(length_one, vec3(0.0, 0.0, 1.0), all(length_one == vec3(0.0)));
}

/// Packs the second layer of a pixel.
fn pack_behind(pixel: vec2<u32>, i: u32) {
    let depth = depth_at(pixel, 1u);
    var normal = vec3(0.0);
    if (depth < BACKGROUND) {
        normal = normal_of_depth(pixel, depth);
    }
    second_surfels[i] = packed(normal);
}
