//! A workshop or a kitchen: a bench along a wall, shelves, hanging tools and pots.

use super::architecture::{floor, wall, window};
use super::furniture::{cabinet, chair, table};
use super::mesh::{Mesh, Pose, turn};
use super::props::{bottle, bowl, crate_of_slats, hollow, lamp, mug, plate};
use super::rng::Rng;
use super::settle::Ground;
use super::shapes::{Segments, block, cuboid, cylinder, extrude, lathe, torus, tube};
use super::tools::{cutlery, jar, pan, tool};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Two walls and what stands before them; the front is open.
pub(super) fn workshop(rng: &mut Rng) -> Mesh {
    let half = vec2(rng.range(1.6, 2.4), rng.range(1.2, 1.7));
    let height = rng.range(2.3, 2.8);
    let mut mesh = floor(half, &mut rng.fork());
    let kitchen = rng.chance(0.5);
    let back = Pose::at(0.0, 0.0, -half.y);
    let x = rng.spread(0.4 * half.x);
    let pane = (vec2(x - 0.45, 1.25), vec2(x + 0.45, 2.0));
    mesh.add(&wall(vec3(2.0 * half.x, height, 0.2), &[pane]), back.shift(0.0, 0.0, -0.1));
    mesh.add(&window(pane.1 - pane.0, 0.2, rng), back.shift(x, pane.0.y, -0.1));
    let side = *rng.pick(&[-1.0, 1.0]);
    let left = Pose::at(side * half.x, 0.0, 0.0).yaw(-side * FRAC_PI_2);
    mesh.add(&wall(vec3(2.0 * half.y, height, 0.2), &[]), left.shift(0.0, 0.0, -0.1));
    if rng.chance(0.5) {
        mesh.add(&cuboid(vec3(2.0 * half.x + 0.4, 0.15, 2.0 * half.y + 0.4)), Pose::at(0.0, height, 0.0));
    }
    let free = [(-half.x, pane.0.x - 0.12), (pane.1.x + 0.12, half.x)];
    if kitchen {
        counters(&mut mesh, (half, back), rng);
        tiles(&mut mesh, (half, back), rng);
    } else {
        bench(&mut mesh, (half, back), rng);
    }
    for (from, to) in free {
        let span = Span { from: from + 0.08, to: to - 0.08 };
        if kitchen { hang_pans(&mut mesh, back, span, rng) } else { hang_tools(&mut mesh, back, span, rng) }
    }
    shelves(&mut mesh, (left, half.y), rng);
    let stool = if rng.chance(0.5) { stool(rng) } else { chair(rng) };
    mesh.add(&stool, Pose::at(rng.spread(0.6), 0.0, rng.range(-0.1, 0.5)).yaw(rng.angle()));
    for _ in 0..rng.count(1, 4) {
        let at = Pose::at(rng.spread(half.x - 0.4), 0.0, rng.range(0.1, half.y - 0.3)).yaw(rng.angle());
        let size = vec3(rng.range(0.35, 0.55), rng.range(0.2, 0.35), rng.range(0.25, 0.4));
        mesh.add(&crate_of_slats(size, rng), at);
        if rng.chance(0.6) {
            heap(&mut mesh, (at.shift(0.0, 0.03, 0.0), 0.4 * size.z, 8), rng);
        }
    }
    mesh
}

/// Small things settled about the place `at`, at most `half` away.
fn heap(mesh: &mut Mesh, (at, half, count): (Pose, f32, usize), rng: &mut Rng) {
    let mut ground = Ground::new(half * 1.2, 0.05, |_, _| 0.0);
    for _ in 0..count {
        let piece = match rng.below(6) {
            0 => jar(rng.range(0.02, 0.045), rng),
            1 => cylinder((0.03, 0.03), rng.range(0.03, 0.15), 20),
            2 => block(vec3(rng.range(0.03, 0.15), 0.03, rng.range(0.03, 0.1)), 0.003),
            3 => torus(0.035, 0.012, Segments { around: 28, across: 10 }),
            _ => tool(rng),
        };
        if let Some(pose) = ground.drop(&piece, rng.in_rect(Vec2::splat(half * 0.6)), rng) {
            mesh.add(&piece, at * pose);
        }
    }
}

