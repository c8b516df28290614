struct Cover {
    @builtin(position) place: vec4<f32>,
    /// 0 to 1 from the left and from the top.
    @location(0) uv: vec2<f32>,
}

/// A triangle that covers the target.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Cover {
    let corner = vec2(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    return Cover(vec4(corner, 0.0, 1.0), corner * vec2(0.5, -0.5) + 0.5);
}
