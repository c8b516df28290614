//! A car park: rows of cars, in part under a deck or a carport.

use super::mesh::{Mesh, Pose, turn};
use super::plants::tree;
use super::props::crate_of_slats;
use super::rng::Rng;
use super::shapes::{block, cuboid, cylinder, extrude, lathe, torus, tube};
use super::street::{litter_bin, railing, street_lamp};
use super::vehicle::car;
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Measures of the place (m).
struct Plan {
    /// A parking space: width and length.
    bay: Vec2,
    bays: usize,
    /// Half length of a row.
    half: f32,
    lane: f32,
    /// Share of the spaces that are taken.
    full: f32,
}

/// The car park; its rows lie along x.
pub(super) fn car_park(rng: &mut Rng) -> Mesh {
    let (bay, bays) = (vec2(rng.range(2.35, 2.75), rng.range(4.7, 5.3)), rng.count(5, 8));
    let half = 0.5 * bay.x * bays as f32;
    let plan = Plan { bay, bays, half, lane: rng.range(5.0, 6.6), full: rng.range(0.6, 1.0) };
    let rows = rng.count(2, 3);
    let island = rng.range(0.5, 2.2);
    let mut mesh = Mesh::default();
    let mut z = 0.0;
    let covered = rng.below(rows);
    for row in 0..rows {
        // Cars of the first row look to -z, those of the next over the lane to +z, and so on.
        let facing = if row % 2 == 0 { PI } else { 0.0 };
        let at = Pose::at(0.0, 0.0, z + 0.5 * bay.y).yaw(facing);
        spaces(&mut mesh, at, &plan, rng);
        match rng.below(3) {
            0 if row == covered => deck(&mut mesh, at, &plan, rng),
            1 if row == covered => carport(&mut mesh, at, &plan, rng),
            _ if row == covered && rng.chance(0.5) => carport(&mut mesh, at, &plan, rng),
            _ if row == covered => deck(&mut mesh, at, &plan, rng),
            _ => {}
        }
        z += bay.y;
        if row % 2 == 0 {
            z += plan.lane;
        } else {
            strip(&mut mesh, (z, island), &plan, rng);
            z += island;
        }
    }
    let (low, high) = (-rng.range(0.8, 2.0), z + rng.range(0.8, 2.0));
    strip(&mut mesh, (low, -low), &plan, rng);
    let ends = rng.range(1.5, 4.0);
    ground(&mut mesh, (vec2(-half - ends, low), vec2(half + ends, high)), rng);
    border(&mut mesh, (vec2(half + ends, low), high), rng);
    entrance(&mut mesh, vec2(half + 0.5 * ends, bay.y + 0.5 * plan.lane), plan.lane, rng);
    let lane = bay.y + 0.5 * plan.lane;
    for _ in 0..rng.count(1, 6) {
        let at = Pose::at(rng.spread(half), 0.0, lane + rng.spread(0.4 * plan.lane));
        mesh.add(&trolley(rng), at.yaw(rng.angle()));
    }
    mesh
}

/// Slabs of concrete with joints, between two corners.
fn ground(mesh: &mut Mesh, (lo, hi): (Vec2, Vec2), rng: &mut Rng) {
    let size = hi - lo;
    let middle = 0.5 * (lo + hi);
    mesh.add(&cuboid(vec3(size.x, 0.3, size.y)), Pose::at(middle.x, -0.32, middle.y));
    let n = (size / rng.range(1.6, 5.0)).ceil();
    let each = size / n;
    let slab = block(vec3(each.x - 0.012, 0.1, each.y - 0.012), 0.006);
    for (i, j) in (0..n.x as usize).flat_map(|i| (0..n.y as usize).map(move |j| (i, j))) {
        let p = lo + (vec2(i as f32, j as f32) + 0.5) * each;
        mesh.add(&slab, Pose::at(p.x, -0.1, p.y));
    }
}

