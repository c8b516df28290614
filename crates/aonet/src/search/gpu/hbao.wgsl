// HBAO: how much the sine of the horizon rises above the tangent plane's; before its filter. CPU twin: search/hbao.rs.

/// What the horizon's rise to a tap so many pixels along, or against, a slice adds to the occlusion, and its sine after it.
fn rise(p: Pixel, s: Slice, pixels: f32, highest: f32) -> vec2<f32> {
    let place = p.at + offset_in(s, pixels);
    let at = project(p, s, shown_at(place));
    let squared = max(dot(at, at), 1e-36);
    let sine = at.x * inverseSqrt(squared);
    let range = frame.radius * RADIUS_SCALE;
    if (!inside(place) || squared > range * range || sine <= highest) {
        return vec2(0.0, highest);
    }
    return vec2((sine - highest) * (1.0 - squared * (ATTENUATION / (range * range))), sine);
}

/// Occlusion on both sides of a slice.
fn gathered(p: Pixel, s: Slice, jitter: f32) -> vec2<f32> {
    // The tangent's elevation above the viewer's plane has the sine -sign sin n and the cosine cos n.
    let across = s.sin_n * COS_BIAS;
    let up = max(s.cos_n, 0.0) * SIN_BIAS;
    var right = vec2(0.0, up - across);
    var left = vec2(0.0, up + across);
    var occlusion = 0.0;
    for (var k = 0u; k < STEPS; k++) {
        let share = power((jitter + f32(k)) / f32(STEPS), DISTRIBUTION);
        let pixels = tap_distance(p, k, share);
        right = rise(p, s, pixels, right.y);
        left = rise(p, s, -pixels, left.y);
        occlusion += right.x + left.x;
    }
    return vec2(occlusion, 0.0);
}

fn open_share(sums: vec2<f32>) -> f32 {
    return 1.0 - sums.x * (0.5 * STRENGTH / f32(SLICES));
}
