//! Pipeworks: bundles of pipes on racks along a wall and a ceiling, ducts, cable trays, gratings.

use super::architecture::wall;
use super::machine::{flange, plated, rounded, unit, valve};
use super::mesh::{Mesh, Pose, turn};
use super::rng::Rng;
use super::shapes::{Segments, block, cuboid, cylinder, torus, tube};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// The place: half length, depth and height; the wall is at z = 0, the floor at y = 0.
struct Hall {
    half: f32,
    deep: f32,
    height: f32,
}

/// How pipes look; drawn once a place.
struct Style {
    radius: f32,
    flanged: f32,
    valves: f32,
    lagged: f32,
}

/// Pipes along a wall, below a ceiling and over the floor.
pub(super) fn pipeworks(rng: &mut Rng) -> Mesh {
    let hall = Hall { half: rng.range(2.2, 4.2), deep: rng.range(1.8, 3.2), height: rng.range(2.5, 3.8) };
    let style = Style {
        radius: rng.range(0.03, 0.08),
        flanged: rng.range(0.1, 0.6),
        valves: rng.range(0.0, 0.35),
        lagged: rng.range(0.0, 0.4),
    };
    let roofed = rng.chance(0.6);
    let mut mesh = Mesh::default();
    shell(&mut mesh, &hall, roofed, rng);
    let mut low = rng.range(0.35, 0.7);
    let top = hall.height - if roofed { 0.75 } else { 0.2 };
    while low < top {
        let reach = rng.range(0.3, 0.9);
        match rng.below(4) {
            0 => tray(&mut mesh, Pose::at(0.0, low, 0.32), (2.0 * hall.half, 0.4), rng),
            _ => wall_rack(&mut mesh, (&hall, low, reach), &style, rng),
        }
        low += rng.range(0.3, 0.65);
    }
    risers(&mut mesh, &hall, &style, rng);
    if roofed {
        hangers(&mut mesh, &hall, &style, rng);
    }
    sleepers(&mut mesh, &hall, &style, rng);
    for _ in 0..rng.count(1, 3) {
        let at = Pose::at(rng.spread(0.7 * hall.half), 0.01, rng.range(0.6, 0.8) * hall.deep);
        unit(&mut mesh, at.yaw(rng.spread(0.4)).scale(rng.range(0.6, 1.0)), rng);
    }
    mesh
}

/// Floor, wall, and sometimes a ceiling and a side wall.
fn shell(mesh: &mut Mesh, hall: &Hall, roofed: bool, rng: &mut Rng) {
    let size = vec2(2.0 * hall.half, hall.height);
    if rng.chance(0.4) {
        mesh.add(&plated(size, rng), Pose::IDENTITY);
    } else {
        mesh.add(&wall(size.extend(0.2), &[]), Pose::at(0.0, 0.0, -0.1));
        let piers = rng.count(2, 5);
        for k in 0..piers {
            let x = (k as f32 / (piers - 1) as f32 - 0.5) * (size.x - 0.4);
            mesh.add(&block(vec3(0.3, size.y - 0.01, 0.24), 0.015), Pose::at(x, 0.005, 0.0));
        }
    }
    if rng.chance(0.5) {
        let side = *rng.pick(&[-1.0, 1.0]);
        let at = Pose::at(side * (hall.half + 0.1), 0.0, 0.5 * hall.deep - 0.1).yaw(FRAC_PI_2);
        mesh.add(&wall(vec3(hall.deep + 0.2, size.y, 0.2), &[]), at);
    }
    if roofed {
        let lid = cuboid(vec3(size.x + 0.4, 0.2, hall.deep + 0.3));
        mesh.add(&lid, Pose::at(0.0, hall.height, 0.5 * hall.deep - 0.1));
        let n = rng.count(2, 5);
        let beam = block(vec3(0.16, rng.range(0.12, 0.3), hall.deep - 0.02), 0.01);
        for k in 0..n {
            let x = ((k as f32 + 0.5) / n as f32 - 0.5) * size.x;
            let y = hall.height - beam.extent().1.y + 0.002;
            mesh.add(&beam, Pose::at(x, y, 0.5 * hall.deep));
        }
    }
    if rng.chance(0.5) {
        mesh.add(&cuboid(vec3(size.x + 0.4, 0.2, hall.deep + 0.2)), Pose::at(0.0, -0.2, 0.5 * hall.deep));
    } else {
        pit(mesh, hall, rng);
    }
}