/// A row of spaces about `at`, with lines, stops and cars that drive along +z of it.
fn spaces(mesh: &mut Mesh, at: Pose, plan: &Plan, rng: &mut Rng) {
    let (bay, stops) = (plan.bay, rng.below(3));
    let line = block(vec3(0.1, 0.004, bay.y - 0.1), 0.001);
    let stop = block(vec3(rng.range(1.2, 1.8), 0.11, 0.15), 0.03);
    let post = cylinder((0.055, 0.05), rng.range(0.5, 1.0), 16);
    let trolleys = rng.below(2 * plan.bays);
    for i in 0..=plan.bays {
        mesh.add(&line, at.shift(i as f32 * bay.x - plan.half, 0.0, 0.0));
    }
    for i in 0..plan.bays {
        let space = at.shift((i as f32 + 0.5) * bay.x - plan.half, 0.0, 0.0);
        match stops {
            0 => mesh.add(&stop, space.shift(0.0, 0.0, 0.5 * bay.y - 0.6)),
            1 => mesh.add(&post, space.shift(0.0, 0.0, 0.5 * bay.y - 0.15)),
            _ => {}
        }
        if i == trolleys {
            shelter(mesh, space, bay, rng);
        } else if rng.chance(plan.full) {
            let back = if rng.chance(0.3) { PI } else { 0.0 };
            let size = rng.range(0.92, 1.04);
            let at = space.shift(rng.spread(0.15), 0.0, rng.range(-0.25, 0.05));
            mesh.add(&car(rng), at.yaw(back + rng.spread(0.04)).scale(size));
        }
    }
}

/// A deck on columns over a row and part of the lane, with beams below and sometimes cars on it.
fn deck(mesh: &mut Mesh, at: Pose, plan: &Plan, rng: &mut Rng) {
    let (clear, thick) = (rng.range(2.1, 2.8), rng.range(0.2, 0.35));
    let (long, beam) = (2.0 * plan.half + 0.6, rng.range(0.25, 0.5));
    let deep = plan.bay.y + rng.range(0.2, 0.8) * plan.lane;
    // The far edge lies over the end of the spaces, the near one over the lane.
    let at = at.shift(0.0, 0.0, 0.5 * (plan.bay.y - deep) + 0.2);
    let top = clear + beam + thick;
    mesh.add(&block(vec3(long, thick, deep), 0.02), at.shift(0.0, clear + beam, 0.0));
    let (round, wide) = (rng.chance(0.4), rng.range(0.25, 0.45));
    let column = match round {
        true => cylinder((0.55 * wide, 0.55 * wide), clear + 0.02, 28),
        false => block(vec3(wide, clear + 0.02, wide), 0.025),
    };
    let step = rng.count(1, 2);
    for i in (0..=plan.bays).step_by(step) {
        let x = i as f32 * plan.bay.x - plan.half;
        let rib = block(vec3(0.28, beam + 0.02, deep - 0.3), 0.02);
        mesh.add(&rib, at.shift(x, clear, 0.0));
        for z in [-0.5, 0.5] {
            mesh.add(&column, at.shift(x, 0.0, z * (deep - 0.9)));
        }
    }
    for z in [-0.5, 0.0, 0.5] {
        let main = block(vec3(long - 0.3, 0.8 * beam, 0.2), 0.015);
        mesh.add(&main, at.shift(0.0, clear + 0.22 * beam, z * (deep - 0.9)));
    }
    for _ in 0..rng.count(1, 4) {
        let (r, z) = (rng.range(0.03, 0.09), rng.spread(0.45 * deep));
        let path = [vec3(-0.49 * long, 0.0, z), vec3(0.49 * long, 0.0, z)];
        mesh.add(&tube(&path, &[r; 2], 14), at.shift(0.0, clear - r, 0.0));
    }
    let solid = rng.chance(0.5);
    for (pose, wide) in [
        (at.shift(0.0, top, 0.5 * deep - 0.1), long - 0.02),
        (at.shift(0.0, top, 0.1 - 0.5 * deep), long - 0.02),
        (at.shift(0.5 * long - 0.1, top, 0.0).yaw(FRAC_PI_2), deep - 0.4),
        (at.shift(0.1 - 0.5 * long, top, 0.0).yaw(FRAC_PI_2), deep - 0.4),
    ] {
        let wall = block(vec3(wide, 1.0, 0.14), 0.015).at(Pose::at(0.0, -0.01, 0.0));
        mesh.add(&if solid { wall } else { railing(wide, rng) }, pose);
    }
    for k in 0..plan.bays / 2 {
        if rng.chance(0.5 * plan.full) {
            let x = (2.0 * k as f32 + 0.5) * plan.bay.x - plan.half;
            mesh.add(&car(rng), at.shift(x, top, 0.2).yaw(rng.spread(0.05)).scale(0.96));
        }
    }
}

