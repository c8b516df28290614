//! The floor under a single object.

use super::Scene;
use glam::Vec3;

/// Half the side of the floor, in radii of the sphere around the scene's box.
// guess: from an eye one radius above the floor its edge is 6 degrees below the horizon.
const HALF_SIDE_IN_RADII: f32 = 10.0;

/// Adds a square floor (normal +Y) through the lowest point of the scene, centred below it; its side is 20 radii
/// of the sphere around the scene's box. An empty scene stays empty.
pub fn add_ground(scene: &mut Scene) {
    if scene.position.is_empty() {
        return;
    }
    let bounds = scene.bounds();
    let half = HALF_SIDE_IN_RADII * bounds.radius();
    let middle = bounds.centre().with_y(bounds.min.y);
    let corner = |x, z| middle + half * Vec3::new(x, 0.0, z);
    scene.append(&Scene {
        position: vec![corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)],
        normal: vec![Vec3::Y; 4],
        triangle: vec![[0, 1, 2], [0, 2, 3]],
        ..Scene::default()
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_floor_is_flat_below_the_object_and_faces_up() {
        let (low, high) = (Vec3::new(1.0, -2.0, 3.0), Vec3::new(3.0, 4.0, 6.0));
        let position = vec![low, high, low.with_x(2.0)];
        let mut scene =
            Scene { position, normal: vec![Vec3::X; 3], triangle: vec![[0, 1, 2]], ..Scene::default() };
        add_ground(&mut scene);
        assert_eq!((scene.position.len(), scene.triangle.len()), (7, 3));
        let [a, b, c] = scene.triangle[1].map(|i| scene.position[i as usize]);
        assert!((b - a).cross(c - a).normalize().abs_diff_eq(Vec3::Y, 1e-6));
        let bounds = scene.bounds();
        assert_eq!(bounds.min.y, low.y);
        // The box is 2 x 6 x 3: its diagonal is 7.
        assert!((bounds.max - bounds.min).abs_diff_eq(Vec3::new(70.0, 6.0, 70.0), 1e-4));
        assert!(bounds.centre().with_y(0.0).abs_diff_eq(Vec3::new(2.0, 0.0, 4.5), 1e-4));
    }

    #[test]
    fn an_empty_scene_gets_no_floor() {
        let mut scene = Scene::default();
        add_ground(&mut scene);
        assert_eq!(scene, Scene::default());
    }
}
