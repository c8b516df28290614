//! Machines of pipes, gears, plates and bolts.

use super::mesh::{Mesh, Pose, turn};
use super::rng::Rng;
use super::shapes::{Segments, ball, block, cuboid, curve, cylinder, extrude, lathe, ring, torus, tube};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// A plate with the counter-clockwise `outline` (star-shaped about the origin) and a round hole of
/// radius `bore`, `depth` thick along z about z = 0.
pub(super) fn bored(outline: &[Vec2], bore: f32, depth: f32) -> Mesh {
    let n = outline.len();
    let fine = (32 / n).max(1);
    let outer: Vec<Vec2> = (0..n * fine)
        .map(|k| outline[k / fine].lerp(outline[(k / fine + 1) % n], (k % fine) as f32 / fine as f32))
        .collect();
    let inner: Vec<Vec2> = outer.iter().map(|p| p.normalize_or(Vec2::X) * bore).collect();
    ring(&outer, &inner, (depth, 0.06 * depth))
}

/// A gear wheel of `radius`, `depth` thick along z, bored, with a hub.
pub(super) fn gear(radius: f32, depth: f32, rng: &mut Rng) -> Mesh {
    let teeth = rng.count(8, 28);
    let root = radius * (1.0 - rng.range(2.0, 3.2) / (teeth as f32 + 4.0));
    let outline: Vec<Vec2> = (0..4 * teeth)
        .map(|i| {
            let phase = [0.0, 0.18, 0.42, 0.6][i % 4];
            let r = [root, radius, radius, root][i % 4];
            turn((i / 4) as f32 / teeth as f32 * TAU + phase / teeth as f32 * TAU) * r
        })
        .collect();
    let bore = rng.range(0.15, 0.6) * radius;
    let mut mesh = bored(&outline, bore, depth);
    if bore > 0.35 * radius {
        let spokes = rng.count(3, 6);
        let bar = [vec2(0.0, -0.07), vec2(1.03, -0.1), vec2(1.03, 0.1), vec2(0.0, 0.07)].map(|p| p * bore);
        for k in 0..spokes {
            mesh.add(
                &extrude(&bar, 0.5 * depth, 0.02 * depth),
                Pose::IDENTITY.roll(k as f32 / spokes as f32 * TAU),
            );
        }
    }
    let hub: Vec<Vec2> = (0..24).map(|k| turn(k as f32 / 24.0 * TAU) * 0.22 * radius).collect();
    mesh.add(&bored(&hub, 0.1 * radius, 1.5 * depth), Pose::IDENTITY);
    mesh
}

/// A hexagonal bolt head on a washer, `size` across, pointing along +z.
pub(super) fn bolt(size: f32) -> Mesh {
    let r = 0.5 * size;
    let washer = [Vec2::ZERO, vec2(r, 0.0), vec2(0.94 * r, 0.14 * size), vec2(0.0, 0.14 * size)];
    let mut mesh = lathe(&washer, 12);
    let head =
        [Vec2::ZERO, vec2(0.8, 0.0), vec2(0.8, 0.5), vec2(0.65, 0.6), Vec2::new(0.0, 0.6)].map(|p| p * r);
    mesh.add(&super::shapes::lathe_with(&head, 6, 0.0), Pose::at(0.0, 0.13 * size, 0.0));
    mesh.at(Pose::IDENTITY.pitch(FRAC_PI_2))
}

