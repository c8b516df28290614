//! A thicket: hedges, bushes, ferns and small trees, a fence and a trellis with climbers.

use super::mesh::{Mesh, Pose, turn};
use super::plants::{grass, rock, tree};
use super::rng::{Noise, Rng};
use super::shapes::{block, cylinder, surface, tube};
use super::village::fence;
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// The land and how much may still grow on it.
struct Land {
    noise: Noise,
    relief: f32,
    half: f32,
}

impl Land {
    fn height(&self, p: Vec2) -> f32 {
        let q = vec3(p.x, 0.0, p.y);
        self.relief * self.noise.fractal(q * 0.2, 3) + 0.015 * self.noise.fractal(q * 3.0, 2)
    }

    fn at(&self, p: Vec2) -> Pose {
        Pose::at(p.x, self.height(p) - 0.03, p.y)
    }

    fn somewhere(&self, rng: &mut Rng) -> Vec2 {
        rng.in_rect(Vec2::splat(0.92 * self.half))
    }
}

/// A piece of land full of plants.
pub(super) fn thicket(rng: &mut Rng) -> Mesh {
    let land = Land { noise: Noise::new(rng), relief: rng.range(0.05, 0.6), half: rng.range(2.8, 4.8) };
    let mut mesh = surface((110, 110), |u, v| {
        let p = vec2(v - 0.5, u - 0.5) * 2.0 * land.half;
        vec3(p.x, land.height(p), p.y)
    });
    screens(&mut mesh, &land, rng);
    shrubs(&mut mesh, &land, rng);
    let ferns: Vec<Mesh> = (0..2).map(|_| fern(rng.range(0.4, 1.0), rng)).collect();
    for _ in 0..rng.count(4, 16) {
        let p = land.somewhere(rng);
        mesh.add(rng.pick(&ferns), land.at(p).yaw(rng.angle()).scale(rng.range(0.6, 1.2)));
    }
    for _ in 0..rng.count(1, 4) {
        let p = land.somewhere(rng);
        let young = tree(rng.range(2.2, 4.5), 600, rng);
        mesh.add(&young, land.at(p).yaw(rng.angle()));
    }
    litter(&mut mesh, &land, rng);
    mesh
}

/// Hedges, fences and trellises: some lines across the land.
fn screens(mesh: &mut Mesh, land: &Land, rng: &mut Rng) {
    let first = rng.below(3);
    for k in 0..rng.count(3, 5) {
        let p = rng.in_rect(Vec2::splat(0.75 * land.half));
        let long = rng.range(2.2, 4.5).min(1.2 * land.half);
        let at = land.at(p).yaw(rng.below(2) as f32 * FRAC_PI_2 + rng.spread(0.3));
        match (first + k) % 3 {
            0 => mesh.add(&hedge(vec3(long, rng.range(0.7, 1.9), rng.range(0.4, 0.9)), rng), at),
            1 => mesh.add(&trellis(vec2(0.75 * long, rng.range(1.5, 2.3)), rng), at),
            _ => {
                let high = rng.range(0.9, 1.5);
                mesh.add(
                    &fence(long, rng).at(Pose::IDENTITY.stretch(1.0, high, 1.0)),
                    at.shift(0.0, -0.05, 0.0),
                );
                for x in [-0.5, -0.15, 0.2, 0.5] {
                    let post = block(vec3(0.09, high + 0.5, 0.09), 0.008);
                    mesh.add(&post, at.shift(x * long, -0.4, -0.1));
                }
            }
        }
    }
}

fn shrubs(mesh: &mut Mesh, land: &Land, rng: &mut Rng) {
    let kinds: Vec<Mesh> = (0..rng.count(2, 4))
        .map(|_| {
            let size = vec3(rng.range(0.4, 0.9), rng.range(0.35, 1.0), rng.range(0.4, 0.9));
            shrub(size, rng.count(900, 2000), rng)
        })
        .collect();
    for _ in 0..rng.count(10, 22) {
        let p = land.somewhere(rng);
        let pose = land.at(p).yaw(rng.angle()).scale(rng.range(0.6, 1.3));
        mesh.add(rng.pick(&kinds), pose);
    }
}

