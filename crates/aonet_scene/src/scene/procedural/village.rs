//! A village: cottages, a church, walls, fences, carts, wells, trees on uneven ground.

use super::architecture::{door, wall, window};
use super::mesh::{Mesh, Pose, turn};
use super::plants::{conifer, grass, rock, tree};
use super::rng::{Noise, Rng};
use super::shapes::{Segments, block, cuboid, cylinder, extrude, lathe, lathe_with, surface, torus};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Houses around a green.
pub(super) fn village(rng: &mut Rng) -> Mesh {
    let half = rng.range(16.0, 21.0);
    let noise = Noise::new(rng);
    let relief = rng.range(0.2, 0.9);
    let level = move |p: Vec2| {
        let calm = ((p.length() - 4.0) / 8.0).clamp(0.0, 1.0);
        relief * calm * noise.fractal(vec3(p.x, 0.0, p.y) * 0.12, 3)
            + 0.02 * noise.at(vec3(p.x, 9.0, p.y) * 2.0)
    };
    let mut mesh = surface((140, 140), |u, v| {
        let p = vec2(v - 0.5, u - 0.5) * 2.0 * half;
        vec3(p.x, level(p), p.y)
    });
    let mut taken: Vec<(Vec2, f32)> = Vec::new();
    let mut put = |part: &Mesh, at: Vec2, yaw: f32| {
        let (lo, hi) = part.extent();
        let r = 0.5 * vec2(hi.x - lo.x, hi.z - lo.z).length() * 0.85;
        let free = at.abs().max_element() + r < half && taken.iter().all(|(p, q)| p.distance(at) > r + q);
        if free {
            taken.push((at, r));
            mesh.add(part, Pose::at(at.x, level(at) - 0.05, at.y).yaw(yaw));
        }
        free
    };
    put(&well(rng), rng.in_rect(Vec2::splat(1.0)), rng.angle());
    let tower = church(rng);
    let homes = rng.count(7, 12);
    for k in 0..homes {
        let a = k as f32 / homes as f32 * TAU + rng.spread(0.2);
        let t = turn(a);
        let face = FRAC_PI_2 - a + PI;
        let home = if k == 0 { tower.clone() } else { cottage(&mut rng.fork()) };
        (0..6).any(|i| put(&home, t * (9.0 + i as f32 * 1.1 + rng.range(0.0, 1.0)), face + rng.spread(0.3)));
    }
    outdoors(&mut put, half, rng);
    let stone = rock(vec3(1.0, 0.7, 0.9), rng);
    for _ in 0..rng.count(30, 80) {
        let at = rng.in_rect(Vec2::splat(half));
        let size = 0.1 + 0.7 * rng.unit() * rng.unit() * rng.unit();
        mesh.add(&stone, Pose::at(at.x, level(at) + 0.1 * size, at.y).yaw(rng.angle()).scale(size));
    }
    mesh
}

/// Trees, carts, fences and grass between the houses; `put` places a thing if it finds the place free.
fn outdoors(put: &mut impl FnMut(&Mesh, Vec2, f32) -> bool, half: f32, rng: &mut Rng) {
    let trees: Vec<Mesh> = (0..3)
        .map(|k| if k == 0 { conifer(6.0, rng) } else { tree(rng.range(4.0, 6.5), 800, rng) })
        .collect();
    let small = [barrels(rng), cart(rng), super::street::bench(rng), woodpile(rng), haystack(rng)];
    for k in 0..150 {
        let at = rng.in_rect(Vec2::splat(half));
        match k {
            0..8 => _ = put(rng.pick(&trees), at, rng.angle()),
            8..50 => _ = put(rng.pick(&small), 0.45 * at, rng.angle()),
            50..64 => _ = put(&fence(rng.range(2.0, 5.0), rng), at, rng.angle()),
            _ => _ = put(&grass(0.4, 20, rng), at, rng.angle()),
        }
    }
}