/// A machine on a floor before a wall: tanks, pipes, gear trains, cabinets.
pub(super) fn plant(rng: &mut Rng) -> Mesh {
    let half = vec2(rng.range(2.2, 3.4), rng.range(1.6, 2.4));
    let height = rng.range(2.6, 3.6);
    let mut mesh =
        plated(vec2(2.0 * half.x, 2.0 * half.y), rng).at(Pose::at(0.0, 0.0, half.y).pitch(-FRAC_PI_2));
    mesh.add(&plated(vec2(2.0 * half.x, height), rng), Pose::at(0.0, 0.0, -half.y));
    if rng.chance(0.6) {
        let side = *rng.pick(&[-1.0, 1.0]);
        let wall = plated(vec2(2.0 * half.y, height), rng);
        mesh.add(&wall, Pose::at(side * half.x, 0.0, 0.0).yaw(-side * FRAC_PI_2));
    }
    let slots = (half.x * 2.0 / 1.1) as usize;
    for i in 0..slots {
        let x = (i as f32 + 0.5) / slots as f32 * 2.0 * half.x - half.x;
        let back = Pose::at(x + rng.spread(0.1), 0.0, -half.y + rng.range(0.45, 0.7));
        unit(&mut mesh, back, rng);
        if rng.chance(0.5) {
            unit(
                &mut mesh,
                Pose::at(x, 0.0, rng.range(0.1, 0.6) * half.y).yaw(rng.spread(0.5)).scale(0.7),
                rng,
            );
        }
    }
    for _ in 0..rng.count(10, 22) {
        let lo = vec3(-half.x, 0.15, -half.y + 0.06);
        let hi = vec3(half.x, height, -half.y + rng.range(0.3, 1.2));
        pipe_run(&mut mesh, (lo, hi), rng);
    }
    for _ in 0..rng.count(3, 8) {
        cable(&mut mesh, vec3(half.x, height, -half.y + 0.1), rng);
    }
    mesh
}

/// One machine part of about 1 m that stands at `pose`.
pub(super) fn unit(mesh: &mut Mesh, pose: Pose, rng: &mut Rng) {
    match rng.below(5) {
        0 => mesh.add(&tank(rng), pose),
        1 | 2 => mesh.add(&gear_train(rng), pose),
        3 => mesh.add(&console(rng), pose),
        _ => mesh.add(&motor(rng), pose),
    }
}

/// A wall of bolted plates of `size` in x, y, facing +z.
pub(super) fn plated(size: Vec2, rng: &mut Rng) -> Mesh {
    let mut mesh = cuboid(size.extend(0.1)).at(Pose::at(0.0, 0.0, -0.08));
    let n = (size / rng.range(0.5, 1.1)).ceil();
    let cell = size / n;
    let (gap, thick, screws) = (rng.range(0.006, 0.02), rng.range(0.015, 0.04), rng.chance(0.7));
    let head = bolt(0.03);
    for (i, j) in (0..n.x as usize).flat_map(|i| (0..n.y as usize).map(move |j| (i, j))) {
        let at = Pose::at((i as f32 + 0.5) * cell.x - 0.5 * size.x, j as f32 * cell.y + 0.5 * gap, -0.035);
        let plate = cell - Vec2::splat(gap);
        if rng.chance(0.12) {
            let slots = (plate.y / 0.05) as usize;
            mesh.add(
                &super::architecture::frame(plate - 0.08, vec2(0.04, 2.0 * thick)),
                at.shift(0.0, 0.04, 0.0),
            );
            for k in 0..slots {
                let slat = block(vec3(plate.x - 0.08, 0.006, 0.04), 0.002);
                mesh.add(&slat, at.shift(0.0, (k as f32 + 0.5) * 0.05, 0.0).pitch(0.6));
            }
            continue;
        }
        mesh.add(&block(plate.extend(2.0 * thick), 0.006), at);
        if screws {
            for (sx, y) in [(-1.0, 0.05), (1.0, 0.05), (-1.0, plate.y - 0.05), (1.0, plate.y - 0.05)] {
                mesh.add(&head, at.shift(sx * (0.5 * plate.x - 0.05), y, thick));
            }
        }
    }
    mesh
}

