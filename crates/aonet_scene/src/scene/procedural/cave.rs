//! Caves and rock arches: carved noise.

use super::mesh::{Mesh, Pose, turn};
use super::plants::{grass, rock};
use super::rng::{Noise, Rng};
use super::settle::Ground;
use super::shapes::{cuboid, surface};
use super::solid::{blend, capsule, carve, isosurface};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// A cave of chambers joined by passages, with dripstones and rubble.
pub(super) fn cave(rng: &mut Rng) -> Mesh {
    let noise = Noise::new(rng);
    let half = vec3(rng.range(6.0, 9.0), 3.2, rng.range(6.0, 9.0));
    let inner = vec2(half.x - 2.2, half.z - 2.2);
    let mut at = vec2(-inner.x, 0.0);
    let mut passages = Vec::new();
    for _ in 0..rng.count(4, 7) {
        let next = rng.in_rect(inner);
        let (lift, r) = (rng.range(0.8, 1.6), rng.range(0.9, 2.2));
        passages.push((
            (vec3(at.x, lift, at.y), vec3(next.x, rng.range(0.8, 1.6), next.y)),
            (r, rng.range(0.9, 2.4)),
        ));
        at = next;
    }
    let (rough, strata) = (rng.range(0.25, 0.6), rng.range(0.0, 0.12));
    let layers = rng.range(3.0, 7.0);
    let floor_noise = rng.range(0.1, 0.35);
    let field = |p: Vec3| {
        let mut air = passages.iter().fold(1e3, |d, (ends, r)| blend(d, capsule(p, *ends, *r), 0.8));
        if air > 1.6 {
            return 0.6 - air;
        }
        air += rough * crags(noise, p * 0.6) + strata * turn(p.y * layers + noise.at(p * 0.4) * 3.0).x;
        let ground = p.y - floor_noise * noise.fractal(vec3(p.x, 7.0, p.z) * 0.6, 3);
        -carve(air, ground, 0.5)
    };
    let mut mesh =
        isosurface((vec3(-half.x, -1.2, -half.z), vec3(half.x, 2.0 * half.y, half.z)), 0.125, 55.0, field);
    // Rock all around: without it, a ray from inside the rock would meet the sky.
    let hull = cuboid(vec3(2.0 * half.x, 2.0 * half.y + 1.6, 2.0 * half.z) + 0.5);
    mesh.add(&hull, Pose::at(0.0, -1.6, 0.0));
    dripstones(&mut mesh, (&field, half), rng);
    let level = |x: f32, z: f32| floor_noise * noise.fractal(vec3(x, 7.0, z) * 0.6, 3);
    let open = |x: f32, z: f32| if field(vec3(x, 0.7, z)) > 0.3 { level(x, z) } else { 1e6 };
    rubble(&mut mesh, (Ground::new(half.x.max(half.z), 0.5, open), inner), rng);
    mesh
}

/// Fractal noise with sharp ridges in its finer half.
fn crags(noise: Noise, p: Vec3) -> f32 {
    let ridge = |p: Vec3| 0.5 - noise.at(p).abs();
    noise.at(p) + 0.8 * ridge(p * 2.1) + 0.4 * ridge(p * 4.3) + 0.18 * noise.at(p * 8.9)
}

/// Cones that hang from the roof and stand below, where there is air between.
fn dripstones(mesh: &mut Mesh, (field, half): (&impl Fn(Vec3) -> f32, Vec3), rng: &mut Rng) {
    for _ in 0..rng.count(60, 160) {
        let p = rng.in_rect(vec2(half.x, half.z) * 0.85);
        let along = |y: f32| field(vec3(p.x, y, p.y)) > 0.0;
        let Some(floor) = (0..60).map(|k| k as f32 * 0.1 - 1.0).find(|y| along(*y)) else { continue };
        let roof = (0..80).map(|k| floor + k as f32 * 0.1).find(|y| !along(*y)).unwrap_or(floor);
        let gap = roof - floor;
        if gap < 0.5 {
            continue;
        }
        let (thick, share) = (rng.range(0.05, 0.22), rng.range(0.15, 1.2));
        let long = (gap * share * 0.6).min(8.0 * thick);
        mesh.add(&drip(long, thick, rng), Pose::at(p.x, roof + 0.15, p.y).stretch(1.0, -1.0, 1.0));
        if rng.chance(0.6) {
            mesh.add(&drip(long * rng.range(0.3, 0.8), 1.3 * thick, rng), Pose::at(p.x, floor - 0.2, p.y));
        }
    }
}