/// A cottage that faces +z: stone foot, timber frame, tiled gable roof, chimney.
fn cottage(rng: &mut Rng) -> Mesh {
    let size = vec3(rng.range(4.0, 6.5), rng.range(2.3, 4.2), rng.range(3.5, 4.8));
    let thick = 0.3;
    let columns = (size.x / 1.5) as usize;
    let bay = size.x / columns as f32;
    let entry = rng.below(columns);
    let mut mesh = block(vec3(size.x + 0.12, 0.45, size.z + 0.12), 0.04).at(Pose::at(0.0, -0.3, 0.0));
    let pane = vec2(rng.range(0.6, 0.85), rng.range(0.7, 0.95));
    for side in [1.0f32, -1.0] {
        let pose =
            Pose::IDENTITY.yaw(if side > 0.0 { 0.0 } else { PI }).shift(0.0, 0.1, 0.5 * (size.z - thick));
        let mut holes = Vec::new();
        for i in 0..columns {
            let x = (i as f32 + 0.5) * bay - 0.5 * size.x;
            let hole = if side > 0.0 && i == entry { (0.05, vec2(0.9, 1.95)) } else { (0.9, pane) };
            if hole.0 < 0.1 || rng.chance(0.75) {
                holes.push((vec2(x - 0.5 * hole.1.x, hole.0), vec2(x + 0.5 * hole.1.x, hole.0 + hole.1.y)));
            }
        }
        mesh.add(&wall(vec3(size.x, size.y, thick), &holes), pose);
        let fitting = window(pane, thick, rng);
        for (lo, hi) in &holes {
            let at = pose.shift(0.5 * (lo.x + hi.x), lo.y, 0.0);
            let part = if lo.y < 0.1 { door(*hi - *lo, rng) } else { fitting.clone() };
            mesh.add(&part, at.shift(0.0, 0.0, 0.05));
            if lo.y > 0.1 {
                for s in [-1.0, 1.0] {
                    let shutter = block(vec3(0.5 * pane.x, pane.y, 0.04), 0.008);
                    mesh.add(&shutter, at.shift(s * (0.76 * pane.x + 0.06), 0.0, 0.5 * thick + 0.03));
                }
            }
        }
        if rng.chance(0.7) {
            timber(&mut mesh, pose.shift(0.0, 0.0, 0.5 * thick), (size, columns));
        }
    }
    let rise = gables(&mut mesh, size, rng);
    roof(&mut mesh, size, rise, rng);
    let chimney = block(vec3(0.6, rise + 1.3, 0.6), 0.04);
    let at = Pose::at(rng.spread(0.35 * size.x), size.y, rng.spread(0.3));
    mesh.add(&chimney, at);
    mesh.add(&block(vec3(0.75, 0.12, 0.75), 0.03), at.shift(0.0, rise + 1.2, 0.0));
    mesh
}

/// Posts, rails and braces on a wall face at z = 0.
fn timber(mesh: &mut Mesh, face: Pose, (size, columns): (Vec3, usize)) {
    let beam = |long: f32| block(vec3(long, 0.14, 0.08), 0.012);
    for y in [0.0, size.y - 0.14] {
        mesh.add(&beam(size.x), face.shift(0.0, y, 0.02));
    }
    let post = block(vec3(0.13, size.y, 0.07), 0.012);
    for i in 0..=columns {
        let x = (i as f32 / columns as f32 - 0.5) * (size.x - 0.14);
        mesh.add(&post, face.shift(x, 0.0, 0.02));
    }
    for s in [-1.0, 1.0] {
        let brace = face.shift(s * (0.5 * size.x - 0.1), 0.1, 0.015).roll(s * 0.5 + FRAC_PI_2);
        mesh.add(&beam(1.3), brace.shift(0.65, -0.07, 0.0));
    }
}

/// The end walls up to the ridge; returns the rise of the roof.
fn gables(mesh: &mut Mesh, size: Vec3, rng: &mut Rng) -> f32 {
    let rise = 0.5 * size.z * rng.range(0.8, 1.3);
    let h = 0.5 * size.z;
    let outline = [vec2(-h, 0.0), vec2(h, 0.0), vec2(h, size.y), vec2(0.0, size.y + rise), vec2(-h, size.y)];
    let end = extrude(&outline, 0.3, 0.0);
    let pane = window(vec2(0.7, 0.8), 0.1, rng);
    for side in [-1.0, 1.0] {
        let pose = Pose::at(side * (0.5 * size.x - 0.15), 0.1, 0.0).yaw(side * FRAC_PI_2);
        mesh.add(&end, pose);
        mesh.add(&pane, pose.shift(0.0, size.y - 0.1, 0.13));
    }
    rise
}

