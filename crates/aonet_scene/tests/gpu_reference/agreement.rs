//! Agreement with closed forms and with the CPU.

use super::scenes::{cuboid, floor, quad, sphere, view};
use super::{LEAST_PSNR, agreement, both, device, procedural};
use aonet::Size;
use aonet_scene::View;
use aonet_scene::gbuffer::render;
use aonet_scene::gpu::Offscreen;
use aonet_scene::reference::{Sampling, reference_ao};
use aonet_scene::scene::gltf::{self, MissingNormals};
use aonet_scene::scene::procedural::Kind;
use aonet_scene::trace::Tracer;
use glam::Vec3;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

const SAMPLING: Sampling = Sampling { spp: 1024, seed: 7 };

/// Five standard deviations of a mean of `SAMPLING.spp` independent rays of which a share of `p` is open.
fn five_sigma(p: f32) -> f32 {
    5.0 * (p * (1.0 - p) / SAMPLING.spp as f32).sqrt()
}

#[test]
fn closed_forms_hold() {
    let Some(device) = device() else { return };
    let mut wall = floor(1.0);
    wall.append(&quad(Vec3::new(-1e4, 0.0, -0.5), Vec3::X * 2e4, Vec3::Y));
    let mut ball = floor(10.0);
    ball.append(&sphere(Vec3::Y, 0.5, 64));
    let box_ = cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0));
    let inside = Vec3::new(0.3, 1.0, 0.2);
    let at_wall = view(Vec3::new(0.0, 0.5, 0.3), Vec3::ZERO, 1e6);
    for (scene, view, expected) in [
        (floor(100.0), view(Vec3::new(0.3, 2.0, 0.4), Vec3::ZERO, 50.0), 1.0),
        (floor(100.0), view(Vec3::new(0.3, -2.0, 0.4), Vec3::ZERO, 50.0), 1.0),
        (box_.clone(), view(inside, Vec3::ZERO, 10.0), 0.0),
        (box_.clone(), view(inside, Vec3::new(1.0, 1.0, 0.0), 10.0), 0.0),
        (box_, view(inside, Vec3::ZERO, 0.99), 1.0),
        (wall, at_wall, 0.5 * (1.0 + 0.5 / 1.25f32.sqrt())),
        (ball, view(Vec3::new(0.9, 0.05, 0.0), Vec3::ZERO, 100.0), 0.75),
    ] {
        let (surface, cpu, gpu) = both(&device, (scene, &view), SAMPLING);
        for (i, v) in gpu.visibility().iter().enumerate() {
            assert!(surface.gbuffer.is_foreground(i), "pixel {i} sees nothing");
            assert!((v - expected).abs() <= five_sigma(expected), "{v} instead of {expected} at {i}");
        }
        assert!(agreement(&cpu, &gpu) > LEAST_PSNR);
    }
}

#[test]
fn every_procedural_scene_agrees_with_the_cpu() {
    let Some(device) = device() else { return };
    for (i, &kind) in Kind::ALL.iter().enumerate() {
        // No size is a multiple of anything.
        let (scene, view) = procedural(kind, Size::px(37 + 2 * i, 23 + 2 * i));
        let (surface, cpu, gpu) = both(&device, (scene, &view), Sampling { spp: 60, seed: 1 << 40 });
        let n = surface.triangle.len();
        let foreground = (0..n).filter(|&i| surface.gbuffer.is_foreground(i)).count();
        let different = cpu.visibility().iter().zip(gpu.visibility()).filter(|(a, b)| a != b).count();
        let psnr = agreement(&cpu, &gpu);
        println!("{kind:14} {psnr:6.1} dB, {different} of {foreground} pixels differ");
        assert!(psnr >= LEAST_PSNR && foreground > 100, "{kind}: {psnr} dB");
        assert!(cpu.visibility().iter().any(|v| *v < 0.9), "{kind}: nothing is occluded");
    }
}

#[test]
fn rays_below_the_surface_are_not_open() {
    let Some(device) = device() else { return };
    let tracer = Tracer::new(floor(100.0));
    let above = view(Vec3::new(0.3, 2.0, 0.4), Vec3::ZERO, 50.0);
    let mut surface = render(&tracer, &above).unwrap();
    // A surface that leans more than its normal.
    let normal = surface.gbuffer.normal()[40];
    let across = Vec3::from(normal).any_orthonormal_vector();
    let leaning = (Vec3::from(normal) + across).normalize();
    surface.geo_normal.fill(leaning.into());
    let mut offscreen = Offscreen::new(&device, &tracer).unwrap();
    let ao = offscreen.reference_ao(&surface, above.params().unwrap(), SAMPLING, &|_| ()).unwrap();
    let expected = 0.5 * (1.0 + 0.5f32.sqrt());
    for v in ao.visibility() {
        assert!((v - expected).abs() <= five_sigma(expected), "{v} instead of {expected}");
    }
}

/// Scenes of the folder that `AONET_DATA` names; they are not part of the project.
#[test]
fn scenes_of_others_agree_with_the_cpu() {
    let Some(device) = device() else { return };
    let Some(folder) = std::env::var_os("AONET_DATA").map(|d| PathBuf::from(d).join("reference-frames"))
    else {
        println!("skipped: AONET_DATA is not set");
        return;
    };
    for name in ["room", "koala_2", "graveyard_2"] {
        let path = folder.join(format!("{name}.json"));
        let view = View { width: 128, height: 72, ..View::load(&path).unwrap() };
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let scene = gltf::load(&folder.join(json["glb"].as_str().unwrap()), MissingNormals::Flat).unwrap();
        let triangles = scene.triangle.len();
        let (_, cpu, gpu) = both(&device, (scene, &view), Sampling { spp: 64, seed: 2 });
        let different = cpu.visibility().iter().zip(gpu.visibility()).filter(|(a, b)| a != b).count();
        let psnr = agreement(&cpu, &gpu);
        println!("{name:14} {triangles} triangles, {psnr:6.1} dB, {different} pixels differ");
        assert!(psnr >= LEAST_PSNR, "{name}: {psnr} dB");
    }
}

#[test]
fn rays_are_counted_and_many_of_them_take_several_dispatches() {
    let Some(device) = device() else { return };
    let mut scene = floor(1.0);
    scene.append(&cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 0.6, 0.5)));
    let tracer = Tracer::new(scene);
    let wide = view(Vec3::new(0.4, 3.0, 1.0), Vec3::ZERO, 1.0);
    let wide = View { fov_y_deg: 60.0, width: 90, height: 70, ..wide };
    let (surface, params) = (render(&tracer, &wide).unwrap(), wide.params().unwrap());
    let rays = AtomicU64::new(0);
    let count = |n| {
        rays.fetch_add(n, Ordering::Relaxed);
    };
    // 1.6 million rays, with those of the background that are not traced.
    let sampling = Sampling { spp: 256, seed: 1 };
    let mut offscreen = Offscreen::new(&device, &tracer).unwrap();
    let gpu = offscreen.reference_ao(&surface, params, sampling, &count).unwrap();
    let cpu = reference_ao(&tracer, &surface, params, sampling, &|_| ()).unwrap();
    let foreground = (0..90 * 70).filter(|&i| surface.gbuffer.is_foreground(i)).count();
    assert_eq!(rays.into_inner(), 256 * foreground as u64);
    assert!(foreground < 90 * 70 && cpu.visibility().iter().any(|v| *v < 0.6));
    assert!(agreement(&cpu, &gpu) >= LEAST_PSNR);
}
