// GTAO that fades every occluder by its own distance instead of one horizon; before its filter. CPU twin:
// classic/agtao.rs.

@group(1) @binding(0) var<storage, read_write> found: array<f32>;

/// The highest occluder so far on one side of a slice.
struct Horizon {
    /// Of the angle to the viewer.
    cosine: f32,
    /// Light between the viewer and it.
    light: f32,
    /// Light that is lost below it.
    lost: f32,
}

/// v in [0, 1] to the power of an exponent.
fn power(v: f32, exponent: f32) -> f32 {
    return exp2(log2(max(v, 1e-20)) * exponent);
}

/// The horizon after a tap so many pixels along, or against, a slice.
fn rise(p: Pixel, s: Slice, pixels: f32, sign: f32, before: Horizon) -> Horizon {
    let place = p.at + vec2(s.direction.x, -s.direction.y) * (pixels * sign);
    let last = vec2<f32>(frame.size) - 1.0;
    let inside = all(place >= vec2(-0.5)) && all(place <= last + 0.5);
    let nearest = round(clamp(place, vec2(0.0), last));
    let t = position_at(nearest, depth_at(vec2<u32>(nearest))) - p.position;
    // Taps lie on pixels beside the slice: they are moved into it along the tangent plane.
    let towards = dot(t, s.towards);
    let along = dot(t, s.along);
    let squared = max(towards * towards + along * along, 1e-36);
    let cosine = towards * inverseSqrt(squared);
    let radius = frame.radius * RADIUS_SCALE;
    if (!inside || squared > radius * radius || cosine <= before.cosine) {
        return before;
    }
    let weight = 1.0 - squared * (ATTENUATION / (radius * radius));
    let light = light_above(s, cosine, sign);
    return Horizon(cosine, light, before.lost + (before.light - light) * weight);
}

/// Light that occluders on both sides of a slice take.
fn lost(p: Pixel, s: Slice, jitter: f32) -> f32 {
    // The tangent's elevation above the viewer's plane has the sine -sign sin n and the cosine cos n.
    let across = s.sin_n * COS_BIAS;
    let up = max(s.cos_n, 0.0) * SIN_BIAS;
    var right = Horizon(up - across, light_above(s, up - across, 1.0), 0.0);
    var left = Horizon(up + across, light_above(s, up + across, -1.0), 0.0);
    let reach = p.radius_px * RADIUS_SCALE;
    for (var k = 0u; k < STEPS; k++) {
        let share = power((jitter + f32(k)) / f32(STEPS), DISTRIBUTION);
        let pixels = max(share * reach, 1.0 + f32(k));
        right = rise(p, s, pixels, 1.0, right);
        left = rise(p, s, pixels, -1.0, left);
    }
    return right.lost + left.lost;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= frame.size.x || id.y >= frame.size.y) {
        return;
    }
    let surface = surface_at(id.xy);
    var visibility = 1.0;
    if (surface.foreground) {
        let at = vec2<f32>(id.xy);
        let position = position_at(at, surface.depth);
        let to_viewer = select(vec3(0.0, 0.0, 1.0), normalize(-position), perspective());
        let pixel_size = frame.pixel_size.x * surface.depth + frame.pixel_size.y;
        let p = Pixel(at, position, surface.normal, to_viewer, frame.radius / pixel_size);
        let noise = noise_at(id.xy);
        var taken = 0.0;
        var open = 0.0;
        for (var i = 0u; i < SLICES; i++) {
            let s = slice_at(p, (noise.x + f32(i)) / f32(SLICES));
            // The golden ratio keeps the slices' taps apart.
            taken += s.normal_length * lost(p, s, fract(noise.y + f32(i) * 0.618034));
            open += s.normal_length * open_light(s);
        }
        visibility = power(saturate(1.0 - taken / max(open, 1e-6)), POWER);
    }
    found[id.y * frame.size.x + id.x] = visibility;
}
