// A plane through a pixel and the camera, in which occluders are looked for. CPU twin: search/slice.rs.

/// Spanned by the unit vectors to_viewer and one across it, "along".
// Jimenez et al. 2016, §4, Alg. 1: the light of a pixel as an integral over slices.
struct Slice {
    /// On the screen, y up.
    direction: vec2<f32>,
    /// How far a vector goes along, and towards the viewer once it is moved into the slice.
    along: vec3<f32>,
    towards: vec3<f32>,
    /// Length of the normal's projection into the slice.
    normal_length: f32,
    /// The projection's angle from to_viewer, positive along: cosine, sine and angle [rad].
    cos_n: f32,
    sin_n: f32,
    n: f32,
}

/// Arc cosine [rad], off by less than 7e-5. Abramowitz and Stegun 1964, 4.4.45. WGSL's own may be off by more.
fn arc_cosine(x: f32) -> f32 {
    let t = min(abs(x), 1.0);
    let of_t = 1.5707288 + t * (-0.2121144 + t * (0.0742610 - t * 0.0187293));
    let positive = sqrt(1.0 - t) * of_t;
    return select(positive, PI - positive, x < 0.0);
}

/// The slice at so many half turns from the screen's x axis, in [0, 1].
fn slice_at(p: Pixel, turn: f32) -> Slice {
    let d = half_turn(turn);
    let v = p.to_viewer;
    let view_slope = dot(d, v.xy);
    let inverse_along = inverseSqrt(max(1.0 - view_slope * view_slope, 1e-6));
    let along = (vec3(d, 0.0) - v * view_slope) * inverse_along;
    let axis = vec3(d.y * v.z, -d.x * v.z, d.x * v.y - d.y * v.x) * inverse_along;
    let facing = dot(p.normal, v);
    // How far to go towards the viewer for a step along the axis on the tangent plane.
    let slide = dot(p.normal, axis) / max(facing, MOST_GRAZING);
    let leaning = dot(p.normal, along);
    let squared = max(facing * facing + leaning * leaning, 1e-12);
    let inverse_length = inverseSqrt(squared);
    let cos_n = facing * inverse_length;
    let sin_n = leaning * inverse_length;
    let n = arc_cosine(cos_n);
    return Slice(d, along, v + axis * slide, squared * inverse_length, cos_n, sin_n, select(n, -n, sin_n < 0.0));
}

/// Light from the angles between the viewer and an angle (with its cosine and sine), whose sign tells the side.
// Jimenez et al. 2016, Eq. 7: an antiderivative of cos(t - n) |sin t|, zero at the viewer.
fn arc(s: Slice, angle: f32, cosine: f32, sine: f32) -> f32 {
    let of_double = (2.0 * cosine * cosine - 1.0) * s.cos_n + 2.0 * cosine * sine * s.sin_n;
    return (2.0 * angle * s.sin_n + s.cos_n - of_double) * 0.25;
}

/// Light between the viewer and a horizon on one side, by the cosine between the two.
fn light_above(s: Slice, horizon: f32, sign: f32) -> f32 {
    let cosine = clamp(horizon, -1.0, 1.0);
    return arc(s, arc_cosine(cosine) * sign, cosine, sqrt(1.0 - cosine * cosine) * sign);
}

/// Light of the whole slice when nothing occludes.
fn open_light(s: Slice) -> f32 {
    return s.n * s.sin_n + s.cos_n;
}