/// A lumpy cone of `height` from y = 0.
fn drip(height: f32, radius: f32, rng: &mut Rng) -> Mesh {
    let noise = Noise::new(rng);
    let rings = rng.range(10.0, 30.0);
    surface((14, 14), |u, v| {
        let k = (v * 14.0).round() % 14.0;
        let t = turn(k / 14.0 * TAU);
        let taper = (1.0 - u) * (1.0 - 0.5 * u) + 0.02 * f32::from(u < 0.99);
        let bump = 1.0 + 0.25 * noise.at(vec3(t.x, u * height / radius, t.y)) + 0.06 * turn(u * rings).x;
        let r = radius * taper * bump * if u < 0.1 { 1.5 } else { 1.0 };
        vec3(r * t.x, u * height, r * t.y)
    })
}

/// Stones that lie on the ground.
fn rubble(mesh: &mut Mesh, (mut ground, inner): (Ground, Vec2), rng: &mut Rng) {
    let stones: Vec<Mesh> = (0..5)
        .map(|_| rock(vec3(rng.range(0.6, 1.2), rng.range(0.4, 0.9), rng.range(0.6, 1.2)), rng))
        .collect();
    for _ in 0..rng.count(60, 140) {
        let size = 0.08 + 1.0 * rng.unit() * rng.unit() * rng.unit();
        let stone = rng.pick(&stones).at(Pose::IDENTITY.scale(size));
        let from = rng.in_rect(inner);
        if let Some(pose) = ground.drop(&stone, from, rng).filter(|p| p.offset.y < 3.0) {
            mesh.add(&stone, pose);
        }
    }
}

/// Arches and pillars of layered rock on open ground.
pub(super) fn arch(rng: &mut Rng) -> Mesh {
    let noise = Noise::new(rng);
    let (span, rise) = (rng.range(2.5, 5.0), rng.range(2.5, 5.0));
    let half = vec3(span + 3.5, rise + 2.6, 5.0);
    let mut bones = Vec::new();
    let arc = |k: usize| turn(k as f32 / 8.0 * std::f32::consts::PI) * vec2(span, rise);
    let (skew, fat) = (rng.spread(0.5), rng.range(0.6, 1.2));
    for k in 0..8 {
        let at = |k: usize| vec3(arc(k).x, arc(k).y, skew * arc(k).x * 0.5);
        let girth = |k: usize| fat * (1.0 + 0.5 * (arc(k).x / span).abs());
        bones.push(((at(k), at(k + 1)), (girth(k), girth(k + 1))));
    }
    for _ in 0..rng.count(1, 4) {
        let foot = rng.in_rect(vec2(half.x - 1.5, half.z - 1.5));
        let top = vec3(foot.x + rng.spread(0.5), rng.range(0.8, rise), foot.y + rng.spread(0.5));
        bones.push(((vec3(foot.x, -0.5, foot.y), top), (rng.range(0.7, 1.5), rng.range(0.3, 0.9))));
    }
    let (rough, strata, layers) = (rng.range(0.25, 0.55), rng.range(0.02, 0.14), rng.range(4.0, 9.0));
    let hills = rng.range(0.1, 0.4);
    let level = |x: f32, z: f32| hills * noise.fractal(vec3(x, 3.0, z) * 0.35, 4);
    let field = |p: Vec3| {
        let ground = 0.7 * (p.y - level(p.x, p.z));
        let stone = bones.iter().fold(1e3, |d, (ends, r)| blend(d, capsule(p, *ends, *r), 0.5));
        if stone > 1.2 {
            return blend(ground, stone - 0.6, 0.5);
        }
        let shelf = strata * turn(p.y * layers + 2.0 * noise.at(p * 0.3)).x;
        blend(ground, stone + rough * crags(noise, p * 0.7) + shelf, 0.5)
    };
    let mut mesh = isosurface((vec3(-half.x, -1.0, -half.z), half), 0.1, 55.0, field);
    let open = |x: f32, z: f32| {
        (0..40)
            .map(|k| 6.0 - 0.15 * k as f32)
            .find(|y| field(vec3(x, *y, z)) < 0.0)
            .map_or(level(x, z), |y| y + 0.1)
    };
    rubble(&mut mesh, (Ground::new(half.x.max(half.z), 0.6, open), vec2(half.x, half.z) * 0.85), rng);
    let tuft = grass(0.35, 24, rng);
    for _ in 0..rng.count(120, 420) {
        let p = rng.in_rect(vec2(half.x, half.z) * 0.95);
        let y = level(p.x, p.y);
        if field(vec3(p.x, y + 0.3, p.y)) > 0.1 {
            mesh.add(&tuft, Pose::at(p.x, y - 0.02, p.y).yaw(rng.angle()).scale(rng.range(0.5, 1.3)));
        }
    }
    mesh
}
