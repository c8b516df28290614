// SSAO: points around the pixel that are behind what the depth buffer shows are hidden; before its filter. CPU twin:
// search/ssao.rs.

fn visibility_at(p: Pixel, noise: vec2<f32>) -> f32 {
    let basis = basis_about(select(p.to_viewer, p.normal, HEMISPHERE), noise.x);
    var hidden = 0.0;
    for (var i = 0u; i < SAMPLES; i++) {
        let seen = look(p, basis * samples[i].xyz * (frame.radius * RADIUS_SCALE) + p.position);
        if (seen.y > frame.radius * BIAS) {
            let before_pixel = max(abs(seen.x - p.position.z), 1e-20);
            // Hermite.
            hidden += smoothstep(0.0, 1.0, frame.radius * RANGE / before_pixel);
        }
    }
    return (1.0 - hidden / f32(SAMPLES)) * select(2.0, 1.0, HEMISPHERE);
}
