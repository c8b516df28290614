//! The inside of a ship or station: panels on panels, ribs, pipes, grates.

use super::machine::{bolt, rounded};
use super::mesh::{Mesh, Pose, turn};
use super::rng::Rng;
use super::shapes::{block, cuboid, cylinder, extrude, inset, ring, tube};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// A corridor along z with bays between ribs, a door at each end.
pub(super) fn corridor(rng: &mut Rng) -> Mesh {
    let (wide, high) = (rng.range(1.1, 1.9), rng.range(2.4, 3.2));
    let (cut_low, cut_high) = (rng.range(0.1, 0.6), rng.range(0.2, 0.9));
    let outline = [
        vec2(-wide + cut_low, 0.0),
        vec2(wide - cut_low, 0.0),
        vec2(wide, cut_low),
        vec2(wide, high - cut_high),
        vec2(wide - cut_high, high),
        vec2(cut_high - wide, high),
        vec2(-wide, high - cut_high),
        vec2(-wide, cut_low),
    ];
    let (bays, bay) = (rng.count(4, 7), rng.range(1.6, 2.6));
    let long = bays as f32 * bay;
    let mut mesh = Mesh::default();
    let kinds: Vec<u64> = (0..2).map(|_| rng.below(1 << 30) as u64).collect();
    for b in 0..bays {
        let z = (b as f32 + 0.5) * bay - 0.5 * long;
        for k in 0..8 {
            let (a, c) = (outline[k], outline[(k + 1) % 8]);
            let middle = (0.5 * (a + c)).extend(z);
            let size = vec2(a.distance(c), bay);
            let along = (c - a).normalize_or(Vec2::X);
            let turned =
                Pose::at(middle.x, middle.y, middle.z).roll(libm::atan2f(along.y, along.x)).pitch(-FRAC_PI_2);
            let mut style =
                Rng::new(kinds[b % kinds.len()] + if k == 0 { 0 } else { [1, 2, 3, 4, 3, 2, 1][k - 1] });
            let part = if k == 0 { grate(size, &mut style) } else { greebles(size, &mut style) };
            mesh.add(&part, turned.shift(0.0, -0.5 * bay, 0.0));
        }
    }
    ribs(&mut mesh, (&outline, bays, bay), rng);
    pipes(&mut mesh, (vec2(wide, high), long, cut_high), rng);
    for side in [-1.0, 1.0] {
        let at = Pose::at(0.0, 0.0, side * 0.5 * long).yaw(if side > 0.0 { PI } else { 0.0 });
        mesh.add(&bulkhead(&outline, rng), at);
    }
    for _ in 0..rng.count(3, 8) {
        let size = vec3(rng.range(0.3, 0.6), rng.range(0.25, 0.6), rng.range(0.3, 0.8));
        let side = *rng.pick(&[-1.0, 1.0]);
        let x = side * (wide - cut_low - 0.4 * size.x - 0.15).max(0.2);
        let at = Pose::at(x, 0.05, rng.spread(0.45 * long)).yaw(rng.spread(0.3));
        mesh.add(&container(size, rng), at);
    }
    mesh
}

/// A panel field of `size` (x, y) facing +z, split again and again, its parts raised, sunk or slotted.
fn greebles(size: Vec2, rng: &mut Rng) -> Mesh {
    let mut mesh = cuboid(size.extend(0.1)).at(Pose::at(0.0, 0.0, -0.11));
    split(&mut mesh, (vec2(-0.5 * size.x, 0.0), vec2(0.5 * size.x, size.y)), 5, rng);
    mesh
}

/// Splits the rectangle between two corners, and fills what is small enough.
fn split(mesh: &mut Mesh, (lo, hi): (Vec2, Vec2), depth: usize, rng: &mut Rng) {
    let size = hi - lo;
    let small = size.max_element() < 0.24 || depth == 0;
    if small || (depth < 4 && rng.chance(0.32)) {
        return cell(mesh, (lo, size), rng);
    }
    let cut = rng.range(0.3, 0.7);
    let at = if size.x > size.y { vec2(lo.x + cut * size.x, hi.y) } else { vec2(hi.x, lo.y + cut * size.y) };
    let other = if size.x > size.y { vec2(at.x, lo.y) } else { vec2(lo.x, at.y) };
    split(mesh, (lo, at), depth - 1, rng);
    split(mesh, (other, hi), depth - 1, rng);
}