/// A floor of gratings over a pit with pipes.
fn pit(mesh: &mut Mesh, hall: &Hall, rng: &mut Rng) {
    let (wide, down) = (2.0 * hall.half, rng.range(0.3, 0.8));
    mesh.add(&cuboid(vec3(wide + 0.4, 0.2, hall.deep + 0.2)), Pose::at(0.0, -down - 0.2, 0.5 * hall.deep));
    let n = (wide / rng.range(0.8, 1.3)).ceil() as usize;
    let panel = vec2(wide / n as f32, hall.deep);
    let open = rng.below(3 * n);
    let grate = grating(panel - 0.012, rng.range(0.03, 0.05));
    let joist = block(vec3(0.06, down - 0.04, hall.deep - 0.02), 0.006);
    for k in 0..=n {
        let x = (k as f32 - 0.5 * n as f32) * panel.x;
        mesh.add(&joist, Pose::at(x, -down, 0.5 * hall.deep));
        if k < n && k != open {
            mesh.add(&grate, Pose::at(x + 0.5 * panel.x, 0.0, 0.5 * hall.deep));
        }
    }
    for _ in 0..rng.count(3, 8) {
        let (r, z) = (rng.range(0.02, 0.3 * down), rng.range(0.1, 0.95) * hall.deep);
        let path = [vec3(-hall.half, 0.0, z), vec3(hall.half, 0.0, z)];
        let y = rng.range(r - down, -r - 0.05);
        mesh.add(&tube(&path, &[r; 2], 16), Pose::at(0.0, y, 0.0));
    }
}

/// A grating of `size` whose top is y = 0.
fn grating(size: Vec2, pitch: f32) -> Mesh {
    let mut mesh = Mesh::default();
    let n = (size.x / pitch) as usize;
    let bar = cuboid(vec3(0.005, 0.03, size.y));
    for k in 0..=n {
        mesh.add(&bar, Pose::at((k as f32 / n as f32 - 0.5) * (size.x - 0.005), -0.03, 0.0));
    }
    let m = (size.y / 0.11) as usize;
    let rod = cuboid(vec3(size.x - 0.006, 0.006, 0.006));
    for k in 0..=m {
        mesh.add(&rod, Pose::at(0.0, -0.009, (k as f32 / m as f32 - 0.5) * (size.y - 0.02)));
    }
    mesh
}

/// A pipe of radius `r` through `corners`, with elbows, flanges, lagging and valves.
fn pipe(mesh: &mut Mesh, (corners, r): (&[Vec3], f32), style: &Style, rng: &mut Rng) {
    let path = rounded(corners, 2.6 * r);
    mesh.add(&tube(&path, &vec![r; path.len()], 16), Pose::IDENTITY);
    for pair in corners.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let (along, long) = ((to - from).normalize_or(Vec3::Y), from.distance(to));
        if long < 9.0 * r {
            continue;
        }
        if rng.chance(style.lagged) {
            let (a, b) = (rng.range(3.0 * r, 0.4 * long), rng.range(0.6 * long, long - 3.0 * r));
            let p = from + along * a;
            let coat = cylinder((1.45 * r, 1.45 * r), b - a, 20);
            mesh.add(&coat, Pose::at(p.x, p.y, p.z).stand_on(along));
            continue;
        }
        let n = (long / rng.range(0.9, 2.2)) as usize;
        for k in 0..n {
            if !rng.chance(style.flanged) {
                continue;
            }
            let p = from + along * long * (k as f32 + rng.range(0.35, 0.65)) / n as f32;
            let joint = Pose::at(p.x, p.y, p.z).stand_on(along);
            if rng.chance(style.valves) {
                stop_valve(mesh, joint, r, rng);
            } else {
                let disc = flange(1.7 * r);
                mesh.add(&disc, joint.shift(0.0, 0.003, 0.0));
                mesh.add(&disc, joint.shift(0.0, -0.003, 0.0).roll(PI));
            }
        }
    }
}

