//! Sculptures on plinths in a small court.

use super::architecture::{column, floor, wall};
use super::mesh::{Mesh, Pose, turn};
use super::rng::{Noise, Rng};
use super::shapes::{block, cylinder, lathe, superellipsoid, tube};
use super::solid::{blend, capsule, carve, cube, ellipsoid, isosurface};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// One large sculpture, some smaller ones around it, a wall with niches behind.
pub(super) fn court(rng: &mut Rng) -> Mesh {
    let half = vec2(rng.range(3.5, 5.0), rng.range(3.0, 4.5));
    let mut mesh = floor(half, &mut rng.fork());
    backdrop(&mut mesh, half, &mut rng.fork());
    let main = sculpture((rng.range(1.3, 2.2), 84), &mut rng.fork());
    let pose = Pose::at(rng.spread(0.3), 0.0, rng.spread(0.3)).yaw(rng.angle());
    let stand = plinth(rng.range(0.5, 1.1), 0.6 * footprint(&main), &mut rng.fork());
    mesh.add(&stand, pose);
    mesh.add(&main, pose.shift(0.0, stand.extent().1.y - 0.005, 0.0));
    let small = rng.count(3, 5);
    for i in 0..small {
        let t = turn(i as f32 / small as f32 * TAU + rng.spread(0.3)) * rng.range(0.68, 0.8) * half;
        let piece = sculpture((rng.range(0.5, 1.0), 46), rng);
        let pose = Pose::at(t.x, 0.0, t.y).yaw(rng.angle());
        let stand = plinth(rng.range(0.5, 1.2), 0.6 * footprint(&piece), rng);
        mesh.add(&stand, pose);
        mesh.add(&piece, pose.shift(0.0, stand.extent().1.y - 0.004, 0.0));
    }
    mesh
}

/// The larger side of the lowest tenth of a mesh about x = z = 0.
fn footprint(mesh: &Mesh) -> f32 {
    let (lo, hi) = mesh.extent();
    let low = lo.y + 0.1 * (hi.y - lo.y);
    let foot = mesh.position.iter().filter(|p| p.y < low);
    foot.map(|p| p.x.abs().max(p.z.abs())).fold(0.0, f32::max) * 2.0
}

/// A base of `height` for a foot of about `radius`: square or round, moulded.
pub(super) fn plinth(height: f32, radius: f32, rng: &mut Rng) -> Mesh {
    let r = radius.max(0.12);
    let mut mesh = Mesh::default();
    let lip = 0.08 * height.min(0.8);
    if rng.chance(0.5) {
        let steps = rng.count(1, 3);
        let mut y = 0.0;
        for i in 0..steps {
            let wide = 2.0 * r + (steps - i) as f32 * 0.14;
            let step = block(vec3(wide, 0.09, wide), 0.01);
            mesh.add(&step, Pose::at(0.0, y, 0.0));
            y += 0.09;
        }
        mesh.add(&block(vec3(2.0 * r, height - y - lip, 2.0 * r), 0.012), Pose::at(0.0, y, 0.0));
        let top = block(vec3(2.0 * r + lip, lip, 2.0 * r + lip), 0.3 * lip);
        mesh.add(&top, Pose::at(0.0, height - lip, 0.0));
        if rng.chance(0.6) && height - y > 0.35 {
            let inner = vec2(1.3 * r, height - y - lip - 0.2);
            let panel = super::architecture::frame(inner, vec2(0.04, 0.03));
            for k in 0..4 {
                mesh.add(&panel, Pose::at(0.0, y + 0.1, 0.0).yaw(k as f32 * FRAC_PI_2).shift(0.0, 0.0, r));
            }
        }
        return mesh;
    }
    let mut profile = vec![Vec2::ZERO, vec2(1.25, 0.0), vec2(1.25, 0.08)];
    profile.extend(
        (0..=6)
            .map(|k| turn((k as f32 / 6.0 - 0.5) * PI))
            .map(|t| vec2(1.12 + 0.08 * t.x, 0.14 + 0.05 * t.y)),
    );
    profile.extend([vec2(1.0, 0.22), vec2(0.97, 0.84)]);
    profile.extend(
        (0..=6)
            .map(|k| turn(FRAC_PI_2 * k as f32 / 6.0))
            .map(|t| vec2(0.97 + 0.15 * (1.0 - t.x), 0.84 + 0.08 * t.y)),
    );
    profile.extend([vec2(1.16, 0.92), vec2(1.16, 1.0), vec2(0.0, 1.0)]);
    let scaled: Vec<Vec2> = profile.iter().map(|p| vec2(p.x * r * 1.1, p.y * height)).collect();
    mesh.add(&lathe(&scaled, 64), Pose::IDENTITY);
    mesh
}

