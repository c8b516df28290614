//! Small scenes for the tests of this folder.

use super::{Scene, glb};
use glam::Vec3;
use std::path::{Path, PathBuf};

/// A box with outward or inward faces.
pub(super) fn cuboid(min: Vec3, max: Vec3, inward: bool) -> Scene {
    let mut scene = Scene::default();
    for axis in 0..3 {
        for side in [min, max] {
            let (mut a, mut b) = (Vec3::ZERO, Vec3::ZERO);
            a[(axis + 1) % 3] = (max - min)[(axis + 1) % 3];
            b[(axis + 2) % 3] = (max - min)[(axis + 2) % 3];
            let mut corner = min;
            corner[axis] = side[axis];
            let outward = Vec3::AXES[axis] * if side == max { 1.0 } else { -1.0 };
            if (a.cross(b).dot(outward) > 0.0) == inward {
                (a, b) = (b, a);
            }
            let position = vec![corner, corner + a, corner + a + b, corner + b];
            let normal = vec![if inward { -outward } else { outward }; 4];
            scene.append(&Scene {
                position,
                normal,
                triangle: vec![[0, 1, 2], [0, 2, 3]],
                ..Scene::default()
            });
        }
    }
    scene
}

/// A room of 6x3x5 with boxes standing in it.
pub(super) fn room() -> Scene {
    let mut scene = cuboid(Vec3::new(-3.0, 0.0, -2.5), Vec3::new(3.0, 3.0, 2.5), true);
    for i in 0..12 {
        let (x, z) = (-2.5 + 1.6 * (i % 4) as f32, -2.0 + 1.8 * (i / 4) as f32);
        let size = Vec3::new(0.4, 0.3 + 0.15 * i as f32, 0.5);
        scene.append(&cuboid(Vec3::new(x, 0.0, z), Vec3::new(x, 0.0, z) + size, false));
    }
    scene
}

/// Boxes on boxes.
pub(super) fn stack() -> Scene {
    let mut scene = Scene::default();
    for i in 0..5 {
        let size = Vec3::new(1.0 - 0.15 * i as f32, 0.3, 0.8 - 0.1 * i as f32);
        let min = Vec3::new(0.1 * i as f32, 0.3 * i as f32, -0.5 * size.z);
        scene.append(&cuboid(min, min + size, false));
    }
    scene
}

/// Writes a scene as NAME.glb.
pub(super) fn write_glb(dir: &Path, name: &str, scene: &Scene) -> PathBuf {
    let path = dir.join(format!("{name}.glb"));
    glb::save(scene, &path).unwrap();
    path
}