/// A valve about `at` in a pipe along +y: a body between flanges and a hand wheel.
fn stop_valve(mesh: &mut Mesh, at: Pose, r: f32, rng: &mut Rng) {
    let body = super::shapes::superellipsoid(vec3(1.6 * r, 2.4 * r, 1.6 * r), (0.8, 0.9), 20);
    mesh.add(&body, at);
    for side in [-1.0, 1.0] {
        let disc = cylinder((1.75 * r, 1.75 * r), 0.5 * r, 20);
        mesh.add(&disc, at.shift(0.0, side * 2.4 * r - 0.25 * r, 0.0));
    }
    // Towards the room or up.
    let turned = at.yaw(*rng.pick(&[0.0, FRAC_PI_2, PI, 1.5 * PI]));
    mesh.add(&cylinder((0.7 * r, 0.6 * r), 2.0 * r, 16), turned.pitch(FRAC_PI_2));
    mesh.add(&valve(1.5 * r + 0.02), turned.shift(0.0, 0.0, 1.4 * r));
}

/// Brackets on the wall at height `y` with pipes side by side along x; some turn off.
fn wall_rack(mesh: &mut Mesh, (hall, y, reach): (&Hall, f32, f32), style: &Style, rng: &mut Rng) {
    let n = (2.0 * hall.half / rng.range(0.9, 1.8)).ceil() as usize;
    let arms = (0..n).map(|k| ((k as f32 + 0.5) / n as f32 - 0.5) * 2.0 * hall.half);
    for x in arms.clone() {
        let arm = block(vec3(0.05, 0.06, reach + 0.06), 0.005);
        mesh.add(&arm, Pose::at(x, y - 0.06, 0.5 * reach + 0.02));
        mesh.add(&block(vec3(0.1, 0.26, 0.02), 0.004), Pose::at(x, y - 0.2, 0.012));
        let strut = [vec3(x, y - 0.17, 0.02), vec3(x, y - 0.05, 0.7 * reach)];
        mesh.add(&tube(&strut, &[0.014; 2], 8), Pose::IDENTITY);
    }
    let mut z = 0.16;
    while z < reach {
        let r = style.radius * rng.range(0.5, 1.5);
        z += 1.2 * r;
        if rng.chance(0.85) {
            let (left, right) = (-hall.half, hall.half);
            let mut corners = vec![vec3(left, y + r, z), vec3(right, y + r, z)];
            if rng.chance(0.35) {
                let (at, to) = (rng.spread(0.75 * hall.half), rng.range(0.05, hall.height - 0.1));
                corners[1] = vec3(at, y + r, z);
                let aside = if rng.chance(0.5) { vec3(at, to, z) } else { vec3(at, y + r, hall.deep) };
                corners.push(aside);
            }
            for x in arms.clone().filter(|x| *x < corners[1].x - 3.0 * r) {
                let clip = cylinder((1.15 * r, 1.15 * r), 0.035, 18);
                mesh.add(&clip, Pose::at(x + 0.017, y + r, z).roll(FRAC_PI_2));
            }
            pipe(mesh, (&corners, r), style, rng);
        }
        z += r * 1.25 + rng.range(0.01, 0.07);
    }
}

/// Upright pipes close to the wall, in bundles with clamps.
fn risers(mesh: &mut Mesh, hall: &Hall, style: &Style, rng: &mut Rng) {
    for _ in 0..rng.count(1, 4) {
        let (n, mut x) = (rng.count(2, 7), rng.spread(0.85 * hall.half));
        let z = if rng.chance(0.6) { 0.09 } else { rng.range(0.5, 0.9) };
        let from = x;
        for _ in 0..n {
            let r = (0.8 * style.radius * rng.range(0.4, 1.2)).min(0.055);
            x += r;
            let end = rng.range(0.6, 1.0) * hall.height;
            let mut corners = vec![vec3(x, 0.0, z), vec3(x, end, z)];
            if end < 0.9 * hall.height {
                corners.push(vec3(x, end, rng.range(0.7, 1.0) * hall.deep));
            }
            pipe(mesh, (&corners, r), style, rng);
            x += r + rng.range(0.01, 0.05);
        }
        for k in 1..4 {
            let clamp = block(vec3(x - from + 0.04, 0.04, 0.03), 0.004);
            mesh.add(&clamp, Pose::at(0.5 * (x + from), 0.25 * k as f32 * hall.height, z - 0.065));
        }
    }
}