/// A work bench with a vise, drawers, tools and shavings on it.
fn bench(mesh: &mut Mesh, (half, back): (Vec2, Pose), rng: &mut Rng) {
    let size = vec3(2.0 * half.x - 0.5, rng.range(0.82, 0.92), rng.range(0.6, 0.75));
    let at = back.shift(0.0, 0.0, 0.5 * size.z + 0.02);
    mesh.add(&block(vec3(size.x, 0.06, size.z), 0.006), at.shift(0.0, size.y - 0.06, 0.0));
    let post = block(vec3(0.09, size.y - 0.06, 0.09), 0.008);
    for (sx, sz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        mesh.add(&post, at.shift(sx * (0.5 * size.x - 0.1), 0.0, sz * (0.5 * size.z - 0.08)));
    }
    mesh.add(&block(vec3(size.x - 0.3, 0.03, size.z - 0.1), 0.004), at.shift(0.0, 0.2, 0.0));
    let drawers = cabinet(vec3(rng.range(0.5, 0.9), size.y - 0.27, size.z - 0.12), rng);
    mesh.add(&drawers, at.shift(rng.spread(0.2) * size.x, 0.22, 0.0));
    for _ in 0..rng.count(2, 4) {
        let x = rng.spread(0.5 * size.x - 0.3);
        let below = crate_of_slats(vec3(0.35, 0.25, 0.4), rng);
        mesh.add(&below, at.shift(x, 0.23, 0.0).yaw(rng.spread(0.2)));
    }
    let top = at.shift(0.0, size.y, 0.0);
    mesh.add(&vise(rng), top.shift(-0.5 * size.x + 0.3, 0.0, 0.5 * size.z - 0.1));
    let long = (size.x / 0.5) as usize;
    for k in 0..long {
        let x = ((k as f32 + 0.5) / long as f32 - 0.5) * (size.x - 0.6) + 0.2;
        match rng.below(5) {
            0 => mesh.add(&lamp(0.45, rng), top.shift(x, 0.0, -0.15)),
            1 => mesh.add(&toolbox(rng), top.shift(x, 0.0, -0.1).yaw(rng.spread(0.4))),
            _ => heap(mesh, (top.shift(x, 0.0, 0.0), 0.2, 7), rng),
        }
    }
}

/// A vise whose jaws open along z.
fn vise(rng: &mut Rng) -> Mesh {
    let open = rng.range(0.02, 0.08);
    let mut mesh = cylinder((0.08, 0.07), 0.03, 24);
    mesh.add(&block(vec3(0.08, 0.07, 0.16), 0.01), Pose::at(0.0, 0.02, 0.0));
    mesh.add(&block(vec3(0.14, 0.07, 0.04), 0.006), Pose::at(0.0, 0.08, 0.0));
    mesh.add(&block(vec3(0.14, 0.07, 0.04), 0.006), Pose::at(0.0, 0.08, 0.04 + open));
    mesh.add(&block(vec3(0.05, 0.05, 0.14), 0.006), Pose::at(0.0, 0.035, 0.04 + open));
    mesh.add(&cylinder((0.012, 0.012), 0.1, 14), Pose::at(0.0, 0.06, 0.08 + open).pitch(FRAC_PI_2));
    let bar = cylinder((0.006, 0.006), 0.16, 10);
    mesh.add(&bar, Pose::at(0.0, 0.06, 0.16 + open).roll(rng.angle()).shift(0.0, -0.08, 0.0));
    mesh
}

/// A metal tool box with a handle.
fn toolbox(rng: &mut Rng) -> Mesh {
    let (w, h, d) = (rng.range(0.35, 0.5), rng.range(0.15, 0.22), 0.2);
    let mut mesh = block(vec3(w, h, d), 0.008);
    let lid = [vec2(-0.5 * d, 0.0), vec2(0.5 * d, 0.0), vec2(0.3 * d, 0.05), vec2(-0.3 * d, 0.05)];
    mesh.add(&extrude(&lid, w + 0.008, 0.004), Pose::at(0.0, h + 0.002, 0.0).yaw(FRAC_PI_2));
    let grip = super::machine::rounded(
        &[vec3(-0.1, 0.0, 0.0), vec3(-0.1, 0.05, 0.0), vec3(0.1, 0.05, 0.0), vec3(0.1, 0.0, 0.0)],
        0.02,
    );
    mesh.add(&tube(&grip, &vec![0.008; grip.len()], 10), Pose::at(0.0, h + 0.045, 0.0));
    for x in [-0.3, 0.3] {
        mesh.add(&block(vec3(0.03, 0.05, 0.012), 0.003), Pose::at(x * w, h - 0.03, 0.5 * d + 0.004));
    }
    mesh
}

