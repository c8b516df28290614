//! A library: walls and stacks full of books, a ladder, a reading table.

use super::architecture::{floor, trim_around, trim_profile, wall};
use super::furniture::{chair, table};
use super::mesh::{Mesh, Pose};
use super::props::{book, books, lamp, vessel};
use super::rng::Rng;
use super::shapes::{Segments, ball, block, cuboid, cylinder, extrude, torus};
use glam::{Vec2, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// The room: +-`half` on the floor.
pub(super) fn library(rng: &mut Rng) -> Mesh {
    let half = vec2(rng.range(2.2, 3.4), rng.range(2.0, 3.2));
    let height = rng.range(2.7, 3.6);
    let mut mesh = floor(half, &mut rng.fork());
    mesh.add(&cuboid(vec3(2.0 * half.x + 0.6, 0.2, 2.0 * half.y + 0.6)), Pose::at(0.0, height, 0.0));
    let cornice = trim_profile(0.16, 0.12, rng);
    let down: Vec<Vec2> = cornice.iter().rev().map(|p| vec2(p.x, -p.y)).collect();
    mesh.add(&trim_around(half, height, &down), Pose::IDENTITY);
    let tall = height - rng.range(0.25, 0.7);
    let depth = 0.3;
    let open_side = rng.below(4);
    for side in 0..4 {
        let (long, reach) = if side % 2 == 0 { (half.x, half.y) } else { (half.y, half.x) };
        let pose = Pose::IDENTITY.yaw(side as f32 * FRAC_PI_2).shift(0.0, 0.0, -reach);
        let hole = if side == open_side { vec![(vec2(-0.6, 0.0), vec2(0.6, 2.2))] } else { vec![] };
        mesh.add(&wall(vec3(2.0 * long + 0.5, height, 0.25), &hole), pose.shift(0.0, 0.0, -0.125));
        let spans = if side == open_side {
            vec![(-long + depth, -0.7), (0.7, long - depth)]
        } else {
            vec![(-long + depth, long - depth)]
        };
        for (from, to) in spans {
            if to - from > 0.5 {
                let case = bookcase(vec3(to - from, tall, depth), rng);
                mesh.add(&case, pose.shift(0.5 * (from + to), 0.0, 0.5 * depth + 0.005));
            }
        }
        if side != open_side && rng.chance(0.5) {
            let at = pose.shift(rng.spread(0.5 * long), 0.0, depth + rng.range(0.5, 0.7));
            mesh.add(&ladder(tall, rng.range(0.45, 0.6) / tall), at);
        }
    }
    middle(&mut mesh, half - Vec2::splat(depth + 0.7), rng);
    mesh
}

/// Shelves of `size` full of books, with pilasters, plinth and a moulded top.
fn bookcase(size: glam::Vec3, rng: &mut Rng) -> Mesh {
    let mut mesh = block(vec3(size.x, 0.1, size.z), 0.006);
    let bays = (size.x / rng.range(0.7, 1.1)).ceil() as usize;
    let bay = size.x / bays as f32;
    let (board, lip) = (0.025, rng.range(0.02, 0.05));
    mesh.add(&block(vec3(size.x, size.y, 0.012), 0.001), Pose::at(0.0, 0.0, 0.006 - 0.5 * size.z));
    mesh.add(&block(vec3(size.x, 0.1, size.z + lip), 0.012), Pose::at(0.0, size.y - 0.1, 0.5 * lip));
    mesh.add(&block(vec3(size.x, 0.035, size.z + 2.4 * lip), 0.01), Pose::at(0.0, size.y, 1.2 * lip));
    for i in 0..=bays {
        let x = (i as f32 * bay - 0.5 * size.x).clamp(0.5 * board - 0.5 * size.x, 0.5 * size.x - 0.5 * board);
        let upright = block(vec3(board, size.y - 0.2, size.z - 0.004), 0.003);
        mesh.add(&upright, Pose::at(x, 0.1, 0.0));
        let post = block(vec3(0.06, size.y - 0.18, 0.02), 0.005);
        let x = x.clamp(0.03 - 0.5 * size.x, 0.5 * size.x - 0.03);
        mesh.add(&post, Pose::at(x, 0.09, 0.5 * size.z + 0.006));
    }
    for i in 0..bays {
        let x = (i as f32 + 0.5) * bay - 0.5 * size.x;
        let mut y = 0.1;
        while y + 0.2 < size.y - 0.1 {
            let gap = rng.range(0.22, 0.38).min(size.y - 0.1 - y);
            mesh.add(&block(vec3(bay - board, board, size.z - 0.01), 0.003), Pose::at(x, y, 0.0));
            let inner = bay - board - 0.04;
            let at = Pose::at(x - 0.5 * inner, y + board, 0.5 * size.z - 0.02);
            if rng.chance(0.9) {
                mesh.add(&books((inner, gap - board - 0.02, size.z - 0.04), rng), at);
            } else {
                let pot = vessel(0.3 * gap, 0.7 * gap, rng);
                mesh.add(&pot, at.shift(rng.range(0.25, 0.75) * inner, 0.0, -0.5 * size.z));
            }
            y += gap;
        }
    }
    mesh
}

/// A ladder of `height` that leans towards -z by `lean` of its height.
fn ladder(height: f32, lean: f32) -> Mesh {
    let mut mesh = Mesh::default();
    let long = height * (1.0 + lean * lean).sqrt();
    let back = Pose::at(0.0, 0.0, 0.0).pitch(-libm::atanf(lean));
    for side in [-0.2, 0.2] {
        mesh.add(&block(vec3(0.035, long, 0.06), 0.006), back.shift(side, 0.0, 0.0));
    }
    let rungs = (long / 0.28) as usize;
    for k in 1..=rungs {
        let rung = cylinder((0.015, 0.015), 0.4, 10);
        mesh.add(&rung, back.shift(0.2, k as f32 * 0.28 - 0.1, 0.0).roll(FRAC_PI_2));
    }
    mesh
}

/// A reading table with chairs, or a low stack, and books in piles on the floor.
fn middle(mesh: &mut Mesh, half: Vec2, rng: &mut Rng) {
    let size = vec3((1.6 * half.x).min(2.2), 0.76, (1.2 * half.y).min(1.1));
    let top = table(size, rng);
    mesh.add(&top, Pose::IDENTITY);
    let seat = chair(rng);
    for k in 0..rng.count(2, 4) {
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let x = ((k / 2) as f32 - 0.5) * 0.5 * size.x + rng.spread(0.1);
        let turned = if side > 0.0 { PI } else { 0.0 };
        let at = Pose::at(x, 0.0, side * (0.5 * size.z + rng.range(0.05, 0.35)));
        mesh.add(&seat, at.yaw(turned + rng.spread(0.4)));
    }
    let mut spots: Vec<Vec2> = Vec::new();
    for _ in 0..rng.count(5, 12) {
        let at = rng.in_rect(vec2(0.5 * size.x - 0.2, 0.5 * size.z - 0.16));
        if spots.iter().all(|s| s.distance(at) > 0.34) {
            spots.push(at);
            let pose = Pose::at(at.x, size.y, at.y).yaw(rng.angle());
            match rng.below(4) {
                0 => mesh.add(&lamp(rng.range(0.35, 0.5), rng), pose),
                1 => mesh.add(&globe(rng), pose),
                2 => mesh.add(&open_book(rng), pose),
                _ => mesh.add(&stack(rng.count(2, 6), rng), pose),
            }
        }
    }
    for _ in 0..rng.count(2, 7) {
        let at = rng.in_rect(half);
        if at.x.abs() > 0.5 * size.x + 0.2 || at.y.abs() > 0.5 * size.z + 0.6 {
            mesh.add(&stack(rng.count(3, 14), rng), Pose::at(at.x, 0.0, at.y).yaw(rng.angle()));
        }
    }
}

/// `count` books lying on each other.
pub(super) fn stack(count: usize, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let mut y = 0.0;
    for _ in 0..count {
        let size = vec3(rng.range(0.012, 0.05), rng.range(0.18, 0.27), rng.range(0.12, 0.19));
        let flat = Pose::at(rng.spread(0.015), y + 0.5 * size.x, rng.spread(0.015))
            .yaw(rng.spread(0.3))
            .roll(FRAC_PI_2);
        mesh.add(&book(size), flat.shift(0.0, -0.5 * size.y, 0.0));
        y += size.x + 0.0005;
    }
    mesh
}

/// An open book whose pages arch from the spine.
fn open_book(rng: &mut Rng) -> Mesh {
    let (w, d, thick) = (rng.range(0.13, 0.18), rng.range(0.19, 0.26), rng.range(0.008, 0.02));
    let mut mesh = block(vec3(2.0 * w + 0.012, 0.004, d + 0.01), 0.001);
    for side in [-1.0f32, 1.0] {
        let mut outline: Vec<Vec2> = vec![Vec2::ZERO, vec2(w, 0.0)];
        outline.extend((0..=12).rev().map(|k| k as f32 / 12.0).map(|t| {
            let arch = thick * (0.35 + 1.3 * (t * (1.0 - t)) + 0.65 * t.min(0.3) / 0.3 * (1.0 - t) + 0.1 * t);
            vec2(t * w, arch.max(0.002))
        }));
        let half = extrude(&outline, d, 0.0);
        mesh.add(&half, Pose::at(0.0, 0.004, 0.0).stretch(side, 1.0, 1.0));
    }
    mesh
}

/// A globe in a ring on a foot.
fn globe(rng: &mut Rng) -> Mesh {
    let r = rng.range(0.1, 0.16);
    let mut mesh = cylinder((0.7 * r, 0.6 * r), 0.02, 32);
    mesh.add(&cylinder((0.012, 0.012), 0.5 * r, 12), Pose::at(0.0, 0.01, 0.0));
    let centre = Pose::at(0.0, 1.6 * r, 0.0);
    mesh.add(&ball(r, 40), centre);
    mesh.add(&torus(1.1 * r, 0.008, Segments { around: 48, across: 8 }), centre.roll(0.4).pitch(FRAC_PI_2));
    mesh
}