/// What hangs from the ceiling: bars on rods with pipes along x, pipes across, a duct, a tray.
fn hangers(mesh: &mut Mesh, hall: &Hall, style: &Style, rng: &mut Rng) {
    let (low, from) = (hall.height - rng.range(0.4, 0.6), rng.range(0.7, 1.1));
    let to = (from + rng.range(0.4, 1.2)).min(hall.deep - 0.1);
    let n = rng.count(3, 6);
    for k in 0..n {
        let x = ((k as f32 + 0.5) / n as f32 - 0.5) * 2.0 * hall.half + 0.09;
        mesh.add(
            &block(vec3(0.05, 0.05, to - from + 0.1), 0.006),
            Pose::at(x, low - 0.05, 0.5 * (from + to)),
        );
        for z in [from, to] {
            let rod = cylinder((0.007, 0.007), hall.height - low + 0.08, 8);
            mesh.add(&rod, Pose::at(x, low - 0.07, z));
        }
    }
    let mut z = from + 0.05;
    while z < to - 0.05 {
        let r = style.radius * rng.range(0.5, 1.3);
        z += r;
        let ends = [vec3(-hall.half, low + r, z), vec3(hall.half, low + r, z)];
        pipe(mesh, (&ends, r), style, rng);
        z += r + rng.range(0.01, 0.08);
    }
    for _ in 0..rng.count(1, 3) {
        let mut x = rng.spread(0.8 * hall.half);
        for _ in 0..rng.count(1, 5) {
            let r = 0.7 * style.radius * rng.range(0.5, 1.3);
            let y = low - 0.06 - r;
            let mut corners = vec![vec3(x, y, 0.0), vec3(x, y, hall.deep)];
            if rng.chance(0.3) {
                corners[1].z = rng.range(0.5, 0.9) * hall.deep;
                corners.push(vec3(x, 0.0, corners[1].z));
            }
            pipe(mesh, (&corners, r), style, rng);
            x += 2.2 * r + rng.range(0.01, 0.06);
        }
    }
    if rng.chance(0.7) {
        let z = if to + 0.5 < hall.deep { 0.5 * (to + hall.deep) + 0.05 } else { 0.38 };
        let wide = (2.0 * (hall.deep - z)).min(rng.range(0.25, 0.6)).max(0.2);
        duct(mesh, (Pose::at(0.0, hall.height - 0.12, z), 2.0 * hall.half, wide), rng);
    } else {
        tray(mesh, Pose::at(0.0, low - 0.25, to - 0.1), (2.0 * hall.half, 0.3), rng);
    }
}

/// A sheet metal duct along x whose top is at `at`: boxed with ribs, or round with folds.
fn duct(mesh: &mut Mesh, (at, long, wide): (Pose, f32, f32), rng: &mut Rng) {
    let high = wide * rng.range(0.6, 1.0);
    let axis = at.shift(0.0, -0.5 * high, 0.0);
    let round = rng.chance(0.5);
    let n = (long / if round { 0.18 } else { 0.7 }) as usize;
    if round {
        let path = [vec3(-0.5 * long, 0.0, 0.0), vec3(0.5 * long, 0.0, 0.0)];
        mesh.add(&tube(&path, &[0.5 * high; 2], 32), axis);
    } else {
        mesh.add(&block(vec3(long, high, wide), 0.006), axis.shift(0.0, -0.5 * high, 0.0));
    }
    let fold = torus(0.5 * high, 0.006, Segments { around: 32, across: 6 });
    let rib = block(vec3(0.03, high + 0.05, wide + 0.05), 0.004);
    let grille = block(vec3(0.3, 0.02, 0.6 * wide), 0.004);
    for k in 0..n {
        let x = ((k as f32 + 0.5) / n as f32 - 0.5) * long;
        if round {
            mesh.add(&fold, axis.shift(x, 0.0, 0.0).roll(FRAC_PI_2));
        } else {
            mesh.add(&rib, axis.shift(x, -0.5 * high - 0.025, 0.0));
            if rng.chance(0.3) {
                mesh.add(&grille, axis.shift(x + 0.3, -0.5 * high - 0.015, 0.0));
            }
        }
    }
}