/// Cupboards with a worktop, a sink, a stove and dishes.
fn counters(mesh: &mut Mesh, (half, back): (Vec2, Pose), rng: &mut Rng) {
    let (high, deep, top) = (0.86, 0.6, 0.04);
    let long = 2.0 * half.x - 0.1;
    let stove = rng.range(-0.3, 0.3) * long;
    let sink = if stove > 0.0 { stove - 1.1 } else { stove + 1.1 }.clamp(-0.5 * long + 0.4, 0.5 * long - 0.4);
    let mut x = -0.5 * long;
    while x + 0.3 < 0.5 * long {
        let wide = rng.range(0.45, 1.0).min(0.5 * long - x);
        mesh.add(
            &cabinet(vec3(wide - 0.002, high - 0.02, deep - 0.04), rng),
            back.shift(x + 0.5 * wide, 0.0, 0.5 * deep),
        );
        x += wide;
    }
    // The worktop is a wall that lies on its back, so that the sink can be an opening in it.
    let hole = (vec2(sink - 0.24, 0.1), vec2(sink + 0.24, 0.48));
    let slab = wall(vec3(long, deep + 0.03, top), &[hole]);
    let worktop = back.shift(0.0, high + 0.5 * top, deep + 0.03).pitch(-FRAC_PI_2);
    mesh.add(&slab, worktop);
    let surface = high + top;
    basin(mesh, back.shift(sink, high - 0.16, deep + 0.03 - 0.29), rng);
    mesh.add(&faucet(), back.shift(sink, surface, 0.07));
    stove_top(mesh, back.shift(stove, surface, 0.5 * deep), rng);
    let step = 0.24;
    for k in 0..(long / step) as usize {
        let x = (k as f32 + 0.5) * step - 0.5 * long;
        if (x - sink).abs() < 0.38 || (x - stove).abs() < 0.42 {
            continue;
        }
        let at = back.shift(x, surface, rng.range(0.14, 0.42)).yaw(rng.angle());
        match rng.below(7) {
            0 => mesh.add(&jar(rng.range(0.04, 0.065), rng), at),
            1 => mesh.add(&bottle(rng), at),
            2 => mesh.add(&mug(rng), at),
            3 => (0..rng.count(2, 6))
                .for_each(|i| mesh.add(&plate(0.105), at.shift(0.0, 0.0065 * i as f32, 0.0))),
            4 => (0..rng.count(1, 4))
                .for_each(|i| mesh.add(&bowl(0.09, 0.06), at.shift(0.0, 0.022 * i as f32, 0.0))),
            5 => mesh.add(&utensils(rng), at),
            _ => {}
        }
    }
}

/// A sink of sheet metal with dishes in it, its floor about `at`.
fn basin(mesh: &mut Mesh, at: Pose, rng: &mut Rng) {
    for (size, p) in [
        (vec3(0.5, 0.02, 0.4), vec3(0.0, 0.0, 0.0)),
        (vec3(0.5, 0.17, 0.015), vec3(0.0, 0.0, 0.197)),
        (vec3(0.5, 0.17, 0.015), vec3(0.0, 0.0, -0.197)),
        (vec3(0.015, 0.17, 0.4), vec3(0.247, 0.0, 0.0)),
        (vec3(0.015, 0.17, 0.4), vec3(-0.247, 0.0, 0.0)),
    ] {
        mesh.add(&block(size, 0.004), at.shift(p.x, p.y, p.z));
    }
    for _ in 0..3 {
        mesh.add(
            &plate(0.12),
            at.shift(rng.spread(0.06), 0.05, 0.0).yaw(rng.angle()).pitch(rng.range(0.2, 0.6)),
        );
    }
}

/// Four burners with pans.
fn stove_top(mesh: &mut Mesh, hob: Pose, rng: &mut Rng) {
    mesh.add(&block(vec3(0.58, 0.015, 0.5), 0.005), hob);
    for (sx, sz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let ring = hob.shift(0.14 * sx, 0.015, 0.12 * sz);
        mesh.add(&cylinder((0.05, 0.04), 0.015, 24), ring);
        for k in 0..4 {
            let bar = block(vec3(0.012, 0.012, 0.09), 0.002);
            mesh.add(&bar, ring.yaw(k as f32 * FRAC_PI_2).shift(0.0, 0.018, 0.06));
        }
        if rng.chance(0.6) {
            mesh.add(&pan(rng), ring.shift(0.0, 0.031, 0.0).yaw(rng.spread(1.0)));
        }
    }
}

/// A crock full of spoons, forks and knives.
fn utensils(rng: &mut Rng) -> Mesh {
    let mut mesh = hollow(&[vec2(0.05, 0.0), vec2(0.055, 0.08), vec2(0.052, 0.15)], 0.005);
    for k in 0..rng.count(3, 7) {
        let pose = Pose::at(0.0, 0.012, 0.0).yaw(k as f32 * 2.4).shift(0.012, 0.0, 0.0);
        mesh.add(&cutlery(rng.below(3)), pose.roll(-rng.range(0.05, 0.2)).scale(1.3));
    }
    mesh
}