/// A wall with niches or openings behind the court, and columns before it.
fn backdrop(mesh: &mut Mesh, half: Vec2, rng: &mut Rng) {
    let (height, thick) = (rng.range(2.6, 3.6), 0.5);
    let n = rng.count(2, 4);
    let bay = 2.0 * half.x / n as f32;
    let wide = rng.range(0.35, 0.6) * bay;
    let (low, high) = (rng.range(0.3, 0.9), height - 0.5);
    let holes: Vec<_> = (0..n)
        .map(|i| (i as f32 + 0.5) * bay - half.x)
        .map(|x| (vec2(x - 0.5 * wide, low), vec2(x + 0.5 * wide, high)))
        .collect();
    let closed = rng.chance(0.7);
    for side in 0..rng.count(1, 3) {
        let yaw = side as f32 * FRAC_PI_2;
        let reach = if side % 2 == 0 { half.y } else { half.x };
        let pose = Pose::IDENTITY.yaw(yaw).shift(0.0, 0.0, -reach - 0.5 * thick);
        mesh.add(&wall(vec3(2.0 * half.x + 1.0, height, thick), &holes), pose);
        if closed {
            let back = block(vec3(2.0 * half.x + 1.0, height, 0.1), 0.01);
            mesh.add(&back, pose.shift(0.0, 0.0, -0.5 * thick - 0.04));
        }
        let top = block(vec3(2.0 * half.x + 1.2, 0.12, thick + 0.25), 0.03);
        mesh.add(&top, pose.shift(0.0, height, 0.0));
        if closed {
            let pot = super::props::vessel(0.25 * wide.min(0.8), rng.range(0.4, 0.8), rng);
            holes.iter().for_each(|(lo, hi)| mesh.add(&pot, pose.shift(0.5 * (lo.x + hi.x), lo.y, 0.0)));
        }
    }
    if rng.chance(0.5) {
        let shaft = column(height, 0.16, rng);
        for i in 0..=n {
            mesh.add(&shaft, Pose::at(i as f32 * bay - half.x, 0.0, 0.3 - half.y));
        }
    }
}

/// A sculpture about `height` tall from y = 0, its field sampled `cells` times over the height.
pub(super) fn sculpture((height, cells): (f32, usize), rng: &mut Rng) -> Mesh {
    let unit = match rng.below(7) {
        0 => figure(cells, rng),
        1 => pierced(cells, rng),
        2 => tower(rng),
        3 => knot(rng),
        4 => minimal_surface(cells, rng),
        5 => cairn(rng),
        _ => bust(cells, rng),
    };
    let (lo, hi) = unit.extent();
    let s = height / (hi.y - lo.y);
    let middle = 0.5 * (lo + hi);
    unit.at(Pose::IDENTITY.scale(s).shift(-middle.x, -lo.y, -middle.z))
}

/// A standing figure of blended limbs in a random pose.
fn figure(cells: usize, rng: &mut Rng) -> Mesh {
    let lean = rng.spread(0.12);
    let hip = vec3(0.0, 0.9, 0.0);
    let chest = vec3(lean, 1.32, rng.spread(0.06));
    let head = chest + vec3(lean * 0.5, 0.38, rng.range(0.0, 0.06));
    let mut limbs = vec![
        ((hip, chest), (0.14, 0.17)),
        ((chest, head), (0.07, 0.06)),
        ((head, head + Vec3::Y * 0.06), (0.105, 0.09)),
    ];
    for side in [-1.0, 1.0] {
        let stride = rng.spread(0.2);
        let (hip_joint, knee) = (hip + vec3(0.1 * side, -0.02, 0.0), vec3(0.14 * side, 0.48, stride + 0.05));
        let foot = vec3(0.14 * side + rng.spread(0.04), 0.06, stride - 0.04);
        limbs.extend([
            ((hip_joint, knee), (0.1, 0.07)),
            ((knee, foot), (0.07, 0.05)),
            ((foot, foot + vec3(0.0, -0.02, 0.14)), (0.055, 0.04)),
        ]);
        let shoulder = chest + vec3(0.2 * side, 0.1, 0.0);
        let raised = rng.range(-1.3, 1.3);
        let t = turn(raised);
        let elbow = shoulder + 0.28 * vec3(side * t.x, t.y, rng.spread(0.6)).normalize();
        let hand = elbow
            + 0.28 * vec3(side * rng.range(-0.6, 0.6), rng.spread(1.0), rng.range(0.1, 1.0)).normalize();
        limbs.extend([
            ((shoulder, elbow), (0.065, 0.05)),
            ((elbow, hand), (0.05, 0.035)),
            ((hand, hand), (0.05, 0.05)),
        ]);
    }
    let robe = rng.chance(0.4);
    let folds = rng.count(7, 14) as f32;
    let field = move |p: Vec3| {
        let body = limbs.iter().fold(1e3, |d, (ends, r)| blend(d, capsule(p, *ends, *r), 0.09));
        let base = cube(p - vec3(0.0, 0.02, 0.03), vec3(0.27, 0.03, 0.3));
        let whole = blend(body, base, 0.03);
        if !robe {
            return whole;
        }
        let angle = libm::atan2f(p.z, p.x);
        let wave = 0.02 * turn(angle * folds + p.y * 2.0).x * (1.3 - p.y).max(0.0);
        let cone = vec2(p.x, p.z).length() - (0.3 - 0.14 * p.y) - wave;
        blend(whole, cone.max(p.y - 1.15).max(-p.y), 0.06)
    };
    isosurface((vec3(-0.85, -0.06, -0.85), vec3(0.85, 2.3, 0.85)), 2.0 / cells as f32, 60.0, field)
}

