//! A storeroom: rows of deep racks along aisles, full of boxes, bins and cans.

use super::architecture::{door, floor, wall};
use super::mesh::{Mesh, Pose, turn};
use super::props::{books, crate_of_slats, hollow};
use super::rng::Rng;
use super::shapes::{block, cuboid, cylinder, lathe, superellipsoid, tube};
use super::tools::jar;
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// How the racks of a room are made.
struct Style {
    post: f32,
    beam: f32,
    bay: f32,
    gap: f32,
    /// 0: solid decks, 1: slats, 2: wires.
    deck: usize,
    braced: bool,
    panelled: bool,
    fullness: f32,
    /// Triangles of the goods in a compartment.
    most: usize,
}

/// The room; its racks stand along z, or along x where it is turned.
pub(super) fn storeroom(rng: &mut Rng) -> Mesh {
    let half = vec2(rng.range(2.2, 4.2), rng.range(2.0, 3.8));
    let height = rng.range(2.5, 4.0);
    let mut mesh = shell((half, height), rng);
    let (deep, aisle) = (rng.range(0.4, 0.95), rng.range(0.85, 1.4));
    let tall = rng.range(1.7, 3.2).min(height - 0.3);
    let (bay, gap) = (rng.range(0.8, 1.9), rng.range(0.38, 0.75));
    let compartments = 4.0 * half.x * half.y * tall / ((deep + aisle) * bay * gap);
    let style = Style {
        post: rng.range(0.035, 0.07),
        beam: rng.range(0.04, 0.1),
        bay,
        gap,
        deck: rng.below(3),
        braced: rng.chance(0.6),
        panelled: rng.chance(0.25),
        fullness: rng.range(0.45, 1.0),
        // guess: with racks and floor the scene stays below 450 000 triangles
        most: (400_000.0 / compartments).clamp(700.0, 8000.0) as usize,
    };
    let mut x = -half.x + 0.05;
    while x + deep < half.x {
        let from = -half.y + if rng.chance(0.5) { 0.05 } else { rng.range(0.5, 1.1) };
        let to = half.y - rng.range(0.9, 1.4);
        let rack = rack(vec3(to - from, tall * rng.range(0.85, 1.0), deep), &style, rng);
        mesh.add(&rack, Pose::at(x + 0.5 * deep, 0.0, 0.5 * (from + to)).yaw(FRAC_PI_2));
        let twin = rng.chance(0.35) && x > -half.x + deep;
        let left = half.x - x - 2.0 * deep - aisle;
        // The last row stands at the wall if an aisle is left before it.
        x += deep
            + if twin { 0.05 } else { aisle + if left < deep + aisle { left.max(0.0) * 0.9 } else { 0.0 } };
    }
    on_floor(&mut mesh, half, rng);
    overhead(&mut mesh, (half, height), rng);
    mesh
}

/// Floor, walls with a door, ceiling.
fn shell((half, height): (Vec2, f32), rng: &mut Rng) -> Mesh {
    let mut mesh = match rng.chance(0.4) {
        true => floor(half, rng),
        false => cuboid(vec3(2.0 * half.x + 0.4, 0.2, 2.0 * half.y + 0.4)).at(Pose::at(0.0, -0.2, 0.0)),
    };
    mesh.add(&cuboid(vec3(2.0 * half.x + 0.4, 0.2, 2.0 * half.y + 0.4)), Pose::at(0.0, height, 0.0));
    for side in 0..4 {
        let (long, reach) = if side % 2 == 0 { (half.x, half.y) } else { (half.y, half.x) };
        let at = Pose::IDENTITY.yaw(side as f32 * FRAC_PI_2).shift(0.0, 0.0, -reach - 0.1);
        let x = rng.spread(long - 0.8);
        let hole = (vec2(x - 0.5, 0.0), vec2(x + 0.5, 2.1));
        let holes = if side == 2 { vec![hole] } else { vec![] };
        let extra = if side % 2 == 0 { 0.4 } else { 0.0 };
        mesh.add(&wall(vec3(2.0 * long + extra, height, 0.2), &holes), at);
        if side == 2 {
            mesh.add(&door(hole.1 - hole.0, rng), at.shift(x, 0.002, 0.0));
        }
    }
    mesh
}