/// A tap with a bent spout and two handles.
fn faucet() -> Mesh {
    let mut mesh = cylinder((0.03, 0.025), 0.04, 20);
    let arc = |i: usize| turn(PI - i as f32 / 12.0 * 1.1 * PI) * 0.09;
    let mut path = vec![Vec3::ZERO, vec3(0.0, 0.2, 0.0)];
    path.extend((0..=12).map(|i| vec3(0.0, 0.2 + arc(i).y, 0.09 + arc(i).x)));
    mesh.add(&tube(&path, &vec![0.011; path.len()], 14), Pose::IDENTITY);
    for side in [-1.0, 1.0] {
        let at = Pose::at(0.09 * side, 0.0, 0.0);
        mesh.add(&cylinder((0.02, 0.015), 0.05, 16), at);
        mesh.add(&block(vec3(0.06, 0.01, 0.014), 0.004), at.shift(0.015 * side, 0.05, 0.0));
    }
    mesh
}

/// Tiles on the wall over the worktop.
fn tiles(mesh: &mut Mesh, (half, back): (Vec2, Pose), rng: &mut Rng) {
    let size = vec2(rng.range(0.1, 0.22), rng.range(0.07, 0.14));
    let tile = block(vec3(size.x - 0.004, size.y - 0.004, 0.01), 0.002);
    let bond = if rng.chance(0.5) { 0.5 } else { 0.0 };
    for j in 0..(0.33 / size.y) as usize {
        for i in 0..(2.0 * half.x / size.x) as usize {
            let x = (i as f32 + 0.5 + bond * (j % 2) as f32) * size.x - half.x;
            if x + 0.5 * size.x < half.x {
                mesh.add(&tile, back.shift(x, 0.9 + j as f32 * size.y, 0.004));
            }
        }
    }
}

/// A part of a wall from left to right (m).
#[derive(Clone, Copy)]
struct Span {
    from: f32,
    to: f32,
}

/// Narrower parts of a wall stay empty (m).
const LEAST_SPAN: f32 = 0.4;

impl Span {
    fn width(self) -> f32 {
        self.to - self.from
    }

    fn middle(self) -> f32 {
        0.5 * (self.from + self.to)
    }
}

/// Adds a rail with pans.
fn hang_pans(mesh: &mut Mesh, back: Pose, span: Span, rng: &mut Rng) {
    let (wide, middle) = (span.width(), span.middle());
    if wide < LEAST_SPAN {
        return;
    }
    let at = back.shift(middle, rng.range(1.75, 1.95), 0.0);
    mesh.add(&cylinder((0.008, 0.008), wide, 12), at.shift(0.5 * wide, 0.0, 0.06).roll(FRAC_PI_2));
    for k in 0..(wide / 0.2) as usize {
        let hook = at.shift((k as f32 + 0.5) * 0.2 - 0.5 * wide, 0.0, 0.06);
        mesh.add(
            &torus(0.015, 0.003, Segments { around: 16, across: 6 }),
            hook.shift(0.0, -0.018, 0.0).roll(FRAC_PI_2),
        );
        let piece = if rng.chance(0.4) {
            pan(rng)
        } else {
            cutlery(rng.below(3)).at(Pose::IDENTITY.pitch(FRAC_PI_2).scale(1.5))
        };
        let (_, hi) = piece.extent();
        mesh.add(&piece, hook.shift(0.0, -0.03, 0.0).pitch(-FRAC_PI_2).shift(0.0, -0.02, -hi.z));
    }
    let shelf = block(vec3(wide, 0.025, 0.2), 0.003);
    mesh.add(&shelf, at.shift(0.0, 0.12, 0.1));
    stock(mesh, (at.shift(0.0, 0.145, 0.1), wide, 0.25), rng);
}

