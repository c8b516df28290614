// Connected arcs: what is seen to block light, apart from what may lie behind it; before its filter. CPU twin:
// search/arcs.rs. Vectors in the plane of a slice go along it, and towards the viewer.

/// Longest way to a tap [px]: beyond every frame.
const LONGEST: f32 = 65536.0;

/// One side of a slice.
struct Side {
    /// 1 along the slice, -1 against it.
    sign: f32,
    /// Depth of the pixel, and length of its ray for each unit of depth.
    depth: f32,
    ray_length: f32,
    /// Where a step on the screen goes, for each world unit.
    across: vec2<f32>,
    /// Cosine between the viewer and the lowest occluder that counts.
    lowest: f32,
    /// Light when nothing blocks it.
    light: f32,
    /// Sectors for each share of light.
    scale: f32,
    /// What is added before rounding to whole sectors: in [-0.5, 0.5).
    dither: f32,
}

/// A place on a surface that a tap sees.
struct Seen {
    /// Whether there is a surface.
    valid: bool,
    /// Signed distance on the screen [px], and depth [world units].
    pixels: f32,
    depth: f32,
    /// Its normal in the plane of the slice, of any length.
    normal: vec2<f32>,
    /// From the pixel to it, and whether that is within the AO radius.
    offset: vec2<f32>,
    near: bool,
    /// Sectors between the viewer and it: a whole number.
    sector: f32,
}

/// What a tap reads, and where.
struct Tap {
    pixel: vec2<u32>,
    /// Signed distance on the screen [px].
    pixels: f32,
    /// Where its ray goes for each unit of depth.
    ray: vec2<f32>,
    /// From the centre of the pixel to the tap's place: right and up [px, by their height].
    aside: vec2<f32>,
}

/// Sectors of one side.
struct Blocked {
    hit: u32,
    /// Behind something seen by less than each of the gaps.
    hidden: array<u32, SHARES - 2>,
    off: u32,
}

fn side_of(p: Pixel, s: Slice, sign: f32, dither: f32) -> Side {
    let slope = dot(s.direction, p.to_viewer.xy);
    let across = vec2(sqrt(max(1.0 - slope * slope, 0.0)), slope);
    let lowest = max(s.cos_n, 0.0) * SIN_BIAS - s.sin_n * sign * COS_BIAS;
    let light = max(light_above(s, -s.sin_n * sign, sign), 1e-6);
    let ray_length = 1.0 / p.to_viewer.z;
    return Side(sign, -p.position.z, ray_length, across, lowest, light, SECTORS / light, dither - 0.5);
}

/// Height of a pixel at a depth [world units].
fn pixel_size(depth: f32) -> f32 {
    return frame.pixel_size.x * depth + frame.pixel_size.y;
}

/// Where the ray of a place goes, so many pixels along: for each unit of depth.
fn ray_to(side: Side, pixels: f32) -> vec2<f32> {
    return pixels * frame.pixel_size.x * side.across - vec2(0.0, side.ray_length);
}

/// From the pixel to a place so many pixels along, at a depth.
fn offset_to(side: Side, pixels: f32, depth: f32) -> vec2<f32> {
    return pixels * pixel_size(depth) * side.across - vec2(0.0, (depth - side.depth) * side.ray_length);
}

/// Sectors between the viewer and an offset: a whole number.
fn sector_of(s: Slice, side: Side, offset: vec2<f32>) -> f32 {
    let cosine = offset.y * inverseSqrt(max(dot(offset, offset), 1e-36));
    let light = light_above(s, min(max(cosine, side.lowest), 1.0), side.sign);
    return round(clamp(light * side.scale + side.dither, 0.0, SECTORS));
}

/// Whether the plane of one place predicts the depth of another, whose ray is given.
fn predicts(side: Side, place: Seen, other: Seen, ray: vec2<f32>) -> bool {
    // The ray meets the plane `fall / facing` nearer than the place.
    let step = (other.pixels - place.pixels) * pixel_size(place.depth);
    let facing = dot(ray, place.normal);
    let fall = step * dot(side.across, place.normal);
    let miss = (other.depth - place.depth) * facing + fall;
    // From the place to there, times `facing`.
    let way = step * facing * side.across - fall * ray;
    let in_front = (place.depth * facing - fall) * facing > 0.0;
    return in_front && miss * miss * dot(ray, ray) < dot(way, way) * (CONNECTED * CONNECTED);
}

