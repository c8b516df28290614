//! A street between rows of houses, with cars, lamps, trees and what else stands about.

use super::architecture::{door, wall, window};
use super::mesh::{Mesh, Pose, turn};
use super::plants::tree;
use super::rng::Rng;
use super::shapes::{ball, block, cuboid, cylinder, extrude, lathe, tube};
use super::vehicle::car;
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// The street along z.
pub(super) fn street(rng: &mut Rng) -> Mesh {
    let (long, road, walk) = (rng.range(36.0, 54.0), rng.range(2.6, 4.2), rng.range(1.8, 3.4));
    let mut mesh = ground(long, road, walk);
    let front = road + walk;
    for side in [-1.0, 1.0] {
        let mut z = -0.5 * long;
        while z < 0.5 * long - 4.0 {
            let wide = rng.range(5.5, 12.0).min(0.5 * long - z);
            let house = house(vec2(wide, rng.range(6.0, 10.0)), rng.count(2, 5), &mut rng.fork());
            let back = if rng.chance(0.2) { rng.range(0.2, 0.8) } else { 0.0 };
            mesh.add(&house, Pose::at(side * (front + back), 0.14, z + 0.5 * wide).yaw(-side * FRAC_PI_2));
            z += wide + if rng.chance(0.2) { rng.range(0.5, 3.0) } else { 0.0 };
        }
    }
    parked(&mut mesh, (long, road), rng);
    furniture(&mut mesh, (long, road, walk), rng);
    for k in 0..rng.count(1, 5) {
        let z = (k as f32 * 0.21 - 0.4) * long;
        let y = rng.range(5.0, 6.5);
        let sag = |i: usize| {
            let t = i as f32 / 16.0 * 2.0 - 1.0;
            vec3(t * front, y - 0.6 * (1.0 - t * t), z)
        };
        let path: Vec<Vec3> = (0..=16).map(sag).collect();
        mesh.add(&tube(&path, &[0.015; 17], 6), Pose::IDENTITY);
    }
    mesh
}

/// Carriageway, kerbs and flagstones.
fn ground(long: f32, road: f32, walk: f32) -> Mesh {
    let mut mesh = Mesh::default();
    let camber = |x: f32| 0.05 * (1.0 - (x / road) * (x / road)) - 0.02;
    mesh.add(
        &super::shapes::surface((2, 24), |u, v| {
            let x = (v - 0.5) * 2.0 * road;
            vec3(x, camber(x), (u - 0.5) * long)
        }),
        Pose::IDENTITY,
    );
    for side in [-1.0, 1.0] {
        let stones = (long / 1.2) as usize;
        let each = long / stones as f32;
        let kerb = block(vec3(0.16, 0.3, each - 0.01), 0.015);
        for i in 0..stones {
            let z = (i as f32 + 0.5) * each - 0.5 * long;
            mesh.add(&kerb, Pose::at(side * (road + 0.06), -0.16, z));
        }
        let rows = (walk / 0.6).ceil() as usize;
        let flag = block(vec3(walk / rows as f32 - 0.008, 0.1, each - 0.008), 0.006);
        for (i, j) in (0..stones).flat_map(|i| (0..rows).map(move |j| (i, j))) {
            let x = road + 0.14 + (j as f32 + 0.5) * walk / rows as f32;
            let z = (i as f32 + 0.5 + 0.5 * (j % 2) as f32) * each - 0.5 * long;
            mesh.add(&flag, Pose::at(side * x, 0.04, z));
        }
        let base = cuboid(vec3(walk + 13.0, 0.1, long + 1.0));
        mesh.add(&base, Pose::at(side * (road + 0.5 * walk + 6.5), -0.005, 0.0));
    }
    mesh
}

