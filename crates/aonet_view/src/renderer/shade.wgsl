// The picture of a frame from its G-buffer and its visibility: sRGB values.

struct Shade {
    /// World from view space, for directions.
    world_from_view: mat3x3<f32>,
    /// View-space x and y at distance 1, per unit of the picture from its middle.
    half_image: vec2<f32>,
    size: vec2<u32>,
    /// First column of the second method [px].
    split: u32,
    show: u32,
    /// View-space x and y at distance 1 of the picture's middle.
    middle: vec2<f32>,
    /// Columns of guard band left of the picture, and rows above it [px].
    margin: vec2<u32>,
}

const SHADED: u32 = 0u;
const VISIBILITY: u32 = 1u;
const NORMALS: u32 = 2u;
const ERROR: u32 = 3u;
const SECOND: u32 = 4u;
const SHARES: u32 = 5u;
const BENT: u32 = 6u;

@group(0) @binding(0) var<uniform> shade: Shade;
@group(0) @binding(1) var normals: texture_2d<f32>;
@group(0) @binding(2) var depths: texture_2d<f32>;
@group(0) @binding(3) var albedos: texture_2d<f32>;
@group(0) @binding(4) var first: texture_2d<f32>;
@group(0) @binding(5) var second: texture_2d<f32>;
@group(0) @binding(6) var reference: texture_2d<f32>;
@group(0) @binding(7) var second_normals: texture_2d<f32>;
@group(0) @binding(8) var shares: texture_2d<f32>;
@group(0) @binding(9) var first_bent: texture_2d<f32>;
@group(0) @binding(10) var second_bent: texture_2d<f32>;

/// Keeps white paint below white.
const EXPOSURE: f32 = 0.45;
/// World-space directions and radiances, chosen by eye.
const TO_KEY: vec3<f32> = vec3(0.38, 0.80, 0.46);
const KEY: vec3<f32> = vec3(0.52, 0.48, 0.42);
const ABOVE: vec3<f32> = vec3(1.00, 1.06, 1.16);
const BELOW: vec3<f32> = vec3(0.66, 0.61, 0.56);

/// Narkowicz 2015, ACES Filmic Tone Mapping Curve.
fn tone_mapped(radiance: vec3<f32>) -> vec3<f32> {
    let x = radiance;
    return clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), vec3(0.0), vec3(1.0));
}

/// IEC 61966-2-1.
fn encoded(linear: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, 12.92 * linear, linear <= vec3(0.0031308));
}

/// The colours of aonet_lab::picture::error for a difference in [-1, 1].
fn diverging(difference: f32) -> vec3<f32> {
    var stops = array(
        vec3(5.0, 48.0, 97.0), vec3(67.0, 147.0, 195.0), vec3(247.0), vec3(214.0, 96.0, 77.0), vec3(103.0, 0.0, 31.0),
    );
    let place = clamp(2.0 * difference + 2.0, 0.0, 4.0);
    let i = min(u32(place), 3u);
    return mix(stops[i], stops[i + 1u], place - f32(i)) / 255.0;
}

/// Visibility dims ambient light only, no single light. Ambient light comes from about the bent normal.
fn lit(normal_view: vec3<f32>, bent_view: vec3<f32>, albedo: vec3<f32>, visibility: f32) -> vec3<f32> {
    let normal = shade.world_from_view * normal_view;
    let bent = shade.world_from_view * bent_view;
    let ambient = mix(BELOW, ABOVE, 0.5 + 0.5 * bent.y) * visibility;
    let key = KEY * max(dot(normal, normalize(TO_KEY)), 0.0);
    return tone_mapped(EXPOSURE * albedo * (ambient + key));
}

fn sky(pixel: vec2<u32>) -> vec3<f32> {
    let at = (vec2<f32>(pixel) + 0.5) / vec2<f32>(shade.size) * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    let up = normalize(shade.world_from_view * vec3(at * shade.half_image + shade.middle, -1.0)).y;
    return tone_mapped(mix(vec3(0.42, 0.46, 0.50), vec3(0.22, 0.33, 0.48), smoothstep(-0.2, 0.8, up)));
}

/// A method that is off has a texture of one texel.
fn visibility_at(visibilities: texture_2d<f32>, pixel: vec2<u32>) -> f32 {
    return textureLoad(visibilities, min(pixel, textureDimensions(visibilities) - 1u), 0).x;
}

/// A method without bent normals has a texture of one texel, all zero: the normal takes their place.
fn bent_at(bent: texture_2d<f32>, pixel: vec2<u32>, normal: vec3<f32>) -> vec3<f32> {
    let found = textureLoad(bent, min(pixel, textureDimensions(bent) - 1u), 0);
    return select(normal, found.xyz, found.w > 0.5);
}

/// Black on the background, where normals are zero.
fn normal_colour(normal: vec3<f32>) -> vec3<f32> {
    return select(vec3(0.0), 0.5 * normal + 0.5, any(normal != vec3(0.0)));
}

fn colour(pixel: vec2<u32>) -> vec3<f32> {
    // The textures of the G-buffer have a guard band; others do not.
    let texel = pixel + shade.margin;
    let normal = textureLoad(normals, texel, 0).xyz;
    let foreground = textureLoad(depths, texel, 0).x > 0.0;
    var visibility = visibility_at(first, pixel);
    var bent = bent_at(first_bent, pixel, normal);
    if (pixel.x >= shade.split) {
        visibility = visibility_at(second, pixel);
        bent = bent_at(second_bent, pixel, normal);
    }
    switch shade.show {
        case VISIBILITY: { return vec3(visibility); }
        case NORMALS: { return normal_colour(normal); }
        case SECOND: { return normal_colour(textureLoad(second_normals, texel, 0).xyz); }
        case SHARES: { return textureLoad(shares, min(pixel, textureDimensions(shares) - 1u), 0).xyz; }
        case BENT: { return normal_colour(bent); }
        case ERROR: { return diverging((visibility - visibility_at(reference, pixel)) / ERROR_SCALE); }
        default: {}
    }
    if (!foreground) {
        return encoded(sky(pixel));
    }
    return encoded(lit(normal, bent, textureLoad(albedos, texel, 0).xyz, visibility));
}

@fragment
fn main(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = min(vec2<u32>(place.xy), shade.size - 1u);
    let is_slider = pixel.x == shade.split && pixel.x > 0u;
    return vec4(select(colour(pixel), vec3(1.0, 0.72, 0.2), is_slider), 1.0);
}
