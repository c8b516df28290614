// The vector of light, and what bends a normal. CPU twins: `beam_above` of search/slice.rs, Beams of search/bent.rs.

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

/// The bend by the vectors of the light that all slices lose and of how far the normal leans along them, by the share of the light that is not
/// lost, and by that share with its power.
fn bend_of(p: Pixel, lost: vec3<f32>, leaning: vec3<f32>, share: f32, powered: f32) -> vec3<f32> {
    let sky = dot(p.normal, p.to_viewer) * f32(SLICES) * p.to_viewer + 2.0 * leaning;
    return ((1.0 - share) * sky - 1.5 * lost) * (powered / max(share, 1e-6) / f32(SLICES));
}
