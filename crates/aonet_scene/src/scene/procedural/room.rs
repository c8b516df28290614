//! A furnished room: living room, bedroom, dining room or study.

use super::architecture::{Opening, door, floor, trim_around, trim_profile, wall, window};
use super::furniture::{bed, cabinet, chair, curtains, potted_plant, radiator, shelf, sofa, table};
use super::library::stack;
use super::mesh::{Mesh, Pose};
use super::props::{bottle, bowl, crate_of_slats, cushion, lamp, mug, picture, plate, vessel};
use super::rng::Rng;
use super::shapes::{ball, block, cuboid, lathe};
use glam::{Vec2, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// A room under construction: floor y = 0, inner walls at +-`half`.
pub(super) struct Room {
    pub(super) mesh: Mesh,
    pub(super) half: Vec2,
    pub(super) height: f32,
    /// Footprints on the floor: lower and upper corner.
    taken: Vec<(Vec2, Vec2)>,
    /// Openings with the wall that they are in.
    pub(super) openings: Vec<(usize, Opening)>,
}

impl Room {
    /// An empty room without walls.
    pub(super) fn new(half: Vec2, height: f32) -> Self {
        Self { mesh: Mesh::default(), half, height, taken: Vec::new(), openings: Vec::new() }
    }

    /// Whether a footprint is inside and free; takes it if so.
    fn claim(&mut self, lo: Vec2, hi: Vec2) -> bool {
        let inside = lo.cmpge(-self.half).all() && hi.cmple(self.half).all();
        let free = inside && !self.taken.iter().any(|(l, h)| lo.cmplt(*h).all() && hi.cmpgt(*l).all());
        if free {
            self.taken.push((lo, hi));
        }
        free
    }

    /// Where wall `side` (0..4) stands, seen from inside: x along it, z into the room.
    pub(super) fn along_wall(&self, side: usize, x: f32) -> Pose {
        let half = [self.half, vec2(self.half.y, self.half.x)][side % 2];
        Pose::IDENTITY.yaw(side as f32 * FRAC_PI_2).shift(x, 0.0, -half.y)
    }

    pub(super) fn wall_length(&self, side: usize) -> f32 {
        2.0 * if side.is_multiple_of(2) { self.half.x } else { self.half.y }
    }

    /// Puts `part` with its back to some wall where there is place; where it went.
    pub(super) fn against_wall(&mut self, part: &Mesh, rng: &mut Rng) -> Option<Pose> {
        let (lo, hi) = part.extent();
        for _ in 0..12 {
            let side = rng.below(4);
            let free = 0.5 * self.wall_length(side) - 0.5 * (hi.x - lo.x);
            if free <= 0.0 {
                continue;
            }
            let pose = self.along_wall(side, rng.spread(free)).shift(0.0, 0.0, 0.04 - lo.z);
            if self.put(part, pose) {
                return Some(pose);
            }
        }
        None
    }

    /// Puts `part` at `pose` unless something is there.
    pub(super) fn put(&mut self, part: &Mesh, pose: Pose) -> bool {
        let placed = part.at(pose);
        let (lo, hi) = placed.extent();
        let free = self.claim(vec2(lo.x, lo.z), vec2(hi.x, hi.z));
        if free {
            self.mesh.add(&placed, Pose::IDENTITY);
        }
        free
    }
}

/// The room.
pub(super) fn room(rng: &mut Rng) -> Mesh {
    let half = vec2(rng.range(1.8, 3.0), rng.range(1.7, 2.8));
    let mut room = Room::new(half, rng.range(2.4, 3.4));
    room.mesh.add(&floor(half, &mut rng.fork()), Pose::IDENTITY);
    walls(&mut room, &mut rng.fork());
    ceiling(&mut room, &mut rng.fork());
    furnish(&mut room, rng);
    let pieces = rng.count(7, 14);
    fill(&mut room, pieces, rng);
    room.mesh
}

/// The main furniture of a room for sleeping, eating, working or sitting.
pub(super) fn furnish(room: &mut Room, rng: &mut Rng) {
    match rng.below(4) {
        0 => bedroom(room, rng),
        1 => dining(room, rng),
        2 => study(room, rng),
        _ => living(room, rng),
    }
}

fn walls(room: &mut Room, rng: &mut Rng) {
    let thick = 0.22;
    let door_side = rng.below(4);
    let size = vec2(0.9, 2.05);
    let panelled = rng.chance(0.35);
    for side in 0..4 {
        let long = room.wall_length(side);
        let mut holes = Vec::new();
        let mut x = -0.5 * long + rng.range(0.4, 0.9);
        if side == door_side {
            holes.push((vec2(x, 0.0), vec2(x + size.x, size.y)));
            room.claim_front(side, x + 0.5 * size.x, vec2(size.x, 0.9));
            x += size.x + 0.5;
        }
        let (wide, sill) = (rng.range(0.7, 1.7), if rng.chance(0.2) { 0.1 } else { rng.range(0.7, 1.0) });
        let top = (room.height - 0.25).min(rng.range(2.0, 2.5));
        while rng.chance(0.75) && x + wide + 0.3 < 0.5 * long {
            holes.push((vec2(x, sill), vec2(x + wide, top)));
            x += wide + rng.range(0.4, 1.4);
        }
        let pose = room.along_wall(side, 0.0).shift(0.0, 0.0, -0.5 * thick);
        room.mesh.add(&wall(vec3(long + 2.0 * thick, room.height, thick), &holes), pose);
        if panelled {
            panels(room, pose.shift(0.0, 0.0, 0.5 * thick), (long, &holes), &mut rng.clone());
        }
        for (lo, hi) in holes {
            room.openings.push((side, (lo, hi)));
            let at = pose.shift(0.5 * (lo.x + hi.x), lo.y, 0.0);
            if lo.y == 0.0 {
                room.mesh.add(&door(hi - lo, rng), at);
                continue;
            }
            room.glaze((side, (lo, hi)), thick, rng);
        }
    }
}

impl Room {
    /// Keeps a `size` of floor (along the wall, into the room) free in front of wall `side` at `x`.
    pub(super) fn claim_front(&mut self, side: usize, x: f32, size: Vec2) {
        let a = self.along_wall(side, x - 0.5 * size.x).offset;
        let b = self.along_wall(side, x + 0.5 * size.x).shift(0.0, 0.0, size.y).offset;
        let (lo, hi) = (a.min(b), a.max(b));
        self.taken.push((vec2(lo.x, lo.z), vec2(hi.x, hi.z)));
    }

    /// A window in an opening of a wall `thick` deep, often with curtains or a radiator.
    pub(super) fn glaze(&mut self, (side, (lo, hi)): (usize, Opening), thick: f32, rng: &mut Rng) {
        let at = self.along_wall(side, 0.5 * (lo.x + hi.x)).shift(0.0, lo.y, -0.5 * thick);
        self.mesh.add(&window(hi - lo, thick, rng), at);
        if rng.chance(0.5) {
            let drop = if lo.y < 0.5 || rng.chance(0.7) { hi.y + 0.1 } else { hi.y - lo.y + 0.25 };
            self.claim_front(side, 0.5 * (lo.x + hi.x), vec2(hi.x - lo.x + 0.3, 0.16));
            let at = at.shift(0.0, hi.y - lo.y + 0.12, 0.5 * thick + 0.1);
            self.mesh.add(&curtains(hi.x - lo.x + 0.3, drop, rng), at);
        } else if lo.y > 0.6 && rng.chance(0.6) {
            self.claim_front(side, 0.5 * (lo.x + hi.x), vec2(hi.x - lo.x, 0.17));
            let at = at.shift(0.0, 0.12 - lo.y, 0.5 * thick + 0.1);
            self.mesh.add(&radiator(0.9 * (hi.x - lo.x), lo.y - 0.22), at);
        }
    }
}

fn ceiling(room: &mut Room, rng: &mut Rng) {
    let (half, height) = (room.half, room.height);
    let lid = cuboid(vec3(2.0 * half.x + 0.4, 0.2, 2.0 * half.y + 0.4));
    room.mesh.add(&lid, Pose::at(0.0, height, 0.0));
    let skirting = trim_profile(rng.range(0.06, 0.16), rng.range(0.012, 0.025), rng);
    room.mesh.add(&trim_around(half, 0.0, &skirting), Pose::IDENTITY);
    if rng.chance(0.6) {
        let cornice = trim_profile(rng.range(0.06, 0.18), rng.range(0.05, 0.14), rng);
        let down: Vec<Vec2> = cornice.iter().rev().map(|p| vec2(p.x, -p.y)).collect();
        room.mesh.add(&trim_around(half, height, &down), Pose::IDENTITY);
    } else if rng.chance(0.6) {
        let n = rng.count(3, 7);
        let beam = block(vec3(2.0 * half.x, rng.range(0.1, 0.2), rng.range(0.08, 0.16)), 0.01);
        let deep = beam.extent().1.y;
        for i in 0..n {
            let z = ((i as f32 + 0.5) / n as f32 - 0.5) * 2.0 * half.y;
            room.mesh.add(&beam, Pose::at(0.0, height - deep, z));
        }
    }
    pendant(room, rng);
}

/// A lamp that hangs from the middle of the ceiling.
pub(super) fn pendant(room: &mut Room, rng: &mut Rng) {
    let height = room.height;
    let long = rng.range(0.4, 0.9);
    let cord = super::shapes::cylinder((0.005, 0.005), long, 8);
    room.mesh.add(&cord, Pose::at(0.0, height - long, 0.0));
    let (wide, tall) = (rng.range(0.15, 0.35), rng.range(0.12, 0.3));
    let shade = [vec2(wide - 0.006, 0.0), vec2(wide, 0.0), vec2(0.7 * wide, 0.6 * tall), vec2(0.03, tall)];
    let mut profile = super::shapes::curve(&shade[1..], 6);
    profile.extend(super::shapes::curve(
        &[vec2(0.02, tall - 0.01), vec2(0.67 * wide, 0.57 * tall), shade[0]],
        6,
    ));
    profile.push(shade[1]);
    room.mesh.add(&lathe(&profile, 40), Pose::at(0.0, height - long - 0.5 * tall, 0.0));
    room.mesh.add(&ball(0.04, 16), Pose::at(0.0, height - long - 0.02, 0.0));
}

fn living(room: &mut Room, rng: &mut Rng) {
    let seat = sofa(rng.range(1.5, 2.4), rng);
    if let Some(pose) = room.against_wall(&seat, rng) {
        let low = table(vec3(rng.range(0.8, 1.2), rng.range(0.35, 0.45), rng.range(0.5, 0.7)), rng);
        let at = pose.shift(0.0, 0.0, rng.range(0.95, 1.15)).yaw(rng.spread(0.1));
        rug(room, pose.shift(0.0, 0.0, 0.9), rng);
        if room.put(&low, at) {
            tabletop(room, &low, at, rng);
        }
        let armchair = sofa(rng.range(0.8, 0.95), rng);
        let side = *rng.pick(&[-1.0, 1.0]);
        let turned = at.shift(side * 1.25, 0.0, 0.2).yaw(-side * rng.range(1.0, 1.6));
        room.put(&armchair, turned);
    }
    let board = cabinet(vec3(rng.range(1.2, 1.9), rng.range(0.45, 0.7), 0.42), rng);
    if let Some(pose) = room.against_wall(&board, rng) {
        let top = pose.shift(0.0, board.extent().1.y, 0.0);
        let screen = vec2(rng.range(0.8, 1.2), rng.range(0.5, 0.65));
        room.mesh.add(&block(vec3(0.4, 0.015, 0.22), 0.004), top);
        room.mesh.add(&block(vec3(0.06, 0.08, 0.03), 0.004), top.shift(0.0, 0.01, -0.03));
        room.mesh.add(&block(screen.extend(0.05), 0.008), top.shift(0.0, 0.07, 0.0));
        let bezel = super::architecture::frame(screen - Vec2::splat(0.03), vec2(0.015, 0.01));
        room.mesh.add(&bezel, top.shift(0.0, 0.085, 0.027));
    }
}

fn bedroom(room: &mut Room, rng: &mut Rng) {
    let sleeper = bed(rng);
    if let Some(pose) = room.against_wall(&sleeper, rng) {
        let (_, hi) = sleeper.extent();
        rug(room, pose.shift(0.0, 0.0, 0.6), rng);
        for side in [-1.0, 1.0] {
            let stand = cabinet(vec3(0.42, rng.range(0.45, 0.6), 0.38), rng);
            let at = pose.shift(side * (hi.x + 0.26), 0.0, 0.25 - hi.z);
            if room.put(&stand, at) {
                let y = stand.extent().1.y;
                room.mesh.add(&lamp(rng.range(0.35, 0.5), rng), at.shift(0.0, y, -0.05));
                room.mesh.add(&mug(rng), at.shift(0.13, y, 0.1).yaw(rng.angle()));
            }
        }
    }
    for _ in 0..2 {
        let robe = cabinet(vec3(rng.range(0.9, 1.6), rng.range(1.7, 2.1), 0.58), rng);
        room.against_wall(&robe, rng);
    }
}

fn dining(room: &mut Room, rng: &mut Rng) {
    let size = vec3(rng.range(1.2, 1.9), rng.range(0.72, 0.78), rng.range(0.8, 1.0));
    let board = table(size, rng);
    let pose = Pose::at(rng.spread(0.3), 0.0, rng.spread(0.3))
        .yaw(rng.spread(0.1) + FRAC_PI_2 * rng.below(2) as f32);
    rug(room, pose, rng);
    room.put(&board, pose);
    tabletop(room, &board, pose, rng);
    let seat = chair(rng);
    let per_side = (size.x / 0.6) as usize;
    for (i, side) in (0..per_side).flat_map(|i| [(i, -1.0f32), (i, 1.0)]) {
        let x = ((i as f32 + 0.5) / per_side as f32 - 0.5) * size.x * 0.95;
        let at = pose.shift(x, 0.0, side * (0.5 * size.z + rng.range(0.0, 0.25)));
        room.mesh.add(&seat, at.yaw(if side > 0.0 { PI } else { 0.0 } + rng.spread(0.25)));
        let place = pose.shift(x, size.y, side * (0.5 * size.z - 0.2));
        room.mesh.add(&plate(0.13), place);
    }
    for _ in 0..2 {
        let board = cabinet(vec3(rng.range(1.0, 1.7), rng.range(0.8, 1.9), 0.42), rng);
        if let Some(pose) = room.against_wall(&board, rng) {
            tabletop(room, &board, pose, rng);
        }
    }
}

fn study(room: &mut Room, rng: &mut Rng) {
    let desk = table(vec3(rng.range(1.2, 1.7), 0.74, rng.range(0.6, 0.8)), rng);
    if let Some(pose) = room.against_wall(&desk, rng) {
        tabletop(room, &desk, pose, rng);
        let at = pose.shift(rng.spread(0.2), 0.0, rng.range(0.45, 0.7)).yaw(PI + rng.spread(0.6));
        room.mesh.add(&chair(rng), at);
        rug(room, at, rng);
    }
    for _ in 0..rng.count(2, 4) {
        let shelf = cabinet(vec3(rng.range(0.8, 1.6), rng.range(1.6, 2.2), 0.32), rng);
        room.against_wall(&shelf, rng);
    }
    let seat = sofa(rng.range(0.85, 1.0), rng);
    room.against_wall(&seat, rng);
}

/// A rug with a border, a few millimetres thick and gently wavy.
fn rug(room: &mut Room, at: Pose, rng: &mut Rng) {
    if rng.chance(0.3) {
        return;
    }
    let size = vec2(rng.range(1.2, 2.2), rng.range(0.9, 1.6)).min(room.half * 1.2);
    let centre = at.offset.clamp(
        vec3(0.5 * size.x - room.half.x, 0.0, 0.5 * size.y - room.half.y),
        vec3(room.half.x - 0.5 * size.x, 0.0, room.half.y - 0.5 * size.y),
    );
    let spot = Pose::at(centre.x, 0.002, centre.z);
    room.mesh.add(&block(vec3(size.x, 0.008, size.y), 0.003), spot);
    room.mesh.add(&block(vec3(size.x - 0.12, 0.011, size.y - 0.12), 0.003), spot);
}

/// Things on top of a piece of furniture.
fn tabletop(room: &mut Room, under: &Mesh, at: Pose, rng: &mut Rng) {
    let (lo, hi) = under.extent();
    let half = vec2(hi.x - lo.x, hi.z - lo.z) * 0.5 - Vec2::splat(0.12);
    let mut spots: Vec<(Vec2, f32)> = Vec::new();
    for _ in 0..rng.count(4, 12) {
        let (thing, radius) = small_thing(rng);
        let p = rng.in_rect(half.max(Vec2::splat(0.01)));
        if spots.iter().any(|(q, r)| q.distance(p) < r + radius) {
            continue;
        }
        spots.push((p, radius));
        room.mesh.add(&thing, at.shift(p.x, hi.y, p.y).yaw(rng.angle()));
    }
}

/// Something for a table and its radius.
fn small_thing(rng: &mut Rng) -> (Mesh, f32) {
    match rng.below(7) {
        0 => (mug(rng), 0.07),
        1 => (bottle(rng), 0.05),
        2 => (bowl(0.13, 0.07), 0.13),
        3 => (lamp(rng.range(0.35, 0.55), rng), 0.2),
        4 => (potted_plant(rng.range(0.2, 0.4), rng), 0.16),
        5 => (stack(rng.count(1, 4), rng), 0.16),
        _ => (vessel(rng.range(0.05, 0.09), rng.range(0.12, 0.3), rng), 0.09),
    }
}

/// Plants, lamps, cupboards, pictures and what lies about, where there is place left.
pub(super) fn fill(room: &mut Room, pieces: usize, rng: &mut Rng) {
    for _ in 0..pieces {
        let kind = rng.below(6);
        let part = match kind {
            0 => potted_plant(rng.range(0.6, 1.5), rng),
            1 => lamp(rng.range(1.3, 1.7), rng),
            2 => chair(rng),
            3 => table(vec3(rng.range(0.5, 1.0), rng.range(0.5, 0.75), rng.range(0.35, 0.5)), rng),
            _ => cabinet(vec3(rng.range(0.5, 1.4), rng.range(0.5, 2.1), 0.36), rng),
        };
        if let (Some(pose), 3..) = (room.against_wall(&part, rng), kind) {
            tabletop(room, &part, pose, rng);
        }
    }
    litter(room, rng);
    hang(room, rng);
}

/// Pictures and shelves on the walls, where there is place left.
pub(super) fn hang(room: &mut Room, rng: &mut Rng) {
    for side in 0..4 {
        let long = room.wall_length(side);
        for _ in 0..rng.count(1, 4) {
            let size = vec2(rng.range(0.2, 0.7), rng.range(0.25, 0.6));
            let spot = vec2(rng.spread(0.5 * long - 0.6), rng.range(1.25, 1.7));
            let clear = |(at, (lo, hi)): &(usize, Opening)| {
                *at != side || spot.x + 0.6 < lo.x || spot.x - 0.6 > hi.x || spot.y - 0.3 > hi.y
            };
            if !room.openings.iter().all(clear) {
                continue;
            }
            let pose = room.along_wall(side, spot.x).shift(0.0, spot.y, 0.001);
            let (lo, hi) = (pose.apply(vec3(-0.55, -0.1, -0.1)), pose.apply(vec3(0.55, 0.6, 0.3)));
            let (lo, hi) = (lo.min(hi), lo.max(hi));
            if room.mesh.position.iter().any(|p| p.cmpge(lo).all() && p.cmple(hi).all()) {
                continue;
            }
            if rng.chance(0.7) {
                room.mesh.add(&picture(size, rng), pose);
            } else {
                shelf(&mut room.mesh, pose, rng);
            }
        }
    }
}

/// Cushions, crates, books and balls on the floor.
fn litter(room: &mut Room, rng: &mut Rng) {
    for _ in 0..rng.count(4, 16) {
        let part = match rng.below(6) {
            0 => cushion(vec3(0.5, 0.14, 0.5), rng),
            1 => crate_of_slats(vec3(rng.range(0.3, 0.5), rng.range(0.15, 0.35), 0.3), rng),
            2 => stack(rng.count(1, 7), rng),
            3 => ball(rng.range(0.06, 0.13), 32),
            4 => block(vec3(rng.range(0.15, 0.5), rng.range(0.1, 0.35), rng.range(0.15, 0.4)), 0.006),
            _ => vessel(rng.range(0.1, 0.18), rng.range(0.2, 0.5), rng),
        };
        let at = rng.in_rect(room.half - Vec2::splat(0.3));
        room.put(&part, Pose::at(at.x, 0.01 - part.extent().0.y, at.y).yaw(rng.angle()));
    }
}

/// Panels on the lower part of a wall along `pose`, between its openings.
fn panels(room: &mut Room, pose: Pose, (long, holes): (f32, &[Opening]), rng: &mut Rng) {
    let (n, high) = ((long / rng.range(0.5, 0.9)).ceil(), rng.range(0.7, 1.1));
    let wide = long / n;
    let rim = rng.range(0.03, 0.06);
    let field = vec2(wide - 0.1 - 2.0 * rim, high - 0.3);
    let panel = super::architecture::frame(field, vec2(rim, 0.025));
    let rail = block(vec3(wide, 0.05, 0.05), 0.01);
    for k in 0..n as usize {
        let x = (k as f32 + 0.5) * wide - 0.5 * long;
        let free =
            holes.iter().all(|(lo, hi)| lo.y > high + 0.1 || hi.x < x - 0.5 * wide || lo.x > x + 0.5 * wide);
        if free {
            room.mesh.add(&panel, pose.shift(x, 0.21, 0.006));
            room.mesh.add(&rail, pose.shift(x, high, 0.01));
        }
    }
}