/// Smooth masses with holes through them.
fn pierced(cells: usize, rng: &mut Rng) -> Mesh {
    let lumps: Vec<(Vec3, Vec3)> = (0..rng.count(3, 5))
        .map(|i| {
            let at = vec3(rng.spread(0.35), 0.45 + 0.4 * i as f32, rng.spread(0.25));
            (at, vec3(rng.range(0.3, 0.6), rng.range(0.3, 0.5), rng.range(0.25, 0.45)))
        })
        .collect();
    let holes: Vec<(Vec3, Vec3, f32)> = (0..rng.count(1, 3))
        .map(|_| {
            let through = (rng.direction() * vec3(1.0, 0.4, 1.0)).normalize_or(Vec3::X);
            let at = lumps[rng.below(lumps.len())].0 + vec3(rng.spread(0.15), rng.spread(0.2), 0.0);
            (at - through * 1.5, at + through * 1.5, rng.range(0.12, 0.24))
        })
        .collect();
    let field = move |p: Vec3| {
        let mass = lumps.iter().fold(1e3, |d, (at, size)| blend(d, ellipsoid(p - *at, *size), 0.25));
        let cut = holes.iter().fold(mass, |d, (a, b, r)| carve(d, capsule(p, (*a, *b), (*r, *r)), 0.12));
        cut.max(0.06 - p.y)
    };
    isosurface((vec3(-1.1, -0.06, -1.0), vec3(1.1, 2.8, 1.0)), 2.4 / cells as f32, 60.0, field)
}

/// A twisted, tapered column of any cross-section.
fn tower(rng: &mut Rng) -> Mesh {
    let size = vec3(rng.range(0.3, 0.5), 1.0, rng.range(0.3, 0.5));
    let shape =
        superellipsoid(size, (rng.range(0.1, 0.4), rng.range(0.2, 1.8)), 96).at(Pose::at(0.0, 1.0, 0.0));
    let (twist, waist, sway) = (rng.spread(3.0), rng.range(0.0, 0.5), rng.spread(0.4));
    shape.warp(|p| {
        let t = turn(p.y * twist);
        let narrow = 1.0 - waist * turn(p.y * 2.4).y.max(0.0);
        let bend = sway * turn(p.y * 1.7).y;
        vec3((p.x * t.x - p.z * t.y) * narrow + bend, p.y, (p.x * t.y + p.z * t.x) * narrow)
    })
}

/// A torus knot of thick tube.
fn knot(rng: &mut Rng) -> Mesh {
    let (p, q) = *rng.pick(&[(2.0, 3.0), (3.0, 2.0), (2.0, 5.0), (3.0, 4.0), (1.0, 4.0)]);
    let (steps, fat) = (420, rng.range(0.09, 0.15));
    let at = |i: usize| {
        let t = (i % steps) as f32 / steps as f32 * TAU;
        let (a, b) = (turn(p * t), turn(q * t));
        let r = 0.62 + 0.27 * b.x;
        vec3(r * a.x, 1.0 + r * a.y, 0.34 * b.y)
    };
    let path: Vec<Vec3> = (0..=steps).map(at).collect();
    let mut mesh = tube(&path, &vec![fat; steps + 1], 20);
    let (lo, _) = mesh.extent();
    mesh.add(&cylinder((0.3, 0.16), 0.16, 40), Pose::at(0.0, lo.y - 0.08, 0.0));
    mesh
}

