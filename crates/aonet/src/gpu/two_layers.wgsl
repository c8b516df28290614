// Depth of frames with two layers.

@group(0) @binding(3) var second_depths: texture_2d<f32>;

fn stored_depth(pixel: vec2<u32>, layer: u32) -> f32 {
    if (layer == 1u) {
        return textureLoad(second_depths, pixel, 0).x;
    }
    return textureLoad(depths, pixel, 0).x;
}
