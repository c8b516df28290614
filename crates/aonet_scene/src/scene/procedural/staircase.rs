//! A stairwell with straight flights, landings and a spiral stair.

use super::architecture::{Opening, column, door, floor, frame, trim_around, trim_profile, wall, window};
use super::mesh::{Mesh, Pose, turn};
use super::props::picture;
use super::rng::Rng;
use super::shapes::{ball, block, cuboid, curve, cylinder, extrude, lathe, tube};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Measures and looks that all stairs of one house share.
struct Style {
    rise: f32,
    tread: f32,
    width: f32,
    closed: bool,
    baluster: Mesh,
    per_step: usize,
}

impl Style {
    fn new(rng: &mut Rng) -> Self {
        let baluster = match rng.below(3) {
            0 => cylinder((0.012, 0.012), 0.92, 10),
            1 => block(vec3(0.03, 0.92, 0.03), 0.004),
            _ => {
                let n = rng.count(5, 8);
                let mut points: Vec<Vec2> =
                    (0..=n).map(|i| vec2(rng.range(0.014, 0.042), i as f32 / n as f32 * 0.92)).collect();
                (points[0].x, points[n].x) = (0.03, 0.02);
                lathe(&curve(&points, 5), 14)
            }
        };
        Self {
            rise: rng.range(0.15, 0.18),
            tread: rng.range(0.26, 0.31),
            width: rng.range(1.0, 1.5),
            closed: rng.chance(0.5),
            baluster,
            per_step: rng.count(1, 2),
        }
    }

    /// Balusters and a handrail over `path` (a line of feet).
    fn rail(&self, mesh: &mut Mesh, path: &[Vec3], each: f32) {
        let up = Vec3::Y * 0.92;
        let mut left = 0.5 * each;
        for pair in path.windows(2) {
            let length = pair[0].distance(pair[1]);
            while left < length {
                let p = pair[0].lerp(pair[1], left / length);
                mesh.add(&self.baluster, Pose::at(p.x, p.y, p.z));
                left += each;
            }
            left -= length;
        }
        let top: Vec<Vec3> = path.iter().map(|p| *p + up).collect();
        mesh.add(&tube(&top, &vec![0.03; top.len()], 14), Pose::IDENTITY);
    }
}

/// The stairwell.
pub(super) fn stairwell(rng: &mut Rng) -> Mesh {
    let style = Style::new(rng);
    let per_flight = rng.count(9, 12);
    let storeys = rng.count(1, 2);
    let run = per_flight as f32 * style.tread;
    let climb = per_flight as f32 * style.rise;
    let half = vec2(rng.range(3.0, 4.2), 0.5 * run + style.width + rng.range(0.1, 0.8));
    let height = 2.0 * climb * storeys as f32 + 2.9;
    let mut mesh = floor(half, &mut rng.fork());
    shell(&mut mesh, (half, height, 2.0 * climb), &mut rng.fork());
    let x = [half.x - 0.5 * style.width - 0.02, half.x - 1.5 * style.width - 0.25];
    for storey in 0..storeys {
        let y = 2.0 * climb * storey as f32;
        let up = Pose::at(x[0], y, -0.5 * run);
        mesh.add(&flight(per_flight, &style, rng), up);
        let span = x[0] - x[1] + style.width;
        let landing = block(vec3(span, 0.2, style.width), 0.012);
        let middle = 0.5 * (x[0] + x[1]);
        mesh.add(&landing, Pose::at(middle, y + climb - 0.2, 0.5 * run + 0.5 * style.width));
        mesh.add(&flight(per_flight, &style, rng), Pose::at(x[1], y + climb, 0.5 * run).yaw(PI));
        gallery(&mut mesh, half, &Edge { y: y + 2.0 * climb, z: -0.5 * run, stair_x: x[1] }, &style);
    }
    let radius = rng.range(0.9, 1.25);
    let at = Pose::at(radius + 0.3 - half.x, 0.0, 0.1 * half.y + 0.2).yaw(rng.angle());
    mesh.add(&spiral(radius, 2.0 * climb * storeys as f32, &style), at);
    let post = column(height, 0.18, rng);
    mesh.add(&post, Pose::at(-half.x + 0.3, 0.0, half.y - 0.3));
    mesh.add(&post, Pose::at(0.2, 0.0, half.y - 0.3));
    furnish(&mut mesh, half, rng);
    mesh
}

