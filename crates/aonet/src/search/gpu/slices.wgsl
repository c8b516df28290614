// What the methods that look for occluders in slices share. CPU twin: search/slice.rs.

/// How many pixels away the taps of a step are that are to be at a share of the search's radius.
fn tap_distance(p: Pixel, step: u32, share: f32) -> f32 {
    return max(share * (p.radius_px * RADIUS_SCALE), 1.0 + f32(step));
}

/// How far on the screen so many pixels, by their height, along, or against, a slice are.
fn offset_in(s: Slice, pixels: f32) -> vec2<f32> {
    return vec2(s.direction.x / frame.aspect, -s.direction.y) * pixels;
}

/// Where an occluder is in a slice, seen from the pixel: towards the viewer, and along [world units].
fn project(p: Pixel, s: Slice, occluder: vec3<f32>) -> vec2<f32> {
    // Taps lie on pixels beside the slice: they are moved into it along the tangent plane.
    let t = occluder - p.position;
    return vec2(dot(t, s.towards), dot(t, s.along));
}
