// Sample points around a pixel, turned by noise, and whether the depth buffer hides them. CPU twin: search/hemisphere.rs.

/// In the unit ball, or directions about +z and places along them.
@group(1) @binding(1) var<storage, read> samples: array<vec4<f32>, SAMPLES>;

/// Right-handed axes about a unit vector, turned by so many half turns.
// Duff et al. 2017, Building an Orthonormal Basis, Revisited.
fn basis_about(z: vec3<f32>, turn: f32) -> mat3x3<f32> {
    let sign = select(1.0, -1.0, z.z < 0.0);
    let a = -1.0 / (sign + z.z);
    let b = z.x * z.y * a;
    let x = vec3(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x);
    let y = vec3(b, sign + z.y * z.y * a, -z.y);
    let cos_sin = half_turn(turn);
    return mat3x3(x * cos_sin.x + y * cos_sin.y, y * cos_sin.x - x * cos_sin.y, z);
}

/// The depth that is seen at a view-space sample point, z, and how far that is in front of the sample; not in front where
/// the sample has no place in the frame.
fn look(p: Pixel, point: vec3<f32>) -> vec2<f32> {
    // A sample nearer than a hundredth of the pixel's depth is as good as beside the camera.
    if (point.z >= p.position.z * 0.01) {
        return vec2(0.0, -1.0);
    }
    let scale = 1.0 / (frame.pixel_size.y - frame.pixel_size.x * point.z);
    let place = vec2(point.x / frame.aspect, -point.y) * scale + frame.centre - 0.5;
    let z = -depth_at(vec2<u32>(nearest(place)), 0u);
    return vec2(z, select(-1.0, z - point.z, inside(place)));
}