/// A leaf of `size` from its stalk at the origin along +z, `wide` times as broad, folded, bent down.
fn blade(size: f32, wide: f32) -> Mesh {
    let half = 0.5 * wide * size;
    let (tip, bend) = (vec3(0.0, -0.14 * size, size), vec3(0.0, 0.02 * size, 0.45 * size));
    let mut mesh = Mesh::default();
    for side in [-1.0, 1.0] {
        let edge = vec3(side * half, 0.3 * half, 0.4 * size);
        let halves = [[Vec3::ZERO, edge, bend], [bend, edge, tip]];
        // Counter-clockwise from above on either side.
        halves.iter().for_each(|&[a, b, c]| mesh.push(if side > 0.0 { [a, c, b] } else { [a, b, c] }));
    }
    mesh.triangle.iter_mut().for_each(|t| {
        let [a, b, c] = t.map(|i| mesh.position[i as usize]);
        if (b - a).cross(c - a).y < 0.0 {
            t.swap(1, 2);
        }
    });
    mesh.shade(50.0)
}

/// The leaves of one plant.
fn foliage(rng: &mut Rng) -> Mesh {
    blade(rng.range(0.05, 0.13), *rng.pick(&[0.3, 0.5, 0.7, 0.9]))
}

/// A leaf at `p` whose front looks about along `out`.
fn sprout(mesh: &mut Mesh, leaf: &Mesh, (p, out): (Vec3, Vec3), rng: &mut Rng) {
    let up = (out + rng.direction() * 0.65 + Vec3::Y * 0.35).normalize_or(Vec3::Y);
    let pose = Pose::at(p.x, p.y, p.z).stand_on(up).yaw(rng.angle());
    mesh.add(leaf, pose.scale(rng.range(0.6, 1.3)));
}

/// A bush within half `size` about y = size.y, on bare stems, its leaves mostly outside.
fn shrub(size: Vec3, leaves: usize, rng: &mut Rng) -> Mesh {
    let (leaf, noise) = (foliage(rng), Noise::new(rng));
    let (lift, hollow) = (rng.range(0.0, 0.35) * size.y, rng.range(0.3, 0.85));
    let lump = |d: Vec3| 1.0 + 0.3 * noise.fractal(d * 2.2, 2);
    let mut mesh = Mesh::default();
    for _ in 0..rng.count(7, 16) {
        let to = (rng.direction() * 0.9 + Vec3::Y * 0.5).normalize_or(Vec3::Y);
        let end = to * size * rng.range(0.6, 0.95) * lump(to) + Vec3::Y * (size.y + lift);
        let foot = rng.in_rect(Vec2::splat(0.15 * size.x));
        let bend = |k: usize| {
            let t = k as f32 / 6.0;
            vec3(foot.x, -0.1, foot.y).lerp(end, t) + vec3(0.0, 0.35 * size.y * t * (1.0 - t), 0.0)
        };
        let path: Vec<Vec3> = (0..=6).map(bend).collect();
        let thick = size.y * rng.range(0.012, 0.03);
        let radii: Vec<f32> = (0..=6).map(|k| thick * (1.0 - 0.12 * k as f32)).collect();
        mesh.add(&tube(&path, &radii, 6), Pose::IDENTITY);
    }
    for _ in 0..leaves {
        let d = rng.direction();
        let depth = 1.0 - (1.0 - hollow) * rng.unit() * rng.unit();
        let p = d * size * depth * lump(d) + Vec3::Y * (size.y + lift);
        if p.y > 0.03 {
            sprout(&mut mesh, &leaf, (p, d), rng);
        }
    }
    mesh
}

