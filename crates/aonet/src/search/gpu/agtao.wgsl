// GTAO that fades every occluder by its own distance instead of one horizon; before its filter. CPU twin:
// search/agtao.rs.

/// The highest occluder so far on one side of a slice.
struct Horizon {
    /// Of the angle to the viewer.
    cosine: f32,
    /// Light between the viewer and it.
    beam: Beam,
    /// Light that is lost below it.
    lost: Beam,
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
    let beam = beam_above(s, cosine, sign);
    return Horizon(cosine, beam, before.lost + (before.beam - beam) * weight);
}

/// Light that occluders on both sides of a slice take.
fn lost_in(p: Pixel, s: Slice, jitter: f32) -> Beam {
    // The tangent's elevation above the viewer's plane has the sine -sign sin n and the cosine cos n.
    let across = s.sin_n * COS_BIAS;
    let up = max(s.cos_n, 0.0) * SIN_BIAS;
    var right = Horizon(up - across, beam_above(s, up - across, 1.0), Beam());
    var left = Horizon(up + across, beam_above(s, up + across, -1.0), Beam());
    for (var k = 0u; k < STEPS; k++) {
        let cubic = DISTANCES[k];
        let share = cubic.x + jitter * (cubic.y + jitter * (cubic.z + jitter * cubic.w));
        let pixels = tap_distance(p, k, share);
        right = rise(p, s, pixels, 1.0, right);
        left = rise(p, s, pixels, -1.0, left);
    }
    return right.lost + left.lost;
}
