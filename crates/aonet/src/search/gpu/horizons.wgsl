// The visibility of a method with horizons: it adds `lost_in`, what a slice loses. CPU twin: Sums of search/bent.rs.

/// The light between the viewer and a horizon.
alias Beam = f32;

fn beam_above(s: Slice, cosine: f32, sign: f32) -> Beam {
    return light_above(s, cosine, sign);
}

fn open_beam(s: Slice) -> Beam {
    return open_light(s);
}

/// Light that a slice loses, and light when nothing occludes.
fn gathered(p: Pixel, s: Slice, jitter: f32) -> vec2<f32> {
    return s.normal_length * vec2(lost_in(p, s, jitter), open_light(s));
}

fn open_share(sums: vec2<f32>) -> f32 {
    return 1.0 - sums.x / max(sums.y, 1e-6);
}
