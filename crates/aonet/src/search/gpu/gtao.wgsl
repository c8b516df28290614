// GTAO: two horizons a slice and the exact light between them; before its filter. CPU twin: search/gtao.rs.

/// Cosine between the viewer and what is so many pixels away on one side; as far as it is too far away, `lowest`.
fn occluder(p: Pixel, s: Slice, pixels: f32, sign: f32, lowest: f32) -> f32 {
    let place = p.at + offset_in(s, pixels * sign);
    let at = project(p, s, tap(nearest(place), pixels));
    let squared = max(dot(at, at), 1e-36);
    let before = at.x * (1.0 + THIN_OCCLUDER);
    let felt = sqrt(max(before * before + at.y * at.y, 1e-36));
    let range = frame.radius * RADIUS_SCALE;
    let weight = select(0.0, saturate((range - felt) / (FALLOFF * range)), inside(place));
    return (at.x * inverseSqrt(squared) - lowest) * weight + lowest;
}

/// Light that the horizons on both sides of a slice take.
fn lost_in(p: Pixel, s: Slice, jitter: f32) -> Beam {
    // The tangent plane at least.
    var right = -s.sin_n;
    var left = s.sin_n;
    for (var k = 0u; k < STEPS; k++) {
        let share = power((jitter + f32(k)) / f32(STEPS), DISTRIBUTION);
        let pixels = tap_distance(p, k, share);
        right = max(right, occluder(p, s, pixels, 1.0, -s.sin_n));
        left = max(left, occluder(p, s, pixels, -1.0, s.sin_n));
    }
    return open_beam(s) - (beam_above(s, right, 1.0) + beam_above(s, left, -1.0));
}
