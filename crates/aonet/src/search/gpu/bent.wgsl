// Visibility and bend of a method with horizons: it adds `lost_in`, what a slice loses. CPU twin: search/bent.rs.

/// The light of a whole slice when nothing occludes, and its vector.
fn open_beam(s: Slice) -> Beam {
    return vec3(open_light(s), vec2(2.0 * s.cos_n, 4.0 * s.sin_n) / 3.0);
}

fn planes_at(p: Pixel, noise: vec2<f32>) -> array<f32, PLANES> {
    var lost = vec2(0.0);
    var bent = vec3(0.0);
    // For the vector of the open sky.
    var leaning = vec3(0.0);
    for (var i = 0u; i < SLICES; i++) {
        let s = slice_at(p, (noise.x + f32(i)) / f32(SLICES));
        // The golden ratio keeps the slices' taps apart.
        let gone = s.normal_length * lost_in(p, s, fract(noise.y + f32(i) * 0.618034));
        lost += vec2(gone.x, s.normal_length * open_light(s));
        bent += gone.y * p.to_viewer + gone.z * s.along;
        leaning += s.normal_length * s.sin_n * s.along;
    }
    let visibility = saturate(1.0 - lost.x / max(lost.y, 1e-6));
    let powered = power(visibility, POWER);
    let bend = bend_of(p, bent, leaning, visibility, powered);
    return array<f32, PLANES>(powered, bend.x, bend.y, bend.z);
}