/// A rack of `size` along x with its goods.
fn rack(size: Vec3, style: &Style, rng: &mut Rng) -> Mesh {
    let bays = (size.x / style.bay).round().max(1.0);
    let bay = (size.x - style.post) / bays;
    let mut mesh = Mesh::default();
    let post = block(vec3(style.post, size.y, style.post), 0.004);
    for i in 0..=bays as usize {
        let x = i as f32 * bay - 0.5 * (size.x - style.post);
        for side in [-1.0, 1.0] {
            mesh.add(&post, Pose::at(x, 0.0, side * 0.5 * (size.z - style.post)));
            let foot = block(vec3(style.post + 0.05, 0.012, style.post + 0.03), 0.002);
            mesh.add(&foot, Pose::at(x, 0.0, side * 0.5 * (size.z - style.post)));
        }
        if style.panelled {
            let panel = block(vec3(0.012, size.y - 0.1, size.z - 2.0 * style.post - 0.01), 0.002);
            mesh.add(&panel, Pose::at(x, 0.05, 0.0));
        } else {
            lacing(&mut mesh, x, (size, style.post));
        }
    }
    let levels = (size.y / (style.gap * rng.range(0.85, 1.15))).floor().clamp(2.0, 7.0);
    let low = rng.range(0.06, 0.2);
    let rise = (size.y - low - 0.06) / (levels - if rng.chance(0.5) { 1.0 } else { 0.0 });
    for (i, j) in (0..bays as usize).flat_map(|i| (0..levels as usize).map(move |j| (i, j))) {
        let y = low + j as f32 * rise;
        let at = Pose::at((i as f32 + 0.5) * bay - 0.5 * (size.x - style.post), y, 0.0);
        deck(&mut mesh, at, (vec2(bay - style.post - 0.004, size.z), style));
        let free = if y + rise > size.y { 0.5 } else { rise - style.beam - 0.03 };
        let hole = vec3(bay - style.post - 0.03, free, size.z - 0.03);
        if rng.chance(style.fullness) {
            goods(&mut mesh, at, (hole, style.most), rng);
        }
    }
    if style.braced {
        let (run, rise) = (bay, 0.6 * size.y);
        let bar = block(vec3(0.03, run.hypot(rise), 0.004), 0.001);
        for i in 0..bays as usize {
            let x = i as f32 * bay - 0.5 * (size.x - style.post);
            for (x, sign) in [(x, -1.0), (x + bay, 1.0)] {
                let z = -0.5 * size.z - 0.004 - 0.003 * sign;
                mesh.add(&bar, Pose::at(x, 0.15 * size.y, z).roll(sign * libm::atan2f(run, rise)));
            }
        }
    }
    mesh
}

/// Bars between a front and a back post.
fn lacing(mesh: &mut Mesh, x: f32, (size, post): (Vec3, f32)) {
    let (n, run) = ((size.y / 0.7).ceil(), size.z - post);
    let rise = (size.y - 0.2) / n;
    let bar = block(vec3(0.4 * post, run.hypot(rise), 0.4 * post), 0.002);
    for k in 0..n as usize {
        let side = if k % 2 == 0 { -1.0 } else { 1.0 };
        let at = Pose::at(x, 0.1 + k as f32 * rise, side * 0.5 * run);
        mesh.add(&bar, at.pitch(-side * libm::atan2f(run, rise)));
    }
}

