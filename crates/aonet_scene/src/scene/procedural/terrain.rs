//! Open land: hills, rocks, grass and trees.

use super::mesh::{Mesh, Pose};
use super::plants::{conifer, grass, rock, tree};
use super::rng::{Noise, Rng};
use super::shapes::{ball, surface};
use glam::{Vec2, Vec3, vec2, vec3};

/// The shape of the land.
struct Land {
    noise: Noise,
    relief: f32,
    ridge: f32,
}

impl Land {
    fn height(&self, p: Vec2) -> f32 {
        let q = vec3(p.x, 0.0, p.y) * 0.09;
        let hills = self.noise.fractal(q, 5);
        let ridge = 1.0 - self.noise.at(q * 1.7 + Vec3::splat(9.1)).abs() * 2.0;
        self.relief * (hills + self.ridge * ridge.max(0.0) * ridge) + 0.03 * self.noise.fractal(q * 25.0, 2)
    }

    fn up(&self, p: Vec2) -> Vec3 {
        let e = 0.1;
        let slope = |d: Vec2| (self.height(p + d) - self.height(p - d)) / (2.0 * e);
        vec3(-slope(vec2(e, 0.0)), 1.0, -slope(vec2(0.0, e))).normalize()
    }
}

/// A piece of land about 30 m across.
pub(super) fn terrain(rng: &mut Rng) -> Mesh {
    let half = rng.range(10.0, 18.0);
    let land = Land { noise: Noise::new(rng), relief: rng.range(0.4, 2.6), ridge: rng.range(0.0, 1.0) };
    let mut mesh = surface((140, 140), |u, v| {
        let p = vec2(v - 0.5, u - 0.5) * 2.0 * half;
        vec3(p.x, land.height(p), p.y)
    });
    trees(&mut mesh, (&land, half), rng);
    rocks(&mut mesh, (&land, half), rng);
    undergrowth(&mut mesh, (&land, half), rng);
    pebbles(&mut mesh, (&land, half), rng);
    mesh
}

fn trees(mesh: &mut Mesh, (land, half): (&Land, f32), rng: &mut Rng) {
    let kinds: Vec<Mesh> = (0..3)
        .map(|_| match rng.chance(0.35) {
            true => conifer(rng.range(4.0, 9.0), rng),
            false => tree(rng.range(3.5, 8.0), 800, rng),
        })
        .collect();
    for _ in 0..rng.count(5, 11) {
        let p = rng.in_rect(Vec2::splat(0.92 * half));
        let pose = Pose::at(p.x, land.height(p) - 0.08, p.y).yaw(rng.angle()).scale(rng.range(0.6, 1.2));
        mesh.add(rng.pick(&kinds), pose);
    }
    let bush = tree(1.6, 350, rng);
    for _ in 0..rng.count(3, 14) {
        let p = rng.in_rect(Vec2::splat(0.92 * half));
        let pose = Pose::at(p.x, land.height(p) - 0.45, p.y).yaw(rng.angle());
        mesh.add(&bush, pose.scale(rng.range(0.7, 1.2)));
    }
    for _ in 0..rng.count(1, 5) {
        let p = rng.in_rect(Vec2::splat(0.8 * half));
        let (r, long) = (rng.range(0.15, 0.35), rng.range(1.0, 4.0));
        let log = super::shapes::cylinder((r, 0.85 * r), long, 18);
        let pose = Pose::at(p.x, land.height(p) + 0.8 * r, p.y).stand_on(land.up(p)).yaw(rng.angle());
        mesh.add(&log, pose.pitch(std::f32::consts::FRAC_PI_2).shift(0.0, -0.5 * long, 0.0));
    }
}

fn rocks(mesh: &mut Mesh, (land, half): (&Land, f32), rng: &mut Rng) {
    let kinds: Vec<Mesh> = (0..6)
        .map(|_| rock(vec3(rng.range(0.7, 1.3), rng.range(0.5, 1.1), rng.range(0.7, 1.3)), rng))
        .collect();
    for _ in 0..rng.count(5, 12) {
        let centre = rng.in_rect(Vec2::splat(0.85 * half));
        let big = rng.range(0.3, 2.2);
        for k in 0..rng.count(3, 10) {
            let size = if k == 0 { big } else { big * rng.range(0.06, 0.5) };
            let away = if k == 0 { Vec2::ZERO } else { rng.in_rect(Vec2::splat(1.6 * big)) };
            let p = centre + away;
            let sink = size * rng.range(-0.1, 0.3);
            let tilt = Pose::at(p.x, land.height(p) + sink, p.y).stand_on(land.up(p)).yaw(rng.angle());
            mesh.add(rng.pick(&kinds), tilt.pitch(rng.spread(0.5)).scale(size));
        }
    }
}

fn pebbles(mesh: &mut Mesh, (land, half): (&Land, f32), rng: &mut Rng) {
    let stone = ball(1.0, 10);
    for _ in 0..rng.count(6, 20) {
        let centre = rng.in_rect(Vec2::splat(0.9 * half));
        for _ in 0..rng.count(4, 22) {
            let p = centre + rng.in_rect(Vec2::splat(1.2));
            let r = 0.02 + 0.1 * rng.unit() * rng.unit();
            let pose = Pose::at(p.x, land.height(p) + 0.3 * r, p.y).yaw(rng.angle());
            mesh.add(&stone, pose.stretch(r, r * rng.range(0.4, 0.9), r * rng.range(0.6, 1.0)));
        }
    }
}

fn undergrowth(mesh: &mut Mesh, (land, half): (&Land, f32), rng: &mut Rng) {
    let tufts: Vec<Mesh> = (0..4).map(|_| grass(rng.range(0.25, 0.7), 22, rng)).collect();
    for _ in 0..rng.count(30, 60) {
        let centre = rng.in_rect(Vec2::splat(half));
        let wide = rng.range(0.3, 2.0);
        for _ in 0..rng.count(4, 18) {
            let p = (centre + rng.in_rect(Vec2::splat(wide))).clamp(Vec2::splat(-half), Vec2::splat(half));
            let pose = Pose::at(p.x, land.height(p) - 0.02, p.y).yaw(rng.angle()).scale(rng.range(0.6, 1.4));
            mesh.add(rng.pick(&tufts), pose);
        }
    }
}
