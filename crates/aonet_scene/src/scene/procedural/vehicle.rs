//! Cars.

use super::mesh::{Mesh, Pose, turn};
use super::rng::Rng;
use super::shapes::{Segments, block, cuboid, cylinder, extrude, inset, lathe, ring, torus};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Measures of a car (m): half length, half width, height of body and roof, wheel radius, axle distance.
struct Shape {
    half: f32,
    wide: f32,
    belt: f32,
    roof: f32,
    wheel: f32,
    axle: f32,
}

/// A car on its wheels that drives along +z.
pub(super) fn car(rng: &mut Rng) -> Mesh {
    let half = rng.range(1.9, 2.4);
    let shape = Shape {
        half,
        wide: rng.range(0.82, 0.95),
        belt: rng.range(0.82, 1.0),
        roof: rng.range(1.35, 1.75),
        wheel: rng.range(0.3, 0.36),
        axle: half * rng.range(0.6, 0.66),
    };
    let mut mesh = Mesh::default();
    body(&mut mesh, &shape, rng);
    cabin(&mut mesh, &shape, rng);
    let wheel = wheel(shape.wheel, rng);
    for (sx, sz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let pose = Pose::at(sx * (shape.wide - 0.1), shape.wheel, sz * shape.axle);
        mesh.add(&wheel, pose.yaw(sx * FRAC_PI_2));
    }
    mesh
}

/// The lower body: its side view with wheel arches, drawn in at the ends.
fn body(mesh: &mut Mesh, s: &Shape, rng: &mut Rng) {
    let (low, arch) = (0.2, s.wheel + 0.07);
    let mut outline = vec![vec2(-s.half, low + 0.12), vec2(-s.half + 0.08, low)];
    for axle in [-s.axle, s.axle] {
        let rise = (0..=12).map(|k| turn(PI - k as f32 / 12.0 * PI) * arch);
        outline.extend(rise.map(|p| vec2(axle + p.x, (s.wheel + p.y).max(low))));
    }
    let (nose, tail) = (s.belt - rng.range(0.08, 0.22), s.belt - rng.range(0.0, 0.12));
    outline.extend([
        vec2(s.half - 0.06, low),
        vec2(s.half, low + 0.14),
        vec2(s.half, nose - 0.1),
        vec2(s.half - 0.12, nose),
    ]);
    outline.extend([
        vec2(0.45 * s.half, s.belt),
        vec2(-0.6 * s.half, s.belt),
        vec2(-s.half + 0.1, tail),
        vec2(-s.half, tail - 0.12),
    ]);
    let side = extrude(&outline, 2.0 * s.wide, 0.05).at(Pose::IDENTITY.yaw(-FRAC_PI_2));
    let drawn = |p: Vec3| {
        let t = (p.z / s.half) * (p.z / s.half);
        vec3(p.x * (1.0 - 0.1 * t * t) * (1.0 - 0.06 * (p.y - 0.55).abs()), p.y, p.z)
    };
    mesh.add(&side.warp(drawn), Pose::IDENTITY);
    mesh.add(&cuboid(vec3(1.9 * s.wide - 0.5, 0.3, 1.8 * s.half)), Pose::at(0.0, 0.24, 0.0));
    for sz in [-1.0, 1.0] {
        let bumper = block(vec3(1.75 * s.wide, 0.16, 0.14), 0.06);
        mesh.add(&bumper, Pose::at(0.0, 0.34, sz * (s.half - 0.01)));
        mesh.add(&block(vec3(0.5, 0.11, 0.02), 0.004), Pose::at(0.0, 0.36, sz * (s.half + 0.065)));
        for sx in [-1.0, 1.0] {
            let light = cylinder((0.1, 0.085), 0.06, 20);
            let at = Pose::at(sx * 0.66 * s.wide, nose - 0.2, sz * (s.half - 0.03));
            mesh.add(&light, at.pitch(sz * FRAC_PI_2));
        }
    }
    for k in 0..5 {
        let bar = block(vec3(0.9 * s.wide, 0.018, 0.03), 0.004);
        mesh.add(&bar, Pose::at(0.0, nose - 0.3 + 0.035 * k as f32, s.half - 0.002));
    }
    for sx in [-1.0, 1.0] {
        let mirror = block(vec3(0.16, 0.12, 0.09), 0.03);
        mesh.add(&mirror, Pose::at(sx * (s.wide + 0.06), s.belt + 0.02, 0.32 * s.half));
        for z in [-0.25, 0.25] {
            let grip = block(vec3(0.03, 0.025, 0.16), 0.008);
            mesh.add(&grip, Pose::at(sx * (s.wide - 0.005), s.belt - 0.16, z * s.half - 0.2));
        }
    }
}

