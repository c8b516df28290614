// Frames with one layer have no second one to pack.

fn pack_behind(pixel: vec2<u32>, i: u32) {}
