//! Reference AO where its value is known in closed form.

mod scenes;

use aonet::{AoImage, AoParams};
use aonet_scene::gbuffer::{Surface, render};
use aonet_scene::reference::{Sampling, reference_ao, reference_with_bent_normals};
use aonet_scene::trace::Tracer;
use aonet_scene::{Scene, View};
use glam::{Vec3, Vec3A};
use scenes::{cuboid, floor, quad, sphere, view};
use std::sync::atomic::{AtomicU64, Ordering};

const SAMPLING: Sampling = Sampling { spp: 4096, seed: 7 };

fn trace(scene: &Scene, view: &View, sampling: Sampling) -> (Surface, AoImage) {
    let tracer = Tracer::new(scene.clone().checked().unwrap());
    let surface = render(&tracer, view).unwrap();
    let ao = reference_ao(&tracer, &surface, view.params().unwrap(), sampling, &|_| ()).unwrap();
    (surface, ao)
}

/// Five standard deviations of a mean of `SAMPLING.spp` independent rays of which a share of `p` is open.
fn five_sigma(p: f32) -> f32 {
    5.0 * (p * (1.0 - p) / SAMPLING.spp as f32).sqrt()
}

#[track_caller]
fn assert_all(scene: &Scene, view: &View, expected: f32) {
    let (surface, ao) = trace(scene, view, SAMPLING);
    for (i, v) in ao.visibility().iter().enumerate() {
        assert!(surface.gbuffer.is_foreground(i), "pixel {i} sees nothing");
        assert!((v - expected).abs() <= five_sigma(expected), "{v} instead of {expected} at {i}");
    }
}

#[test]
fn an_open_plane_is_fully_open_from_both_sides() {
    for eye in [Vec3::new(0.3, 2.0, 0.4), Vec3::new(0.3, -2.0, 0.4), Vec3::new(40.0, 0.5, 3.0)] {
        for scale in [1e-3, 1.0, 1e3] {
            let offset = Vec3::new(17.3, 5.1, -8.9) * scale;
            let mut scene = floor(100.0 * scale);
            scene.position.iter_mut().for_each(|p| *p += offset);
            assert_all(&scene, &view(eye * scale + offset, offset, 50.0 * scale), 1.0);
        }
    }
}

#[test]
fn a_tilted_plane_of_uneven_triangles_is_fully_open() {
    let tilt = glam::Quat::from_rotation_z(0.7) * glam::Quat::from_rotation_x(-0.4);
    let (a, b) = (tilt * Vec3::Z, tilt * Vec3::X);
    let mut scene = quad(Vec3::ZERO, a * 300.0, b * 300.0);
    scene.append(&quad(-0.1 * a, a * 0.1, b * 0.1));
    scene.append(&quad(-0.1 * (a + b), a * 0.1, b * 0.1));
    scene.append(&quad(-0.1 * b, a * 300.0, b * 0.1));
    let normal = a.cross(b);
    for target in [b + a, 100.0 * b + 3.0 * a, 0.05 * b - 0.05 * a, -0.05 * b + 0.05 * a] {
        assert_all(&scene, &view(target + normal * 2.0 + a, target, 10.0), 1.0);
    }
}

#[test]
fn a_wall_hides_its_share() {
    for (h, d) in [(1.0f32, 0.1f32), (1.0, 1.0), (0.2, 1.0)] {
        let mut scene = floor(1.0);
        // Wide enough to be endless within the tolerance.
        scene.append(&quad(Vec3::new(-1e4, 0.0, -d), Vec3::X * 2e4, Vec3::Y * h));
        let expected = 0.5 * (1.0 + d / (d * d + h * h).sqrt());
        assert_all(&scene, &view(Vec3::new(0.0, 0.5 * h, 0.3), Vec3::ZERO, 1e6), expected);
    }
}