/// A ball or block cut from a periodic minimal surface.
fn minimal_surface(cells: usize, rng: &mut Rng) -> Mesh {
    let (density, thick, round) = (rng.range(5.0, 9.0), rng.range(0.12, 0.3), rng.chance(0.5));
    let diamond = rng.chance(0.4);
    let field = move |p: Vec3| {
        let q = p * density;
        let [x, y, z] = q.to_array().map(turn);
        let wave = match diamond {
            true => x.x + y.x + z.x,
            false => x.y * y.x + y.y * z.x + z.y * x.x,
        };
        let sheet = (wave.abs() - thick * 1.5) / density;
        let c = p - Vec3::Y;
        let hull = if round { c.length() - 0.95 } else { cube(c, Vec3::splat(0.8)) };
        sheet.max(hull)
    };
    isosurface((vec3(-1.0, 0.0, -1.0), vec3(1.0, 2.0, 1.0)), 2.0 / cells as f32, 60.0, field)
}

/// Flat stones balanced on each other.
fn cairn(rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let (mut y, mut wide) = (0.0, 0.6);
    for _ in 0..rng.count(4, 8) {
        let size = vec3(wide * rng.range(0.8, 1.2), wide * rng.range(0.3, 0.7), wide * rng.range(0.8, 1.2));
        let stone = super::plants::rock(size, rng);
        let (lo, hi) = stone.extent();
        mesh.add(&stone, Pose::at(rng.spread(0.08 * wide), y - lo.y, rng.spread(0.08 * wide)));
        y += 0.93 * (hi.y - lo.y);
        wide *= rng.range(0.75, 1.0);
    }
    mesh
}

/// A head on shoulders.
fn bust(cells: usize, rng: &mut Rng) -> Mesh {
    let noise = Noise::new(rng);
    let (jaw, nose, curls) = (rng.range(0.26, 0.33), rng.range(0.05, 0.1), rng.range(0.0, 0.06));
    let tilt = rng.spread(0.25);
    let field = move |p: Vec3| {
        let t = turn(tilt);
        let h = p - vec3(0.0, 1.25, 0.05);
        let q = vec3(t.x * h.x - t.y * h.y, t.y * h.x + t.x * h.y, h.z);
        let skull = ellipsoid(q - vec3(0.0, 0.12, -0.06), vec3(0.34, 0.4, 0.42));
        let mut head = blend(skull, ellipsoid(q - vec3(0.0, -0.18, 0.1), vec3(jaw, 0.3, 0.27)), 0.15);
        head = blend(head, capsule(q, (vec3(0.0, 0.1, 0.36), vec3(0.0, -0.08, 0.44)), (0.03, nose)), 0.07);
        head = blend(head, ellipsoid(q - vec3(0.0, 0.17, 0.3), vec3(0.27, 0.05, 0.08)), 0.08);
        for side in [-1.0, 1.0] {
            let eye = q - vec3(0.13 * side, 0.07, 0.35);
            head = carve(head, eye.length() - 0.075, 0.05);
            head = blend(head, (eye + Vec3::Z * 0.03).length() - 0.062, 0.015);
            head = blend(head, ellipsoid(q - vec3(0.35 * side, 0.02, -0.05), vec3(0.05, 0.12, 0.07)), 0.03);
        }
        head = blend(head, ellipsoid(q - vec3(0.0, -0.22, 0.35), vec3(0.1, 0.025, 0.04)), 0.025);
        head = blend(head, ellipsoid(q - vec3(0.0, -0.28, 0.34), vec3(0.08, 0.03, 0.04)), 0.025);
        let hair = ellipsoid(q - vec3(0.0, 0.2, -0.12), vec3(0.38, 0.38, 0.42));
        head = head.min(hair + curls * noise.at(q * 11.0) + 0.01);
        let neck = capsule(p, (vec3(0.0, 0.5, -0.06), vec3(0.0, 1.1, -0.02)), (0.2, 0.16));
        let shoulders = ellipsoid(p - vec3(0.0, 0.3, -0.05), vec3(0.75, 0.4, 0.33));
        let body = blend(neck, shoulders, 0.2);
        let folds = 0.02 * turn((p.x * 0.8 + p.y) * 22.0 + 3.0 * noise.at(p * 2.0)).x * f32::from(p.y < 0.55);
        blend(head, body + folds, 0.05).max(0.04 - p.y)
    };
    isosurface((vec3(-0.9, 0.0, -0.7), vec3(0.9, 2.0, 0.75)), 2.0 / cells as f32, 60.0, field)
}
