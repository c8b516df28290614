// A method that looks around every pixel: places on the screen, and what a method sees of the one that it looks around. A method adds
// `planes_at`. CPU twin:
// search/screen.rs.

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

/// What a method sees of the pixel that it looks around.
fn pixel_of(pixel: vec2<u32>, surface: Surface) -> Pixel {
    let at = vec2<f32>(pixel);
    let position = position_at(at, surface.depth);
    let to_viewer = select(vec3(0.0, 0.0, 1.0), normalize(-position), perspective());
    let pixel_size = frame.pixel_size.x * surface.depth + frame.pixel_size.y;
    return Pixel(at, position, surface.normal, to_viewer, frame.radius / pixel_size);
}
