//! A laid table, seen from near: food, dishes, cutlery, flowers.

use super::furniture::potted_plant;
use super::mesh::{Mesh, Pose, turn};
use super::props::{bottle, bowl, crate_of_slats, hollow, mug, plate, vessel};
use super::rng::{Noise, Rng};
use super::settle::Ground;
use super::shapes::{ball, block, curve, cylinder, extrude, lathe, superellipsoid, surface, tube};
use super::solid::{carve, cube, isosurface};
use super::tools::{cutlery, jar, pan};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// The table top is at y = 0.
pub(super) fn meal(rng: &mut Rng) -> Mesh {
    let half = vec2(rng.range(0.55, 0.95), rng.range(0.38, 0.55));
    let mut mesh = top(half, &mut rng.fork());
    let mut taken: Vec<(Vec2, f32)> = Vec::new();
    let covers = rng.count(1, 4);
    for k in 0..covers {
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let x = ((k / 2) as f32 - 0.5 * (covers / 3) as f32) * 0.6 + rng.spread(0.1);
        let at = vec2(x.clamp(0.22 - half.x, half.x - 0.22), side * (half.y - 0.19));
        if taken.iter().all(|(q, r)| q.distance(at) > r + 0.2) {
            taken.push((at, 0.2));
            let turned = if side > 0.0 { 0.0 } else { PI };
            mesh.add(&cover(rng), Pose::at(at.x, 0.0, at.y).yaw(turned + rng.spread(0.15)));
        }
    }
    for attempt in 0..400 {
        let kind = rng.below(if attempt < 8 { 5 } else { 16 });
        let radius = *DISH_RADIUS.get(kind).unwrap_or(&0.05);
        let at = rng.in_rect(half - Vec2::splat(radius.min(half.y) * 0.9));
        if taken.len() < 45 && taken.iter().all(|(q, r)| q.distance(at) > r + radius) {
            taken.push((at, radius));
            mesh.add(&dish(kind, &mut rng.fork()), Pose::at(at.x, 0.0, at.y).yaw(rng.angle()));
        }
    }
    mesh
}

/// Boards, a slab or a cloth with folds that hangs over.
fn top(half: Vec2, rng: &mut Rng) -> Mesh {
    let mut mesh = super::furniture::table(vec3(2.0 * half.x, 0.75, 2.0 * half.y), &mut rng.fork());
    mesh = mesh.at(Pose::at(0.0, -0.752, 0.0));
    let floor = super::architecture::floor(half * 1.15, rng);
    mesh.add(&floor, Pose::at(0.0, -0.755, 0.0));
    if rng.chance(0.4) {
        let noise = Noise::new(rng);
        let hang = rng.range(0.1, 0.3);
        let cloth = surface((110, 150), |u, v| {
            let p = vec2(v - 0.5, u - 0.5) * 2.0 * (half + hang);
            let over = (p.abs() - half).max(Vec2::ZERO);
            let drop = over.length();
            let wave = 0.5 + 0.5 * noise.at(vec3(p.x * 9.0, 0.0, p.y * 9.0));
            let out = over.normalize_or_zero() * (0.12 * drop.min(0.1) + 0.35 * drop * wave) * p.signum();
            let flat = p.clamp(-half - 0.004, half + 0.004) + out;
            let crease = 0.0012 * noise.fractal(vec3(p.x * 6.0, 4.0, p.y * 6.0), 3);
            vec3(flat.x, -0.002 + crease - drop, flat.y)
        });
        mesh.add(&cloth, Pose::IDENTITY);
    } else {
        let boards = rng.count(4, 9);
        let each = 2.0 * half.y / boards as f32;
        for k in 0..boards {
            let z = (k as f32 + 0.5) * each - half.y;
            let board = block(vec3(2.0 * half.x + 0.02, 0.03, each - 0.002), 0.002);
            mesh.add(&board, Pose::at(rng.spread(0.004), -0.03, z));
        }
    }
    mesh
}

/// A place setting that is eaten from +z.
fn cover(rng: &mut Rng) -> Mesh {
    let r = rng.range(0.11, 0.14);
    let mut mesh = plate(r);
    let inner = plate(0.72 * r);
    match rng.below(3) {
        0 => mesh.add(&inner, Pose::at(0.0, 0.035 * r, 0.0)),
        1 => mesh.add(&bowl(0.6 * r, 0.045), Pose::at(0.0, 0.035 * r, 0.0)),
        _ => serve(&mut mesh, r, rng),
    }
    let flat = |x: f32| Pose::at(x, 0.003, 0.1).pitch(-FRAC_PI_2);
    mesh.add(&cutlery(1), flat(-r - 0.035));
    mesh.add(&cutlery(0), flat(r + 0.03));
    mesh.add(&cutlery(2), flat(r + 0.065));
    mesh.add(&glass(rng), Pose::at(r + 0.02, 0.0, -r - 0.03));
    mesh
}