/// Pillars, roof and glass above the belt line.
fn cabin(mesh: &mut Mesh, s: &Shape, rng: &mut Rng) {
    let (hood, rear) = (rng.range(0.3, 0.45) * s.half, -rng.range(0.6, 0.93) * s.half);
    let (front, back) = (hood - rng.range(0.35, 0.6), rear + rng.range(0.08, 0.5));
    let outline =
        [vec2(rear, 0.0), vec2(hood, 0.0), vec2(front, s.roof - s.belt), vec2(back, s.roof - s.belt)];
    let narrow = |p: Vec3| vec3(p.x * (1.0 - 0.2 * p.y.max(0.0)), p.y, p.z + 0.0);
    let solid = extrude(&outline, 1.86 * s.wide, 0.06).at(Pose::IDENTITY.yaw(-FRAC_PI_2)).warp(narrow);
    mesh.add(&solid, Pose::at(0.0, s.belt - 0.05, 0.0));
    let middle = 0.5 * (hood + rear) + 0.05;
    let (lean, rise) = (0.2, s.roof - s.belt - 0.14);
    for (from, to, shift) in
        [(middle + 0.04, hood - 0.16, front - hood), (rear + 0.16, middle - 0.04, back - rear)]
    {
        let t = rise / (s.roof - s.belt);
        let ends = if shift < 0.0 { (from, to + shift * t) } else { (from + shift * t, to) };
        let pane = [vec2(from, 0.0), vec2(to, 0.0), vec2(ends.1, rise), vec2(ends.0, rise)];
        let rim = ring(&pane, &inset(&pane, 0.035), (0.03, 0.005));
        for sx in [-1.0, 1.0] {
            mesh.add(&rim, Pose::at(sx * 0.93 * s.wide, s.belt, 0.0).roll(sx * lean).yaw(-FRAC_PI_2));
        }
    }
    if rng.chance(0.3) {
        for sx in [-1.0, 1.0] {
            let rail = block(vec3(0.03, 0.04, 0.8 * (front - back)), 0.01);
            mesh.add(&rail, Pose::at(sx * 0.62 * s.wide, s.roof - 0.03, 0.5 * (front + back)));
        }
    }
}

/// A wheel of `radius` about its axle, its outside towards +z.
fn wheel(radius: f32, rng: &mut Rng) -> Mesh {
    let width = 0.2;
    let mut tyre = torus(0.8 * radius, 0.2 * radius, Segments { around: 48, across: 16 });
    tyre = tyre.at(Pose::IDENTITY.pitch(FRAC_PI_2).stretch(1.0, 0.5 * width / (0.2 * radius), 1.0));
    let mut mesh = tyre;
    let dish = [
        vec2(0.0, 0.02),
        vec2(0.15, 0.02),
        vec2(0.2, -0.02),
        vec2(0.6, -0.05),
        vec2(0.66, 0.05),
        vec2(0.72, 0.05),
        vec2(0.72, -0.09),
        vec2(0.0, -0.09),
    ];
    let profile: Vec<Vec2> = dish.iter().rev().map(|p| vec2(p.x * radius, p.y)).collect();
    mesh.add(&lathe(&profile, 32), Pose::at(0.0, 0.0, 0.02).pitch(FRAC_PI_2));
    let spokes = rng.count(5, 10);
    let bar = extrude(
        &[vec2(0.1, -0.05), vec2(0.68, -0.08), vec2(0.68, 0.08), vec2(0.1, 0.05)].map(|p| p * radius),
        0.035,
        0.006,
    );
    for k in 0..spokes {
        mesh.add(&bar, Pose::at(0.0, 0.0, 0.035).roll(k as f32 / spokes as f32 * 2.0 * PI));
    }
    mesh
}