/// Walls with windows and doors, trims, ceiling.
fn shell(mesh: &mut Mesh, (half, height, storey): (Vec2, f32, f32), rng: &mut Rng) {
    let thick = 0.3;
    for side in 0..4 {
        let (long, reach) = if side % 2 == 0 { (half.x, half.y) } else { (half.y, half.x) };
        let pose = Pose::IDENTITY.yaw(side as f32 * FRAC_PI_2).shift(0.0, 0.0, -reach - 0.5 * thick);
        let mut holes = Vec::new();
        let wide = rng.range(0.6, 1.2);
        let mut y = 0.0;
        while y + 2.6 < height {
            for x in [-0.5, 0.5] {
                if rng.chance(0.6) && side != 3 {
                    holes.push((vec2(x * long - 0.5 * wide, y + 0.9), vec2(x * long + 0.5 * wide, y + 2.3)));
                }
            }
            if side == 0 {
                holes.retain(|h: &(Vec2, Vec2)| h.0.y != y + 0.9);
                holes.push((vec2(-0.75 * long, y), vec2(-0.75 * long + 0.9, y + 2.05)));
            }
            y += storey;
        }
        mesh.add(&wall(vec3(2.0 * long + 2.0 * thick, height, thick), &holes), pose);
        let face =
            Face { pose: pose.shift(0.0, 0.0, 0.5 * thick), half_length: long, height, openings: &holes };
        decorate(mesh, &face, rng);
        for (lo, hi) in holes {
            let at = pose.shift(0.5 * (lo.x + hi.x), lo.y, 0.0);
            let fitting = if side == 0 { door(hi - lo, rng) } else { window(hi - lo, thick, rng) };
            mesh.add(&fitting, at);
        }
    }
    let lid = cuboid(vec3(2.0 * half.x + 0.6, 0.2, 2.0 * half.y + 0.6));
    mesh.add(&lid, Pose::at(0.0, height, 0.0));
    let skirting = trim_profile(0.14, 0.025, rng);
    mesh.add(&trim_around(half, 0.0, &skirting), Pose::IDENTITY);
    let cornice = trim_profile(0.2, 0.15, rng);
    let down: Vec<Vec2> = cornice.iter().rev().map(|p| vec2(p.x, -p.y)).collect();
    mesh.add(&trim_around(half, height, &down), Pose::IDENTITY);
}

/// The face of a wall.
struct Face<'a> {
    /// The middle of its lower edge.
    pose: Pose,
    half_length: f32,
    height: f32,
    openings: &'a [Opening],
}

/// Adds mouldings in fields and pictures to a wall, where its openings leave room.
fn decorate(mesh: &mut Mesh, face: &Face<'_>, rng: &mut Rng) {
    let Face { half_length: long, height, openings: holes, .. } = *face;
    let n = (long / rng.range(0.5, 0.9)).ceil();
    let wide = 2.0 * long / n;
    let rows = (height / 1.45) as usize;
    let field = frame(vec2(wide - 0.3, 1.0), vec2(0.05, 0.03));
    for (i, j) in (0..n as usize).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let at = vec2((i as f32 + 0.5) * wide - long, j as f32 * 1.45 + 0.3);
        let free = |(lo, hi): &Opening| {
            hi.x < at.x - 0.5 * wide || lo.x > at.x + 0.5 * wide || hi.y < at.y - 0.15 || lo.y > at.y + 1.2
        };
        if !holes.iter().all(free) {
            continue;
        }
        let pose = face.pose.shift(at.x, at.y, 0.0);
        mesh.add(&field, pose.shift(0.0, 0.0, 0.01));
        if rng.chance(0.3) && wide > 0.7 {
            let size = vec2(rng.range(0.4, 0.7) * wide, rng.range(0.4, 0.7));
            mesh.add(&picture(size, rng), pose.shift(0.0, 0.15, 0.0));
        }
    }
}

/// Steps that climb along +z from the origin, x about 0, with rails on both sides.
fn flight(steps: usize, style: &Style, rng: &mut Rng) -> Mesh {
    let (rise, tread, width) = (style.rise, style.tread, style.width);
    let mut mesh = Mesh::default();
    let board = block(vec3(width, 0.035, tread + 0.03), 0.01);
    for i in 0..steps {
        mesh.add(&board, Pose::at(0.0, (i + 1) as f32 * rise - 0.035, (i as f32 + 0.5) * tread - 0.015));
    }
    let mut saw = vec![vec2(0.0, 0.0)];
    for i in 0..steps {
        let y = (i + 1) as f32 * rise - 0.03;
        saw.extend([vec2(i as f32 * tread, y), vec2((i + 1) as f32 * tread, y)]);
    }
    let under = if style.closed { 0.16 } else { 0.1 };
    saw.extend([vec2(steps as f32 * tread, steps as f32 * rise - rise - under), vec2(tread, -0.0)]);
    saw.reverse();
    let body = if style.closed { width - 0.06 } else { 0.05 };
    let side = extrude(&saw, body, 0.0).at(Pose::IDENTITY.yaw(-FRAC_PI_2));
    let places: &[f32] = if style.closed { &[0.0] } else { &[-0.42, 0.42] };
    places.iter().for_each(|x| mesh.add(&side, Pose::at(x * width, 0.0, 0.0)));
    for x in [-0.5 * width + 0.05, 0.5 * width - 0.05] {
        let foot = |i: usize| vec3(x, (i + 1) as f32 * rise, (i as f32 + 0.5) * tread);
        let path: Vec<Vec3> = (0..steps).map(foot).collect();
        let slope = vec2(rise, tread).length();
        style.rail(&mut mesh, &path, slope / style.per_step as f32);
        for p in [path[0], path[steps - 1]] {
            mesh.add(&newel(rng), Pose::at(p.x, p.y - 0.02, p.z));
        }
    }
    mesh
}

