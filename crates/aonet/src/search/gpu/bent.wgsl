// Visibility and bend of a method with horizons: it adds `lost_in`, what a slice loses. CPU twin: search/bent.rs.

/// The light between the viewer and a horizon, and its vector: towards the viewer, and along the slice.
alias Beam = vec3<f32>;

fn beam_above(s: Slice, horizon: f32, sign: f32) -> Beam {
    let cosine = clamp(horizon, -1.0, 1.0);
    let square = 1.0 - cosine * cosine;
    let sine_cubed = square * sqrt(square);
    let cubed = cosine * cosine * cosine;
    let towards = s.cos_n * (1.0 - cubed) + s.sin_n * sine_cubed * sign;
    let along = s.sin_n * (2.0 - 3.0 * cosine + cubed) + s.cos_n * sine_cubed * sign;
    return vec3(light_above(s, cosine, sign), vec2(towards, along) / 3.0);
}

/// The same of a whole slice when nothing occludes.
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
    let sky = dot(p.normal, p.to_viewer) * f32(SLICES) * p.to_viewer + 2.0 * leaning;
    let sum = (1.0 - visibility) * sky - 1.5 * bent;
    let bend = sum * (powered / max(visibility, 1e-6) / f32(SLICES));
    return array<f32, PLANES>(powered, bend.x, bend.y, bend.z);
}