/// Rows of overlapping tiles on two slopes, rafters' ends and a ridge.
fn roof(mesh: &mut Mesh, size: Vec3, rise: f32, rng: &mut Rng) {
    let over = 0.4;
    let slope = libm::atan2f(rise, 0.5 * size.z);
    let along = vec2(0.5 * size.z, rise).length() + over;
    let (row, wide) = (rng.range(0.22, 0.4), rng.range(0.18, 0.45));
    let rows = (along / row).ceil() as usize;
    let columns = ((size.x + 0.7) / wide).ceil() as usize;
    let thatch = rng.chance(0.25);
    let tile = cuboid(vec3(wide - 0.01, 0.025, row + 0.08));
    for side in [0.0, PI] {
        let ridge = Pose::at(0.0, size.y + rise + 0.1, 0.0).yaw(side).pitch(slope);
        let board = block(vec3(size.x + 0.6, 0.06, along), 0.01);
        mesh.add(&board, ridge.shift(0.0, 0.0, 0.5 * along));
        if thatch {
            let noise = Noise::new(rng);
            let straw = surface((30, 60), |u, v| {
                let bump = 0.03 * noise.fractal(vec3(v * 40.0, u * 6.0, side), 3);
                let edge = (u - 0.96).max(0.0) * 5.0;
                let top = if v == 0.0 || v == 1.0 { 0.0 } else { 0.22 + bump - edge };
                let x = ((v * 60.0 - 1.0) / 58.0).clamp(0.0, 1.0) - 0.5;
                vec3(x * (size.x + 0.8), top, u * (along + 0.1))
            });
            mesh.add(&straw, ridge);
            continue;
        }
        for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
            let x = (i as f32 + 0.5 + 0.5 * (j % 2) as f32 - 0.5 * columns as f32) * wide;
            let at = ridge.shift(x, 0.07 + rng.range(0.0, 0.012), (j as f32 + 0.5) * row);
            mesh.add(&tile, at.yaw(rng.spread(0.03)).pitch(-0.07));
        }
    }
    let cap = cylinder((0.1, 0.1), size.x + 0.7, 14);
    mesh.add(&cap, Pose::at(0.5 * size.x + 0.35, size.y + rise + 0.17, 0.0).roll(FRAC_PI_2));
}

/// A church that faces +z: nave, square tower with a spire.
fn church(rng: &mut Rng) -> Mesh {
    let size = vec3(7.0, rng.range(3.5, 4.5), 4.2);
    let mut mesh = Mesh::default();
    for side in [1.0, -1.0] {
        let pose = Pose::IDENTITY.yaw(if side > 0.0 { 0.0 } else { PI }).shift(0.0, 0.0, 0.5 * size.z - 0.2);
        let holes: Vec<_> = (0..3)
            .map(|i| (i as f32 - 1.0) * 2.0)
            .map(|x| (vec2(x - 0.35, 1.0), vec2(x + 0.35, 2.9)))
            .collect();
        mesh.add(&wall(vec3(size.x, size.y, 0.4), &holes), pose);
        for (lo, hi) in &holes {
            mesh.add(&window(*hi - *lo, 0.4, rng), pose.shift(0.5 * (lo.x + hi.x), lo.y, 0.0));
        }
        for i in 0..4 {
            let buttress =
                extrude(&[vec2(0.0, 0.0), vec2(0.7, 0.0), vec2(0.5, 1.6), vec2(0.0, 2.6)], 0.35, 0.02);
            mesh.add(&buttress, pose.shift((i as f32 - 1.5) * 2.0, 0.0, 0.2).yaw(-FRAC_PI_2));
        }
    }
    let rise = gables(&mut mesh, size, rng);
    roof(&mut mesh, size, rise, rng);
    let w = 2.6;
    mesh.add(&steeple(w, rng), Pose::at(0.5 * size.x + 0.5 * w - 0.3, 0.0, 0.0));
    mesh
}