/// A clipped hedge of `size` along x: stems inside, leaves about its faces.
fn hedge(size: Vec3, rng: &mut Rng) -> Mesh {
    let (leaf, noise) = (foliage(rng), Noise::new(rng));
    let (ragged, foot) = (rng.range(0.02, 0.12), rng.range(0.0, 0.3) * size.y);
    let mut mesh = Mesh::default();
    let stems = (size.x / 0.28) as usize;
    for k in 0..stems {
        let x = ((k as f32 + 0.5) / stems as f32 - 0.5) * size.x + rng.spread(0.08);
        for _ in 0..3 {
            let end = vec3(x + rng.spread(0.25), size.y * rng.range(0.7, 0.98), rng.spread(0.45 * size.z));
            let middle = vec3(x, 0.3 * size.y, 0.3 * end.z);
            let path = [vec3(x, -0.15, 0.0), middle, end];
            mesh.add(&tube(&path, &[0.022, 0.016, 0.006], 6), Pose::IDENTITY);
        }
    }
    let faces = [
        (Vec3::Z, size.x * size.y),
        (-Vec3::Z, size.x * size.y),
        (Vec3::Y, size.x * size.z),
        (Vec3::X, size.y * size.z),
        (-Vec3::X, size.y * size.z),
    ];
    let density = rng.range(350.0, 650.0);
    for (out, area) in faces {
        for _ in 0..((area * density) as usize).min(4000) {
            let p = vec3(rng.spread(0.5), rng.unit(), rng.spread(0.5)) * size;
            let face = vec3(0.0, 0.5 * size.y, 0.0) + out * 0.5 * size;
            let on = p.reject_from_normalized(out) + face.project_onto_normalized(out);
            let depth = 0.3 * size.z * rng.unit() * rng.unit() + ragged * noise.fractal(on * 4.0, 2);
            let at = on - out * depth;
            if at.y > foot + 0.1 * noise.at(on * 3.0) {
                sprout(&mut mesh, &leaf, (at, out), rng);
            }
        }
    }
    mesh
}

/// A lattice of `size` between posts, with stems and leaves that climb on both sides of it.
fn trellis(size: Vec2, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    for side in [-1.0, 1.0] {
        let post = block(vec3(0.09, size.y + 0.35, 0.09), 0.008);
        mesh.add(&post, Pose::at(side * (0.5 * size.x + 0.05), -0.3, 0.0));
    }
    for y in [0.1, size.y - 0.1] {
        mesh.add(&block(vec3(size.x + 0.02, 0.06, 0.04), 0.005), Pose::at(0.0, y, 0.0));
    }
    let pitch = rng.range(0.1, 0.24);
    for k in 1..(size.x / pitch) as usize {
        let x = k as f32 * pitch - 0.5 * size.x;
        mesh.add(&block(vec3(0.03, size.y - 0.14, 0.012), 0.002), Pose::at(x, 0.13, 0.008));
    }
    for k in 1..(size.y / pitch) as usize {
        let y = k as f32 * pitch;
        mesh.add(&block(vec3(size.x + 0.01, 0.03, 0.012), 0.002), Pose::at(0.0, y, -0.008));
    }
    let leaf = foliage(rng);
    for _ in 0..rng.count(2, 7) {
        let (x, sway, turns) = (rng.spread(0.5 * size.x), rng.range(0.05, 0.4), rng.range(0.5, 3.0));
        let phase = rng.angle();
        let top = size.y * rng.range(0.5, 1.05);
        let climb = |k: usize| {
            let t = k as f32 / 30.0;
            let w = turn(phase + t * turns * TAU);
            let x = (x + sway * t * w.x).clamp(-0.5 * size.x, 0.5 * size.x);
            vec3(x, t * top - 0.08, 0.035 * turn(t * top / pitch * PI).x)
        };
        let path: Vec<Vec3> = (0..=30).map(climb).collect();
        let radii: Vec<f32> = (0..=30).map(|k| 0.014 - 0.0003 * k as f32).collect();
        mesh.add(&tube(&path, &radii, 6), Pose::IDENTITY);
        for _ in 0..rng.count(100, 500) {
            let t = 1.0 - rng.unit() * rng.unit();
            let side = *rng.pick(&[-1.0, 1.0]);
            let around = vec3(rng.spread(0.3), rng.spread(0.15), side * rng.range(0.02, 0.22));
            let p = climb((t * 30.0) as usize) + around * (0.3 + 0.7 * t);
            sprout(&mut mesh, &leaf, (p.with_y(p.y.max(0.05)), Vec3::Z * side), rng);
        }
    }
    mesh
}

