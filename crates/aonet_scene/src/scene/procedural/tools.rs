//! Hand tools, cutlery, pots. They lie along +y from y = 0, flat in z, unless said otherwise.

use super::mesh::{Mesh, Pose, turn};
use super::props::hollow;
use super::rng::Rng;
use super::shapes::{block, curve, cylinder, extrude, lathe, ring, surface, tube};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Any hand tool.
pub(super) fn tool(rng: &mut Rng) -> Mesh {
    match rng.below(8) {
        0 => hammer(rng),
        1 => wrench(rng),
        2 => screwdriver(rng),
        3 => saw(rng),
        4 => pliers(rng),
        5 => brush(rng),
        6 => chisel(rng),
        _ => square(rng),
    }
}

/// A turned wooden handle of `length` and about `radius`.
fn handle(length: f32, radius: f32, rng: &mut Rng) -> Mesh {
    let shape = [(0.6, 0.0), (1.0, 0.06), (rng.range(0.8, 1.1), 0.3), (rng.range(0.6, 0.9), 0.7), (0.7, 1.0)];
    let points = shape.map(|(r, y)| vec2(r * radius, y * length));
    let mut profile = vec![Vec2::ZERO];
    profile.extend(curve(&points, 5));
    profile.push(vec2(0.0, length));
    lathe(&profile, 16)
}

fn hammer(rng: &mut Rng) -> Mesh {
    let long = rng.range(0.25, 0.34);
    let mut mesh = handle(long, 0.016, rng);
    let head = Pose::at(0.0, long - 0.015, 0.0).roll(FRAC_PI_2);
    mesh.add(&block(vec3(0.03, 0.07, 0.028), 0.005), head.shift(0.0, -0.035, 0.0));
    mesh.add(&cylinder((0.016, 0.019), 0.035, 18), head.shift(0.0, 0.03, 0.0));
    let claw =
        [vec2(0.0, -0.013), vec2(0.05, -0.02), vec2(0.075, -0.035), vec2(0.055, 0.002), vec2(0.0, 0.013)];
    for z in [-0.009, 0.009] {
        mesh.add(&extrude(&claw, 0.012, 0.001), Pose::at(0.03, long - 0.015, z));
    }
    mesh
}

fn wrench(rng: &mut Rng) -> Mesh {
    let (long, s) = (rng.range(0.16, 0.28), rng.range(0.014, 0.02));
    let mut mesh = block(vec3(1.1 * s, long, 0.35 * s), 0.12 * s);
    let jaw = [
        (0.5, -1.4),
        (1.5, -0.8),
        (1.7, 0.5),
        (1.1, 1.7),
        (0.75, 1.5),
        (0.8, -0.1),
        (-0.8, -0.1),
        (-0.75, 1.5),
        (-1.1, 1.7),
        (-1.7, 0.5),
        (-1.5, -0.8),
        (-0.5, -1.4),
    ];
    let outline: Vec<Vec2> = jaw.iter().map(|(x, y)| vec2(*x, *y) * s).collect();
    mesh.add(&extrude(&outline, 0.6 * s, 0.06 * s), Pose::at(0.0, long + 0.6 * s, 0.0).roll(0.25));
    let circle: Vec<Vec2> = (0..24).map(|k| turn(k as f32 / 24.0 * TAU) * 1.4 * s).collect();
    mesh.add(&super::machine::bored(&circle, 0.85 * s, 0.6 * s), Pose::at(0.0, -s, 0.0));
    mesh.at(Pose::at(0.0, 2.4 * s, 0.0))
}

fn screwdriver(rng: &mut Rng) -> Mesh {
    let (grip, shank) = (rng.range(0.08, 0.12), rng.range(0.08, 0.18));
    let lobes = 6.0;
    let mut mesh = surface((16, 36), |u, v| {
        let k = (v * 36.0).round() % 36.0;
        let a = k / 36.0 * TAU;
        let round = (4.0 * u * (1.0 - u)).max(0.0).sqrt().min(1.0);
        let r = 0.015
            * (1.0 + 0.1 * turn(a * lobes).x)
            * if u == 0.0 || u == 1.0 { 0.0 } else { 0.55 + 0.45 * round };
        let t = turn(a) * r;
        vec3(t.x, u * grip, t.y)
    });
    mesh.add(&cylinder((0.004, 0.004), shank, 10), Pose::at(0.0, grip - 0.004, 0.0));
    mesh.add(&block(vec3(0.008, 0.012, 0.002), 0.0005), Pose::at(0.0, grip + shank - 0.008, 0.0));
    mesh
}

