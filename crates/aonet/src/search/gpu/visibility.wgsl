// A method that reports the visibility alone: it adds `visibility_at`.

fn planes_at(p: Pixel, noise: vec2<f32>) -> array<f32, PLANES> {
    return array<f32, PLANES>(power(saturate(visibility_at(p, noise)), POWER));
}