/// A pressure tank on legs or lying in saddles, with a flange of bolts and a valve.
fn tank(rng: &mut Rng) -> Mesh {
    let (r, h) = (rng.range(0.22, 0.4), rng.range(0.7, 1.4));
    let dome = |low: bool| {
        (0..=10).map(move |k| turn(k as f32 / 10.0 * FRAC_PI_2)).map(move |t| match low {
            true => vec2(t.y * r, 0.45 * r * (1.0 - t.x)),
            false => vec2(t.x * r, 0.45 * r + h + 0.45 * r * t.y),
        })
    };
    let profile: Vec<Vec2> = dome(true).chain(dome(false)).map(|p| vec2(p.x.max(0.0), p.y)).collect();
    let mut body = lathe(&profile, 48);
    for k in 0..rng.count(1, 3) {
        let y = 0.45 * r + h * (0.15 + 0.35 * k as f32);
        body.add(&torus(r, 0.018, Segments { around: 48, across: 10 }), Pose::at(0.0, y, 0.0));
    }
    let neck = cylinder((0.3 * r, 0.3 * r), 0.5 * r, 24);
    body.add(&neck, Pose::at(0.0, h + 0.7 * r, 0.0));
    body.add(&flange(0.45 * r), Pose::at(0.0, h + 1.15 * r, 0.0));
    if rng.chance(0.6) {
        body.add(&valve(0.5 * r), Pose::at(0.0, 0.5 * h, r));
    }
    let leg = block(vec3(0.05, 0.45, 0.08), 0.008);
    let mut mesh = body.at(Pose::at(0.0, 0.3, 0.0));
    for k in 0..4 {
        mesh.add(&leg, Pose::IDENTITY.yaw((k as f32 + 0.5) * FRAC_PI_2).shift(0.0, 0.0, 0.8 * r));
    }
    mesh
}

/// A disc with bolts around, of `radius`, upright.
pub(super) fn flange(radius: f32) -> Mesh {
    let mut mesh = cylinder((radius, radius), 0.25 * radius, 32);
    let head = bolt(0.24 * radius);
    for k in 0..8 {
        let at = Pose::IDENTITY.yaw(k as f32 / 8.0 * TAU).shift(0.0, 0.25 * radius, 0.78 * radius);
        mesh.add(&head, at.pitch(-FRAC_PI_2));
    }
    mesh
}

/// A hand wheel on a stem along +z.
pub(super) fn valve(radius: f32) -> Mesh {
    let mut mesh = cylinder((0.18 * radius, 0.18 * radius), 1.1 * radius, 16);
    let rim = Pose::at(0.0, radius, 0.0);
    mesh.add(&torus(radius, 0.09 * radius, Segments { around: 40, across: 10 }), rim);
    let spoke = cylinder((0.06 * radius, 0.06 * radius), 2.0 * radius, 8);
    for k in 0..3 {
        let at = rim.yaw(k as f32 / 3.0 * PI).pitch(FRAC_PI_2);
        mesh.add(&spoke, at.shift(0.0, -radius, 0.0));
    }
    mesh.add(&ball(0.2 * radius, 14), rim);
    mesh.at(Pose::IDENTITY.pitch(FRAC_PI_2))
}

/// Gears in mesh on a bored plate that stands on feet.
fn gear_train(rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let size = vec2(rng.range(0.8, 1.1), rng.range(0.9, 1.5));
    mesh.add(&block(size.extend(0.05), 0.01), Pose::at(0.0, 0.08, -0.06));
    mesh.add(&block(vec3(size.x + 0.1, 0.1, 0.5), 0.015), Pose::at(0.0, 0.0, 0.05));
    let shaft = cylinder((0.02, 0.02), 0.2, 14);
    let (mut at, mut last) = (vec2(rng.spread(0.2), rng.range(0.35, 0.55)), rng.range(0.15, 0.28));
    for k in 0..rng.count(4, 9) {
        let pose = Pose::at(at.x, at.y, 0.02 + 0.05 * (k % 2) as f32);
        mesh.add(&gear(last, 0.05, rng), pose.roll(rng.angle()));
        mesh.add(&shaft, Pose::at(at.x, at.y, -0.05).pitch(FRAC_PI_2));
        let next = rng.range(0.08, 0.26);
        let away = turn(rng.range(0.0, PI)) * (last + next) * 0.94;
        at = (at + away).clamp(vec2(-0.5 * size.x, 0.3), vec2(0.5 * size.x, size.y));
        last = next;
    }
    let head = bolt(0.05);
    for (sx, y) in [(-1.0, 0.16), (1.0, 0.16), (-1.0, size.y), (1.0, size.y)] {
        mesh.add(&head, Pose::at(sx * (0.5 * size.x - 0.06), y, -0.035));
    }
    mesh
}

