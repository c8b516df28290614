//! A pile of rigid things on a floor.

use super::mesh::{Mesh, Pose, turn};
use super::props::{book, bottle, bowl, crate_of_slats, mug, plate, star, vessel};
use super::rng::{Noise, Rng};
use super::settle::Ground;
use super::shapes::{Segments, ball, block, cylinder, extrude, superellipsoid, surface, torus, tube};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// Many different things, dropped one after the other.
pub(super) fn pile(rng: &mut Rng) -> Mesh {
    let scale = rng.range(0.6, 1.6);
    let half = rng.range(1.0, 1.7) * scale;
    let (bowl_depth, noise) = (rng.range(0.0, 0.3) * scale, Noise::new(rng));
    let bumps = if rng.chance(0.5) { 0.0 } else { rng.range(0.02, 0.1) * scale };
    let base = |x: f32, z: f32| {
        let r = vec2(x, z).length() / half;
        bowl_depth * r * r + bumps * noise.fractal(vec3(x, 0.0, z) / scale * 1.5, 3)
    };
    let mut mesh = surface((96, 96), |u, v| {
        let (x, z) = ((v - 0.5) * 2.2 * half, (u - 0.5) * 2.2 * half);
        vec3(x, base(x, z), z)
    });
    let mut ground = Ground::new(half, 0.12 * scale, base);
    let toys = rng.chance(0.3);
    let heap = rng.range(0.5, 0.95);
    for i in 0..rng.count(130, 240) {
        let size = scale * rng.range(0.08, 0.34) * if i < 8 { 1.7 } else { 1.0 };
        let body = if toys { solid(size, rng) } else { thing(size, rng) };
        let from = (rng.in_rect(Vec2::splat(half)) + rng.in_rect(Vec2::splat(half))) * 0.5 * heap;
        if let Some(pose) = ground.drop(&body, from, rng) {
            mesh.add(&body, pose);
        }
    }
    mesh
}

/// A mathematical solid about `size` across.
fn solid(size: f32, rng: &mut Rng) -> Mesh {
    let h = 0.5 * size;
    match rng.below(8) {
        0 => ball(0.8 * h, 32),
        1 => torus(0.7 * h, rng.range(0.15, 0.3) * h, Segments { around: 40, across: 20 }),
        2 => cylinder((h, if rng.chance(0.5) { 0.01 * h } else { rng.range(0.3, 1.0) * h }), size, 36),
        3 => extrude(
            &star(rng.count(3, 8), (h, rng.range(0.4, 0.9) * h)),
            rng.range(0.2, 0.8) * size,
            0.04 * h,
        ),
        4 => {
            let exponents = (rng.range(0.15, 1.8), rng.range(0.15, 1.8));
            superellipsoid(vec3(h, rng.range(0.5, 1.0) * h, rng.range(0.5, 1.0) * h), exponents, 32)
        }
        5 => gear(h, rng),
        _ => block(
            vec3(size, rng.range(0.2, 1.0) * size, rng.range(0.3, 1.0) * size),
            rng.range(0.01, 0.08) * size,
        ),
    }
}

/// An everyday thing about `size` across, or a solid.
fn thing(size: f32, rng: &mut Rng) -> Mesh {
    match rng.below(13) {
        0 => book(vec3(rng.range(0.1, 0.25) * size, size, 0.7 * size)),
        1 => vessel(rng.range(0.25, 0.5) * size, size, rng),
        2 => mug(rng).at(Pose::IDENTITY.scale(8.0 * size)),
        3 => bottle(rng).at(Pose::IDENTITY.scale(3.5 * size)),
        4 => plate(0.6 * size),
        5 => bowl(0.55 * size, 0.45 * size),
        6 => crate_of_slats(vec3(size, rng.range(0.3, 0.6) * size, 0.7 * size), rng),
        7 => coil(size, rng),
        8 => pipe_elbow(0.5 * size, rng),
        9 => ring_nut(0.4 * size, rng),
        _ => solid(size, rng),
    }
}

/// A gear wheel of `radius` with a bore.
fn gear(radius: f32, rng: &mut Rng) -> Mesh {
    super::machine::gear(radius, rng.range(0.2, 0.4) * radius, rng)
}

/// A coil of wire.
fn coil(size: f32, rng: &mut Rng) -> Mesh {
    let (turns, steps) = (rng.range(3.0, 7.0), 160);
    let path: Vec<Vec3> = (0..=steps)
        .map(|i| i as f32 / steps as f32)
        .map(|t| (turn(t * turns * TAU) * 0.3 * size, t))
        .map(|(c, t)| vec3(c.x, 0.8 * size * t, c.y))
        .collect();
    tube(&path, &vec![0.035 * size; steps + 1], 10)
}

/// A bent pipe with flanges.
fn pipe_elbow(size: f32, rng: &mut Rng) -> Mesh {
    let r = rng.range(0.15, 0.3) * size;
    let arc = |i: usize| turn(i as f32 / 16.0 * 0.25 * TAU) * size;
    let path: Vec<Vec3> = (0..=16).map(|i| arc(i).extend(0.0)).collect();
    let mut mesh = tube(&path, &[r; 17], 24);
    let flange = cylinder((1.5 * r, 1.5 * r), 0.3 * r, 24);
    mesh.add(&flange, Pose::at(size, -0.05 * r, 0.0));
    mesh.add(&flange, Pose::at(-0.05 * r, size, 0.0).roll(-0.25 * TAU));
    mesh
}

/// A hexagonal nut: two extruded halves around a round bore.
fn ring_nut(radius: f32, rng: &mut Rng) -> Mesh {
    super::machine::bored(
        &super::props::star(3, (radius, radius)),
        0.55 * radius,
        rng.range(0.5, 0.9) * radius,
    )
}