/// How much deeper along a ray it enters the sphere of the AO radius, and leaves it. The ray starts at an offset from the pixel.
fn crossing(ray: vec2<f32>, offset: vec2<f32>) -> vec2<f32> {
    let a = dot(ray, ray);
    let b = dot(ray, offset);
    let c = dot(offset, offset) - frame.radius * frame.radius;
    let half_way = sqrt(max(b * b - a * c, 0.0));
    return vec2(-half_way - b, half_way - b) / a;
}

/// Sectors of light that leaves the frame within the AO radius, for a tap outside of it.
fn off_at(s: Slice, side: Side, pixels: f32) -> u32 {
    let ray = ray_to(side, pixels);
    let offset = offset_to(side, pixels, side.depth);
    let ways = crossing(ray, offset);
    if (ways.x >= ways.y) {
        return 0u;
    }
    let ends = vec2(sector_of(s, side, offset + ray * ways.x), sector_of(s, side, offset + ray * ways.y));
    return sectors(u32(min(ends.x, ends.y)), u32(max(ends.x, ends.y)));
}

/// What a tap sees in a layer; nothing on the background.
fn seen_by(p: Pixel, s: Slice, side: Side, tap: Tap, layer: u32) -> Seen {
    let stored = depth_at(tap.pixel, layer);
    if (stored >= BACKGROUND) {
        return nothing(tap.pixels);
    }
    let normal = surfel(tap.pixel, layer);
    let turned = vec2(dot(normal, s.along), dot(normal, p.to_viewer));
    // The pixel's plane at the tap's place.
    let facing = min(dot(tap.ray, turned), -LEAST_FACING);
    let depth = stored - pixel_size(stored) * dot(tap.aside, normal.xy) / facing;
    let offset = offset_to(side, tap.pixels, depth);
    let near = dot(offset, offset) <= frame.radius * frame.radius;
    return Seen(true, tap.pixels, depth, turned, offset, near, sector_of(s, side, offset));
}

fn nothing(pixels: f32) -> Seen {
    return Seen(false, pixels, 1.0, vec2(0.0), vec2(0.0), false, SECTORS);
}

/// Sectors between the viewer and the end of an arc, which ends where it leaves the AO radius.
fn end_of(s: Slice, side: Side, place: Seen, other: Seen) -> f32 {
    if (place.near) {
        return place.sector;
    }
    let way = place.offset - other.offset;
    return sector_of(s, side, other.offset + way * crossing(way, other.offset).y);
}

/// Sectors of one side of a slice by share: what is hit is not hidden, and what is hidden is not off.
fn sectors_on(p: Pixel, s: Slice, side: Side, jitter: f32) -> array<u32, SHARES> {
    // What the steps before saw: the last one first, layer by layer. Arcs begin at the tangent plane.
    var before: array<Seen, EARLIER * LAYERS>;
    before[0] = Seen(true, 0.0, side.depth, vec2(s.sin_n, s.cos_n), vec2(0.0), true, SECTORS);
    for (var i = 1u; i < EARLIER * LAYERS; i++) {
        before[i] = nothing(0.0);
    }
    var blocked: Blocked;
    for (var k = 0u; k < STEPS; k++) {
        let cubic = DISTANCES[k];
        let share = cubic.x + jitter * (cubic.y + jitter * (cubic.z + jitter * cubic.w));
        let pixels = min(max(share * p.radius_px, 1.0 + f32(k)), LONGEST) * side.sign;
        let right_up = s.direction * pixels;
        // Whole pixels, as on the CPU.
        let cells = round(vec2(right_up.x / frame.aspect, -right_up.y));
        let place = p.at + cells;
        var now: array<Seen, LAYERS>;
        if (inside(place)) {
            let aside = right_up + vec2(-cells.x * frame.aspect, cells.y);
            let tap = Tap(vec2<u32>(place), pixels, ray_to(side, pixels), aside);
            for (var layer = 0u; layer < LAYERS; layer++) {
                now[layer] = seen_by(p, s, side, tap, layer);
            }
            for (var layer = 0u; layer < LAYERS; layer++) {
                let here = now[layer];
                if (!here.valid) {
                    continue;
                }
                for (var i = 0u; i < EARLIER * LAYERS; i++) {
                    let earlier = before[i];
                    // Sectors above the tangent plane alone are blocked.
                    if (!earlier.valid || !(here.near || earlier.near) || min(here.sector, earlier.sector) >= SECTORS) {
                        continue;
                    }
                    let forth = predicts(side, earlier, here, tap.ray);
                    let back = predicts(side, here, earlier, ray_to(side, earlier.pixels));
                    // With two layers, arcs between layers and over the border of the AO radius need both planes.
                    let one_is_enough = LAYERS == 1u || (i % LAYERS == layer && here.near && earlier.near);
                    if ((forth && back) || (one_is_enough && (forth || back))) {
                        let ends = vec2(end_of(s, side, earlier, here), end_of(s, side, here, earlier));
                        blocked.hit |= sectors(u32(min(ends.x, ends.y)), u32(max(ends.x, ends.y)));
                    }
                }
                if (here.near && here.sector < SECTORS) {
                    let offset = here.offset;
                    let leaves = crossing(tap.ray, offset).y;
                    let along_ray = inverseSqrt(dot(tap.ray, tap.ray)) * frame.radius;
                    // What a second layer shows lies farther behind the first.
                    let gaps = select(1u, SHARES - 2u, layer + 1u == LAYERS);
                    for (var i = 0u; i < gaps; i++) {
                        let end = sector_of(s, side, offset + tap.ray * min(leaves, along_ray * GAPS[i]));
                        blocked.hidden[i] |= sectors(u32(min(here.sector, end)), u32(max(here.sector, end)));
                    }
                }
            }
        } else {
            blocked.off |= off_at(s, side, pixels);
        }
        for (var i = EARLIER * LAYERS; i > LAYERS; i--) {
            before[i - 1u] = before[i - 1u - LAYERS];
        }
        for (var layer = 0u; layer < LAYERS; layer++) {
            before[layer] = now[layer];
        }
    }
    var seen = blocked.hit;
    var found: array<u32, SHARES>;
    found[0] = seen;
    for (var i = 1u; i < SHARES; i++) {
        var more = blocked.off;
        if (i < SHARES - 1) {
            more = blocked.hidden[i - 1];
        }
        found[i] = more & ~seen;
        seen |= more;
    }
    return found;
}