/// A control cabinet with knobs, buttons, dials and a sloped desk.
fn console(rng: &mut Rng) -> Mesh {
    let (w, h, d) = (rng.range(0.7, 1.0), rng.range(1.1, 1.8), 0.45);
    let side = [
        vec2(-0.5 * d, 0.0),
        vec2(0.5 * d, 0.0),
        vec2(0.5 * d, 0.75),
        vec2(0.05, 0.9),
        vec2(0.02, h),
        vec2(-0.5 * d, h),
    ];
    let mut mesh = extrude(&side, w, 0.015).at(Pose::IDENTITY.yaw(-FRAC_PI_2));
    let face = Pose::at(0.0, 0.95, 0.045).pitch(-0.03);
    let (columns, rows) = ((w / 0.13) as usize, ((h - 1.0) / 0.13).max(1.0) as usize);
    for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let x = ((i as f32 + 0.5) / columns as f32 - 0.5) * (w - 0.06);
        let at = face.shift(x, 0.04 + j as f32 * 0.13, 0.0);
        match rng.below(4) {
            0 => mesh.add(&cylinder((0.03, 0.024), 0.03, 20), at.pitch(FRAC_PI_2)),
            1 => mesh.add(&block(vec3(0.05, 0.05, 0.03), 0.006), at.shift(0.0, -0.025, 0.0)),
            2 => {
                let dial =
                    super::props::hollow(&[vec2(0.05, 0.0), vec2(0.05, 0.01), vec2(0.05, 0.025)], 0.006);
                mesh.add(&dial, at.pitch(FRAC_PI_2));
                mesh.add(
                    &block(vec3(0.003, 0.035, 0.004), 0.001),
                    at.shift(0.0, 0.0, 0.008).roll(rng.angle()),
                );
            }
            _ => {
                mesh.add(&cylinder((0.012, 0.012), 0.01, 12), at.pitch(FRAC_PI_2));
                mesh.add(&cylinder((0.004, 0.006), 0.035, 8), at.pitch(FRAC_PI_2 + 0.4));
            }
        }
    }
    let desk = Pose::at(0.0, 0.765, 0.5 * d - 0.1).pitch(FRAC_PI_2 - 0.62);
    for _ in 0..rng.count(6, 14) {
        let at = desk.shift(rng.spread(0.5 * w - 0.06), 0.0, 0.0);
        mesh.add(&block(vec3(0.03, 0.03, 0.02), 0.004), at.shift(0.0, rng.range(-0.05, 0.03), 0.048));
    }
    mesh
}

