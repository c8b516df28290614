// How a camera projects: depths of a texture, and positions of pixels. A shader has a uniform `frame` with the fields that
// the struct Lens of uniforms.rs describes, and the constants BACKGROUND, DEPTH, LINEAR_DEPTH and
// FARTHEST.

fn perspective() -> bool {
    return frame.pixel_size.x > 0.0;
}

/// Distance along -Z of what a depth texture holds.
fn decode_depth(stored: f32) -> f32 {
    if (DEPTH == LINEAR_DEPTH) {
        // NaN, too, is background.
        return select(BACKGROUND, min(stored, BACKGROUND), stored > 0.0);
    }
    if (stored == FARTHEST) {
        return BACKGROUND;
    }
    // Between the near and the far plane distances are linear; with perspective, their inverses are.
    let line = frame.depth_line.x * stored + frame.depth_line.y;
    return select(line, 1.0 / line, perspective());
}

/// View-space position of the centre of a pixel at a depth.
fn position_at(pixel: vec2<f32>, depth: f32) -> vec3<f32> {
    let from_centre = pixel + 0.5 - frame.centre;
    let scale = frame.pixel_size.x * depth + frame.pixel_size.y;
    return vec3(from_centre.x * (scale * frame.aspect), -from_centre.y * scale, -depth);
}
