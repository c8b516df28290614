//! Files are built in memory; the expected scenes are known in closed form.

mod arrays;
mod builder;
mod colour;
mod container;
mod hostile;
mod placement;
mod stored;
mod texture;

use super::{MissingNormals, from_bytes};
use crate::scene::Scene;
use builder::Builder;
use glam::Vec3;

/// One triangle in the plane y = 0, facing up.
const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];

fn load(file: &Builder) -> Scene {
    from_bytes(&file.glb(), None, "test", MissingNormals::Flat).unwrap()
}

fn error(file: &Builder) -> String {
    from_bytes(&file.glb(), None, "test", MissingNormals::Flat).unwrap_err().to_string()
}

/// Corner positions of all triangles, in order.
fn soup(scene: &Scene) -> Vec<Vec3> {
    scene.triangle.as_flattened().iter().map(|&i| scene.position[i as usize]).collect()
}

#[track_caller]
fn assert_near(found: &[Vec3], expected: &[Vec3]) {
    let near = |(a, b): (&Vec3, &Vec3)| a.abs_diff_eq(*b, 1e-6);
    assert!(
        found.len() == expected.len() && found.iter().zip(expected).all(near),
        "expected {expected:?}, found {found:?}"
    );
}

/// Every shading normal lies on the front side of its triangles.
#[track_caller]
fn assert_fronts(scene: &Scene) {
    for t in &scene.triangle {
        let [a, b, c] = t.map(|i| scene.position[i as usize]);
        let front = (b - a).cross(c - a).normalize();
        for i in t {
            assert!(
                scene.normal[*i as usize].dot(front) > 0.5,
                "{:?} but {front}",
                scene.normal[*i as usize]
            );
        }
    }
}

#[test]
fn comparison_helpers_can_fail() {
    let fails = |check: fn()| std::panic::catch_unwind(check).is_err();
    assert!(fails(|| assert_near(&[Vec3::ZERO], &[Vec3::splat(1e-5)])));
    assert!(fails(|| assert_near(&[Vec3::ZERO], &[])));
    assert!(fails(|| {
        let mut scene = load(&Builder::triangle());
        scene.triangle[0].swap(0, 1);
        assert_fronts(&scene);
    }));
}