/// A town house of `size` (width, depth) and some floors; its front on z = 0 towards +z.
fn house(size: Vec2, floors: usize, rng: &mut Rng) -> Mesh {
    let (tall, thick) = (rng.range(2.8, 3.6), 0.35);
    let height = tall * floors as f32 + rng.range(0.3, 0.8);
    let columns = (size.x / rng.range(1.8, 2.8)).floor().max(2.0) as usize;
    let bay = size.x / columns as f32;
    let (pane, sill) = (vec2(rng.range(0.4, 0.62) * bay, rng.range(1.3, 1.9)), rng.range(0.6, 0.95));
    let entry = rng.below(columns);
    let gate = vec2((0.6 * bay).min(1.3), rng.range(2.1, 2.5));
    let mut holes = Vec::new();
    for (i, j) in (0..columns).flat_map(|i| (0..floors).map(move |j| (i, j))) {
        let x = (i as f32 + 0.5) * bay - 0.5 * size.x;
        let is_door = j == 0 && i == entry;
        let (low, hole) = if is_door { (0.0, gate) } else { (j as f32 * tall + sill, pane) };
        holes.push((vec2(x - 0.5 * hole.x, low), vec2(x + 0.5 * hole.x, low + hole.y)));
    }
    let mut mesh = wall(vec3(size.x, height, thick), &holes).at(Pose::at(0.0, 0.0, -0.5 * thick));
    let fitting = window(pane, thick, &mut rng.fork());
    let balcony = balcony(pane.x + 0.6, rng);
    let (balconies, keystones) = (rng.range(-0.3, 0.6), rng.chance(0.5));
    for (k, (lo, hi)) in holes.iter().enumerate() {
        let at = Pose::at(0.5 * (lo.x + hi.x), lo.y, -0.5 * thick);
        if lo.y == 0.0 {
            mesh.add(&door(*hi - *lo, rng), at.shift(0.0, 0.0, 0.07));
            mesh.add(&block(vec3(gate.x + 0.3, 0.15, 0.4), 0.015), at.shift(0.0, -0.1, 0.5 * thick + 0.2));
            continue;
        }
        mesh.add(&fitting, at);
        if k % floors > 0 && rng.chance(balconies) {
            mesh.add(&balcony, at.shift(0.0, -sill, 0.5 * thick));
        } else if keystones {
            let head = block(vec3(pane.x + 0.3, 0.14, 0.16), 0.02);
            mesh.add(&head, at.shift(0.0, pane.y + 0.1, 0.5 * thick + 0.05));
        }
    }
    rooms(&mut mesh, vec3(size.x, height, size.y - thick), (tall, floors));
    facade(&mut mesh, (size.x, tall, floors), rng);
    roof(&mut mesh, vec3(size.x, height, size.y), rng);
    mesh
}

/// What is behind a front at z = -0.35: side walls, a back, a wall between, floors.
fn rooms(mesh: &mut Mesh, size: Vec3, (tall, floors): (f32, usize)) {
    let middle = Pose::at(0.0, 0.0, -0.35 - 0.5 * size.z);
    for side in [-1.0, 1.0] {
        mesh.add(&cuboid(vec3(0.2, size.y, size.z)), middle.shift(side * (0.5 * size.x - 0.1), 0.0, 0.0));
    }
    mesh.add(&cuboid(vec3(size.x - 0.4, size.y, 0.2)), middle.shift(0.0, 0.0, 0.1 - 0.5 * size.z));
    mesh.add(&cuboid(vec3(size.x - 0.4, size.y, 0.1)), middle.shift(0.0, 0.0, 0.2 * size.z));
    for j in 0..=floors {
        let slab = cuboid(vec3(size.x - 0.4, 0.2, size.z));
        mesh.add(&slab, middle.shift(0.0, (j as f32 * tall - 0.1).max(0.0), 0.0));
    }
}

