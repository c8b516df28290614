// An edge-aware 5x5 filter: neighbours count as far as they lie on the pixel's plane and face its way. CPU twin:
// search/denoise.rs.

@group(1) @binding(0) var<storage, read_write> filtered: array<f32>;

const TILE: vec2<u32> = vec2(TILE_WIDTH, TILE_HEIGHT);
const WINDOW: vec2<u32> = TILE + 2u * REACH;

/// Normals and depth of the tile and what is beside it; the background's depth outside the frame.
var<workgroup> surfaces: array<vec4<f32>, WINDOW.x * WINDOW.y>;
var<workgroup> values: array<array<f32, PLANES>, WINDOW.x * WINDOW.y>;

/// Where a plane holds a pixel.
fn index_of(pixel: vec2<u32>, plane: u32) -> u32 {
    return (plane * frame.size.y + pixel.y) * frame.size.x + pixel.x;
}

fn load(group: vec2<u32>, index: u32) {
    for (var i = index; i < WINDOW.x * WINDOW.y; i += TILE.x * TILE.y) {
        let place = group * TILE + vec2(i % WINDOW.x, i / WINDOW.x);
        let pixel = clamp(place, vec2(REACH), frame.size + REACH - 1u);
        let s = surface_at(pixel - REACH);
        surfaces[i] = vec4(s.normal, select(BACKGROUND, s.depth, all(pixel == place)));
        values[i] = values_at(pixel - REACH);
    }
}

/// The mean, or a pixel's own value as far as it differs from the mean: see Pass in search/denoise.rs.
fn settled(own: f32, mean: f32, keep: f32) -> f32 {
    let difference = own - mean;
    let stays = select(0.0, min(abs(difference) / max(keep, 1e-6), 1.0), keep > 0.0);
    return mean + difference * (stays * stays);
}

@compute @workgroup_size(TILE_WIDTH, TILE_HEIGHT)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    load(group.xy, index);
    workgroupBarrier();
    let pixel = group.xy * TILE + local.xy;
    if (pixel.x >= frame.size.x || pixel.y >= frame.size.y) {
        return;
    }
    let centre = (local.y + REACH) * WINDOW.x + local.x + REACH;
    let normal = surfaces[centre].xyz;
    let depth = surfaces[centre].w;
    if (depth >= BACKGROUND) {
        var open: array<f32, PLANES>;
        open[0] = 1.0;
        store(pixel, open);
        return;
    }
    // From pixel to pixel on the screen, positions move by their size and by their difference in depth along the ray: so
    // does the distance from the plane.
    let tolerance = 1.0 / (PLANE * frame.radius);
    let across = vec2(normal.x * frame.aspect, -normal.y);
    let aside = across * (frame.pixel_size.x * depth + frame.pixel_size.y);
    let ray_aside = across * frame.pixel_size.x;
    let ray = dot(ray_aside, vec2<f32>(pixel) + 0.5 - frame.centre) - normal.z;
    var sums: array<f32, PLANES>;
    var weights = 0.0;
    for (var dy = 0u; dy <= 2u * REACH; dy++) {
        for (var dx = 0u; dx <= 2u * REACH; dx++) {
            let at = (local.y + dy) * WINDOW.x + local.x + dx;
            let neighbour = surfaces[at];
            let step = vec2(f32(dx), f32(dy)) - f32(REACH);
            let away = abs((neighbour.w - depth) * (ray + dot(ray_aside, step)) + dot(aside, step));
            let facing = exp2(log2(max(dot(neighbour.xyz, normal), 1e-20)) * NORMAL);
            let spatial = SPATIAL[u32(abs(step.x))] * SPATIAL[u32(abs(step.y))];
            let counts = select(max(1.0 - away * tolerance, 0.0), 0.0, neighbour.w >= BACKGROUND);
            let weight = spatial * counts * facing;
            for (var c = 0u; c < PLANES; c++) {
                sums[c] += values[at][c] * weight;
            }
            weights += weight;
        }
    }
    for (var c = 0u; c < PLANES; c++) {
        let own = values[centre][c];
        let mean = select(sums[c] / weights, own, weights <= 1e-6);
        sums[c] = settled(own, mean, select(KEEP_OTHERS, KEEP_FIRST, c == 0u));
    }
    store(pixel, sums);
}
