// Bent normals as a picture: unit vectors in view space, or n/2 + 1/2; alpha is 1, and all is 0 on the background. CPU twin: `write` of
// search/bent.rs.

/// What the search found, plane by plane: first the visibility, from BEND_PLANE on the bend.
@group(1) @binding(0) var<storage, read> found: array<f32>;

@fragment
fn main(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = min(vec2<u32>(place.xy) + frame.margin, frame.size - 1u);
    let surface = surface_at(pixel);
    if (!surface.foreground) {
        return vec4(0.0);
    }
    let count = frame.size.x * frame.size.y;
    let at = pixel.y * frame.size.x + pixel.x;
    let first = BEND_PLANE * count + at;
    let bend = vec3(found[first], found[first + count], found[first + 2u * count]);
    let sum = found[at] * surface.normal + bend;
    let size = length(sum);
    let bent = select(surface.normal, sum / max(size, SHORTEST), size > SHORTEST);
    return vec4(select(bent, 0.5 * bent + 0.5, HALVED), 1.0);
}