/// String courses, corner stones, drain pipe.
fn facade(mesh: &mut Mesh, (wide, tall, floors): (f32, f32, usize), rng: &mut Rng) {
    let (course, quoins) = (rng.chance(0.6), rng.chance(0.4));
    let band = block(vec3(wide, rng.range(0.08, 0.25), 0.1), 0.015);
    for j in 1..floors {
        if course {
            mesh.add(&band, Pose::at(0.0, j as f32 * tall, 0.03));
        }
    }
    if quoins {
        for k in 0..(tall * floors as f32 / 0.4) as usize {
            let long = if k % 2 == 0 { 0.5 } else { 0.3 };
            let stone = block(vec3(long, 0.37, 0.08), 0.015);
            for side in [-1.0, 1.0] {
                mesh.add(&stone, Pose::at(side * 0.5 * (wide - long), 0.4 * k as f32, 0.025));
            }
        }
    }
    mesh.add(&block(vec3(wide, rng.range(0.2, 0.6), 0.14), 0.02), Pose::at(0.0, -0.1, 0.03));
    let pipe = cylinder((0.05, 0.05), tall * floors as f32, 10);
    mesh.add(&pipe, Pose::at(0.5 * wide - 0.12, 0.0, 0.16));
    for j in 0..2 * floors {
        let clamp = block(vec3(0.14, 0.04, 0.2), 0.005);
        mesh.add(&clamp, Pose::at(0.5 * wide - 0.12, (j as f32 + 0.4) * 0.5 * tall, 0.1));
    }
}

/// A gable roof with dormers and chimneys along x, or a flat one behind a parapet.
fn roof(mesh: &mut Mesh, size: Vec3, rng: &mut Rng) {
    let eave = block(vec3(size.x, 0.22, 0.5), 0.05);
    mesh.add(&eave, Pose::at(0.0, size.y - 0.1, 0.08));
    let teeth = (size.x / 0.45) as usize;
    let bracket = block(vec3(0.14, 0.2, 0.28), 0.02);
    for i in 0..teeth {
        let x = ((i as f32 + 0.5) / teeth as f32 - 0.5) * size.x;
        mesh.add(&bracket, Pose::at(x, size.y - 0.3, 0.12));
    }
    let flat = rng.chance(0.4);
    let rise = if flat { 0.2 } else { rng.range(0.3, 0.55) * size.z };
    let lid =
        [vec2(-size.z, 0.0), vec2(0.3, 0.0), vec2(0.3, 0.1), vec2(-0.5 * size.z, rise), vec2(-size.z, 0.1)];
    let pose = Pose::at(0.0, size.y + 0.1, 0.0).yaw(-FRAC_PI_2);
    mesh.add(&extrude(&lid, size.x, 0.0), pose);
    let chimney = block(vec3(0.5, rise + 1.2, 0.9), 0.03);
    for side in [-1.0, 1.0] {
        let at = Pose::at(side * (0.5 * size.x - 0.4), size.y, -0.5 * size.z);
        mesh.add(&chimney, at);
        mesh.add(&block(vec3(0.62, 0.1, 1.02), 0.02), at.shift(0.0, rise + 1.2, 0.0));
        for k in [-0.25, 0.25] {
            mesh.add(&cylinder((0.12, 0.1), 0.4, 14), at.shift(0.0, rise + 1.3, k));
        }
    }
    if flat {
        return;
    }
    for i in 0..rng.count(0, 3) {
        let x = (i as f32 - 1.0) * 0.28 * size.x;
        let slope = rise / (0.5 * size.z + 0.3);
        let at = Pose::at(x, size.y + 0.1 + 0.3 * slope, -0.9);
        let cheek = [vec2(-0.6, -0.3), vec2(0.6, -0.3), vec2(0.6, 1.3), vec2(0.0, 1.8), vec2(-0.6, 1.3)];
        mesh.add(&extrude(&cheek, 1.6, 0.03), at.shift(0.0, 0.0, -0.5));
        mesh.add(&window(vec2(0.8, 1.0), 0.1, rng), at.shift(0.0, 0.2, 0.33));
    }
}