/// A light roof on posts: purlins below sheets, level or sloped.
fn carport(mesh: &mut Mesh, at: Pose, plan: &Plan, rng: &mut Rng) {
    let (clear, slope, deep) = (rng.range(2.2, 2.7), rng.spread(0.12), plan.bay.y - 0.3);
    let one_sided = rng.chance(0.5);
    let post = block(vec3(0.12, clear + 0.3, 0.14), 0.01);
    let roof = at.shift(0.0, clear + 0.32, 0.0).pitch(slope);
    for i in 0..=plan.bays {
        let x = (i as f32 * plan.bay.x - plan.half).clamp(0.1 - plan.half, plan.half - 0.1);
        mesh.add(&block(vec3(0.1, 0.2, deep), 0.01), roof.shift(x, -0.12, 0.0));
        mesh.add(&post, at.shift(x, -slope * 0.4 * deep - 0.1, 0.4 * deep));
        if !one_sided {
            mesh.add(&post, at.shift(x, slope * 0.4 * deep - 0.1, -0.4 * deep));
        } else {
            let strut = [vec3(x, 0.55 * clear, 0.4 * deep), vec3(x, clear + 0.2, -0.1 * deep)];
            mesh.add(&tube(&strut, &[0.05; 2], 10), at);
        }
    }
    let n = rng.count(4, 8);
    for k in 0..n {
        let z = ((k as f32 + 0.5) / n as f32 - 0.5) * (deep + 0.2);
        mesh.add(&block(vec3(2.0 * plan.half + 0.3, 0.1, 0.06), 0.006), roof.shift(0.0, 0.075, z));
    }
    let (waves, long) = (rng.count(20, 34), 2.0 * plan.half + 0.5);
    let wave = |k: usize| vec2((k as f32 / (2 * waves) as f32 - 0.5) * long, 0.05 * (k % 2) as f32);
    let mut outline: Vec<Vec2> = (0..=2 * waves).map(wave).collect();
    outline.extend((0..=2 * waves).rev().map(|k| wave(k) + vec2(0.0, 0.012)));
    mesh.add(&extrude(&outline, deep + 0.4, 0.0), roof.shift(0.0, 0.18, 0.0));
}

/// A strip between kerbs behind a row: trees, bollards, lamps, bins, or bare. It starts at `z`.
fn strip(mesh: &mut Mesh, (z, wide): (f32, f32), plan: &Plan, rng: &mut Rng) {
    let at = Pose::at(0.0, 0.0, z + 0.5 * wide);
    let stones = (2.0 * plan.half / 1.0) as usize;
    let each = 2.0 * plan.half / stones as f32;
    let kerb = block(vec3(each - 0.008, 0.3, 0.14), 0.015);
    for i in 0..stones {
        let x = (i as f32 + 0.5) * each - plan.half;
        for side in [-1.0, 1.0] {
            mesh.add(&kerb, at.shift(x, -0.17, side * 0.5 * (wide - 0.16)));
        }
    }
    if wide > 0.5 {
        mesh.add(&cuboid(vec3(2.0 * plan.half - 0.02, 0.1, wide - 0.32)), at.shift(0.0, 0.01, 0.0));
    }
    let (plant, lamp, bin) = (tree(rng.range(2.5, 4.5), 350, rng), street_lamp(rng), litter_bin(rng));
    let bollard = lathe(
        &[Vec2::ZERO, vec2(0.09, 0.0), vec2(0.08, 0.7), vec2(0.1, 0.76), vec2(0.06, 0.86), vec2(0.0, 0.88)],
        18,
    );
    let mut x = -plan.half + rng.range(0.4, 2.5);
    while x < plan.half - 0.3 {
        let spot = at.shift(x, 0.1, 0.0).yaw(rng.angle());
        match rng.below(7) {
            0 => mesh.add(&plant, spot.scale(rng.range(0.7, 1.1))),
            1 => mesh.add(&lamp, spot),
            2 => mesh.add(&bin, spot),
            3 => mesh.add(&crate_of_slats(vec3(0.5, 0.3, 0.4), rng), spot.shift(0.0, 0.01, 0.0)),
            _ => mesh.add(&bollard, spot),
        }
        x += rng.range(1.2, 4.0);
    }
}

