// Two numbers in (0, 1) for every pixel; every 5x5 pixels hold all of them. CPU twin: search/noise.rs.
fn noise_at(pixel: vec2<u32>) -> vec2<f32> {
    let index = (NOISE_RIGHT * pixel.x + NOISE_DOWN * (pixel.y % NOISE_SIDE)) % NOISE_COUNT;
    let indices = vec2(index, index * NOISE_FACTOR % NOISE_COUNT);
    return (vec2<f32>(indices) + NOISE_OFFSET) / f32(NOISE_COUNT);
}