/// A balcony `width` wide: slab, brackets, railing.
fn balcony(width: f32, rng: &mut Rng) -> Mesh {
    let deep = rng.range(0.5, 1.0);
    let mut mesh = block(vec3(width, 0.12, deep), 0.02).at(Pose::at(0.0, -0.12, 0.5 * deep));
    let bracket = extrude(&[vec2(0.0, 0.0), vec2(0.45, 0.35), vec2(0.0, 0.35)], 0.12, 0.01);
    for side in [-1.0, 1.0] {
        mesh.add(&bracket, Pose::at(side * 0.4 * width, -0.46, 0.0).yaw(-FRAC_PI_2));
    }
    mesh.add(&railing(width - 0.06, rng), Pose::at(0.0, 0.0, deep - 0.04));
    for side in [-1.0, 1.0] {
        let pose = Pose::at(side * (0.5 * width - 0.04), 0.0, 0.5 * deep).yaw(FRAC_PI_2);
        mesh.add(&railing(deep - 0.1, rng), pose);
    }
    mesh
}

/// An iron railing along x.
pub(super) fn railing(width: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let high = rng.range(0.9, 1.05);
    mesh.add(&block(vec3(width, 0.04, 0.05), 0.008), Pose::at(0.0, high - 0.04, 0.0));
    mesh.add(&block(vec3(width, 0.02, 0.03), 0.004), Pose::at(0.0, 0.08, 0.0));
    let bar = cuboid(vec3(0.016, high - 0.04, 0.016));
    let n = (width / 0.12).ceil() as usize;
    for i in 0..=n {
        mesh.add(&bar, Pose::at((i as f32 / n as f32 - 0.5) * (width - 0.02), 0.0, 0.0));
    }
    mesh
}

fn parked(mesh: &mut Mesh, (long, road): (f32, f32), rng: &mut Rng) {
    for side in [-1.0, 1.0] {
        let mut z = -0.5 * long + rng.range(2.0, 6.0);
        while z < 0.5 * long - 3.0 {
            if rng.chance(0.6) {
                let flip = if rng.chance(0.15) { PI } else { 0.0 } + if side > 0.0 { 0.0 } else { PI };
                let x = side * (road - rng.range(1.0, 1.25));
                mesh.add(&car(rng), Pose::at(x, 0.0, z).yaw(flip + rng.spread(0.04)));
            }
            z += rng.range(5.0, 7.5);
        }
    }
}

fn furniture(mesh: &mut Mesh, (long, road, walk): (f32, f32, f32), rng: &mut Rng) {
    let (lamp, bin, bench) = (street_lamp(rng), litter_bin(rng), bench(rng));
    let trees: Vec<Mesh> = (0..2).map(|_| tree(rng.range(5.0, 7.0), 900, rng)).collect();
    let wooded = rng.chance(0.7);
    let bollard = lathe(
        &[
            Vec2::ZERO,
            vec2(0.1, 0.0),
            vec2(0.08, 0.1),
            vec2(0.07, 0.75),
            vec2(0.09, 0.8),
            vec2(0.06, 0.9),
            vec2(0.0, 0.93),
        ],
        18,
    );
    for side in [-1.0, 1.0] {
        let mut z = -0.5 * long + rng.range(1.0, 4.0);
        while z < 0.5 * long - 1.0 {
            let at = Pose::at(side * (road + 0.5), 0.14, z).yaw(-side * FRAC_PI_2);
            match rng.below(7) {
                0 | 1 => mesh.add(&lamp, at.yaw(PI)),
                2 if wooded => mesh.add(rng.pick(&trees), at.yaw(rng.angle())),
                3 => mesh.add(&bin, at),
                4 if walk > 2.2 => mesh.add(&bench, at.shift(0.0, 0.0, 0.1)),
                _ => (0..3).for_each(|k| mesh.add(&bollard, at.shift(k as f32 * 1.3, 0.0, -0.1))),
            }
            z += rng.range(2.5, 5.0);
        }
    }
}

