// The occlusion of SSDO: points along cosine-weighted directions; before its filter. CPU twin: search/ssdo.rs.

fn visibility_at(p: Pixel, noise: vec2<f32>) -> f32 {
    let basis = basis_about(p.normal, noise.x);
    var hidden = 0.0;
    for (var i = 0u; i < SAMPLES; i++) {
        let distance = power(fract(noise.y + samples[i].w), DISTRIBUTION);
        let seen = look(p, basis * samples[i].xyz * (distance * (frame.radius * RADIUS_SCALE)) + p.position);
        hidden += select(0.0, 1.0, seen.y > frame.radius * BIAS && seen.y < frame.radius * DEPTH_LIMIT);
    }
    return 1.0 - hidden / f32(SAMPLES);
}
