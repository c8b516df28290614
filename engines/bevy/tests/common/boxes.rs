//! A scene of boxes that rays meet exactly: what a frame must show, without Bevy.

use aonet::glam::Vec3;
use aonet::{Camera, GBuffer};

/// Centre and half of the sides (world units).
pub const BOXES: [([f32; 3], [f32; 3]); 6] = [
    ([0.0, -0.5, 0.0], [6.0, 0.5, 6.0]),
    ([0.0, 1.5, -3.0], [6.0, 1.5, 0.25]),
    ([-1.4, 0.5, -1.2], [0.5, 0.5, 0.5]),
    ([0.2, 0.9, -1.9], [0.4, 0.9, 0.4]),
    ([1.5, 0.3, -0.4], [0.6, 0.3, 0.4]),
    ([0.4, 0.15, 0.6], [0.9, 0.15, 0.2]),
];

/// The frame that a camera sees.
pub fn frame(camera: Camera) -> GBuffer<'static> {
    let view_from_world = camera.view_from_world();
    let world_from_view = view_from_world.inverse();
    let (mut depth, mut normal) = (Vec::new(), Vec::new());
    for (x, y) in (0..camera.height()).flat_map(|y| (0..camera.width()).map(move |x| (x, y))) {
        let [near, far] = [1.0, 2.0]
            .map(|depth| Vec3::from(world_from_view.transform_point3a(camera.position_view(x, y, depth))));
        // Steps of the ray are distances along -Z.
        let (step, start) = (far - near, 2.0 * near - far);
        let hit = BOXES
            .iter()
            .filter_map(|(centre, half)| enter((start - Vec3::from(*centre), step), Vec3::from(*half)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        depth.push(hit.map_or(f32::INFINITY, |(at, _)| at));
        let of_hit = |(_, n): (f32, Vec3)| view_from_world.transform_vector3(n).to_array();
        normal.push(hit.map_or([0.0; 3], of_hit));
    }
    GBuffer::new(camera, depth, normal).unwrap()
}

/// Where a ray enters a box around the origin, and the normal there.
fn enter((start, step): (Vec3, Vec3), half: Vec3) -> Option<(f32, Vec3)> {
    let (near, far) = ((-half - start) / step, (half - start) / step);
    let (first, last) = (near.min(far), near.max(far));
    let at = first.max_element();
    let axis = first.to_array().into_iter().position(|t| t == at)?;
    let mut normal = Vec3::ZERO;
    normal[axis] = -step[axis].signum();
    (at > 0.0 && at <= last.min_element()).then_some((at, normal))
}