/// A lamp post whose arm points along +z.
pub(super) fn street_lamp(rng: &mut Rng) -> Mesh {
    let high = rng.range(3.6, 5.2);
    let foot = [
        (0.0, 0.0),
        (0.14, 0.0),
        (0.14, 0.25),
        (0.1, 0.32),
        (0.08, 0.7),
        (0.1, 0.75),
        (0.06, 0.85),
        (0.045, high),
    ];
    let profile: Vec<Vec2> = foot.iter().map(|(r, y)| vec2(*r, *y)).chain([vec2(0.0, high)]).collect();
    let mut mesh = lathe(&profile, 20);
    if rng.chance(0.5) {
        let bend = |i: usize| {
            let t = turn(i as f32 / 10.0 * FRAC_PI_2);
            vec3(0.0, high - 0.05 + 0.5 * t.y, 0.9 * (1.0 - t.x))
        };
        let path: Vec<Vec3> = (0..=10).map(bend).collect();
        mesh.add(&tube(&path, &[0.035; 11], 12), Pose::IDENTITY);
        mesh.add(&block(vec3(0.22, 0.1, 0.6), 0.04), Pose::at(0.0, high + 0.4, 1.1));
        return mesh;
    }
    let cage = Pose::at(0.0, high, 0.0);
    mesh.add(&cylinder((0.12, 0.2), 0.4, 6), cage);
    mesh.add(
        &lathe(&[vec2(0.0, 0.0), vec2(0.26, 0.0), vec2(0.24, 0.04), vec2(0.08, 0.18), vec2(0.0, 0.2)], 6),
        cage.shift(0.0, 0.42, 0.0),
    );
    mesh.add(&ball(0.05, 12), cage.shift(0.0, 0.66, 0.0));
    mesh
}

pub(super) fn litter_bin(rng: &mut Rng) -> Mesh {
    let (r, h) = (rng.range(0.2, 0.28), rng.range(0.7, 0.95));
    let mut mesh = super::props::hollow(&[vec2(0.9 * r, 0.0), vec2(r, 0.5 * h), vec2(r, h)], 0.02);
    let slats = 18;
    for k in 0..slats {
        let pose = Pose::at(0.0, 0.06, 0.0).yaw(k as f32 / slats as f32 * 2.0 * PI);
        mesh.add(&block(vec3(0.04, h - 0.1, 0.02), 0.004), pose.shift(0.0, 0.0, r + 0.01));
    }
    mesh
}

/// A park bench that looks along +z.
pub(super) fn bench(rng: &mut Rng) -> Mesh {
    let long = rng.range(1.3, 1.9);
    let mut mesh = Mesh::default();
    let slat = block(vec3(long, 0.03, 0.08), 0.008);
    for k in 0..4 {
        mesh.add(&slat, Pose::at(0.0, 0.44, 0.1 * k as f32 - 0.15));
    }
    for k in 0..3 {
        let back = Pose::at(0.0, 0.58 + 0.12 * k as f32, -0.24 - 0.03 * k as f32);
        mesh.add(&block(vec3(long, 0.08, 0.03), 0.008), back);
    }
    let side = [
        (-0.2, 0.0),
        (-0.15, 0.0),
        (-0.12, 0.38),
        (0.15, 0.38),
        (0.17, 0.0),
        (0.22, 0.0),
        (0.2, 0.44),
        (-0.18, 0.44),
        (-0.29, 0.95),
        (-0.33, 0.95),
        (-0.22, 0.42),
    ];
    let outline: Vec<Vec2> = side.iter().map(|(z, y)| vec2(*z, *y)).collect();
    for x in [-0.4, 0.4] {
        mesh.add(&extrude(&outline, 0.05, 0.006), Pose::at(x * long, 0.0, 0.0).yaw(-FRAC_PI_2));
    }
    mesh
}
