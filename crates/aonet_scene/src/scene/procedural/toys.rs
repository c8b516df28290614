//! Towers, gates and trains of toy blocks on a floor.

use super::mesh::{Mesh, Pose, turn};
use super::rng::Rng;
use super::settle::Ground;
use super::shapes::{Segments, ball, block, cylinder, extrude, lathe, lathe_with, torus};
use glam::{Vec2, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Blocks of unit `u` (m): a castle, towers, a train, and what fell down.
pub(super) fn blocks(rng: &mut Rng) -> Mesh {
    let u = rng.range(0.04, 0.07);
    let half = u * rng.range(13.0, 18.0);
    let mut mesh = rug(half, &mut rng.fork());
    let mut ground = Ground::new(half, 2.0 * u, |_, _| 0.0);
    let castle =
        castle(u, &mut rng.fork())
            .at(Pose::at(rng.spread(0.15 * half), 0.0, rng.spread(0.15 * half)).yaw(rng.angle()));
    ground.cover(&castle);
    mesh.add(&castle, Pose::IDENTITY);
    let mut standing = vec![(Vec2::ZERO, 7.0 * u)];
    for _ in 0..40 {
        let piece = match rng.below(4) {
            0 => rings(u, rng),
            1 => train(u, rng),
            _ => tower(u, rng),
        };
        let (lo, hi) = piece.extent();
        let r = 0.5 * vec2(hi.x - lo.x, hi.z - lo.z).length();
        let at = rng.in_rect(Vec2::splat((half - r).max(0.0)));
        if standing.len() < 12 && standing.iter().all(|(p, q)| p.distance(at) > q + r) {
            standing.push((at, r));
            let placed = piece.at(Pose::at(at.x, 0.0, at.y).yaw(rng.angle()));
            ground.cover(&placed);
            mesh.add(&placed, Pose::IDENTITY);
        }
    }
    for _ in 0..rng.count(60, 130) {
        let piece = any(u, rng);
        let from = rng.in_rect(Vec2::splat(0.9 * half));
        if let Some(pose) = ground.drop(&piece, from, rng) {
            mesh.add(&piece, pose);
        }
    }
    mesh
}

/// A floor with a thick, slightly wavy rug.
fn rug(half: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = super::architecture::floor(Vec2::splat(1.08 * half), rng).at(Pose::at(0.0, -0.006, 0.0));
    mesh.add(&block(vec3(2.04 * half, 0.005, 2.04 * half), 0.002), Pose::at(0.0, -0.006, 0.0));
    mesh.add(&block(vec3(1.9 * half, 0.006, 1.9 * half), 0.002), Pose::at(0.0, -0.006, 0.0));
    mesh
}

fn cube(u: f32) -> Mesh {
    block(vec3(u, u, u), 0.06 * u)
}

/// A cube with raised frames and signs on its sides.
fn lettered(u: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = block(vec3(0.94 * u, 0.94 * u, 0.94 * u), 0.06 * u).at(Pose::at(0.0, 0.03 * u, 0.0));
    let rim = super::architecture::frame(vec2(0.66 * u, 0.66 * u), vec2(0.1 * u, 0.06 * u));
    let quarter = |k: usize| match k {
        0..4 => Pose::at(0.0, 0.5 * u, 0.0).yaw(k as f32 * FRAC_PI_2),
        _ => Pose::at(0.0, 0.5 * u, 0.0).pitch(if k == 4 { FRAC_PI_2 } else { -FRAC_PI_2 }),
    };
    for k in 0..6 {
        let side = quarter(k).shift(0.0, 0.0, 0.47 * u);
        mesh.add(&rim, side.shift(0.0, -0.33 * u, 0.0));
        let sign = match rng.below(4) {
            0 => extrude(&super::props::star(5, (0.26 * u, 0.11 * u)), 0.05 * u, 0.01 * u),
            1 => super::machine::bored(&super::props::star(10, (0.24 * u, 0.24 * u)), 0.13 * u, 0.05 * u),
            2 => {
                let s = [
                    (-0.24, -0.24),
                    (-0.1, -0.24),
                    (-0.1, -0.06),
                    (0.1, -0.06),
                    (0.1, -0.24),
                    (0.24, -0.24),
                    (0.24, 0.24),
                    (0.1, 0.24),
                    (0.1, 0.08),
                    (-0.1, 0.08),
                    (-0.1, 0.24),
                    (-0.24, 0.24),
                ];
                extrude(&s.map(|(x, y)| vec2(x, y) * u), 0.05 * u, 0.01 * u)
            }
            _ => {
                let s =
                    [(-0.24, -0.24), (0.2, -0.24), (0.2, -0.1), (-0.1, -0.1), (-0.1, 0.24), (-0.24, 0.24)];
                extrude(&s.map(|(x, y)| vec2(x, y) * u), 0.05 * u, 0.01 * u)
            }
        };
        mesh.add(&sign, side);
    }
    mesh
}

/// A block with an arch through it, 2 units wide.
fn arch(u: f32) -> Mesh {
    let mut outline = vec![vec2(1.0, 0.0), vec2(1.0, 1.0), vec2(-1.0, 1.0), vec2(-1.0, 0.0)];
    outline.extend((0..=14).map(|k| turn(PI - k as f32 / 14.0 * PI) * 0.6));
    extrude(&outline.iter().map(|p| *p * u).collect::<Vec<_>>(), u, 0.04 * u)
}

fn prism(u: f32, wide: f32) -> Mesh {
    extrude(
        &[vec2(-0.5 * wide, 0.0), vec2(0.5 * wide, 0.0), vec2(0.0, 0.5 * wide)].map(|p| p * u),
        u,
        0.04 * u,
    )
}

fn cone(u: f32) -> Mesh {
    lathe(
        &[vec2(0.0, 0.0), vec2(0.48, 0.0), vec2(0.5, 0.04), vec2(0.03, 0.98), vec2(0.0, 1.0)].map(|p| p * u),
        32,
    )
}

fn any(u: f32, rng: &mut Rng) -> Mesh {
    match rng.below(10) {
        0 => lettered(u, rng),
        1 => arch(u),
        2 => prism(u, 1.4),
        3 => cone(u),
        4 => cylinder((0.5 * u, 0.5 * u), u * rng.range(0.8, 2.0), 32),
        5 => block(vec3(2.0 * u, 0.5 * u, u), 0.05 * u),
        6 => block(vec3(3.0 * u, 0.3 * u, 0.8 * u), 0.04 * u),
        7 => ball(0.45 * u, 28),
        8 => torus(0.55 * u, 0.2 * u, Segments { around: 36, across: 14 }),
        _ => cube(u),
    }
}

/// Pieces on top of each other, each a little off.
fn tower(u: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let mut y = 0.0;
    for _ in 0..rng.count(3, 9) {
        let (piece, high) = match rng.below(4) {
            0 => (lettered(u, rng), u),
            1 => (cylinder((0.48 * u, 0.48 * u), u, 32), u),
            2 => (block(vec3(1.3 * u, 0.4 * u, 1.3 * u), 0.05 * u), 0.4 * u),
            _ => (cube(u), u),
        };
        mesh.add(&piece, Pose::at(rng.spread(0.12 * u), y, rng.spread(0.12 * u)).yaw(rng.spread(0.3)));
        y += high;
    }
    let last = *rng.pick(&[0, 1, 2]);
    let cap = [cone(u), prism(u, 1.2), ball(0.4 * u, 28).at(Pose::at(0.0, 0.39 * u, 0.0))];
    mesh.add(&cap[last], Pose::at(0.0, y, 0.0).yaw(rng.angle()));
    mesh
}

/// A square of walls with gates, corner towers, battlements.
fn castle(u: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let n = rng.count(3, 4);
    let side = (2 * n + 1) as f32;
    let rows = rng.count(2, 4);
    for k in 0..4 {
        let front = Pose::IDENTITY.yaw(k as f32 * FRAC_PI_2).shift(0.0, 0.0, 0.5 * side * u);
        for j in 0..rows {
            for i in 0..n {
                let x = (i as f32 + 0.5 - 0.5 * n as f32) * 2.0 * u;
                let at = front.shift(x, j as f32 * u, rng.spread(0.04 * u)).yaw(rng.spread(0.02));
                let gate = j == 0 && (i + k) % 2 == 0;
                mesh.add(&if gate { arch(u) } else { block(vec3(1.97 * u, u, u), 0.05 * u) }, at);
            }
        }
        for i in 0..2 * n {
            if i % 2 == 0 {
                let x = (i as f32 + 0.5 - n as f32) * u;
                mesh.add(&cube(0.8 * u), front.shift(x, rows as f32 * u, 0.0));
            }
        }
        let corner = Pose::IDENTITY.yaw(k as f32 * FRAC_PI_2).shift(0.5 * side * u, 0.0, 0.5 * side * u);
        let tall = rows + rng.count(1, 3);
        for j in 0..tall {
            let drum = cylinder((0.75 * u, 0.72 * u), 0.995 * u, 36);
            mesh.add(&drum, corner.shift(0.0, j as f32 * u, 0.0));
        }
        mesh.add(&cone(1.9 * u), corner.shift(0.0, tall as f32 * u, 0.0));
    }
    let keep = rng.count(3, 6);
    for j in 0..keep {
        mesh.add(
            &block(vec3(1.9 * u, 0.99 * u, 1.9 * u), 0.06 * u),
            Pose::at(0.0, j as f32 * u, 0.0).yaw(rng.spread(0.08)),
        );
    }
    mesh.add(
        &lathe_with(&[vec2(0.0, 0.0), vec2(1.5, 0.0), vec2(1.5, 0.1), vec2(0.0, 1.4)].map(|p| p * u), 4, 0.0),
        Pose::at(0.0, keep as f32 * u, 0.0).yaw(0.25 * PI),
    );
    mesh
}

/// Rings on a peg.
fn rings(u: f32, rng: &mut Rng) -> Mesh {
    let n = rng.count(4, 7);
    let thick = 0.26 * u;
    let mut mesh = cylinder((1.3 * u, 1.3 * u), 0.3 * u, 40);
    mesh.add(&cylinder((0.25 * u, 0.2 * u), 0.3 * u + 2.1 * thick * n as f32, 20), Pose::IDENTITY);
    for k in 0..n {
        let r = u * (1.1 - 0.65 * k as f32 / n as f32);
        mesh.add(
            &torus(r.max(0.26 * u + thick), thick, Segments { around: 40, across: 16 }),
            Pose::at(0.0, 0.3 * u + thick * (1.0 + 1.9 * k as f32), 0.0),
        );
    }
    mesh.add(&ball(0.35 * u, 24), Pose::at(0.0, 0.45 * u + 2.1 * thick * n as f32, 0.0));
    mesh
}

/// An engine and wagons along x.
fn train(u: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let wagons = rng.count(2, 3);
    let wheel = cylinder((0.32 * u, 0.32 * u), 0.2 * u, 28);
    for k in 0..=wagons {
        let at = Pose::at((k as f32 - 0.5 * wagons as f32) * 2.5 * u, 0.0, 0.0);
        mesh.add(&block(vec3(2.1 * u, 0.3 * u, 1.1 * u), 0.05 * u), at.shift(0.0, 0.35 * u, 0.0));
        for (x, side) in [(-0.6, -1.0), (-0.6, 1.0), (0.6, -1.0), (0.6, 1.0)] {
            let hub = at.shift(x * u, 0.32 * u, side * 0.55 * u).pitch(side * FRAC_PI_2);
            mesh.add(&wheel, hub);
            mesh.add(&ball(0.09 * u, 12), hub.shift(0.0, 0.2 * u, 0.0));
        }
        mesh.add(
            &cylinder((0.07 * u, 0.07 * u), 0.5 * u, 10),
            at.shift(1.5 * u, 0.5 * u, 0.0).roll(FRAC_PI_2),
        );
        if k == 0 {
            mesh.add(
                &cylinder((0.45 * u, 0.45 * u), 1.2 * u, 32),
                at.shift(0.15 * u, 1.1 * u, 0.0).roll(FRAC_PI_2),
            );
            mesh.add(&block(vec3(0.8 * u, 1.1 * u, u), 0.05 * u), at.shift(0.55 * u, 0.65 * u, 0.0));
            mesh.add(&block(vec3(1.1 * u, 0.12 * u, 1.2 * u), 0.04 * u), at.shift(0.55 * u, 1.75 * u, 0.0));
            mesh.add(&cylinder((0.13 * u, 0.2 * u), 0.5 * u, 20), at.shift(-0.65 * u, 1.5 * u, 0.0));
            continue;
        }
        let cargo = super::props::crate_of_slats(vec3(1.9 * u, 0.6 * u, u), rng);
        mesh.add(&cargo, at.shift(0.0, 0.65 * u, 0.0));
        for i in 0..3 {
            let t = turn(i as f32 / 3.0 * TAU) * 0.2 * u;
            mesh.add(&ball(0.25 * u, 18), at.shift((i as f32 - 1.0) * 0.52 * u, 0.95 * u, t.y));
        }
    }
    mesh
}