/// Food on a plate of radius `r`.
fn serve(mesh: &mut Mesh, r: f32, rng: &mut Rng) {
    let mut ground = Ground::new(r, 0.02, |x, z| {
        let d = vec2(x, z).length() / r;
        if d > 0.72 { 1.0 } else { 0.035 * r }
    });
    for _ in 0..rng.count(6, 16) {
        let s = rng.range(0.008, 0.028);
        let bite = match rng.below(4) {
            0 => ball(s, 18),
            1 => superellipsoid(vec3(1.5, 0.5, 1.0) * s, (0.6, 0.7), 20),
            2 => cylinder((s, s), 0.4 * s, 20),
            _ => bent_tube(1.6 * s, 0.45 * s, rng),
        };
        if let Some(pose) = ground.drop(&bite, rng.in_rect(Vec2::splat(0.4 * r)), rng) {
            mesh.add(&bite, pose);
        }
    }
}

/// A wine glass or tumbler.
fn glass(rng: &mut Rng) -> Mesh {
    if rng.chance(0.4) {
        let r = rng.range(0.028, 0.04);
        return hollow(&[vec2(0.85 * r, 0.0), vec2(0.95 * r, 0.05), vec2(r, rng.range(0.08, 0.14))], 0.002);
    }
    let (r, stem, cup) = (rng.range(0.03, 0.045), rng.range(0.06, 0.1), rng.range(0.07, 0.11));
    let outside = [
        (0.95, 0.0),
        (0.9, 0.004),
        (0.2, 0.012),
        (0.1, 0.5 * stem),
        (0.12, stem),
        (0.8, stem + 0.3 * cup),
        (1.0, stem + 0.55 * cup),
        (0.75, stem + cup),
    ];
    let mut profile = vec![Vec2::ZERO];
    let outside = curve(&outside.map(|(x, y)| vec2(x * r, y)), 6);
    profile.extend(&outside);
    let inside = outside.iter().rev().filter(|p| p.y > stem + 0.1 * cup).map(|p| vec2(p.x - 0.0015, p.y));
    profile.extend(inside);
    profile.push(vec2(0.0, stem + 0.08 * cup));
    lathe(&profile, 32)
}

/// How much place the first kinds of [`dish`] need (m).
const DISH_RADIUS: [f32; 13] =
    [0.16, 0.18, 0.15, 0.13, 0.12, 0.045, 0.06, 0.05, 0.05, 0.19, 0.05, 0.065, 0.13];

/// Something for the middle of the table; the first kinds are large, the last are fruit.
fn dish(kind: usize, rng: &mut Rng) -> Mesh {
    match kind {
        0 => fruit_bowl(rng),
        1 => bread_board(rng),
        2 => cake(rng),
        3 => teapot(rng),
        4 => potted_plant(rng.range(0.25, 0.4), rng),
        5 => bottle(rng),
        6 => mug(rng),
        7 => candle(rng),
        8 => jar(rng.range(0.025, 0.045), rng),
        9 => pan(rng),
        10 => glass(rng),
        11 => vessel(rng.range(0.03, 0.06), rng.range(0.06, 0.2), rng),
        12 => crate_of_slats(vec3(0.2, 0.07, 0.14), rng),
        _ => {
            let piece = fruit(rng);
            piece.at(Pose::at(0.0, -piece.extent().0.y, 0.0))
        }
    }
}

