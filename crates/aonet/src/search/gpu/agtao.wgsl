// GTAO that fades every occluder by its own distance instead of one horizon; before its filter. CPU twin:
// search/agtao.rs.

/// The highest occluder so far on one side of a slice.
struct Horizon {
    /// Of the angle to the viewer.
    cosine: f32,
    /// Light between the viewer and it.
    light: f32,
    /// Light that is lost below it.
    lost: f32,
}

/// The horizon after a tap so many pixels along, or against, a slice.
fn rise(p: Pixel, s: Slice, pixels: f32, sign: f32, before: Horizon) -> Horizon {
    // Whole pixels, as on the CPU.
    let place = p.at + round(offset_in(s, pixels * sign));
    let at = project(p, s, shown_at(place));
    let squared = max(dot(at, at), 1e-36);
    let cosine = at.x * inverseSqrt(squared);
    let radius = frame.radius * RADIUS_SCALE;
    if (!inside(place) || squared > radius * radius || cosine <= before.cosine) {
        return before;
    }
    let weight = 1.0 - squared * (ATTENUATION / (radius * radius));
    let light = light_above(s, cosine, sign);
    return Horizon(cosine, light, before.lost + (before.light - light) * weight);
}

/// Light that occluders on both sides of a slice take, and light when nothing does.
fn gathered(p: Pixel, s: Slice, jitter: f32) -> vec2<f32> {
    // The tangent's elevation above the viewer's plane has the sine -sign sin n and the cosine cos n.
    let across = s.sin_n * COS_BIAS;
    let up = max(s.cos_n, 0.0) * SIN_BIAS;
    var right = Horizon(up - across, light_above(s, up - across, 1.0), 0.0);
    var left = Horizon(up + across, light_above(s, up + across, -1.0), 0.0);
    for (var k = 0u; k < STEPS; k++) {
        let cubic = DISTANCES[k];
        let share = cubic.x + jitter * (cubic.y + jitter * (cubic.z + jitter * cubic.w));
        let pixels = tap_distance(p, k, share);
        right = rise(p, s, pixels, 1.0, right);
        left = rise(p, s, pixels, -1.0, left);
    }
    return s.normal_length * vec2(right.lost + left.lost, open_light(s));
}

fn open_share(sums: vec2<f32>) -> f32 {
    return 1.0 - sums.x / max(sums.y, 1e-6);
}
