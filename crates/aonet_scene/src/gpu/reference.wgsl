// Traces rays from the start points of a range of pixels, and counts the open ones. CPU twin: reference.rs.

struct Batch {
    /// Seed of the spiral's turns: low and high half.
    seed: vec2<u32>,
    first_pixel: u32,
    pixels: u32,
    first_spoke: u32,
    spoke_stride: u32,
    /// Rays a pixel.
    rays: u32,
    /// AO radius [world units].
    radius: f32,
    /// Points of the spiral.
    spokes: f32,
}

@group(0) @binding(0) var<uniform> batch: Batch;
/// Index, cosine and sine.
@group(0) @binding(3) var<storage, read> spokes: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> origins: array<vec4<f32>>;
/// Zero on the background.
@group(0) @binding(5) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read> geo_normals: array<vec4<f32>>;
/// Open rays of each pixel.
@group(0) @binding(7) var<storage, read_write> open: array<atomic<u32>>;

const TAU: f32 = 6.2831853;

/// 64 bits, low half first.
fn multiply(a: u32, b: u32) -> vec2<u32> {
    let low = (a & 0xffffu) * (b & 0xffffu);
    let middle = (a >> 16u) * (b & 0xffffu) + (low >> 16u);
    let other = (a & 0xffffu) * (b >> 16u) + (middle & 0xffffu);
    return vec2(a * b, (a >> 16u) * (b >> 16u) + (middle >> 16u) + (other >> 16u));
}

/// a ^ (a >> shift), times b.
fn fold(a: vec2<u32>, shift: u32, b: vec2<u32>) -> vec2<u32> {
    let f = a ^ vec2((a.x >> shift) | (a.y << (32u - shift)), a.y >> shift);
    return multiply(f.x, b.x) + vec2(0u, f.x * b.y + f.y * b.x);
}

/// The first 64 bits of SplitMix64 (Steele et al. 2014).
fn mix64(seed: vec2<u32>) -> vec2<u32> {
    let low = seed.x + 0x7f4a7c15u;
    let z = vec2(low, seed.y + 0x9e3779b9u + u32(low < seed.x));
    let folded = fold(fold(z, 30u, vec2(0x1ce4e5b9u, 0xbf58476du)), 27u, vec2(0x133111ebu, 0x94d049bbu));
    return fold(folded, 31u, vec2(1u, 0u));
}

/// Cosine and sine of a share of a full turn. WGSL's own functions are only exact to 2^-11.
fn turned(turn: f32) -> vec2<f32> {
    let quarter = round(4.0 * turn);
    let x = (turn - 0.25 * quarter) * TAU;
    let s = x * x;
    // Taylor up to the term before 3e-8 at an eighth of a turn.
    let sin = x * (1.0 + s * (-1.0 / 6.0 + s * (1.0 / 120.0 + s * (-1.0 / 5040.0 + s / 362880.0))));
    let cos = 1.0 + s * (-0.5 + s * (1.0 / 24.0 + s * (-1.0 / 720.0 + s / 40320.0)));
    let odd = select(vec2(cos, sin), vec2(-sin, cos), (u32(quarter) & 1u) == 1u);
    return select(odd, -odd, (u32(quarter) & 2u) == 2u);
}

/// `local` of a frame whose z is `normal` and whose x and y are turned about it.
// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
fn around(normal: vec3<f32>, turn: vec2<f32>, local: vec3<f32>) -> vec3<f32> {
    // The sign of a zero counts.
    let side = select(1.0, -1.0, bitcast<u32>(normal.z) >> 31u == 1u);
    let a = -1.0 / (side + normal.z);
    let b = normal.x * normal.y * a;
    let x = vec3(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x);
    let y = vec3(b, side + normal.y * normal.y * a, -normal.y);
    return (x * turn.x + y * turn.y) * local.x + (y * turn.x - x * turn.y) * local.y + normal * local.z;
}

/// A direction about `normal`, cosine-weighted (Malley's method).
fn direction(pixel: u32, normal: vec3<f32>, spoke: vec4<f32>) -> vec3<f32> {
    let random = vec2<f32>(mix64(batch.seed ^ mix64(vec2(pixel, 0u))) >> vec2(8u)) / 16777216.0;
    let area = min((spoke.x + random.x) / batch.spokes, 1.0);
    let local = vec3(sqrt(area) * spoke.yz, sqrt(1.0 - area));
    return around(normal, turned(random.y), local);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    // Neighbours are rays of one pixel: they meet the same nodes.
    let of_batch = id.x / batch.rays;
    if (of_batch >= batch.pixels) {
        return;
    }
    let pixel = batch.first_pixel + of_batch;
    let normal = normals[pixel].xyz;
    var is_open = true;
    if (any(normal != vec3(0.0))) {
        let spoke = spokes[batch.first_spoke + id.x % batch.rays * batch.spoke_stride];
        let ray = Ray(origins[pixel].xyz, direction(pixel, normal, spoke), batch.radius);
        is_open = dot(ray.direction, geo_normals[pixel].xyz) > 0.0 && !blocked(ray);
    }
    if (is_open) {
        atomicAdd(&open[pixel], 1u);
    }
}