fn saw(rng: &mut Rng) -> Mesh {
    let long = rng.range(0.3, 0.42);
    let teeth = 34;
    let mut blade = vec![vec2(0.05, long), vec2(0.02, long), vec2(-0.045, 0.0)];
    blade.extend((0..teeth).flat_map(|k| {
        let y = k as f32 / teeth as f32 * long;
        [vec2(0.075, y), vec2(0.083, y + 0.6 * long / teeth as f32)]
    }));
    blade[1].x = 0.01;
    let mut mesh = extrude(&blade, 0.0016, 0.0);
    let outer: Vec<Vec2> =
        (0..28).map(|k| turn(k as f32 / 28.0 * TAU)).map(|t| vec2(0.06 * t.x + 0.01, 0.055 * t.y)).collect();
    let inner: Vec<Vec2> =
        (0..28).map(|k| turn(k as f32 / 28.0 * TAU)).map(|t| vec2(0.035 * t.x + 0.01, 0.026 * t.y)).collect();
    mesh.add(&ring(&outer, &inner, (0.022, 0.005)), Pose::at(0.0, -0.03, 0.0));
    mesh.at(Pose::at(0.0, 0.085, 0.0))
}

fn pliers(rng: &mut Rng) -> Mesh {
    let open = rng.range(0.08, 0.3);
    let half: Vec<Vec2> =
        [(-0.004, 0.0), (0.01, 0.03), (0.008, 0.06), (0.0, 0.0)].iter().map(|(x, y)| vec2(*x, *y)).collect();
    let jaw = [
        half[0] + vec2(-0.006, -0.012),
        vec2(0.012, -0.01),
        half[1],
        vec2(0.006, 0.055),
        vec2(-0.001, 0.055),
        vec2(-0.001, 0.02),
    ];
    let grip: Vec<Vec3> = (0..=10)
        .map(|i| i as f32 / 10.0)
        .map(|t| vec3(-0.004 - 0.022 * turn(t * PI).y - 0.012 * t, -0.13 * t, 0.0))
        .collect();
    let mut mesh = Mesh::default();
    for side in [-1.0f32, 1.0] {
        let pose = Pose::IDENTITY.roll(side * open * 0.5).stretch(side, 1.0, 1.0);
        mesh.add(&extrude(&jaw, 0.01, 0.001), pose.shift(0.0, 0.0, 0.002 * side));
        mesh.add(&tube(&grip, &[0.006; 11], 10), pose);
    }
    mesh.add(&cylinder((0.01, 0.01), 0.016, 16), Pose::at(0.0, 0.0, -0.008).pitch(FRAC_PI_2));
    mesh.at(Pose::at(0.0, 0.14, 0.0))
}

fn brush(rng: &mut Rng) -> Mesh {
    let wide = rng.range(0.03, 0.08);
    let mut mesh = handle(0.13, 0.011, rng);
    mesh.add(&block(vec3(wide, 0.035, 0.016), 0.003), Pose::at(0.0, 0.12, 0.0));
    let tufts = (wide / 0.006) as usize;
    for k in 0..tufts {
        let x = ((k as f32 + 0.5) / tufts as f32 - 0.5) * wide * 0.95;
        let bristle = block(vec3(0.005, 0.05, 0.011), 0.001);
        mesh.add(&bristle, Pose::at(x, 0.15, 0.0).roll(-x * rng.range(0.5, 3.0)));
    }
    mesh
}

fn chisel(rng: &mut Rng) -> Mesh {
    let mut mesh = handle(0.12, 0.014, rng);
    let wide = rng.range(0.008, 0.03);
    let blade = [vec2(0.0, 0.0), vec2(0.006, 0.0), vec2(0.004, 0.12), vec2(0.0, 0.14)];
    mesh.add(&extrude(&blade, wide, 0.0005), Pose::at(0.0, 0.11, -0.003).yaw(-FRAC_PI_2));
    mesh
}

fn square(rng: &mut Rng) -> Mesh {
    let (a, b) = (rng.range(0.15, 0.3), rng.range(0.1, 0.2));
    let outline =
        [vec2(0.0, 0.0), vec2(b, 0.0), vec2(b, 0.03), vec2(0.03, 0.03), vec2(0.03, a), vec2(0.0, a)];
    extrude(&outline, 0.006, 0.001)
}