/// Light of one or more sides of slices.
struct Light {
    /// When nothing blocks it.
    open: f32,
    /// Of each share, times SECTORS.
    shares: array<f32, SHARES>,
}

/// A slice, by its number.
fn numbered(p: Pixel, noise: vec2<f32>, i: u32) -> Slice {
    return slice_at(p, (noise.x + f32(i)) / f32(SLICES));
}

/// A side of that slice.
fn side_in(p: Pixel, s: Slice, noise: vec2<f32>, i: u32, sign: f32) -> Side {
    return side_of(p, s, sign, fract(noise.y * 7.0 + f32(i) * 0.414214));
}

/// Sectors of that side by share.
fn found_on(p: Pixel, s: Slice, side: Side, noise: vec2<f32>, i: u32) -> array<u32, SHARES> {
    // The golden ratio keeps the slices' taps apart.
    return sectors_on(p, s, side, fract(noise.y + f32(i) * 0.618034));
}

/// The light of a side, by its sectors.
fn light_on(s: Slice, side: Side, found: array<u32, SHARES>) -> Light {
    var light: Light;
    light.open = side.light * s.normal_length;
    for (var c = 0u; c < SHARES; c++) {
        light.shares[c] = f32(countOneBits(found[c])) * light.open;
    }
    return light;
}

/// What one side of a slice finds, by the number of the slice.
fn light_of(p: Pixel, noise: vec2<f32>, i: u32, sign: f32) -> Light {
    let s = numbered(p, noise, i);
    let side = side_in(p, s, noise, i, sign);
    return light_on(s, side, found_on(p, s, side, noise, i));
}

/// Sums up.
fn add_light(all: ptr<function, Light>, light: Light) {
    (*all).open += light.open;
    for (var c = 0u; c < SHARES; c++) {
        (*all).shares[c] += light.shares[c];
    }
}

/// Share of the light of all sides that is not lost.
fn visible_share(light: Light) -> f32 {
    var visible = 1.0;
    for (var c = 0u; c < SHARES; c++) {
        visible -= light.shares[c] / (SECTORS * max(light.open, 1e-6)) * LOST[c];
    }
    return saturate(visible);
}

/// The visibility by the light of all sides, then its shares if they are wanted.
fn planes_of(light: Light) -> array<f32, PLANES> {
    var planes: array<f32, PLANES>;
    planes[0] = power(visible_share(light), POWER);
    for (var c = 0u; c < min(SHARES, PLANES - 1u); c++) {
        planes[c + 1u] = light.shares[c] / (SECTORS * max(light.open, 1e-6));
    }
    return planes;
}
