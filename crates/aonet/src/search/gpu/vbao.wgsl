// Visibility bitmask: the occluded part of a slice as a set of sectors; before its filter. CPU twin: search/vbao.rs.

/// Light between the viewer and an angle, negative on the negative side.
fn signed_arc(s: Slice, angle: f32) -> f32 {
    let size = min(abs(angle), PI);
    let sine = small_sine(min(size, PI - size));
    let light = arc(s, angle, small_sine(0.5 * PI - size), select(sine, -sine, angle < 0.0));
    return select(light, -light, angle < 0.0);
}

/// Share of the slice on the negative side of an angle from the viewer; `ends` are the light below the hemisphere's ends.
fn share_below(s: Slice, ends: vec2<f32>, angle: f32) -> f32 {
    if (COSINE) {
        let light = signed_arc(s, clamp(angle, s.n - 0.5 * PI, s.n + 0.5 * PI));
        return saturate((light - ends.x) / max(ends.y - ends.x, 1e-6));
    }
    return saturate((angle - s.n) / PI + 0.5);
}

/// The sectors that a tap so many pixels away on one side occludes: the slab that each layer is.
fn behind_tap(p: Pixel, s: Slice, ends: vec2<f32>, pixels: f32, sign: f32) -> u32 {
    let place = p.at + offset_in(s, pixels * sign);
    if (!inside(place)) {
        return 0u;
    }
    let pixel = nearest(place);
    var occluded = 0u;
    for (var layer = 0u; layer < LAYERS; layer++) {
        let position = position_at(pixel, depth_at(vec2<u32>(pixel), layer));
        occluded |= behind_front(s, ends, project(p, s, position), sign);
    }
    return occluded;
}

/// The sectors behind a surface, as far as it is taken to be thick.
fn behind_front(s: Slice, ends: vec2<f32>, front: vec2<f32>, sign: f32) -> u32 {
    let back = front - vec2(frame.radius * THICKNESS, 0.0);
    let squared = max(dot(front, front), 1e-36);
    let range = frame.radius * RADIUS_SCALE;
    if (squared > range * range) {
        return 0u;
    }
    // Angles from the viewer; those behind are larger.
    let near = arc_cosine(front.x * inverseSqrt(squared)) * sign;
    let far = arc_cosine(back.x * inverseSqrt(max(dot(back, back), 1e-36))) * sign;
    let low = round(share_below(s, ends, select(far, near, sign > 0.0)) * SECTORS);
    let high = round(share_below(s, ends, select(near, far, sign > 0.0)) * SECTORS);
    return sectors(u32(low), u32(high));
}

/// Light of the free sectors of a slice, and of all.
fn gathered(p: Pixel, s: Slice, jitter: f32) -> vec2<f32> {
    let ends = vec2(signed_arc(s, s.n - 0.5 * PI), signed_arc(s, s.n + 0.5 * PI));
    var occluded = 0u;
    for (var k = 0u; k < STEPS; k++) {
        let share = power((jitter + f32(k)) / f32(STEPS), DISTRIBUTION);
        let pixels = tap_distance(p, k, share);
        occluded |= behind_tap(p, s, ends, pixels, 1.0) | behind_tap(p, s, ends, pixels, -1.0);
    }
    let weight = select(1.0, s.normal_length * open_light(s), COSINE);
    return weight * vec2(1.0 - f32(countOneBits(occluded)) / SECTORS, 1.0);
}

fn open_share(sums: vec2<f32>) -> f32 {
    return sums.x / max(sums.y, 1e-6);
}
