// A method that looks around every pixel: places on the screen, and the sum over all. A method adds `planes_at`. CPU twin:
// search/screen.rs.

/// Plane by plane.
@group(1) @binding(0) var<storage, read_write> found: array<f32>;

const PI: f32 = 3.1415927;

/// A pixel that shows geometry.
struct Pixel {
    at: vec2<f32>,
    /// View space.
    position: vec3<f32>,
    normal: vec3<f32>,
    to_viewer: vec3<f32>,
    /// The AO radius on the screen [px].
    radius_px: f32,
}

/// Sine of an angle between -PI/2 and PI/2, and a little beyond. WGSL's own may be off by 5e-4.
fn small_sine(x: f32) -> f32 {
    let s = x * x;
    let higher = 1.0 / 120.0 + s * (-1.0 / 5040.0 + s * (1.0 / 362880.0 - s / 39916800.0));
    return x * (1.0 + s * (-1.0 / 6.0 + s * higher));
}

/// Cosine and sine of so many half turns, in [0, 1].
fn half_turn(turn: f32) -> vec2<f32> {
    let angle = turn * PI;
    return vec2(small_sine(0.5 * PI - angle), small_sine(min(angle, PI - angle)));
}

/// v in [0, 1] to the power of an exponent.
fn power(v: f32, exponent: f32) -> f32 {
    return exp2(log2(max(v, 1e-20)) * exponent);
}

fn inside(place: vec2<f32>) -> bool {
    return all(place >= vec2(-0.5)) && all(place <= vec2<f32>(frame.size) - 0.5);
}

/// The pixel nearest to a place on the screen: the edge's where it is outside.
fn nearest(place: vec2<f32>) -> vec2<f32> {
    return round(clamp(place, vec2(0.0), vec2<f32>(frame.size) - 1.0));
}

/// View-space position of what the pixel nearest to a place shows.
fn shown_at(place: vec2<f32>) -> vec3<f32> {
    let pixel = nearest(place);
    return position_at(pixel, depth_at(vec2<u32>(pixel), 0u));
}

@compute @workgroup_size(TILE_WIDTH, TILE_HEIGHT)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= frame.size.x || id.y >= frame.size.y) {
        return;
    }
    let surface = surface_at(id.xy);
    var planes: array<f32, PLANES>;
    planes[0] = 1.0;
    if (surface.foreground) {
        let at = vec2<f32>(id.xy);
        let position = position_at(at, surface.depth);
        let to_viewer = select(vec3(0.0, 0.0, 1.0), normalize(-position), perspective());
        let pixel_size = frame.pixel_size.x * surface.depth + frame.pixel_size.y;
        let p = Pixel(at, position, surface.normal, to_viewer, frame.radius / pixel_size);
        planes = planes_at(p, noise_at(id.xy));
    }
    for (var c = 0u; c < PLANES; c++) {
        found[(c * frame.size.y + id.y) * frame.size.x + id.x] = planes[c];
    }
}
