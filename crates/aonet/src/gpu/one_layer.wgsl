// Depth of frames with one layer.

fn stored_depth(pixel: vec2<u32>, layer: u32) -> f32 {
    return textureLoad(depths, pixel, 0).x;
}
