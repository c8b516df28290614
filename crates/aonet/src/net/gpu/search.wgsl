// What the methods that look for occluders in slices share: places, taps, and the sum over slices. A method adds
// `gathered`, what a slice gathers, and `open_share`, the visibility by the sums of it.

@group(1) @binding(0) var<storage, read_write> found: array<f32>;

/// v in [0, 1] to the power of an exponent.
fn power(v: f32, exponent: f32) -> f32 {
    return exp2(log2(max(v, 1e-20)) * exponent);
}

/// How many pixels away the taps of a step are that are to be at a share of the search's radius.
fn tap_distance(p: Pixel, step: u32, share: f32) -> f32 {
    return max(share * (p.radius_px * RADIUS_SCALE), 1.0 + f32(step));
}

/// How far on the screen so many pixels along, or against, a slice are.
fn offset_in(s: Slice, pixels: f32) -> vec2<f32> {
    return vec2(s.direction.x, -s.direction.y) * pixels;
}

fn inside(place: vec2<f32>) -> bool {
    return all(place >= vec2(-0.5)) && all(place <= vec2<f32>(frame.size) - 0.5);
}

/// The pixel nearest to a place on the screen: the edge's where it is outside.
fn nearest(place: vec2<f32>) -> vec2<f32> {
    return round(clamp(place, vec2(0.0), vec2<f32>(frame.size) - 1.0));
}

/// Where an occluder is in a slice, seen from the pixel: towards the viewer, and along [world units].
fn project(p: Pixel, s: Slice, occluder: vec3<f32>) -> vec2<f32> {
    // Taps lie on pixels beside the slice: they are moved into it along the tangent plane.
    let t = occluder - p.position;
    return vec2(dot(t, s.towards), dot(t, s.along));
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
        var sums = vec2(0.0);
        for (var i = 0u; i < SLICES; i++) {
            let s = slice_at(p, (noise.x + f32(i)) / f32(SLICES));
            // The golden ratio keeps the slices' taps apart.
            sums += gathered(p, s, fract(noise.y + f32(i) * 0.618034));
        }
        visibility = power(saturate(open_share(sums)), POWER);
    }
    found[id.y * frame.size.x + id.x] = visibility;
}