/// An apple, pear, orange, banana, lemon, bunch of grapes, egg or aubergine about its middle.
fn fruit(rng: &mut Rng) -> Mesh {
    let s = rng.range(0.9, 1.15);
    let turned = |shape: &[(f32, f32)], r: f32| {
        let points: Vec<Vec2> = shape.iter().map(|(x, y)| vec2(*x, *y) * r * s).collect();
        lathe(&curve(&points, 6), 28)
    };
    let stalk = |mesh: &mut Mesh, y: f32| {
        let path = [vec3(0.0, y, 0.0), vec3(0.002, y + 0.009, 0.0), vec3(0.006, y + 0.018, 0.0)];
        mesh.add(&tube(&path, &[0.0015; 3], 6), Pose::IDENTITY);
    };
    match rng.below(8) {
        0 | 1 => {
            let mut apple = turned(
                &[(0.0, -0.72), (0.35, -0.85), (0.8, -0.5), (1.0, 0.1), (0.8, 0.7), (0.35, 0.82), (0.0, 0.5)],
                0.038,
            );
            stalk(&mut apple, 0.019 * s);
            apple
        }
        2 => {
            let mut pear = turned(
                &[(0.0, -0.9), (0.4, -0.95), (0.9, -0.5), (0.9, 0.1), (0.5, 0.8), (0.35, 1.3), (0.0, 1.45)],
                0.034,
            );
            stalk(&mut pear, 0.048 * s);
            pear
        }
        3 => ball(0.036 * s, 32),
        4 => bent_tube(0.09 * s, 0.016 * s, rng),
        5 => turned(
            &[(0.0, -1.35), (0.2, -1.2), (0.75, -0.7), (0.95, 0.0), (0.75, 0.7), (0.25, 1.15), (0.0, 1.25)],
            0.027,
        ),
        6 => {
            let mut grapes = Mesh::default();
            let grape = superellipsoid(vec3(0.009, 0.011, 0.009), (1.0, 1.0), 16);
            for k in 0..rng.count(20, 45) {
                let t = k as f32 / 45.0;
                let around = turn(k as f32 * 2.4) * 0.024 * (1.0 - t * t) * rng.range(0.5, 1.0);
                grapes.add(&grape, Pose::at(around.x, 0.03 - 0.07 * t, around.y).pitch(rng.spread(0.5)));
            }
            grapes.at(Pose::IDENTITY.pitch(FRAC_PI_2))
        }
        _ => turned(&[(0.0, -1.2), (0.5, -1.05), (1.0, -0.3), (0.9, 0.4), (0.5, 1.0), (0.0, 1.25)], 0.025),
    }
}

/// A bent, tapered tube about its middle: banana, bean, sausage.
fn bent_tube(half: f32, radius: f32, rng: &mut Rng) -> Mesh {
    let bend = rng.range(0.3, 1.1);
    let at = |i: usize| {
        let t = i as f32 / 12.0 * 2.0 - 1.0;
        (vec3(half * t, half * bend * 0.5 * t * t, 0.0), radius * (1.0 - 0.8 * t * t * t * t))
    };
    let (path, radii): (Vec<Vec3>, Vec<f32>) = (0..=12).map(at).unzip();
    tube(&path, &radii, 14)
}

/// Fruit settled in a bowl.
fn fruit_bowl(rng: &mut Rng) -> Mesh {
    let (r, h) = (0.14, rng.range(0.05, 0.08));
    let mut mesh = bowl(r, h);
    let mut ground = Ground::new(1.1 * r, 0.02, |_, _| 0.01);
    ground.cover(&mesh);
    for _ in 0..rng.count(6, 14) {
        let piece = fruit(rng);
        let from = rng.in_rect(Vec2::splat(0.45 * r));
        if let Some(pose) =
            ground.drop(&piece, from, rng).filter(|p| vec2(p.offset.x, p.offset.z).length() < r)
        {
            mesh.add(&piece, pose);
        }
    }
    mesh
}

/// A board with a loaf, slices, cheese with holes and a knife.
fn bread_board(rng: &mut Rng) -> Mesh {
    let mut mesh = block(vec3(0.32, 0.018, 0.2), 0.006);
    let noise = Noise::new(rng);
    let cuts = rng.range(55.0, 90.0);
    let ball = superellipsoid(vec3(0.085, 0.04, 0.045), (0.8, 0.9), 64);
    let loaf = ball.warp(|p| {
        let slash = if p.y > 0.01 { 0.1 * (turn((p.x + 0.4 * p.z) * cuts).x - 0.8).max(0.0) } else { 0.0 };
        p * (1.0 + 0.04 * noise.fractal(p * 40.0, 2) - slash)
    });
    mesh.add(&loaf, Pose::at(-0.06, 0.052, -0.03).yaw(rng.spread(0.5)));
    let slice = superellipsoid(vec3(0.009, 0.037, 0.042), (0.5, 0.9), 32);
    for k in 0..rng.count(1, 3) {
        let lean = Pose::at(0.05 + 0.02 * k as f32, 0.018 + 0.012 * (k + 1) as f32, -0.03);
        mesh.add(&slice, lean.roll(FRAC_PI_2 - 0.25 * k as f32));
    }
    let holes: Vec<(Vec3, f32)> = (0..14)
        .map(|_| {
            (vec3(rng.range(0.0, 0.09), rng.range(0.0, 0.05), rng.spread(0.035)), rng.range(0.005, 0.013))
        })
        .collect();
    let field = |p: Vec3| {
        let slab = cube(p - vec3(0.045, 0.024, 0.0), vec3(0.045, 0.022, 0.04)) - 0.002;
        let wedge = slab.max(p.z.abs() * 0.92 - 0.38 * p.x);
        holes.iter().fold(wedge, |d, (c, r)| carve(d, (p - *c).length() - r, 0.002))
    };
    let cheese = isosurface((vec3(-0.005, -0.003, -0.046), vec3(0.096, 0.055, 0.046)), 0.0026, 40.0, field);
    mesh.add(&cheese, Pose::at(0.04, 0.018, 0.05).yaw(rng.spread(0.6)));
    mesh.add(&cutlery(0), Pose::at(-0.1, 0.02, 0.07).yaw(-1.4).pitch(-FRAC_PI_2));
    mesh
}