/// A square tower of width `w` with a bell and a spire.
fn steeple(w: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let tall = rng.range(7.5, 10.0);
    let at = Pose::IDENTITY;
    for k in 0..4 {
        let face = at.yaw(k as f32 * FRAC_PI_2).shift(0.0, 0.0, 0.5 * w - 0.2);
        let mut holes =
            vec![(vec2(-0.4, tall - 2.0), vec2(0.4, tall - 0.5)), (vec2(-0.15, 4.0), vec2(0.15, 5.0))];
        if k == 0 {
            holes.push((vec2(-0.5, 0.0), vec2(0.5, 2.1)));
            mesh.add(&door(vec2(1.0, 2.1), rng), face);
        }
        mesh.add(&wall(vec3(w - if k % 2 == 0 { 0.0 } else { 0.8 }, tall, 0.4), &holes), face);
    }
    for y in [0.0, 3.2, tall - 2.4, tall] {
        mesh.add(
            &super::architecture::frame(vec2(w, w), vec2(0.12, 0.2))
                .at(Pose::at(0.0, 0.0, 0.5 * w).pitch(-FRAC_PI_2)),
            at.shift(0.0, y, 0.0),
        );
    }
    mesh.add(&cuboid(vec3(w - 0.2, 0.2, w - 0.2)), at.shift(0.0, tall - 2.2, 0.0));
    let bell = [(0.0, 0.9), (0.2, 0.9), (0.28, 0.5), (0.4, 0.15), (0.5, 0.0)].map(|(x, y)| vec2(x, y));
    mesh.add(&lathe(&bell.iter().rev().copied().collect::<Vec<_>>(), 28), at.shift(0.0, tall - 1.8, 0.0));
    let sides = *rng.pick(&[4, 8]);
    let spire = [
        vec2(0.0, 0.0),
        vec2(0.78 * w, 0.0),
        vec2(0.74 * w, 0.25),
        vec2(0.3 * w, 1.3),
        vec2(0.02, rng.range(3.0, 5.5)),
    ];
    mesh.add(
        &lathe_with(&spire, sides, 0.0),
        at.shift(0.0, tall + 0.1, 0.0).yaw(if sides == 4 { 0.25 * PI } else { 0.125 * PI }),
    );
    mesh
}

/// A well with a stone ring, a roof on posts, a crank and a bucket.
fn well(rng: &mut Rng) -> Mesh {
    let (r, stones) = (rng.range(0.7, 0.95), 14);
    let mut mesh = Mesh::default();
    let stone = block(vec3(TAU * r / stones as f32 - 0.02, 0.21, 0.26), 0.03);
    for (j, k) in (0..4).flat_map(|j| (0..stones).map(move |k| (j, k))) {
        let a = (k as f32 + 0.5 * (j % 2) as f32) / stones as f32 * TAU;
        mesh.add(&stone, Pose::at(0.0, 0.22 * j as f32, 0.0).yaw(a).shift(0.0, 0.0, r + rng.spread(0.015)));
    }
    for side in [-1.0, 1.0] {
        mesh.add(&block(vec3(0.12, 2.2, 0.12), 0.015), Pose::at(side * r, 0.0, 0.0));
        let slope = Pose::at(0.0, 2.35, 0.0).yaw(if side > 0.0 { 0.0 } else { PI }).pitch(0.7);
        for k in 0..6 {
            let plank = block(vec3(2.3 * r, 0.03, 0.2), 0.008);
            mesh.add(&plank, slope.shift(rng.spread(0.03), 0.0, 0.08 + 0.17 * k as f32).pitch(-0.1));
        }
    }
    let axle = Pose::at(r + 0.25, 1.5, 0.0).roll(FRAC_PI_2);
    mesh.add(&cylinder((0.09, 0.09), 2.0 * r + 0.25, 16), axle);
    for k in 0..6 {
        mesh.add(
            &torus(0.1, 0.02, Segments { around: 20, across: 8 }),
            Pose::at(0.04 * k as f32 - 0.1, 1.5, 0.0).roll(FRAC_PI_2),
        );
    }
    mesh.add(&cylinder((0.015, 0.015), 0.5, 8), Pose::at(0.0, 1.0, 0.1));
    mesh.add(
        &super::props::hollow(&[vec2(0.13, 0.0), vec2(0.16, 0.15), vec2(0.17, 0.28)], 0.02),
        Pose::at(0.0, 0.75, 0.1),
    );
    mesh
}