/// A shelf of `size` (along, across) whose top is about `at`.
fn deck(mesh: &mut Mesh, at: Pose, (size, style): (Vec2, &Style)) {
    let beam = block(vec3(size.x, style.beam, 0.03), 0.004);
    for side in [-1.0, 1.0] {
        mesh.add(&beam, at.shift(0.0, -style.beam - 0.004, side * (0.5 * size.y - 0.02)));
    }
    let inner = size.y - 0.075;
    match style.deck {
        0 => mesh.add(&block(vec3(size.x - 0.006, 0.022, inner), 0.003), at.shift(0.0, -0.022, 0.0)),
        1 => {
            let n = (inner / 0.13).round().max(2.0);
            let slat = block(vec3(size.x - 0.006, 0.02, inner / n - 0.025), 0.003);
            for k in 0..n as usize {
                mesh.add(&slat, at.shift(0.0, -0.02, ((k as f32 + 0.5) / n - 0.5) * inner));
            }
        }
        _ => {
            let n = (size.x / 0.055) as usize;
            let wire = cuboid(vec3(0.006, 0.006, inner + 0.03));
            for k in 0..n {
                mesh.add(&wire, at.shift(((k as f32 + 0.5) / n as f32 - 0.5) * size.x, -0.006, 0.0));
            }
            let bar = cuboid(vec3(size.x, 0.01, 0.01));
            for z in [-0.3, 0.0, 0.3] {
                mesh.add(&bar, at.shift(0.0, -0.0165, z * inner));
            }
        }
    }
}

/// What stands in a compartment of size `hole` on the floor about `at`, of about `most` triangles at most.
fn goods(mesh: &mut Mesh, at: Pose, (hole, most): (Vec3, usize), rng: &mut Rng) {
    let item = match rng.below(9) {
        0 => {
            let row = books((hole.x, hole.y.min(0.34), hole.z.min(0.3)), rng);
            return mesh.add(&row, at.shift(-0.5 * hole.x, 0.0, 0.5 * hole.z - 0.02));
        }
        1 => tin(rng.range(0.05, 0.12), rng),
        2 => jar(rng.range(0.05, 0.1), rng),
        3 => bin(vec3(rng.range(0.15, 0.4), rng.range(0.1, 0.25), rng.range(0.25, 0.6)).min(hole * 0.95)),
        4 => superellipsoid(vec3(rng.range(0.2, 0.35), 0.08, rng.range(0.14, 0.22)), (0.6, 0.35), 20)
            .at(Pose::at(0.0, 0.08, 0.0)),
        5 => roll(hole.z * rng.range(0.6, 0.95), rng),
        6 => crate_of_slats(vec3(rng.range(0.3, 0.5), rng.range(0.18, 0.3), rng.range(0.3, 0.5)), rng),
        _ => carton(rng),
    };
    let turned = if rng.chance(0.3) { item.at(Pose::IDENTITY.yaw(FRAC_PI_2)) } else { item };
    let (lo, hi) = turned.extent();
    let pitch = (hi - lo) + rng.range(0.004, 0.03);
    let mut n = (hole / pitch).floor().min(vec3(9.0, 4.0, 5.0));
    let each = turned.triangle.len() as f32;
    while n.element_product() * each > most as f32 && n.max_element() > 1.0 {
        let longest = n.max_position();
        n[longest] -= 1.0;
    }
    let (taken, loose) = (rng.range(0.0, 0.5), rng.range(0.0, 0.25));
    for (i, k) in (0..n.x as usize).flat_map(|i| (0..n.z as usize).map(move |k| (i, k))) {
        // Whoever takes something takes it from the front, from either side.
        let inner = (k as f32 + 0.5 - 0.5 * n.z).abs() / n.z.max(1.0);
        if rng.chance(taken * (0.3 + 1.4 * inner)) {
            continue;
        }
        let place = (vec2(i as f32, k as f32) + 0.5 - 0.5 * vec2(n.x, n.z)) * vec2(pitch.x, pitch.z);
        let high = if n.y > 1.5 { rng.count(1, n.y as usize) } else { n.y as usize };
        for j in 0..high {
            let yaw = rng.spread(loose) * if pitch.x.min(pitch.z) < 0.25 { 1.0 } else { 0.3 };
            let y = j as f32 * (hi.y - lo.y + 0.001) - lo.y;
            mesh.add(&turned, at.shift(place.x, y + 0.0005, place.y).yaw(yaw));
        }
    }
}