/// A layered cake with a slice taken out, on a stand.
fn cake(rng: &mut Rng) -> Mesh {
    let (r, missing) = (0.11, rng.range(0.4, 1.2));
    let foot = [
        (0.0, 0.0),
        (0.6, 0.0),
        (0.5, 0.08),
        (0.12, 0.2),
        (0.12, 0.6),
        (0.4, 0.85),
        (1.2, 0.9),
        (1.2, 1.0),
        (0.0, 1.0),
    ];
    let mut mesh = lathe(&foot.map(|(x, y)| vec2(x * r, y * 0.09)), 48);
    let mut sector = vec![Vec2::ZERO];
    sector.extend((0..=40).map(|k| turn(missing + (TAU - missing) * k as f32 / 40.0) * r));
    let mut y = 0.09;
    for layer in 0..rng.count(2, 3) * 2 {
        let (thick, s) = if layer % 2 == 0 { (0.022, 1.0) } else { (0.006, 1.02) };
        let outline: Vec<Vec2> = sector.iter().map(|p| *p * s).collect();
        let slab = extrude(&outline, thick, 0.001).at(Pose::IDENTITY.pitch(-FRAC_PI_2));
        mesh.add(&slab, Pose::at(0.0, y + 0.5 * thick, 0.0));
        y += thick;
    }
    let blob =
        lathe(&curve(&[vec2(0.012, 0.0), vec2(0.014, 0.005), vec2(0.008, 0.012), vec2(0.0, 0.02)], 5), 16);
    let berry = ball(0.008, 14);
    for k in 0..12 {
        let a = missing + (TAU - missing) * (k as f32 + 0.5) / 12.0;
        let t = turn(a) * 0.085;
        mesh.add(&blob, Pose::at(t.x, y, -t.y));
        if k % 2 == 0 {
            mesh.add(&berry, Pose::at(t.x, y + 0.022, -t.y));
        }
    }
    mesh
}

/// A teapot with spout, handle and lid.
fn teapot(rng: &mut Rng) -> Mesh {
    let (r, h) = (rng.range(0.055, 0.075), rng.range(0.09, 0.13));
    let body = curve(&[vec2(0.6 * r, 0.0), vec2(r, 0.35 * h), vec2(0.9 * r, 0.75 * h), vec2(0.45 * r, h)], 8);
    let mut profile = vec![Vec2::ZERO];
    profile.extend(&body);
    profile.push(vec2(0.0, h));
    let mut mesh = lathe(&profile, 36);
    let lid = curve(&[vec2(0.48 * r, 0.0), vec2(0.3 * r, 0.1 * h), vec2(0.06 * r, 0.14 * h)], 5);
    mesh.add(&lathe(&lid, 28), Pose::at(0.0, h, 0.0));
    mesh.add(&ball(0.011, 14), Pose::at(0.0, 1.2 * h, 0.0));
    let spout = [
        vec3(0.8 * r, 0.35 * h, 0.0),
        vec3(1.3 * r, 0.5 * h, 0.0),
        vec3(1.5 * r, 0.8 * h, 0.0),
        vec3(1.8 * r, h, 0.0),
    ];
    mesh.add(&tube(&spout, &[0.3 * r, 0.22 * r, 0.15 * r, 0.12 * r], 16), Pose::IDENTITY);
    let arc = |i: usize| {
        let t = turn((i as f32 / 14.0 - 0.5) * PI);
        vec3(-0.75 * r - 0.8 * r * t.x, 0.55 * h + 0.35 * h * t.y, 0.0)
    };
    let path: Vec<Vec3> = (0..=14).map(arc).collect();
    mesh.add(&tube(&path, &[0.007; 15], 10), Pose::IDENTITY);
    mesh
}

/// A candle in a holder.
fn candle(rng: &mut Rng) -> Mesh {
    let h = rng.range(0.03, 0.2);
    let holder = [
        (0.0, 0.0),
        (0.045, 0.0),
        (0.046, 0.006),
        (0.015, 0.012),
        (0.01, h),
        (0.022, h + 0.01),
        (0.022, h + 0.03),
        (0.0, h + 0.03),
    ];
    let mut mesh = lathe(&holder.map(|(x, y)| vec2(x, y)), 28);
    let wax = rng.range(0.04, 0.2);
    mesh.add(&cylinder((0.011, 0.01), wax, 18), Pose::at(0.0, h + 0.02, 0.0));
    mesh.add(&cylinder((0.001, 0.001), 0.012, 6), Pose::at(0.0, h + 0.02 + wax, 0.0));
    mesh
}
