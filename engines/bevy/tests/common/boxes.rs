//! A scene of boxes that rays meet exactly: what a frame must show, without Bevy.

use aonet::glam::Vec3;
use aonet::{Camera, GBuffer, SecondLayer};

/// Centre and half of the sides (world units).
pub type Extents = ([f32; 3], [f32; 3]);

/// What every scene has.
pub const BOXES: [Extents; 6] = [
    ([0.0, -0.5, 0.0], [6.0, 0.5, 6.0]),
    ([0.0, 1.5, -3.0], [6.0, 1.5, 0.25]),
    ([-1.4, 0.5, -1.2], [0.5, 0.5, 0.5]),
    ([0.2, 0.9, -1.9], [0.4, 0.9, 0.4]),
    ([1.5, 0.3, -0.4], [0.6, 0.3, 0.4]),
    ([0.4, 0.15, 0.6], [0.9, 0.15, 0.2]),
];

/// The frame that a camera sees.
pub fn frame(camera: Camera) -> GBuffer<'static> {
    deep_frame(camera, f32::INFINITY, &[]).without_second()
}

/// The frame that a camera sees where there are `more` boxes, with the nearest surfaces that lie `separation` (world units) behind the
/// visible ones.
pub fn deep_frame(camera: Camera, separation: f32, more: &[Extents]) -> GBuffer<'static> {
    let view_from_world = camera.view_from_world();
    let world_from_view = view_from_world.inverse();
    let (mut depth, mut normal, mut second) = (Vec::new(), Vec::new(), Vec::new());
    for (x, y) in (0..camera.height()).flat_map(|y| (0..camera.width()).map(move |x| (x, y))) {
        let [near, far] = [1.0, 2.0]
            .map(|depth| Vec3::from(world_from_view.transform_point3a(camera.position_view(x, y, depth))));
        // Steps of the ray are distances along -Z.
        let (step, start) = (far - near, 2.0 * near - far);
        let through = BOXES
            .iter()
            .chain(more)
            .filter_map(|(centre, half)| through((start - Vec3::from(*centre), step), Vec3::from(*half)));
        let through: Vec<_> = through.collect();
        let hit = through.iter().min_by(|a, b| a.at[0].total_cmp(&b.at[0]));
        let first = hit.map_or(f32::INFINITY, |hit| hit.at[0]);
        let behind = through.iter().flat_map(|hit| hit.at).filter(|at| *at >= first + separation);
        depth.push(first);
        normal.push(hit.map_or([0.0; 3], |hit| view_from_world.transform_vector3(hit.normal).to_array()));
        second.push(behind.fold(f32::INFINITY, f32::min));
    }
    let second = SecondLayer { depth: second.into(), normal: None };
    GBuffer::new(camera, depth, normal).unwrap().with_second(second).unwrap()
}

/// A ray's way through a box.
struct Through {
    /// Where it enters and leaves.
    at: [f32; 2],
    /// Where it enters.
    normal: Vec3,
}

/// A ray's way through a box around the origin.
fn through((start, step): (Vec3, Vec3), half: Vec3) -> Option<Through> {
    let (near, far) = ((-half - start) / step, (half - start) / step);
    let (first, last) = (near.min(far), near.max(far));
    let at = [first.max_element(), last.min_element()];
    let axis = first.to_array().into_iter().position(|t| t == at[0])?;
    let mut normal = Vec3::ZERO;
    normal[axis] = -step[axis].signum();
    (at[0] > 0.0 && at[0] <= at[1]).then_some(Through { at, normal })
}