/// A closed or open carton with flaps.
fn carton(rng: &mut Rng) -> Mesh {
    let size = vec3(rng.range(0.18, 0.55), rng.range(0.12, 0.4), rng.range(0.18, 0.45));
    if rng.chance(0.6) {
        let mut mesh = block(size, 0.004);
        mesh.add(&block(vec3(size.x + 0.003, 0.4 * size.y, 0.05), 0.001), Pose::at(0.0, 0.601 * size.y, 0.0));
        return mesh;
    }
    let mut mesh = bin(size);
    for (side, wide, reach) in
        [(0.0, size.x, size.z), (1.0, size.z, size.x), (2.0, size.x, size.z), (3.0, size.z, size.x)]
    {
        let flap = block(vec3(wide - 0.02, 0.4 * reach.min(0.4), 0.004), 0.001);
        let at = Pose::at(0.0, size.y, 0.0).yaw(side * FRAC_PI_2).shift(0.0, 0.0, 0.5 * reach - 0.004);
        mesh.add(&flap, at.pitch(rng.range(0.2, 1.9)));
    }
    mesh
}

/// An open box of `size`.
fn bin(size: Vec3) -> Mesh {
    let wall = 0.008;
    let mut mesh = block(vec3(size.x - wall, wall, size.z - wall), 0.002);
    for side in [-1.0, 1.0] {
        let long = block(vec3(size.x, size.y, wall), 0.002);
        mesh.add(&long, Pose::at(0.0, 0.0, side * 0.5 * (size.z - wall)));
        let short = block(vec3(wall, size.y - 0.002, size.z - 2.0 * wall), 0.002);
        mesh.add(&short, Pose::at(side * 0.5 * (size.x - wall), 0.0, 0.0));
    }
    mesh
}

/// A tin with rims, or a bucket.
fn tin(radius: f32, rng: &mut Rng) -> Mesh {
    let h = radius * rng.range(1.4, 3.0);
    if rng.chance(0.25) {
        return hollow(&[vec2(0.8 * radius, 0.0), vec2(0.9 * radius, 0.5 * h), vec2(radius, h)], 0.006);
    }
    let rim = 0.03 * h;
    let low = [(0.0, rim), (0.92, rim), (0.94, 0.0), (1.0, 0.0), (1.0, rim), (0.96, 2.0 * rim)];
    let profile: Vec<Vec2> = low.iter().map(|(r, y)| vec2(r * radius, *y)).collect();
    let top = profile.iter().rev().map(|p| vec2(p.x, h - p.y));
    lathe(&profile.iter().copied().chain(top).collect::<Vec<_>>(), 22)
}

/// A roll that lies along z, hollow.
fn roll(long: f32, rng: &mut Rng) -> Mesh {
    let r = rng.range(0.04, 0.1);
    let bore = r * rng.range(0.3, 0.7);
    let profile = [vec2(bore, 0.0), vec2(r, 0.0), vec2(r, long), vec2(bore, long), vec2(bore, 0.0)];
    lathe(&profile, 20).at(Pose::at(0.0, r, -0.5 * long).pitch(FRAC_PI_2))
}

