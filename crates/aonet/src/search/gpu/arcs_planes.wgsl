// Connected arcs of every pixel. CPU twin: `planes` of search/arcs.rs.

/// The visibility, then the shares of light if they are wanted.
fn planes_at(p: Pixel, noise: vec2<f32>) -> array<f32, PLANES> {
    var light: Light;
    for (var i = 0u; i < SLICES; i++) {
        for (var sign = 1.0; sign >= -1.0; sign -= 2.0) {
            add_light(&light, light_of(p, noise, i, sign));
        }
    }
    return planes_of(light);
}
