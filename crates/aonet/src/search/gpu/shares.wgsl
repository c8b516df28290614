// Shares of light as a mixture of their colours. CPU twin: picture::shares of aonet_lab.

/// What the search found, plane by plane: the visibility, then the shares.
@group(1) @binding(0) var<storage, read> found: array<f32>;

@fragment
fn main(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = min(vec2<u32>(place.xy) + frame.margin, frame.size - 1u);
    var open = 1.0;
    var mixed = vec3(0.0);
    for (var share = 1u; share < PLANES; share++) {
        let at = (share * frame.size.y + pixel.y) * frame.size.x + pixel.x;
        let part = saturate(found[at]);
        open -= part;
        mixed += part * COLOURS[share];
    }
    return vec4(mixed + open * COLOURS[0], 1.0);
}