/// A finned motor on a bed plate with a coupling.
fn motor(rng: &mut Rng) -> Mesh {
    let (r, long) = (rng.range(0.18, 0.3), rng.range(0.5, 0.9));
    let mut mesh = block(vec3(long + 0.5, 0.12, 2.2 * r), 0.015);
    let axis = Pose::at(-0.5 * long, r + 0.2, 0.0).roll(-FRAC_PI_2);
    mesh.add(&cylinder((r, r), long, 36), axis);
    let fins = rng.count(18, 32);
    let fin = block(vec3(0.008, 0.8 * long, 0.05), 0.002);
    for k in 0..fins {
        let at = axis.yaw(k as f32 / fins as f32 * TAU);
        mesh.add(&fin, at.shift(0.0, 0.1 * long, r + 0.015));
    }
    mesh.add(&flange(1.15 * r), axis.shift(0.0, long - 0.02, 0.0));
    mesh.add(&cylinder((0.2 * r, 0.2 * r), 0.3, 20), axis.shift(0.0, long, 0.0));
    mesh.add(&block(vec3(0.24, 0.14, 0.2), 0.015), Pose::at(0.0, 2.0 * r + 0.18, 0.0));
    for x in [-0.3, 0.3] {
        mesh.add(&block(vec3(0.1, r + 0.1, 1.6 * r), 0.01), Pose::at(x * long, 0.1, 0.0));
    }
    mesh
}

/// A pipe with elbows and flanges along the axes between two corners.
fn pipe_run(mesh: &mut Mesh, (lo, hi): (Vec3, Vec3), rng: &mut Rng) {
    let r = rng.range(0.015, 0.07);
    let somewhere = |rng: &mut Rng| vec3(rng.range(lo.x, hi.x), rng.range(lo.y, hi.y), rng.range(lo.z, hi.z));
    let mut p = somewhere(rng).with_z(lo.z - 0.1);
    let mut corners = vec![p];
    let mut axis = 1;
    p.z = rng.range(lo.z + 4.0 * r, hi.z.max(lo.z + 5.0 * r));
    corners.push(p);
    for _ in 0..rng.count(2, 6) {
        let to = somewhere(rng);
        axis = 1 - axis;
        p[axis] = to[axis];
        if p.distance(corners[corners.len() - 1]) > 6.0 * r {
            corners.push(p);
        }
    }
    corners.push(if rng.chance(0.5) {
        p.with_z(lo.z - 0.1)
    } else {
        p.with_y(if rng.chance(0.5) { -0.1 } else { hi.y })
    });
    let path = rounded(&corners, 2.2 * r);
    mesh.add(&tube(&path, &vec![r; path.len()], 18), Pose::IDENTITY);
    for pair in corners.windows(2) {
        let along = (pair[1] - pair[0]).normalize_or(Vec3::Y);
        for (from, sign) in [(pair[0], 1.0), (pair[1], -1.0)] {
            let p = from + along * sign * 2.6 * r;
            let collar = cylinder((1.35 * r, 1.35 * r), 0.7 * r, 20);
            mesh.add(&collar, Pose::at(p.x, p.y, p.z).stand_on(along * sign));
        }
    }
}

/// A polyline with arcs of about `radius` for corners.
pub(super) fn rounded(corners: &[Vec3], radius: f32) -> Vec<Vec3> {
    let mut path = vec![corners[0]];
    for w in corners.windows(3) {
        let [a, b, c] = [w[0], w[1], w[2]];
        let r = radius.min(0.45 * a.distance(b)).min(0.45 * b.distance(c));
        let (from, to) = (b + (a - b).normalize_or_zero() * r, b + (c - b).normalize_or_zero() * r);
        path.extend((0..=6).map(|k| k as f32 / 6.0).map(|t| from.lerp(b, t).lerp(b.lerp(to, t), t)));
    }
    path.push(corners[corners.len() - 1]);
    path
}

/// A cable that sags along the back wall and stands out from it.
fn cable(mesh: &mut Mesh, reach: Vec3, rng: &mut Rng) {
    let points: Vec<Vec2> =
        (0..rng.count(3, 5)).map(|_| vec2(rng.range(0.0, 2.0 * reach.x), rng.range(0.3, reach.y))).collect();
    let z = reach.z + rng.range(0.0, 0.5);
    let path: Vec<Vec3> = curve(&points, 12).iter().map(|p| vec3(p.x - reach.x, p.y, z)).collect();
    mesh.add(&tube(&path, &vec![rng.range(0.006, 0.02); path.len()], 10), Pose::IDENTITY);
}
