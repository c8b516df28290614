// The AO texture from what the network computed: in [0, 1], 1 on the background. CPU twin: cpu/image.rs.

@group(1) @binding(0) var<uniform> cells: vec2<u32>;
@group(1) @binding(1) var<storage, read> raw: array<RAW>;
/// What a search found, plane by plane, where the network corrects it; else unused.
@group(1) @binding(2) var<storage, read> base: array<f32>;

@fragment
fn main(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = min(vec2<u32>(place.xy) + frame.margin, frame.size - 1u);
    if (depth_at(pixel, 0u) >= BACKGROUND) {
        return vec4(1.0);
    }
    let cell = pixel / PATCH;
    let of_patch = pixel.y % PATCH * PATCH + pixel.x % PATCH;
    let of_cell = cell.y * cells.x + cell.x;
    var value = f32(raw[of_patch * cells.y * cells.x + of_cell]FIRST_CHANNEL);
    // CORRECTION planes: what is added to the visibility, and weights of the shares.
    let found = pixel.y * frame.size.x + pixel.x;
    if (CORRECTION > 0u) {
        value += base[found];
    }
    for (var plane = 1u; plane < CORRECTION; plane++) {
        let weight = raw[(plane * PATCH * PATCH + of_patch) * cells.y * cells.x + of_cell];
        value += f32(weightFIRST_CHANNEL) * base[plane * frame.size.x * frame.size.y + found];
    }
    // NaN, from weights so large that sums overflow, becomes 0.
    return vec4(select(0.0, min(value, 1.0), value > 0.0));
}