/// A cable tray of `size` (long, wide) along x on arms from the wall, with cables in it.
fn tray(mesh: &mut Mesh, at: Pose, (long, wide): (f32, f32), rng: &mut Rng) {
    let rail = block(vec3(long, 0.07, 0.012), 0.002);
    for side in [-0.5, 0.5] {
        mesh.add(&rail, at.shift(0.0, 0.0, side * wide));
    }
    let n = (long / 0.22) as usize;
    let rung = block(vec3(0.03, 0.012, wide - 0.014), 0.002);
    let arm = block(vec3(0.04, 0.05, at.offset.z + 0.5 * wide), 0.004);
    for k in 0..n {
        let x = ((k as f32 + 0.5) / n as f32 - 0.5) * long;
        mesh.add(&rung, at.shift(x, 0.008, 0.0));
        if k % 6 == 2 && at.offset.z < 0.6 {
            mesh.add(&arm, at.shift(x + 0.1, -0.052, 0.5 * (wide - at.offset.z) - 0.25 * wide));
        }
    }
    for _ in 0..rng.count(3, 14) {
        let (r, z, layer) = (rng.range(0.005, 0.016), rng.spread(0.5 * wide - 0.03), rng.below(2) as f32);
        let (phase, sway) = (rng.angle(), rng.range(0.0, 0.03));
        let swing = |k: usize| {
            let t = k as f32 / 24.0;
            let side = (z + sway * turn(phase + 2.0 * t * TAU).x).clamp(r - 0.5 * wide, 0.5 * wide - r);
            vec3((t - 0.5) * long, 0.021 + r + 0.02 * layer, side)
        };
        let path: Vec<Vec3> = (0..=24).map(swing).collect();
        mesh.add(&tube(&path, &[r; 25], 8), at);
    }
}

/// Pipes on low supports over the floor, and a step of grating across them.
fn sleepers(mesh: &mut Mesh, hall: &Hall, style: &Style, rng: &mut Rng) {
    if rng.chance(0.25) {
        return;
    }
    let (low, from) = (rng.range(0.12, 0.35), rng.range(0.5, 0.9));
    let to = (from + rng.range(0.3, 1.1)).min(0.85 * hall.deep);
    let n = rng.count(2, 5);
    for k in 0..n {
        let x = ((k as f32 + 0.5) / n as f32 - 0.5) * 2.0 * hall.half;
        mesh.add(&block(vec3(0.12, low, to - from + 0.2), 0.012), Pose::at(x, 0.0, 0.5 * (from + to)));
    }
    let mut z = from;
    let mut highest = 0.0f32;
    while z < to {
        let r = style.radius * rng.range(0.6, 1.8);
        z += r;
        let mut corners = vec![vec3(-hall.half, low + r, z), vec3(hall.half, low + r, z)];
        if rng.chance(0.3) {
            let x = rng.spread(0.7 * hall.half);
            corners[1] = vec3(x, low + r, z);
            corners.push(vec3(x, rng.range(0.5, 0.95) * hall.height, z));
        }
        pipe(mesh, (&corners, r), style, rng);
        highest = highest.max(2.0 * r);
        z += r + rng.range(0.02, 0.12);
    }
    if rng.chance(0.6) {
        let (x, top, wide) = (rng.spread(0.6 * hall.half), low + 1.5 * highest + 0.1, rng.range(0.5, 0.8));
        let span = to - from + 0.5;
        let at = Pose::at(x, top, 0.5 * (from + to));
        mesh.add(&grating(vec2(wide, span), 0.035), at);
        for (sx, sz) in [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)] {
            let leg = block(vec3(0.04, top - 0.004, 0.04), 0.004);
            mesh.add(&leg, at.shift(sx * (wide + 0.05), -top, sz * (span - 0.05)));
        }
        for side in [-0.5, 0.5] {
            let edge = block(vec3(0.03, 0.08, span), 0.004);
            mesh.add(&edge, at.shift(side * (wide + 0.04), -0.075, 0.0));
        }
    }
}
