//! A flat: furnished rooms along a corridor, seen through their doors.

use super::architecture::{Opening, door, door_leaf, floor, frame, trim_around, trim_profile, wall};
use super::furniture::{cabinet, chair, potted_plant};
use super::mesh::{Mesh, Pose};
use super::props::{crate_of_slats, lamp};
use super::rng::Rng;
use super::room::{Room, fill, furnish, hang, pendant};
use super::shapes::{ball, block, cuboid};
use glam::{Vec2, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Thickness of all walls (m), for which the frames of doors are made.
const WALL: f32 = 0.2;

/// Triangles of a room that gets no more furniture. guess: six rooms stay below 450 000
const MANY: usize = 45_000;

/// Doorways between rooms: how many lack a door, and how many have a closed one. Drawn once a flat.
struct Doors {
    open: f32,
    closed: f32,
}

/// Rooms on one side of the corridor: its length, and the size of the rooms across and up.
struct Row {
    long: f32,
    deep: f32,
    height: f32,
}

/// The flat, its corridor along x.
pub(super) fn apartment(rng: &mut Rng) -> Mesh {
    let (long, half_width) = (rng.range(6.4, 9.6), rng.range(0.55, 1.05));
    let height = rng.range(2.35, 3.1);
    let doors = Doors { open: rng.range(0.15, 0.6), closed: rng.range(0.0, 0.2) };
    let two_rows = rng.chance(0.7);
    let deep = [rng.range(2.6, 4.0), rng.range(2.4, 3.6)];
    let mut corridor = Room::new(vec2(0.5 * long, half_width), height);
    let mut mesh = Mesh::default();
    let row = row((&Row { long, deep: deep[0], height }, &doors), (&mut corridor, 2), rng);
    mesh.add(&row, Pose::at(0.0, 0.0, half_width));
    let mut back = half_width;
    if two_rows {
        let row = self::row((&Row { long, deep: deep[1], height }, &doors), (&mut corridor, 0), rng);
        mesh.add(&row, Pose::at(0.0, 0.0, -half_width).yaw(PI));
        back += deep[1] + WALL;
    } else {
        outer_wall(&mut corridor, long, rng);
    }
    for side in [1, 3] {
        end_wall(&mut corridor, side, rng);
    }
    passage(&mut corridor, rng);
    mesh.add(&corridor.mesh, Pose::IDENTITY);
    let front = half_width + WALL + deep[0];
    let (middle, half) = (0.5 * (front - back), vec2(0.5 * long, 0.5 * (front + back)));
    mesh.add(&floor(half, &mut rng.fork()), Pose::at(0.0, 0.0, middle));
    let lid = cuboid(vec3(2.0 * half.x + 2.0 * WALL, 0.2, 2.0 * half.y + 2.0 * WALL));
    mesh.add(&lid, Pose::at(0.0, height, middle));
    mesh
}

/// Rooms from z = 0 towards +z, with doors to the corridor, whose wall `side` is theirs.
fn row((row, doors): (&Row, &Doors), (corridor, side): (&mut Room, usize), rng: &mut Rng) -> Mesh {
    let Row { long, deep, height } = *row;
    let count = ((long / rng.range(2.9, 4.4)) as usize).clamp(2, 3);
    let cut = |k: usize, rng: &mut Rng| (k as f32 / count as f32 - 0.5) * long + rng.spread(0.35);
    let mut cuts: Vec<f32> = (1..count).map(|k| cut(k, rng)).collect();
    cuts.insert(0, -0.5 * (long + WALL));
    cuts.push(0.5 * (long + WALL));
    let between: Vec<Option<Opening>> = (1..count).map(|_| passage_hole(deep, rng)).collect();
    let (mut gates, mut panes, mut mesh) = (Vec::new(), Vec::new(), Mesh::default());
    for k in 0..count {
        let (from, to) = (cuts[k] + 0.5 * WALL, cuts[k + 1] - 0.5 * WALL);
        let middle = 0.5 * (from + to);
        let mut room = Room::new(vec2(0.5 * (to - from), 0.5 * deep), height);
        let x = doorway(&mut room, doors, rng);
        gates.push((x.0 + middle, x.1 + middle));
        corridor.claim_front(side, -middle - 0.5 * (x.0.x + x.1.x), vec2(x.1.x - x.0.x, 0.6));
        corridor.openings.push((side, (vec2(-middle - x.1.x, 0.0), vec2(-middle - x.0.x, x.1.y))));
        if let Some(Some((lo, hi))) = k.checked_sub(1).map(|k| between[k]) {
            opening(&mut room, 1, (lo, hi));
        }
        if let Some(Some((lo, hi))) = between.get(k) {
            opening(&mut room, 3, (vec2(-hi.x, lo.y), vec2(-lo.x, hi.y)));
        }
        for (lo, hi) in windows(&mut room, rng) {
            panes.push((vec2(lo.x - middle, lo.y), vec2(hi.x - middle, hi.y)));
        }
        decorate(&mut room, rng);
        mesh.add(&room.mesh, Pose::at(middle, 0.0, WALL + 0.5 * deep));
    }
    let outer = vec3(long + 2.0 * WALL, height, WALL);
    mesh.add(&wall(outer, &gates), Pose::at(0.0, 0.0, 0.5 * WALL));
    mesh.add(&wall(outer, &panes), Pose::at(0.0, 0.0, deep + 1.5 * WALL).yaw(PI));
    for (k, x) in cuts.iter().enumerate() {
        let hole = k.checked_sub(1).and_then(|k| between.get(k).copied().flatten());
        let at = Pose::at(*x, 0.0, WALL + 0.5 * deep).yaw(FRAC_PI_2);
        mesh.add(&wall(vec3(deep, height, WALL), hole.as_slice()), at);
        if let Some((lo, hi)) = hole {
            casing(&mut mesh, at.shift(0.5 * (lo.x + hi.x), 0.0, 0.0), hi - lo, rng);
        }
    }
    mesh
}

/// Perhaps a wide hole from one room to the next, about the middle of a wall `long`.
fn passage_hole(long: f32, rng: &mut Rng) -> Option<Opening> {
    let size = vec2(rng.range(0.8, 1.7).min(long - 1.0), rng.range(1.98, 2.25));
    let x = rng.spread(0.5 * (long - size.x) - 0.2);
    rng.chance(0.5).then(|| (vec2(x - 0.5 * size.x, 0.0), vec2(x + 0.5 * size.x, size.y)))
}

/// Notes a hole in a wall of a room, and keeps the floor before it free.
fn opening(room: &mut Room, side: usize, (lo, hi): Opening) {
    room.claim_front(side, 0.5 * (lo.x + hi.x), vec2(hi.x - lo.x, 0.7));
    room.openings.push((side, (lo, hi)));
}

/// Frames on both sides of a hole of `size` in a wall about `at`.
fn casing(mesh: &mut Mesh, at: Pose, size: Vec2, rng: &mut Rng) {
    let jamb = frame(size, vec2(rng.range(0.06, 0.11), 0.02));
    for side in [-1.0, 1.0] {
        mesh.add(&jamb, at.shift(0.0, -0.003, side * (0.5 * WALL + 0.008)));
    }
    let sill = block(vec3(size.x - 0.004, 0.012, WALL - 0.01), 0.004);
    mesh.add(&sill, at);
}

/// The way to the corridor in wall 0: a hole, often with a door that stands open into the room.
fn doorway(room: &mut Room, doors: &Doors, rng: &mut Rng) -> Opening {
    let size = vec2(rng.range(0.75, 0.98), rng.range(1.98, 2.12));
    let x = rng.spread(room.half.x - 0.5 * size.x - 0.15);
    let hole = (vec2(x - 0.5 * size.x, 0.0), vec2(x + 0.5 * size.x, size.y));
    opening(room, 0, hole);
    room.claim_front(0, x, vec2(size.x, 1.0));
    let at = room.along_wall(0, x).shift(0.0, 0.0, -0.5 * WALL);
    casing(&mut room.mesh, at, size, rng);
    if rng.chance(doors.open) {
        return hole;
    }
    let ajar = if rng.chance(doors.closed) { 0.0 } else { rng.range(0.25, 1.6) };
    let flip = *rng.pick(&[-1.0, 1.0]);
    let hinge = at.shift(-flip * 0.5 * size.x, 0.012, 0.5 * WALL - 0.03).yaw(-flip * ajar);
    let leaf = door_leaf(size - vec2(0.01, 0.02), rng);
    room.mesh.add(&leaf, hinge.stretch(flip, 1.0, 1.0));
    hole
}

/// Windows in wall 2.
fn windows(room: &mut Room, rng: &mut Rng) -> Vec<Opening> {
    let long = room.wall_length(2);
    let (wide, sill) = (rng.range(0.7, 1.6), if rng.chance(0.25) { 0.1 } else { rng.range(0.7, 1.0) });
    let top = (room.height - 0.25).min(rng.range(2.0, 2.4));
    let mut x = -0.5 * long + rng.range(0.3, 0.8);
    let mut holes = Vec::new();
    while x + wide + 0.25 < 0.5 * long {
        let hole = (vec2(x, sill), vec2(x + wide, top));
        holes.push(hole);
        room.openings.push((2, hole));
        room.glaze((2, hole), WALL, rng);
        x += wide + rng.range(0.5, 2.0);
    }
    holes
}

/// Trims, lamp and furniture.
fn decorate(room: &mut Room, rng: &mut Rng) {
    skirting(room, rng);
    if rng.chance(0.5) {
        let cornice = trim_profile(rng.range(0.05, 0.14), rng.range(0.04, 0.1), rng);
        let down: Vec<Vec2> = cornice.iter().rev().map(|p| vec2(p.x, -p.y)).collect();
        let trim = trim_around(room.half, room.height, &down);
        room.mesh.add(&trim, Pose::IDENTITY);
    }
    pendant(room, rng);
    furnish(room, rng);
    if room.mesh.triangle.len() < MANY {
        let pieces = rng.count(0, 3);
        fill(room, pieces, rng);
    } else {
        hang(room, rng);
    }
}

/// Boards at the foot of the walls, between what reaches the floor.
fn skirting(room: &mut Room, rng: &mut Rng) {
    let (high, thick) = (rng.range(0.06, 0.14), rng.range(0.012, 0.02));
    for side in 0..4 {
        // The walls along x have the corners.
        let end = 0.5 * room.wall_length(side) - if side % 2 == 1 { thick + 0.001 } else { 0.0 };
        let low = room.openings.iter().filter(|(s, (lo, _))| *s == side && lo.y < high);
        let mut cuts: Vec<f32> = low.flat_map(|(_, (lo, hi))| [lo.x - 0.11, hi.x + 0.11]).collect();
        cuts.extend([-end, end]);
        cuts.sort_by(f32::total_cmp);
        for span in cuts.chunks_exact(2) {
            let (from, to) = (span[0].max(-end), span[1].min(end));
            if to - from > 0.02 {
                let board = block(vec3(to - from, high, thick + 0.01), 0.004);
                let at = room.along_wall(side, 0.5 * (from + to)).shift(0.0, 0.0, 0.5 * thick - 0.005);
                room.mesh.add(&board, at);
            }
        }
    }
}

/// The corridor's wall 0 where no rooms are behind it.
fn outer_wall(corridor: &mut Room, long: f32, rng: &mut Rng) {
    let at = corridor.along_wall(0, 0.0).shift(0.0, 0.0, -0.5 * WALL);
    let (wide, low, top) = (rng.range(0.6, 1.2), rng.range(0.6, 1.1), rng.range(1.9, 2.2));
    let mut holes = Vec::new();
    let mut x = -0.5 * long + rng.range(0.5, 1.5);
    while x + wide + 0.3 < 0.5 * long {
        holes.push((vec2(x, low), vec2(x + wide, top)));
        x += wide + rng.range(0.8, 2.5);
    }
    let outer = wall(vec3(long + 2.0 * WALL, corridor.height, WALL), &holes);
    corridor.mesh.add(&outer, at);
    for hole in holes {
        corridor.openings.push((0, hole));
        corridor.glaze((0, hole), WALL, rng);
    }
}

/// A wall across the end of the corridor, with a window or the entrance.
fn end_wall(corridor: &mut Room, side: usize, rng: &mut Rng) {
    let (wide, height) = (corridor.wall_length(side), corridor.height);
    let entrance = side == 1 || rng.chance(0.3);
    let half = 0.5 * (wide - 0.24).min(rng.range(0.85, 1.1));
    let hole = if entrance {
        (vec2(-half, 0.0), vec2(half, 2.05))
    } else {
        (vec2(-half, rng.range(0.2, 1.0)), vec2(half, rng.range(1.9, 2.2)))
    };
    let at = corridor.along_wall(side, 0.0).shift(0.0, 0.0, -0.5 * WALL);
    corridor.mesh.add(&wall(vec3(wide, height, WALL), &[hole]), at);
    opening(corridor, side, hole);
    if entrance {
        corridor.mesh.add(&door(hole.1 - hole.0, rng), at.shift(0.0, 0.002, 0.0));
    } else {
        corridor.glaze((side, hole), WALL, rng);
    }
}

/// What stands and hangs in the corridor.
fn passage(corridor: &mut Room, rng: &mut Rng) {
    skirting(corridor, rng);
    let half = corridor.half;
    if rng.chance(0.6) {
        let size = vec3(half.x * rng.range(0.8, 1.7), 0.009, half.y * rng.range(0.8, 1.2));
        corridor.mesh.add(&block(size, 0.003), Pose::at(rng.spread(0.1 * half.x), 0.001, 0.0));
    }
    for k in 0..rng.count(1, 3) {
        let at = Pose::at((k as f32 - 1.0) * 0.6 * half.x, corridor.height - 0.09, 0.0);
        corridor.mesh.add(&super::shapes::cylinder((0.1, 0.16), 0.09, 28), at);
    }
    for _ in 0..rng.count(2, 7) {
        let slim = (0.45 * half.y).min(0.32);
        let part = match rng.below(6) {
            0 => potted_plant(rng.range(0.4, 0.9), rng),
            1 if half.y > 0.7 => chair(rng),
            2 => crate_of_slats(vec3(rng.range(0.3, 0.5), rng.range(0.15, 0.3), slim), rng),
            3 => lamp(rng.range(1.2, 1.6), rng),
            4 => ball(0.11, 28).at(Pose::at(0.0, 0.11, 0.0)),
            _ => cabinet(vec3(rng.range(0.5, 1.3), rng.range(0.5, 1.9), slim), rng),
        };
        corridor.against_wall(&part, rng);
    }
    hang(corridor, rng);
}