/// One plate with its details.
fn cell(mesh: &mut Mesh, (lo, size): (Vec2, Vec2), rng: &mut Rng) {
    let gap = 0.008;
    let plate = size - gap;
    if plate.min_element() < 0.02 {
        return;
    }
    let at = Pose::at(lo.x + 0.5 * size.x, lo.y + 0.5 * gap, -0.03);
    let raise = *rng.pick(&[0.0, 0.005, 0.02, 0.04, -0.02]);
    if raise < 0.0 && plate.min_element() > 0.1 {
        let rim = 0.025;
        mesh.add(&super::architecture::frame(plate - 2.0 * rim, vec2(rim, 0.05)), at.shift(0.0, rim, 0.0));
        let slats = ((plate.y - 2.0 * rim) / 0.035) as usize;
        for k in 0..slats {
            let slat = block(vec3(plate.x - 2.0 * rim, 0.005, 0.03), 0.001);
            mesh.add(&slat, at.shift(0.0, rim + (k as f32 + 0.5) * 0.035, -0.005).pitch(0.5));
        }
        return;
    }
    mesh.add(&block(plate.extend(0.05 + raise), 0.005), at.shift(0.0, 0.0, 0.5 * raise.max(0.0)));
    let face = at.shift(0.0, 0.0, 0.025 + raise.max(0.0));
    if plate.min_element() < 0.08 {
        return;
    }
    detail(mesh, face, (plate, rng));
}

/// What sits on a plate whose lower edge is at `face`.
fn detail(mesh: &mut Mesh, face: Pose, (plate, rng): (Vec2, &mut Rng)) {
    match rng.below(8) {
        0 => mesh.add(&block((plate * 0.6).extend(0.03), 0.006), face.shift(0.0, 0.2 * plate.y, 0.0)),
        1 => {
            let r = 0.3 * plate.min_element();
            let circle: Vec<Vec2> = (0..24).map(|k| turn(k as f32 / 24.0 * TAU) * r).collect();
            mesh.add(&super::machine::bored(&circle, 0.7 * r, 0.03), face.shift(0.0, 0.5 * plate.y, 0.0));
            mesh.add(
                &cylinder((0.4 * r, 0.35 * r), 0.02, 20),
                face.shift(0.0, 0.5 * plate.y, 0.0).pitch(FRAC_PI_2),
            );
        }
        2 => {
            let n = rng.count(2, 5);
            for k in 0..n {
                let x = ((k as f32 + 0.5) / n as f32 - 0.5) * 0.8 * plate.x;
                mesh.add(
                    &block(vec3(0.4 * plate.x / n as f32, 0.7 * plate.y, 0.02), 0.004),
                    face.shift(x, 0.15 * plate.y, 0.0),
                );
            }
        }
        3 => {
            let (y, half) = (0.5 * plate.y, 0.35 * plate.x);
            let path = rounded(
                &[vec3(-half, y, 0.0), vec3(-half, y, 0.05), vec3(half, y, 0.05), vec3(half, y, 0.0)],
                0.02,
            );
            mesh.add(&tube(&path, &vec![0.01; path.len()], 8), face);
        }
        4 | 5 => {
            let head = bolt(0.022);
            for (x, y) in [(-1.0, 0.02), (1.0, 0.02), (-1.0, plate.y - 0.02), (1.0, plate.y - 0.02)] {
                mesh.add(&head, face.shift(x * (0.5 * plate.x - 0.02), y, 0.0));
            }
        }
        _ => {}
    }
}

/// A floor grate of `size` over a dark duct.
fn grate(size: Vec2, rng: &mut Rng) -> Mesh {
    let side = 0.5 * size.x * rng.range(0.4, 0.8);
    let mut mesh = cuboid(size.extend(0.05)).at(Pose::at(0.0, 0.0, -0.3));
    for s in [-1.0, 1.0] {
        let plank = vec2(0.5 * size.x - side, size.y - 0.01);
        mesh.add(&block(plank.extend(0.3), 0.006), Pose::at(s * (side + 0.5 * plank.x), 0.005, -0.15));
    }
    let n = (size.y / 0.06) as usize;
    let bar = block(vec3(2.0 * side, 0.012, 0.04), 0.002);
    for k in 0..n {
        mesh.add(&bar, Pose::at(0.0, (k as f32 + 0.5) / n as f32 * size.y - 0.006, -0.022));
    }
    for k in 0..5 {
        let x = (k as f32 / 4.0 - 0.5) * 1.98 * side;
        mesh.add(&block(vec3(0.012, size.y - 0.01, 0.035), 0.002), Pose::at(x, 0.005, -0.026));
    }
    mesh
}

