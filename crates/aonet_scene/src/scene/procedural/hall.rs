//! A hall with rows of columns, arches or beams, and a vaulted or coffered ceiling.

use super::architecture::{column, floor, trim_around, trim_profile, wall};
use super::mesh::{Mesh, Pose, turn};
use super::rng::Rng;
use super::shapes::{block, cuboid, extrude, surface};
use glam::{Vec2, vec2, vec3};
use std::f32::consts::PI;

/// Measures of a hall: columns stand at (i + 0.5) * bay along z and at +-aisle along x.
struct Measures {
    half: Vec2,
    height: f32,
    bay: f32,
    bays: usize,
    aisle: f32,
    radius: f32,
}

/// The hall along z.
pub(super) fn hall(rng: &mut Rng) -> Mesh {
    let radius = rng.range(0.22, 0.5);
    let bay = radius * rng.range(6.0, 11.0);
    let bays = rng.count(4, 8);
    let aisle = radius * rng.range(4.0, 8.0);
    let side = radius * rng.range(4.0, 8.0);
    let height = (aisle + side) * rng.range(0.8, 1.3);
    let half = vec2(aisle + side, 0.5 * bay * bays as f32);
    let measures = Measures { half, height, bay, bays, aisle, radius };
    let mut mesh = floor(half, &mut rng.fork());
    shell(&mut mesh, &measures, &mut rng.fork());
    let shaft = column(height * 0.7, radius, &mut rng.fork());
    let arches = rng.chance(0.7);
    for (i, sx) in (0..bays).flat_map(|i| [(i, -1.0), (i, 1.0)]) {
        let z = (i as f32 + 0.5) * bay - half.y;
        mesh.add(&shaft, Pose::at(sx * aisle, 0.0, z));
    }
    for sx in [-1.0, 1.0] {
        arcade(&mut mesh, &measures, sx * aisle, arches);
    }
    ceiling(&mut mesh, &measures, rng);
    furnish(&mut mesh, &measures, rng);
    mesh
}

/// Outer walls with window holes or niches, skirting and string course.
fn shell(mesh: &mut Mesh, measures: &Measures, rng: &mut Rng) {
    let (half, height, thick) = (measures.half, measures.height, 0.5);
    let (low, high, wide) = (rng.range(0.1, 0.35), rng.range(0.5, 0.65), rng.range(0.2, 0.5));
    let window = |x: f32| {
        let w = 0.5 * wide * measures.bay;
        (vec2(x - w, low * height), vec2(x + w, high * height))
    };
    let holes: Vec<_> =
        (0..measures.bays).map(|i| window((i as f32 + 0.5) * measures.bay - half.y)).collect();
    let long = wall(vec3(2.0 * half.y + 2.0 * thick, height, thick), &holes);
    for sx in [-1.0, 1.0] {
        let pose = Pose::at(sx * (half.x + 0.5 * thick), 0.0, 0.0).yaw(-sx * 0.5 * PI);
        mesh.add(&long, pose);
        for (lo, hi) in &holes {
            let size = *hi - *lo;
            let middle = 0.5 * (lo.x + hi.x);
            let fitting = super::architecture::window(size, thick, &mut rng.clone());
            mesh.add(&fitting, pose.shift(middle, lo.y, 0.0));
        }
    }
    let gate = rng.range(1.2, 2.4);
    let door = (vec2(-0.5 * gate, 0.0), vec2(0.5 * gate, gate * rng.range(1.3, 1.9)));
    for (sz, holes) in [(-1.0, vec![]), (1.0, vec![door])] {
        let end = wall(vec3(2.0 * half.x, height, thick), &holes);
        let pose = Pose::at(0.0, 0.0, sz * (half.y + 0.5 * thick)).yaw(if sz > 0.0 { PI } else { 0.0 });
        mesh.add(&end, pose);
    }
    let skirting = trim_profile(rng.range(0.15, 0.4), 0.06, rng);
    mesh.add(&trim_around(half, 0.0, &skirting), Pose::IDENTITY);
    let course = trim_profile(rng.range(0.15, 0.3), rng.range(0.08, 0.2), rng);
    let down: Vec<Vec2> = course.iter().rev().map(|p| vec2(p.x, -p.y)).collect();
    mesh.add(&trim_around(half, 0.72 * height, &down), Pose::IDENTITY);
}

/// Arches or a beam over one row of columns.
fn arcade(mesh: &mut Mesh, measures: &Measures, x: f32, arches: bool) {
    let (spring, top) = (0.7 * measures.height, measures.height);
    let depth = 1.6 * measures.radius;
    if !arches {
        let beam = block(vec3(depth, 0.3 * top, 2.0 * measures.half.y), 0.02);
        mesh.add(&beam, Pose::at(x, spring, 0.0));
        return;
    }
    let reach = (0.5 * measures.bay - measures.radius).min(0.9 * (top - spring));
    let mut outline = vec![vec2(0.5 * measures.bay, 0.0), vec2(0.5 * measures.bay, top - spring)];
    outline.extend([vec2(-0.5 * measures.bay, top - spring), vec2(-0.5 * measures.bay, 0.0)]);
    let arc =
        |shrink: f32| (0..=24).map(move |k| vec2(-1.0, 1.0) * turn(k as f32 / 24.0 * PI) * (reach - shrink));
    outline.extend(arc(0.0));
    let span = extrude(&outline, depth, 0.0);
    let mut band: Vec<Vec2> = arc(0.12 * measures.radius).rev().collect();
    band.extend(arc(-0.35 * measures.radius).map(|p| p + vec2(0.0, 0.001)));
    band.reverse();
    let ring = extrude(&band, depth * 1.12, 0.02);
    for i in 0..measures.bays - 1 {
        let pose = Pose::at(x, spring, (i as f32 + 1.0) * measures.bay - measures.half.y).yaw(0.5 * PI);
        mesh.add(&span, pose);
        mesh.add(&ring, pose);
    }
    for sz in [-1.0, 1.0] {
        let stub = cuboid(vec3(depth, top - spring, 0.5 * measures.bay));
        mesh.add(&stub, Pose::at(x, spring, sz * (measures.half.y - 0.25 * measures.bay)));
    }
}