/// Railings, a wall or nothing along the edges at +-`corner.x`, and at the far end.
fn border(mesh: &mut Mesh, (corner, far): (Vec2, f32), rng: &mut Rng) {
    let (long, middle) = (far - corner.y, 0.5 * (far + corner.y));
    let style = rng.below(4);
    for (at, wide) in [
        (Pose::at(0.12 - corner.x, 0.0, middle).yaw(FRAC_PI_2), long - 0.5),
        (Pose::at(0.0, 0.0, far - 0.12), 2.0 * corner.x - 0.5),
        (Pose::at(0.0, 0.0, corner.y + 0.12), 2.0 * corner.x - 0.5),
    ] {
        match style {
            0 => mesh.add(&railing(wide, rng), at),
            1 => {
                mesh.add(&block(vec3(wide, rng.range(0.5, 2.2), 0.2), 0.02), at.shift(0.0, -0.01, 0.0));
            }
            2 => crash_barrier(mesh, at, wide),
            _ => {}
        }
    }
}

/// A rail with a fold on short posts.
fn crash_barrier(mesh: &mut Mesh, at: Pose, long: f32) {
    let side = [(0.0, 0.0), (0.05, 0.06), (0.0, 0.12), (0.0, 0.18), (0.05, 0.24), (0.0, 0.3)];
    let mut outline: Vec<Vec2> = side.iter().map(|(x, y)| vec2(*x, *y)).collect();
    outline.extend(side.iter().rev().map(|(x, y)| vec2(x - 0.01, *y)));
    let rail = extrude(&outline, long, 0.0);
    mesh.add(&rail, at.shift(0.0, 0.45, 0.08).yaw(FRAC_PI_2));
    let n = (long / 2.0) as usize;
    for k in 0..n {
        let x = ((k as f32 + 0.5) / n as f32 - 0.5) * long;
        mesh.add(&block(vec3(0.1, 0.76, 0.1), 0.01), at.shift(x, -0.02, 0.0));
    }
}

/// A barrier with a ticket machine on a small island beside the lane's end.
fn entrance(mesh: &mut Mesh, at: Vec2, lane: f32, rng: &mut Rng) {
    let at = Pose::at(at.x, 0.0, at.y);
    mesh.add(&block(vec3(1.6, 0.24, 0.6), 0.04), at.shift(0.0, -0.1, 0.0));
    mesh.add(&block(vec3(0.3, 1.0, 0.3), 0.02), at.shift(0.4, 0.13, 0.0));
    let raised = if rng.chance(0.5) { 0.0 } else { rng.range(0.5, 1.4) };
    let boom = at.shift(0.4, 1.0, 0.2);
    for (side, long) in [(1.0, 0.5 * lane - 0.3), (-1.0, 0.25 * lane)] {
        let arm = tube(&[vec3(0.0, 0.0, -0.2), vec3(0.0, 0.0, long)], &[0.04; 2], 12);
        if side > 0.0 || rng.chance(0.3) {
            mesh.add(&arm, boom.shift(0.0, 0.0, -0.2).stretch(1.0, 1.0, side).pitch(-raised));
        }
    }
    let machine = block(vec3(0.34, rng.range(1.1, 1.5), 0.3), 0.03);
    mesh.add(&machine, at.shift(-0.45, 0.13, 0.0));
    mesh.add(&block(vec3(0.42, 0.05, 0.4), 0.01), at.shift(-0.45, 0.12 + machine.extent().1.y, 0.03));
    mesh.add(&block(vec3(0.2, 0.14, 0.02), 0.004), at.shift(-0.45, 1.0, 0.155));
}

