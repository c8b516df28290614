// The visibility of a method that looks along slices: it adds `gathered`, what a slice gathers, and `open_share`, the visibility by the
// sums of it.

fn visibility_at(p: Pixel, noise: vec2<f32>) -> f32 {
    var sums = vec2(0.0);
    for (var i = 0u; i < SLICES; i++) {
        let s = slice_at(p, (noise.x + f32(i)) / f32(SLICES));
        // The golden ratio keeps the slices' taps apart.
        sums += gathered(p, s, fract(noise.y + f32(i) * 0.618034));
    }
    return open_share(sums);
}