/// A fern: a rosette of arched fronds of about `size` with paired leaflets.
fn fern(size: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let (fronds, pairs) = (rng.count(9, 18), rng.count(12, 20));
    let wide = rng.range(0.16, 0.3) * size;
    for k in 0..fronds {
        let (long, lean) = (size * rng.range(0.75, 1.1), rng.range(0.9, 1.7));
        let spine = |t: f32| {
            let bend = turn(t * lean);
            vec3(0.0, long * bend.y / lean, long * (1.0 - bend.x) / lean + 0.25 * long * t)
        };
        let path: Vec<Vec3> = (0..=8).map(|i| spine(i as f32 / 8.0)).collect();
        let radii: Vec<f32> = (0..=8).map(|i| size * (0.008 - 0.0008 * i as f32)).collect();
        let mut frond = tube(&path, &radii, 5);
        for i in 1..pairs {
            let t = 0.15 + 0.85 * i as f32 / pairs as f32;
            let reach = wide * (1.0 - t) * (t * 5.0).min(1.6) + 0.01 * size;
            let leaflet = blade(reach, 0.3);
            let ahead = spine(t + 0.02) - spine(t - 0.02);
            let rise = libm::atan2f(ahead.y, ahead.z);
            for side in [-1.0, 1.0] {
                let p = spine(t);
                let at = Pose::at(0.0, p.y, p.z).pitch(-rise).yaw(side * 1.25);
                frond.add(&leaflet, at);
            }
        }
        let yaw = k as f32 / fronds as f32 * TAU + rng.spread(0.25);
        mesh.add(&frond, Pose::at(0.0, -0.02, 0.0).yaw(yaw).pitch(rng.range(0.0, 0.25)));
    }
    mesh
}

/// Grass, fallen leaves, stones, logs and poles on the ground.
fn litter(mesh: &mut Mesh, land: &Land, rng: &mut Rng) {
    let tufts: Vec<Mesh> = (0..3).map(|_| grass(rng.range(0.15, 0.6), 20, rng)).collect();
    for _ in 0..rng.count(12, 36) {
        let (centre, wide) = (land.somewhere(rng), rng.range(0.2, 1.0));
        for _ in 0..rng.count(3, 10) {
            let p = (centre + rng.in_rect(Vec2::splat(wide))).clamp_length_max(1.2 * land.half);
            let p = p.clamp(Vec2::splat(-land.half), Vec2::splat(land.half));
            mesh.add(rng.pick(&tufts), land.at(p).yaw(rng.angle()).scale(rng.range(0.6, 1.4)));
        }
    }
    let leaf = foliage(rng);
    for _ in 0..rng.count(200, 1500) {
        let p = land.somewhere(rng);
        let up = (rng.direction() * 0.4 + Vec3::Y).normalize();
        let at = land.at(p).shift(0.0, 0.03 + rng.range(0.012, 0.04), 0.0);
        mesh.add(&leaf, at.stand_on(up).yaw(rng.angle()).scale(rng.range(0.6, 1.2)));
    }
    let stone = rock(vec3(1.0, 0.7, 0.9), rng);
    for _ in 0..rng.count(4, 24) {
        let (p, size) = (land.somewhere(rng), 0.06 + 0.5 * rng.unit() * rng.unit() * rng.unit());
        mesh.add(&stone, land.at(p).shift(0.0, 0.25 * size, 0.0).yaw(rng.angle()).scale(size));
    }
    for _ in 0..rng.count(0, 6) {
        let (p, r, long) = (land.somewhere(rng), rng.range(0.02, 0.16), rng.range(0.8, 2.2));
        let log = cylinder((r, 0.85 * r), long, 16);
        let at = land.at(p).shift(0.0, 0.9 * r + 0.03, 0.0).yaw(rng.angle());
        mesh.add(&log, at.pitch(FRAC_PI_2 + rng.spread(0.06)).shift(0.0, -0.5 * long, 0.0));
    }
}