/// Checks that all bent normals of a view lie within so many degrees of a direction (world space), and that the AO is that without.
#[track_caller]
fn assert_bent(scene: &Scene, view: &View, expected: Vec3, tolerance_deg: f32) {
    let tracer = Tracer::new(scene.clone().checked().unwrap());
    let surface = render(&tracer, view).unwrap();
    let params = view.params().unwrap();
    let (ao, bent) = reference_with_bent_normals(&tracer, &surface, params, SAMPLING, &|_| ()).unwrap();
    assert_eq!(ao, reference_ao(&tracer, &surface, params, SAMPLING, &|_| ()).unwrap());
    let expected = surface.gbuffer.camera().view_from_world().transform_vector3a(expected.into());
    for found in bent.directions() {
        let off = Vec3A::from(*found).angle_between(expected).to_degrees();
        assert!(off < tolerance_deg, "{found:?} instead of {expected}: {off} degrees");
    }
}

#[test]
fn the_bent_normal_of_an_open_plane_is_its_normal() {
    for eye in [Vec3::new(0.3, 2.0, 0.4), Vec3::new(40.0, 0.5, 3.0)] {
        // Measured: 0.02 degrees.
        assert_bent(&floor(100.0), &view(eye, Vec3::ZERO, 50.0), Vec3::Y, 0.1);
    }
    let eye = Vec3::new(0.3, -2.0, 0.4);
    assert_bent(&floor(100.0), &view(eye, Vec3::ZERO, 50.0), Vec3::NEG_Y, 0.1);
}

#[test]
fn a_wall_bends_the_normal_away_from_it() {
    // A wall at c radii takes the directions x > c: they are a segment of the unit disk, over which x and the height are integrated.
    for c in [0.01f32, 0.3, 0.8] {
        let mut scene = floor(10.0);
        scene.append(&quad(Vec3::new(-1e3, 0.0, -c), Vec3::X * 2e3, Vec3::Y * 1e3));
        let across = 2.0 / 3.0 * (1.0 - c * c).powf(1.5);
        let pi = std::f32::consts::PI;
        let up = 2.0 / 3.0 * pi - 0.5 * pi * (2.0 / 3.0 - c + c * c * c / 3.0);
        let expected = Vec3::new(0.0, up, across).normalize();
        // Measured: 0.3 degrees with 4096 rays.
        assert_bent(&scene, &view(Vec3::new(0.0, 0.9, 0.3), Vec3::ZERO, 1.0), expected, 1.0);
    }
}

#[test]
fn where_all_is_blocked_the_bent_normal_is_the_surfaces() {
    let scene = cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0));
    assert_bent(&scene, &view(Vec3::new(0.3, 1.0, 0.2), Vec3::ZERO, 10.0), Vec3::Y, 0.01);
}

#[test]
fn a_sphere_hides_its_share() {
    for (r, h) in [(0.5f32, 1.0f32), (0.9, 1.0), (0.2, 1.0)] {
        let mut scene = floor(10.0);
        scene.append(&sphere(Vec3::Y * h, r, 64));
        let expected = 1.0 - (r / h) * (r / h);
        assert_all(&scene, &view(Vec3::new(0.9, 0.05, 0.0), Vec3::ZERO, 100.0), expected);
    }
}

#[test]
fn a_closed_box_is_dark_until_the_radius_is_shorter_than_the_walls_are_far() {
    let scene = cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0));
    let eye = Vec3::new(0.3, 1.0, 0.2);
    for target in [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::new(0.0, 1.0, -1.0)] {
        assert_all(&scene, &view(eye, target, 10.0), 0.0);
        assert_all(&scene, &view(eye, target, 0.99), 1.0);
    }
}

#[test]
fn a_larger_radius_is_never_brighter_and_threads_do_not_matter() {
    let mut scene = floor(5.0);
    scene.append(&sphere(Vec3::Y, 0.8, 12));
    scene.append(&cuboid(Vec3::new(0.5, 0.0, -1.0), Vec3::new(1.5, 1.1, 1.0)));
    let tracer = Tracer::new(scene.checked().unwrap());
    let wide =
        View { fov_y_deg: 60.0, width: 64, height: 48, ..view(Vec3::new(3.0, 3.0, 3.0), Vec3::ZERO, 1.0) };
    let surface = render(&tracer, &wide).unwrap();
    let sampling = Sampling { spp: 32, seed: 3 };
    let at = |radius: f32| {
        let rays = AtomicU64::new(0);
        let count = |n| {
            rays.fetch_add(n, Ordering::Relaxed);
        };
        let ao = reference_ao(&tracer, &surface, AoParams::new(radius).unwrap(), sampling, &count).unwrap();
        let foreground = (0..64 * 48).filter(|&i| surface.gbuffer.is_foreground(i)).count();
        assert_eq!(rays.into_inner(), 32 * foreground as u64);
        ao
    };
    let images: Vec<AoImage> = [0.01, 0.1, 0.5, 1.0, 100.0].map(at).into();
    for pair in images.windows(2) {
        assert!(pair[0].visibility().iter().zip(pair[1].visibility()).all(|(a, b)| a >= b));
    }
    assert_ne!(images[0], images[4]);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one_thread.install(|| at(1.0)), images[3]);
    let other = Sampling { seed: 4, ..sampling };
    let params = AoParams::new(1.0).unwrap();
    assert_ne!(reference_ao(&tracer, &surface, params, other, &|_| ()).unwrap(), images[3]);
}

