// GTAO that fades every occluder by its own distance instead of one horizon; before its filter. CPU twin:
// search/agtao.rs.

/// What a tap sees: towards the viewer and along the slice (world units), 1 if that is a surface in the frame, and its distance on the screen (px).
alias Place = vec4<f32>;

/// The highest occluder so far on one side of a slice.
struct Horizon {
    /// Of the angle to the viewer.
    cosine: f32,
    /// Light between the viewer and it.
    beam: Beam,
    /// Light that is lost below it.
    lost: Beam,
    /// The last two places that were looked at; at first the pixel itself.
    before: Place,
    here: Place,
}

/// The horizon after an occluder, by the cosine to it and its squared distance.
fn risen(s: Slice, cosine: f32, squared: f32, sign: f32, before: Horizon) -> Horizon {
    var after = before;
    let radius = frame.radius * RADIUS_SCALE;
    if (cosine > before.cosine) {
        let beam = beam_above(s, cosine, sign);
        after.lost += (before.beam - beam) * (1.0 - squared * (ATTENUATION / (radius * radius)));
        after.beam = beam;
        after.cosine = cosine;
    }
    return after;
}

/// The horizon where a surface enters the search's radius between the tap before and the last one, which lies outside.
fn entered(s: Slice, next: Place, sign: f32, horizon: Horizon) -> Horizon {
    let here = horizon.here;
    let radius = frame.radius * RADIUS_SCALE;
    let way = here.xy - next.xy;
    let a = max(dot(way, way), 1e-36);
    let b = dot(here.xy, way);
    let outside = dot(here.xy, here.xy) - radius * radius;
    let root = b * b - a * outside;
    if (horizon.before.z * here.z * next.z == 0.0 || outside <= 0.0 || b >= 0.0 || root < 0.0) {
        return horizon;
    }
    let steps = (-b - sqrt(root)) / a;
    // As far as the tap before, or half as far if that one lies deeper than this surface.
    let gap = (horizon.before.y - here.y) / way.y;
    let joined = here.x + gap * way.x <= horizon.before.x;
    if (steps > select(0.5 * gap, gap, joined)) {
        return horizon;
    }
    let nearest = here.xy + min(-b / a, gap) * way;
    return risen(s, (here.x + steps * way.x) / radius, min(dot(nearest, nearest), radius * radius), sign, horizon);
}

/// The horizon after a tap so many pixels along, or against, a slice.
fn rise(p: Pixel, s: Slice, pixels: f32, sign: f32, before: Horizon) -> Horizon {
    // Whole pixels, as on the CPU.
    let place = p.at + round(offset_in(s, pixels * sign));
    let at = project(p, s, shown_at(place));
    let radius = frame.radius * RADIUS_SCALE;
    var horizon = before;
    if (FOLLOW > 0.0) {
        // The background is far behind the pixel.
        let now = Place(at, select(0.0, 1.0, inside(place) && -at.x < 0.1 * BACKGROUND), pixels);
        if (pixels - before.here.w <= max(p.radius_px * RADIUS_SCALE * FOLLOW, NEAR)) {
            horizon = entered(s, now, sign, horizon);
        }
        horizon.before = horizon.here;
        horizon.here = now;
    }
    let squared = max(dot(at, at), 1e-36);
    if (!inside(place) || squared > radius * radius) {
        return horizon;
    }
    return risen(s, at.x * inverseSqrt(squared), squared, sign, horizon);
}

/// The horizon on one side before any tap.
fn lowest(s: Slice, cosine: f32, sign: f32) -> Horizon {
    return Horizon(cosine, beam_above(s, cosine, sign), Beam(), Place(0.0, 0.0, 1.0, 0.0), Place(0.0, 0.0, 1.0, 0.0));
}

/// Light that occluders on both sides of a slice take.
fn lost_in(p: Pixel, s: Slice, jitter: f32) -> Beam {
    // The tangent's elevation above the viewer's plane has the sine -sign sin n and the cosine cos n.
    let across = s.sin_n * COS_BIAS;
    let up = max(s.cos_n, 0.0) * SIN_BIAS;
    var right = lowest(s, up - across, 1.0);
    var left = lowest(s, up + across, -1.0);
    for (var k = 0u; k < STEPS; k++) {
        let cubic = DISTANCES[k];
        let share = cubic.x + jitter * (cubic.y + jitter * (cubic.z + jitter * cubic.w));
        let pixels = tap_distance(p, k, share);
        right = rise(p, s, pixels, 1.0, right);
        left = rise(p, s, pixels, -1.0, left);
    }
    return right.lost + left.lost;
}