/// A barrel vault with ribs, a coffered ceiling, or beams under a flat one.
fn ceiling(mesh: &mut Mesh, measures: &Measures, rng: &mut Rng) {
    let (half, height) = (measures.half, measures.height);
    let lid = cuboid(vec3(2.0 * half.x + 1.0, 0.3, 2.0 * half.y + 1.0));
    match rng.below(3) {
        0 => vault(mesh, measures, rng),
        1 => {
            mesh.add(&lid, Pose::at(0.0, height, 0.0));
            let n = rng.count(5, 9);
            let (deep, wide) = (rng.range(0.15, 0.35), rng.range(0.12, 0.25));
            let step = 2.0 * half.x / n as f32;
            for i in 1..n {
                let beam = block(vec3(wide, deep, 2.0 * half.y), 0.02);
                mesh.add(&beam, Pose::at(i as f32 * step - half.x, height - deep, 0.0));
            }
            for j in 1..(2.0 * half.y / step) as usize {
                let beam = block(vec3(2.0 * half.x, 0.8 * deep, wide), 0.02);
                mesh.add(&beam, Pose::at(0.0, height - 0.8 * deep, j as f32 * step - half.y));
            }
        }
        _ => {
            mesh.add(&lid, Pose::at(0.0, height, 0.0));
            for i in 0..2 * measures.bays {
                let beam = block(vec3(2.0 * half.x, 0.35, 0.22), 0.02);
                mesh.add(&beam, Pose::at(0.0, height - 0.35, (i as f32 + 0.5) * 0.5 * measures.bay - half.y));
            }
        }
    }
}

/// A barrel vault over the nave with ribs, flat ceilings over the aisles.
fn vault(mesh: &mut Mesh, measures: &Measures, rng: &mut Rng) {
    let (half, height) = (measures.half, measures.height);
    let rise = rng.range(0.5, 1.0) * measures.aisle;
    let shell = |r: f32, long: f32| {
        surface((2, 40), move |u, v| {
            let t = turn(v * PI);
            vec3(r * t.x * measures.aisle, r * t.y * rise, (u - 0.5) * long)
        })
    };
    mesh.add(&shell(1.0, 2.0 * half.y), Pose::at(0.0, height, 0.0));
    let half_oval = (0..=32).map(|k| turn(k as f32 / 32.0 * PI) * vec2(measures.aisle + 0.1, rise + 0.1));
    let tympanum = extrude(&half_oval.collect::<Vec<_>>(), 0.4, 0.0);
    for side in [-1.0, 1.0] {
        mesh.add(&tympanum, Pose::at(0.0, height, side * (half.y + 0.2)));
    }
    let roof = cuboid(vec3(2.0 * half.x + 1.0, 0.3, 2.0 * half.y + 1.0));
    mesh.add(&roof, Pose::at(0.0, height + rise + 0.2, 0.0));
    for i in 0..measures.bays {
        let z = (i as f32 + 0.5) * measures.bay - half.y;
        let arc = |shrink: f32| {
            (0..=32).map(move |k| turn(k as f32 / 32.0 * PI) * vec2(measures.aisle - shrink, rise - shrink))
        };
        let mut rib: Vec<Vec2> = arc(-0.05).collect();
        rib.extend(arc(0.5 * measures.radius).rev());
        mesh.add(&extrude(&rib, 0.7 * measures.radius, 0.02), Pose::at(0.0, height, z));
    }
    let side = half.x - measures.aisle;
    for sx in [-1.0, 1.0] {
        let flat = cuboid(vec3(side + 0.3, 0.3, 2.0 * half.y + 1.0));
        mesh.add(&flat, Pose::at(sx * (measures.aisle + 0.5 * side + 0.15), height, 0.0));
    }
}

/// Benches, steps at the far end, urns.
fn furnish(mesh: &mut Mesh, measures: &Measures, rng: &mut Rng) {
    let steps = rng.count(2, 5);
    for i in 0..steps {
        let deep = measures.bay * 0.9 - i as f32 * 0.32;
        let step = block(vec3(2.0 * measures.aisle - 3.2 * measures.radius, 0.16, deep), 0.015);
        mesh.add(&step, Pose::at(0.0, i as f32 * 0.16, -measures.half.y + 0.5 * deep));
    }
    let urn = super::props::vessel(0.3, rng.range(0.7, 1.2), rng);
    let stand = block(vec3(0.5, 0.5, 0.5), 0.03);
    let bench = super::furniture::table(vec3(1.8, 0.45, 0.45), rng);
    for i in 0..measures.bays {
        let z = (i as f32 + 0.5) * measures.bay - measures.half.y;
        for sx in [-1.0, 1.0] {
            let x = sx * (measures.half.x - 0.5);
            if rng.chance(0.5) {
                mesh.add(&stand, Pose::at(x, 0.0, z));
                mesh.add(&urn, Pose::at(x, 0.5, z));
            } else if rng.chance(0.6) {
                mesh.add(&bench, Pose::at(x, 0.0, z).yaw(0.5 * PI));
            }
        }
    }
}