pub(super) fn barrels(rng: &mut Rng) -> Mesh {
    let staves = |k: usize| {
        let t = k as f32 / 8.0;
        vec2(0.26 + 0.08 * 4.0 * t * (1.0 - t), 0.85 * t)
    };
    let mut profile = vec![vec2(0.0, 0.04), vec2(0.24, 0.04), vec2(0.24, 0.0)];
    profile.extend((0..=8).map(staves));
    profile.extend([vec2(0.24, 0.85), vec2(0.24, 0.81), vec2(0.0, 0.81)]);
    let mut barrel = lathe_with(&profile, 20, 10.0);
    for y in [0.12, 0.3, 0.55, 0.73] {
        let t = y / 0.85;
        barrel.add(
            &torus(0.262 + 0.32 * t * (1.0 - t), 0.012, Segments { around: 40, across: 6 }),
            Pose::at(0.0, y, 0.0).stretch(1.0, 2.0, 1.0),
        );
    }
    let mut mesh = barrel.at(Pose::at(-0.4, 0.0, 0.0));
    mesh.add(&barrel, Pose::at(0.4, 0.0, 0.1));
    if rng.chance(0.6) {
        mesh.add(&barrel, Pose::at(0.0, 0.34, 0.75).roll(FRAC_PI_2).shift(0.0, -0.42, 0.0));
    }
    mesh.add(
        &super::props::crate_of_slats(vec3(0.6, 0.4, 0.5), rng),
        Pose::at(0.1, 0.0, -0.7).yaw(rng.spread(0.5)),
    );
    mesh
}

/// A wooden cart with spoked wheels.
fn cart(rng: &mut Rng) -> Mesh {
    let r = rng.range(0.45, 0.6);
    let mut mesh = super::props::crate_of_slats(vec3(1.2, 0.5, 2.0), rng).at(Pose::at(0.0, r, 0.0));
    let rim: Vec<Vec2> = (0..32).map(|k| turn(k as f32 / 32.0 * TAU) * r).collect();
    let mut wheel = ring_of(&rim, 0.84 * r);
    wheel.add(&cylinder((0.1, 0.08), 0.2, 16), Pose::at(0.0, 0.0, -0.1).pitch(FRAC_PI_2));
    for k in 0..10 {
        let spoke = block(vec3(0.035, 0.86 * r, 0.04), 0.006);
        wheel.add(&spoke, Pose::IDENTITY.roll(k as f32 / 10.0 * TAU));
    }
    for side in [-1.0, 1.0] {
        mesh.add(&wheel, Pose::at(side * 0.75, r, -0.2).yaw(side * FRAC_PI_2));
        mesh.add(&block(vec3(0.07, 0.07, 1.9), 0.012), Pose::at(side * 0.35, r - 0.02, 1.7).pitch(0.12));
    }
    mesh.add(&cylinder((0.05, 0.05), 1.6, 12), Pose::at(0.8, r, -0.2).roll(FRAC_PI_2));
    mesh
}

fn ring_of(outline: &[Vec2], bore: f32) -> Mesh {
    super::machine::bored(outline, bore, 0.08)
}

fn woodpile(rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    for j in 0..7 {
        for i in 0..12 - j / 3 {
            let r = rng.range(0.06, 0.085);
            let log = cylinder((r, r * rng.range(0.85, 1.0)), 0.9 + rng.spread(0.08), 12);
            let x = (i as f32 - 5.5 + 0.5 * (j % 2) as f32) * 0.165;
            mesh.add(
                &log,
                Pose::at(x, 0.08 + 0.143 * j as f32, -0.45 + rng.spread(0.04))
                    .pitch(FRAC_PI_2)
                    .yaw(rng.angle()),
            );
        }
    }
    mesh
}

fn haystack(rng: &mut Rng) -> Mesh {
    let noise = Noise::new(rng);
    let h = rng.range(1.2, 2.0);
    surface((24, 48), |u, v| {
        let k = (v * 48.0).round() % 48.0;
        let t = turn(k / 48.0 * TAU);
        let r = 0.75
            * h
            * (1.0 - u * u).max(0.0).sqrt()
            * (1.0 + 0.06 * noise.fractal(vec3(t.x * 4.0, u * 9.0, t.y * 4.0), 3));
        vec3(r * t.x, u * h, r * t.y)
    })
}

/// A fence of `long` along x.
pub(super) fn fence(long: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    for y in [0.3, 0.75] {
        mesh.add(&block(vec3(long, 0.07, 0.03), 0.006), Pose::at(0.0, y, -0.03));
    }
    let n = (long / 0.16) as usize;
    for k in 0..n {
        let x = ((k as f32 + 0.5) / n as f32 - 0.5) * long;
        let high = rng.range(0.9, 1.0);
        let picket =
            [vec2(-0.05, 0.0), vec2(0.05, 0.0), vec2(0.05, high), vec2(0.0, high + 0.07), vec2(-0.05, high)];
        mesh.add(&extrude(&picket, 0.025, 0.003), Pose::at(x, 0.0, 0.0).roll(rng.spread(0.03)));
    }
    mesh
}