#[test]
fn what_is_no_reference_is_refused() {
    let tracer = Tracer::new(floor(5.0).checked().unwrap());
    let view = View { width: 8, height: 6, ..view(Vec3::new(3.0, 3.0, 3.0), Vec3::ZERO, 1.0) };
    let surface = render(&tracer, &view).unwrap();
    let (params, sampling) = (view.params().unwrap(), Sampling { spp: 1, seed: 0 });
    let refused = |surface: &Surface, params, sampling, what: &str| {
        let found = reference_ao(&tracer, surface, params, sampling, &|_| ()).unwrap_err().to_string();
        assert!(found.contains(what), "{found}");
    };
    assert!(reference_ao(&tracer, &surface, params, sampling, &|_| ()).is_ok());
    refused(&surface, params, Sampling { spp: 0, seed: 0 }, "rays per pixel");
    let triangles = tracer.scene().triangle.len() as u32;
    for (triangle, what) in [(vec![triangles; 48], "one of"), (vec![0; 47], "47")] {
        refused(&Surface { triangle, ..surface.clone() }, params, sampling, what);
    }
}

#[test]
fn normals_and_depth_follow_the_definition() {
    let target = Vec3::new(0.2, 0.0, 0.1);
    for (eye, backface) in [(Vec3::new(0.0, 3.0, 0.0), false), (Vec3::new(0.0, -3.0, 0.0), true)] {
        let (surface, _) = trace(&floor(1.0), &view(eye, target, 1.0), Sampling { spp: 1, seed: 0 });
        let distance = (target - eye).length();
        for i in 0..81 {
            assert_eq!(surface.backface[i], backface);
            assert!((surface.gbuffer.depth()[i] - distance).abs() < 1e-3);
            assert!(surface.gbuffer.normal()[i][2] > 0.9 && surface.geo_normal[i][2] > 0.9);
        }
    }
    let eye = Vec3::new(0.0, 3.0, 0.0);
    let clipped = View { near: 3.1, ..view(eye, target, 1.0) };
    assert!(!trace(&floor(1.0), &clipped, SAMPLING).0.gbuffer.is_foreground(0));
    let clipped = View { far: 2.9, ..view(eye, target, 1.0) };
    let (surface, ao) = trace(&floor(1.0), &clipped, SAMPLING);
    assert!(!surface.gbuffer.is_foreground(0) && ao.visibility()[0] == 1.0);
    let parallel = View { ortho_height: Some(0.01), ..view(eye, target, 1.0) };
    let (surface, _) = trace(&floor(1.0), &parallel, Sampling { spp: 1, seed: 0 });
    assert!((surface.gbuffer.depth()[40] - (target - eye).length()).abs() < 1e-5);
}

#[test]
fn a_floor_through_the_origin_does_not_shadow_itself_whatever_its_size() {
    for half in (0..64).map(|i| 1.1f32.powi(i)) {
        let eye = 0.1 * half * Vec3::new(1.0, 0.7, 0.3);
        let wide = View { fov_y_deg: 60.0, ..view(eye, Vec3::ZERO, 0.1 * half) };
        let (surface, ao) = trace(&floor(half), &wide, Sampling { spp: 16, seed: 7 });
        assert!(
            (0..81).all(|i| !surface.gbuffer.is_foreground(i) || ao.visibility()[i] == 1.0),
            "half {half}"
        );
    }
}