/// Frames between the bays, with bolts.
fn ribs(mesh: &mut Mesh, (outline, bays, bay): (&[Vec2], usize, f32), rng: &mut Rng) {
    let (thick, deep) = (rng.range(0.08, 0.2), rng.range(0.15, 0.35));
    let inner = inset(outline, thick);
    let outer = inset(outline, -0.12);
    let rib = ring(&outer, &inner, (deep, 0.02));
    let slim = ring(&outer, &inset(outline, 1.35 * thick), (0.35 * deep, 0.01));
    let head = bolt(0.04);
    for b in 0..=bays {
        let at = Pose::at(0.0, 0.0, (b as f32 - 0.5 * bays as f32) * bay);
        mesh.add(&rib, at);
        mesh.add(&slim, at);
        for k in 1..8 {
            let (a, c) = (inner[k], inner[(k + 1) % 8]);
            for t in [0.25, 0.75] {
                let p = a.lerp(c, t) + (outline[k] - a) * 0.5;
                mesh.add(&head, at.shift(p.x, p.y, 0.5 * deep));
                mesh.add(&head, at.shift(p.x, p.y, -0.5 * deep).yaw(PI));
            }
        }
    }
}

/// Pipes and cable bundles under the ceiling and along the walls.
fn pipes(mesh: &mut Mesh, (half, long, cut): (Vec2, f32, f32), rng: &mut Rng) {
    for _ in 0..rng.count(3, 8) {
        let r = rng.range(0.02, 0.08);
        let side = *rng.pick(&[-1.0, 1.0]);
        let x = side * rng.range(0.2, 0.95) * (half.x - cut);
        let y = half.y - rng.range(0.06, 0.2) - r;
        let path = [vec3(x, y, -0.5 * long), vec3(x, y, 0.5 * long)];
        mesh.add(&tube(&path, &[r; 2], 18), Pose::IDENTITY);
        let n = (long / rng.range(0.6, 1.6)) as usize;
        for k in 0..n {
            let z = ((k as f32 + 0.5) / n as f32 - 0.5) * long;
            mesh.add(&cylinder((1.3 * r, 1.3 * r), 0.8 * r, 18), Pose::at(x, y, z).pitch(FRAC_PI_2));
            mesh.add(&block(vec3(0.4 * r, half.y - y, 0.4 * r), 0.002), Pose::at(x, y, z + 0.5 * r));
        }
    }
    for _ in 0..rng.count(2, 6) {
        let side = *rng.pick(&[-1.0, 1.0]);
        let (y, sag) = (rng.range(0.5, 0.8) * half.y, rng.range(0.05, 0.3));
        let n = 60;
        let waves = rng.range(2.0, 5.0);
        let at = |i: usize| {
            let t = i as f32 / n as f32;
            let dip = turn(t * waves * TAU).y;
            vec3(side * (half.x - 0.05), y - sag * dip * dip, (t - 0.5) * long)
        };
        let path: Vec<Vec3> = (0..=n).map(at).collect();
        mesh.add(&tube(&path, &vec![rng.range(0.012, 0.03); n + 1], 10), Pose::IDENTITY);
    }
}

/// A wall across the corridor with a sliding door; its front towards +z.
fn bulkhead(outline: &[Vec2], rng: &mut Rng) -> Mesh {
    let mut mesh = extrude(&inset(outline, -0.1), 0.2, 0.0).at(Pose::at(0.0, 0.0, -0.11));
    let (w, h, c) = (rng.range(0.5, 0.7), rng.range(1.9, 2.15), rng.range(0.1, 0.3));
    let shape =
        [vec2(-w, 0.0), vec2(w, 0.0), vec2(w, h - c), vec2(w - c, h), vec2(c - w, h), vec2(-w, h - c)];
    mesh.add(&ring(&inset(&shape, -0.14), &shape, (0.24, 0.02)), Pose::at(0.0, 0.02, 0.05));
    for side in [-1.0, 1.0] {
        let leaf = greebles(vec2(w - 0.02, h - c - 0.05), &mut rng.clone());
        mesh.add(&leaf, Pose::at(side * 0.5 * w, 0.05, 0.06));
    }
    mesh
}

/// A bevelled container with corner guards and a latch.
fn container(size: Vec3, rng: &mut Rng) -> Mesh {
    let mut mesh = block(size, 0.03);
    let guard = block(vec3(0.07, 0.07, 0.07), 0.012);
    for k in 0..8 {
        let s = vec3((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32) - 0.5;
        let p = s * (size - 0.05);
        mesh.add(&guard, Pose::at(p.x, p.y + 0.5 * size.y - 0.035, p.z));
    }
    let lid = rng.range(0.6, 0.85) * size.y;
    for (x, z) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let strip = vec3(
            if x == 0.0 { size.x - 0.1 } else { 0.02 },
            0.03,
            if z == 0.0 { size.z - 0.1 } else { 0.02 },
        );
        mesh.add(&block(strip, 0.004), Pose::at(x * 0.5 * size.x, lid, z * 0.5 * size.z));
    }
    mesh
}