/// Adds a board of pegs with tools.
fn hang_tools(mesh: &mut Mesh, back: Pose, span: Span, rng: &mut Rng) {
    let (wide, middle) = (span.width(), span.middle());
    if wide < LEAST_SPAN {
        return;
    }
    let high = rng.range(0.7, 1.0);
    let at = back.shift(middle, 1.05, 0.0);
    mesh.add(&block(vec3(wide, high, 0.02), 0.003), at.shift(0.0, 0.0, 0.012));
    let (columns, rows) = ((wide / 0.16) as usize, (high / 0.36) as usize);
    for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let x = ((i as f32 + 0.5) / columns as f32 - 0.5) * wide;
        let peg = at.shift(x, (j as f32 + 0.95) / rows as f32 * high, 0.02);
        mesh.add(&cylinder((0.005, 0.005), 0.05, 8), peg.pitch(FRAC_PI_2));
        if rng.chance(0.9) {
            let piece = tool(rng);
            let (lo, hi) = piece.extent();
            let turned = peg.shift(0.0, -0.008, 0.004 - lo.z).roll(PI + rng.spread(0.06));
            mesh.add(
                &piece,
                turned.shift(-0.5 * (lo.x + hi.x), if rng.chance(0.5) { 0.01 } else { 0.0 }, 0.0),
            );
        }
    }
}

/// Boards on brackets along the side wall, with jars, tins, boxes.
fn shelves(mesh: &mut Mesh, (side, half): (Pose, f32), rng: &mut Rng) {
    let (wide, deep) = (1.7 * half, rng.range(0.25, 0.35));
    let low = table(vec3(wide, 0.8, 0.45), rng);
    mesh.add(&low, side.shift(0.0, 0.0, 0.24));
    heap(mesh, (side.shift(0.2, 0.8, 0.24), 0.18, 8), rng);
    stock(mesh, (side.shift(-0.25 * wide, 0.8, 0.24), 0.4 * wide, 0.3), rng);
    for k in 0..rng.count(2, 4) {
        let at = side.shift(0.0, 1.2 + 0.36 * k as f32, 0.0);
        mesh.add(&block(vec3(wide, 0.025, deep), 0.003), at.shift(0.0, 0.0, 0.5 * deep));
        for x in [-0.4, 0.0, 0.4] {
            let bracket = extrude(&[Vec2::ZERO, vec2(0.8 * deep, 0.16), vec2(0.0, 0.16)], 0.02, 0.002);
            mesh.add(&bracket, at.shift(x * wide, -0.16, 0.0).yaw(-FRAC_PI_2));
        }
        stock(mesh, (at.shift(0.0, 0.025, 0.5 * deep), wide, 0.3), rng);
    }
}

/// Jars, tins, boxes and pots in a row about `at`, at most `high`.
fn stock(mesh: &mut Mesh, (at, wide, high): (Pose, f32, f32), rng: &mut Rng) {
    let mut x = -0.5 * wide + 0.05;
    while x < 0.5 * wide - 0.14 {
        let r = rng.range(0.025, 0.065);
        let place = at.shift(x + r, 0.0, rng.spread(0.03));
        match rng.below(6) {
            0 => mesh.add(
                &block(vec3(1.8 * r, rng.range(1.0, 3.5) * r, 1.6 * r).min(Vec3::splat(high)), 0.002),
                place.yaw(rng.spread(0.2)),
            ),
            1 => {
                let coil = [
                    vec2(0.9, 0.0),
                    vec2(0.9, 0.25),
                    vec2(0.6, 0.3),
                    vec2(0.6, 1.3),
                    vec2(0.9, 1.35),
                    vec2(0.9, 1.6),
                    vec2(0.0, 1.6),
                ];
                let mut profile = vec![Vec2::ZERO];
                profile.extend(coil.map(|p| p * r));
                mesh.add(&lathe(&profile, 28), place);
            }
            2 => {
                let tin = cylinder((r, r), (2.2 * r).min(high), 28);
                mesh.add(&tin, place);
                if rng.chance(0.4) && 4.6 * r < high {
                    mesh.add(&tin, place.shift(0.1 * r, 2.2 * r, 0.0));
                }
            }
            3 => {}
            _ => mesh.add(&jar(r, rng), place),
        }
        x += 2.0 * r + rng.range(0.004, 0.05);
    }
}

/// A round stool.
fn stool(rng: &mut Rng) -> Mesh {
    let h = rng.range(0.45, 0.7);
    let mut mesh = cylinder((0.17, 0.17), 0.04, 36).at(Pose::at(0.0, h, 0.0));
    for k in 0..4 {
        let at = Pose::at(0.0, 0.0, 0.0).yaw((k as f32 + 0.5) / 4.0 * TAU);
        let leg = tube(&[vec3(0.0, 0.0, 0.2), vec3(0.0, h + 0.01, 0.11)], &[0.014, 0.018], 12);
        mesh.add(&leg, at);
        let rung = tube(&[vec3(0.0, 0.3 * h, 0.173), vec3(0.173, 0.3 * h, 0.0)], &[0.009; 2], 10);
        mesh.add(&rung, at);
    }
    mesh
}