/// The post at an end of a rail.
fn newel(rng: &mut Rng) -> Mesh {
    let mut mesh = block(vec3(0.08, 1.02, 0.08), 0.01);
    mesh.add(&block(vec3(0.11, 0.03, 0.11), 0.008), Pose::at(0.0, 1.02, 0.0));
    if rng.chance(0.6) {
        mesh.add(&ball(0.05, 18), Pose::at(0.0, 1.09, 0.0));
    }
    mesh
}

/// Where a gallery ends.
struct Edge {
    /// Height of the floor.
    y: f32,
    /// Place of the edge towards the well.
    z: f32,
    /// Place of the stair that leads up to it.
    stair_x: f32,
}

/// Adds a floor before an edge, with a railing towards the well.
fn gallery(mesh: &mut Mesh, half: Vec2, edge: &Edge, style: &Style) {
    let Edge { y, z, stair_x: x } = *edge;
    let deep = z + half.y;
    let slab = block(vec3(2.0 * half.x, 0.22, deep), 0.012);
    mesh.add(&slab, Pose::at(0.0, y - 0.22, z - 0.5 * deep));
    let beam = block(vec3(2.0 * half.x, 0.2, 0.2), 0.015);
    mesh.add(&beam, Pose::at(0.0, y - 0.4, z - 0.12));
    let edge = x - 0.5 * style.width;
    let path = [vec3(-half.x + 2.7, y, z - 0.06), vec3(edge, y, z - 0.06)];
    if path[1].x > path[0].x + 0.3 {
        style.rail(mesh, &path, 0.13);
    }
}

/// A spiral stair about the y axis.
fn spiral(radius: f32, height: f32, style: &Style) -> Mesh {
    let steps = (height / 0.19).ceil() as usize;
    let rise = height / steps as f32;
    let each = TAU / 13.0;
    let mut mesh = cylinder((0.09, 0.09), height + 1.0, 24);
    let wedge =
        |r: f32, from: f32, to: f32| (0..=5).map(move |k| turn(from + (to - from) * k as f32 / 5.0) * r);
    let mut outline: Vec<Vec2> = wedge(0.08, 0.55 * each, -0.55 * each).collect();
    outline.extend(wedge(radius, -0.55 * each, 0.55 * each));
    let tread = extrude(&outline, 0.045, 0.008).at(Pose::IDENTITY.pitch(-FRAC_PI_2));
    let mut path = Vec::new();
    for i in 0..steps {
        let y = (i + 1) as f32 * rise;
        let t = turn(i as f32 * each);
        mesh.add(&tread, Pose::at(0.0, y - 0.0225, 0.0).yaw(i as f32 * each));
        mesh.add(&cylinder((0.11, 0.11), 0.07, 20), Pose::at(0.0, y - 0.09, 0.0));
        path.push(vec3(t.x * (radius - 0.04), y, -t.y * (radius - 0.04)));
    }
    for p in &path {
        mesh.add(&style.baluster, Pose::at(p.x, p.y, p.z));
    }
    let fine: Vec<Vec3> = path
        .windows(2)
        .flat_map(|w| [0.0, 0.5].map(|t| smooth_ring(w, t)))
        .chain(path.last().copied())
        .collect();
    let rail: Vec<Vec3> = fine.iter().map(|p| *p + Vec3::Y * 0.92).collect();
    mesh.add(&tube(&rail, &vec![0.025; rail.len()], 12), Pose::IDENTITY);
    let string: Vec<Vec3> = fine.iter().map(|p| *p - Vec3::Y * 0.06).collect();
    mesh.add(&tube(&string, &vec![0.03; string.len()], 10), Pose::IDENTITY);
    mesh
}

/// Between two points at one distance from the y axis, staying at that distance.
fn smooth_ring(w: &[Vec3], t: f32) -> Vec3 {
    let p = w[0].lerp(w[1], t);
    let r = vec2(w[0].x, w[0].z).length();
    let flat = vec2(p.x, p.z).normalize_or_zero() * r;
    vec3(flat.x, p.y, flat.y)
}

fn furnish(mesh: &mut Mesh, half: Vec2, rng: &mut Rng) {
    let urn = super::props::vessel(0.25, 0.8, rng);
    mesh.add(&urn, Pose::at(0.3, 0.0, half.y - 1.0));
    mesh.add(&super::street::bench(rng), Pose::at(-0.4 * half.x, 0.0, half.y - 0.4).yaw(PI));
    let plant = super::furniture::potted_plant(rng.range(0.8, 1.4), rng);
    mesh.add(&plant, Pose::at(-half.x + 0.5, 0.0, -half.y + 0.5));
}
