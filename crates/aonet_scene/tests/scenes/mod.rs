//! Scenes of which the reference AO is known in closed form.
#![allow(dead_code, reason = "each test program uses some of it")]

use aonet_scene::{Scene, View};
use glam::Vec3;

/// Two triangles: `corner`, `corner + a`, `corner + b` and the fourth one.
pub(crate) fn quad(corner: Vec3, a: Vec3, b: Vec3) -> Scene {
    let normal = vec![a.cross(b).normalize(); 4];
    let position = vec![corner, corner + a, corner + a + b, corner + b];
    Scene { name: "quad".into(), position, normal, triangle: vec![[0, 1, 2], [0, 2, 3]], ..Scene::default() }
}

pub(crate) fn floor(half: f32) -> Scene {
    quad(Vec3::new(-half, 0.0, -half), Vec3::Z * 2.0 * half, Vec3::X * 2.0 * half)
}

pub(crate) fn cuboid(min: Vec3, max: Vec3) -> Scene {
    let d = max - min;
    let (x, y, z) = (Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z);
    let mut scene = quad(min, x, y);
    for (corner, a, b) in [(min, y, z), (min, z, x), (max, -x, -y), (max, -y, -z), (max, -z, -x)] {
        scene.append(&quad(corner, a, b));
    }
    scene
}

pub(crate) fn sphere(centre: Vec3, radius: f32, n: u32) -> Scene {
    let normal: Vec<Vec3> = (0..=n)
        .flat_map(|i| (0..2 * n).map(move |j| (i, j)))
        .map(|(i, j)| {
            let (theta, phi) = (i as f32 / n as f32, j as f32 / n as f32);
            let (sin, cos) = (theta * std::f32::consts::PI).sin_cos();
            let (sin_phi, cos_phi) = (phi * std::f32::consts::PI).sin_cos();
            Vec3::new(sin * cos_phi, cos, sin * sin_phi)
        })
        .collect();
    let triangle = (0..n).flat_map(|i| {
        (0..2 * n).flat_map(move |j| {
            let at = |i: u32, j: u32| i * 2 * n + j % (2 * n);
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            [[a, b, c], [a, c, d]]
        })
    });
    let position = normal.iter().map(|n| centre + radius * *n).collect();
    Scene { name: "sphere".into(), position, normal, triangle: triangle.collect(), ..Scene::default() }
}

/// A view of 9x9 pixels, so narrow that all of them show very nearly `target`.
pub(crate) fn view(eye: Vec3, target: Vec3, radius: f32) -> View {
    View {
        eye: eye.into(),
        target: target.into(),
        up: [0.1, 1.0, 0.2],
        fov_y_deg: 0.01,
        ortho_height: None,
        width: 9,
        height: 9,
        near: 0.0,
        far: f32::INFINITY,
        radius,
        margin: 0.0,
        separation: None,
    }
}