/// Rows of trolleys pushed into each other, under a roof of bent bars.
fn shelter(mesh: &mut Mesh, at: Pose, bay: Vec2, rng: &mut Rng) {
    let part = trolley(rng);
    for x in [-0.45, 0.45] {
        let n = rng.count(2, 8);
        for k in 0..n {
            mesh.add(&part, at.shift(x, 0.0, 0.45 * bay.y - 0.6 - 0.24 * k as f32).yaw(rng.spread(0.02)));
        }
    }
    for k in 0..4 {
        let z = (k as f32 / 3.0 - 0.5) * (bay.y - 0.6);
        let bend = |i: usize| {
            let t = turn(i as f32 / 12.0 * PI);
            vec3(1.02 * t.x, 1.55 + 0.6 * t.y, z)
        };
        let mut path: Vec<Vec3> = vec![vec3(1.02, 0.0, z)];
        path.extend((0..=12).map(bend));
        path.push(vec3(-1.02, 0.0, z));
        mesh.add(&tube(&path, &[0.025; 15], 10), at);
    }
    for y in [0.3, 0.7] {
        for x in [-1.02, 1.02] {
            let rail = [vec3(x, y, -0.5 * bay.y + 0.3), vec3(x, y, 0.5 * bay.y - 0.3)];
            mesh.add(&tube(&rail, &[0.018; 2], 8), at);
        }
    }
    let sheet = block(vec3(1.3, 0.01, bay.y - 0.5), 0.002);
    mesh.add(&sheet, at.shift(0.0, 2.18, 0.0));
}

/// A shopping trolley that is pushed along +z.
fn trolley(rng: &mut Rng) -> Mesh {
    let (high, long) = (rng.range(0.95, 1.05), rng.range(0.7, 0.9));
    let mut mesh = Mesh::default();
    let bar =
        |a: Vec3, b: Vec3, r: f32, mesh: &mut Mesh| mesh.add(&tube(&[a, b], &[r; 2], 6), Pose::IDENTITY);
    // Half widths of the basket: below and above, at the handle and at the nose.
    let corner = |x: f32, y: f32, z: f32| {
        let nose = 0.5 + z / long;
        vec3(
            x * (0.29 - 0.07 * nose) * (0.8 + 0.2 * y),
            0.45 + 0.05 * nose + y * (high - 0.5 - 0.1 * nose),
            z,
        )
    };
    for k in 0..=8 {
        let z = (k as f32 / 8.0 - 0.5) * long;
        for x in [-1.0, 1.0] {
            bar(corner(x, 0.0, z), corner(x, 1.0, z), 0.004, &mut mesh);
        }
        bar(corner(-1.0, 0.0, z), corner(1.0, 0.0, z), 0.004, &mut mesh);
    }
    for k in 0..=4 {
        let y = k as f32 / 4.0;
        for x in [-1.0, 1.0] {
            bar(corner(x, y, -0.5 * long), corner(x, y, 0.5 * long), 0.005, &mut mesh);
        }
        bar(corner(-1.0, y, 0.5 * long), corner(1.0, y, 0.5 * long), 0.005, &mut mesh);
    }
    bar(vec3(-0.3, high, -0.5 * long - 0.08), vec3(0.3, high, -0.5 * long - 0.08), 0.015, &mut mesh);
    let caster = torus(0.05, 0.02, super::shapes::Segments { around: 14, across: 6 });
    for x in [-0.24, 0.24] {
        bar(vec3(x, 0.14, 0.45 * long), vec3(x, 0.12, -0.5 * long), 0.012, &mut mesh);
        bar(vec3(x, 0.12, -0.5 * long), vec3(1.25 * x, high, -0.5 * long - 0.08), 0.012, &mut mesh);
        for z in [-0.45, 0.42] {
            mesh.add(&caster, Pose::at(x, 0.07, z * long).roll(FRAC_PI_2));
        }
    }
    mesh
}