/// A knife, fork or spoon, 0.2 m long, along +y.
pub(super) fn cutlery(kind: usize) -> Mesh {
    let stem = |u: f32| 0.004 + 0.005 * (1.0 - u) * (1.0 - u);
    match kind % 3 {
        0 => {
            let blade = [
                vec2(-0.008, 0.1),
                vec2(-0.009, 0.0),
                vec2(0.009, 0.0),
                vec2(0.007, 0.1),
                vec2(0.012, 0.115),
                vec2(0.011, 0.19),
                vec2(0.002, 0.21),
                vec2(-0.008, 0.2),
            ];
            let ordered: Vec<Vec2> = blade.to_vec();
            extrude(&ordered, 0.003, 0.0008)
        }
        1 => {
            let mut outline = vec![
                vec2(-stem(0.0), 0.0),
                vec2(stem(0.0), 0.0),
                vec2(stem(1.0), 0.12),
                vec2(0.012, 0.14),
                vec2(0.012, 0.2),
            ];
            for k in 0..3 {
                let x = 0.0085 - 0.0068 * k as f32;
                outline.extend([
                    vec2(x, 0.2),
                    vec2(x - 0.0005, 0.155),
                    vec2(x - 0.003, 0.155),
                    vec2(x - 0.0035, 0.2),
                ]);
            }
            outline.extend([vec2(-0.012, 0.2), vec2(-0.012, 0.14), vec2(-stem(1.0), 0.12)]);
            bent(extrude(&outline, 0.0025, 0.0005))
        }
        _ => {
            let mut mesh = bent(extrude(
                &[vec2(-0.009, 0.0), vec2(0.009, 0.0), vec2(0.004, 0.14), vec2(-0.004, 0.14)],
                0.0028,
                0.0006,
            ));
            let bowl = [vec2(0.2, 0.0), vec2(0.7, 0.2), vec2(1.0, 0.8)].map(|p| p * vec2(0.02, 0.01));
            let dish = hollow(&bowl, 0.0015);
            mesh.add(&dish, Pose::at(0.0, 0.16, 0.0).pitch(FRAC_PI_2).stretch(1.0, 1.0, 1.5));
            mesh
        }
    }
}

/// A little arched along y, as cutlery is.
fn bent(mesh: Mesh) -> Mesh {
    mesh.warp(|p| vec3(p.x, p.y, p.z + 0.006 * turn(p.y * 15.0).y))
}

/// A pan or pot standing on y = 0 with a handle along +z.
pub(super) fn pan(rng: &mut Rng) -> Mesh {
    let (r, h) = (rng.range(0.08, 0.15), rng.range(0.04, 0.16));
    let mut mesh = hollow(&[vec2(0.92 * r, 0.0), vec2(r, 0.3 * h), vec2(rng.range(1.0, 1.12) * r, h)], 0.004);
    if h < 0.08 || rng.chance(0.5) {
        let path = rounded_handle(r, h);
        mesh.add(&tube(&path, &vec![0.009; path.len()], 10), Pose::IDENTITY);
    } else {
        for side in [0.0, PI] {
            let arc = |i: usize| turn((i as f32 / 8.0 - 0.5) * PI);
            let path: Vec<Vec3> =
                (0..=8).map(|i| vec3(0.03 * arc(i).y, 0.8 * h, r + 0.035 * arc(i).x)).collect();
            mesh.add(&tube(&path, &[0.006; 9], 8), Pose::IDENTITY.yaw(side));
        }
        if rng.chance(0.6) {
            let lid = [
                vec2(0.0, 0.0),
                vec2(1.08 * r, 0.0),
                vec2(1.08 * r, 0.006),
                vec2(0.4 * r, 0.03),
                vec2(0.0, 0.035),
            ];
            mesh.add(&lathe(&lid, 32), Pose::at(0.0, h, 0.0));
            mesh.add(&cylinder((0.012, 0.02), 0.025, 14), Pose::at(0.0, h + 0.032, 0.0));
        }
    }
    mesh
}

fn rounded_handle(r: f32, h: f32) -> Vec<Vec3> {
    super::machine::rounded(
        &[vec3(0.0, 0.75 * h, 0.97 * r), vec3(0.0, 0.75 * h, 1.2 * r), vec3(0.0, 0.75 * h + 0.03, 2.4 * r)],
        0.03,
    )
}

/// A lidded jar or tin of about `radius`.
pub(super) fn jar(radius: f32, rng: &mut Rng) -> Mesh {
    let h = radius * rng.range(1.6, 3.2);
    let body = [vec2(0.9, 0.0), vec2(1.0, 0.06), vec2(1.0, 0.8), vec2(0.85, 0.9), vec2(0.8, 1.0)];
    let mut profile = vec![Vec2::ZERO];
    profile.extend(body.map(|p| p * vec2(radius, h)));
    profile.push(vec2(0.0, h));
    let mut mesh = lathe(&profile, 28);
    let lid = rng.range(0.82, 0.95) * radius;
    mesh.add(&cylinder((lid, lid), 0.16 * h, 28), Pose::at(0.0, 0.97 * h, 0.0));
    mesh
}