/// Pallets, drums, cartons and a trolley where there is no rack.
fn on_floor(mesh: &mut Mesh, half: Vec2, rng: &mut Rng) {
    let mut spots: Vec<(Vec2, f32)> = Vec::new();
    let standing: Vec<Vec3> = mesh.position.iter().filter(|p| p.y > 0.03 && p.y < 1.2).copied().collect();
    for _ in 0..rng.count(8, 24) {
        let part = match rng.below(5) {
            0 => pallet(rng),
            1 => cylinder((0.28, 0.28), rng.range(0.6, 0.9), 32),
            2 => crate_of_slats(vec3(0.5, rng.range(0.2, 0.4), 0.4), rng),
            _ => carton(rng),
        };
        let (lo, hi) = part.extent();
        let r = 0.5 * vec2(hi.x - lo.x, hi.z - lo.z).length();
        let p = rng.in_rect(half - Vec2::splat(r.min(1.0) + 0.03));
        let near = |q: &Vec3| vec2(q.x, q.z).distance(p) < r;
        if spots.iter().any(|(q, s)| q.distance(p) < r + s) || standing.iter().any(near) {
            continue;
        }
        spots.push((p, r));
        mesh.add(&part, Pose::at(p.x, 0.001 - lo.y, p.y).yaw(rng.angle()));
    }
}

/// A pallet with a stack of cartons.
fn pallet(rng: &mut Rng) -> Mesh {
    let (x, z) = (rng.range(0.7, 1.1), rng.range(0.6, 0.8));
    let mut mesh = Mesh::default();
    let skid = block(vec3(x, 0.09, 0.09), 0.004);
    let slat = block(vec3(0.09, 0.02, z), 0.003);
    for k in [-1.0, 0.0, 1.0] {
        mesh.add(&skid, Pose::at(0.0, 0.0, k * (0.5 * z - 0.05)));
    }
    let n = (x / 0.14) as usize;
    for k in 0..n {
        let at = ((k as f32 + 0.5) / n as f32 - 0.5) * x;
        mesh.add(&slat, Pose::at(at, 0.09, 0.0));
    }
    goods(&mut mesh, Pose::at(0.0, 0.111, 0.0), (vec3(x, rng.range(0.3, 1.2), z), 8000), rng);
    mesh
}

/// Beams, lamps and pipes under the ceiling.
fn overhead(mesh: &mut Mesh, (half, height): (Vec2, f32), rng: &mut Rng) {
    if rng.chance(0.5) {
        let beam = block(vec3(2.0 * half.x, rng.range(0.12, 0.25), 0.12), 0.01);
        let n = rng.count(2, 4);
        for k in 0..n {
            let z = ((k as f32 + 0.5) / n as f32 - 0.5) * 2.0 * half.y;
            mesh.add(&beam, Pose::at(0.0, height - beam.extent().1.y, z));
        }
    }
    for k in 0..rng.count(2, 4) {
        let at = Pose::at((k as f32 - 1.5) * 0.55 * half.x, height - 0.3, rng.spread(0.5 * half.y));
        mesh.add(&block(vec3(0.14, 0.05, 1.2), 0.01), at);
        mesh.add(&cylinder((0.016, 0.016), 1.1, 12), at.shift(0.0, -0.02, -0.55).pitch(FRAC_PI_2));
        for z in [-0.5, 0.5] {
            mesh.add(&cylinder((0.005, 0.005), 0.26, 6), at.shift(0.0, 0.045, z));
        }
    }
    for _ in 0..rng.count(0, 4) {
        let (r, x) = (rng.range(0.02, 0.09), rng.spread(half.x - 0.15));
        let y = height - r - rng.range(0.02, 0.15);
        let wave = |k: usize| {
            vec3(x + 0.01 * turn(k as f32 * TAU / 3.0).x, y, (k as f32 / 6.0 - 0.5) * 2.0 * half.y)
        };
        let path: Vec<Vec3> = (0..=6).map(wave).collect();
        mesh.add(&tube(&path, &[r; 7], 16), Pose::IDENTITY);
        let hanger = cylinder((1.2 * r, 1.2 * r), 0.03, 16);
        for z in [-0.7, 0.0, 0.7] {
            mesh.add(&hanger, Pose::at(x, y, z * half.y).pitch(0.5 * PI));
        }
    }
}
