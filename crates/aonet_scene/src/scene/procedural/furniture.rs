//! Furniture. Stands on y = 0 about x = z = 0, front towards +z.

use super::mesh::{Mesh, Pose, turn};
use super::props::{books, cushion, vessel};
use super::rng::{Noise, Rng};
use super::shapes::{ball, block, curve, cylinder, extrude, lathe, superellipsoid, surface};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// A leg from the floor to `height`: square, tapered or turned on a lathe.
fn leg(height: f32, thick: f32, rng: &mut Rng) -> Mesh {
    match rng.below(3) {
        0 => block(vec3(thick, height, thick), 0.1 * thick),
        1 => cylinder((0.35 * thick, 0.6 * thick), height, 16),
        _ => {
            let n = rng.count(4, 7);
            let mut points: Vec<Vec2> =
                (0..=n).map(|i| vec2(rng.range(0.25, 0.6) * thick, i as f32 / n as f32 * height)).collect();
            points[n].x = 0.6 * thick;
            let mut profile = vec![Vec2::ZERO];
            profile.extend(curve(&points, 5));
            profile.push(vec2(0.0, height));
            lathe(&profile, 18)
        }
    }
}

/// `top` copies at the corners of a rectangle of `half` extents.
fn at_corners(mesh: &mut Mesh, part: &Mesh, half: Vec2, y: f32) {
    for (sx, sz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        mesh.add(part, Pose::at(sx * half.x, y, sz * half.y));
    }
}

/// A table of `size`: rectangular with an apron, or round on a pedestal.
pub(super) fn table(size: Vec3, rng: &mut Rng) -> Mesh {
    let top = rng.range(0.022, 0.045);
    let mut mesh = Mesh::default();
    if rng.chance(0.3) && (size.x / size.z) < 1.3 {
        let r = 0.5 * size.x.min(size.z);
        mesh.add(&cylinder((r, r), top, 56), Pose::at(0.0, size.y - top, 0.0));
        let post =
            [(0.55, 0.0), (0.5, 0.04), (0.12, 0.12), (0.08, 0.5), (0.14, 0.75), (0.1, 0.9), (0.3, 1.0)];
        let points = post.map(|(x, y)| vec2(x * r, y * (size.y - top)));
        let mut profile = vec![Vec2::ZERO];
        profile.extend(curve(&points, 6));
        mesh.add(&lathe(&profile, 32), Pose::IDENTITY);
        return mesh;
    }
    mesh.add(&block(vec3(size.x, top, size.z), 0.25 * top), Pose::at(0.0, size.y - top, 0.0));
    let thick = rng.range(0.045, 0.08);
    let inset = vec2(size.x, size.z) * 0.5 - Vec2::splat(thick * 0.5 + rng.range(0.01, 0.06));
    at_corners(&mut mesh, &leg(size.y - top, thick, rng), inset, 0.0);
    let apron = rng.range(0.06, 0.12);
    for side in [-1.0, 1.0] {
        let y = size.y - top - apron;
        let long = block(vec3(2.0 * inset.x, apron, 0.02), 0.003);
        mesh.add(&long, Pose::at(0.0, y, side * inset.y));
        let short = block(vec3(0.02, apron, 2.0 * inset.y), 0.003);
        mesh.add(&short, Pose::at(side * inset.x, y, 0.0));
    }
    mesh
}

/// A chair with a slatted, barred or closed back.
pub(super) fn chair(rng: &mut Rng) -> Mesh {
    let (w, d, seat) = (rng.range(0.4, 0.48), rng.range(0.4, 0.48), rng.range(0.42, 0.48));
    let thick = rng.range(0.03, 0.045);
    let mut mesh = Mesh::default();
    let half = vec2(w, d) * 0.5 - Vec2::splat(0.6 * thick);
    at_corners(&mut mesh, &leg(seat, thick, rng), half, 0.0);
    mesh.add(&block(vec3(w, 0.03, d), 0.008), Pose::at(0.0, seat, 0.0));
    if rng.chance(0.4) {
        let pad = cushion(vec3(0.95 * w, 0.06, 0.95 * d), rng);
        mesh.add(&pad, Pose::at(0.0, seat + 0.025, 0.0));
    }
    let rise = rng.range(0.38, 0.55);
    let back = Pose::at(0.0, seat + 0.01, -half.y).pitch(-rng.range(0.05, 0.2));
    for side in [-1.0, 1.0] {
        let post = block(vec3(thick, rise, thick), 0.15 * thick);
        mesh.add(&post, back.shift(side * half.x, 0.0, 0.0));
    }
    mesh.add(&block(vec3(w, 0.07, 0.8 * thick), 0.006), back.shift(0.0, rise - 0.08, 0.0));
    match rng.below(3) {
        0 => {
            let n = rng.count(3, 7);
            for i in 0..n {
                let x = ((i as f32 + 1.0) / (n as f32 + 1.0) - 0.5) * 2.0 * half.x;
                mesh.add(&cylinder((0.008, 0.008), rise - 0.05, 10), back.shift(x, 0.0, 0.0));
            }
        }
        1 => {
            for i in 1..rng.count(3, 4) {
                let bar = block(vec3(2.0 * half.x, 0.05, 0.6 * thick), 0.004);
                mesh.add(&bar, back.shift(0.0, rise * (0.1 + 0.22 * i as f32), 0.0));
            }
        }
        _ => {
            let panel = block(vec3(2.0 * half.x - thick, 0.7 * rise, 0.5 * thick), 0.005);
            mesh.add(&panel, back.shift(0.0, 0.15 * rise, 0.0));
        }
    }
    mesh
}

/// A sofa or armchair `width` wide.
pub(super) fn sofa(width: f32, rng: &mut Rng) -> Mesh {
    let (depth, seat) = (rng.range(0.8, 0.95), rng.range(0.36, 0.44));
    let (arm, foot) = (rng.range(0.12, 0.24), rng.range(0.05, 0.14));
    let (back_h, soft) = (rng.range(0.35, 0.5), rng.range(0.02, 0.05));
    let mut mesh = Mesh::default();
    at_corners(&mut mesh, &leg(foot + 0.01, 0.06, rng), vec2(0.5 * width - 0.08, 0.5 * depth - 0.08), 0.0);
    // Behind the faces of the arms: surfaces in one plane flicker where they are rasterised.
    let base = block(vec3(width - 0.002, seat - foot - 0.12, depth - 0.002), 0.02);
    mesh.add(&base, Pose::at(0.0, foot + 0.001, 0.0));
    for side in [-1.0, 1.0] {
        let rest = block(vec3(arm, seat + 0.2 - foot, depth), soft);
        mesh.add(&rest, Pose::at(side * 0.5 * (width - arm), foot, 0.0));
    }
    let back = Pose::at(0.0, foot, -0.5 * depth + 0.1);
    mesh.add(&block(vec3(width - 2.0 * arm, seat + back_h - foot, 0.2), soft), back);
    let inner = width - 2.0 * arm;
    let places = (inner / 0.65).round().max(1.0);
    let each = inner / places;
    for i in 0..places as usize {
        let x = (i as f32 + 0.5 - 0.5 * places) * each;
        let pad = superellipsoid(vec3(0.5 * each - 0.004, 0.1, 0.5 * depth - 0.1), (0.35, 0.2), 40);
        mesh.add(&pad, Pose::at(x, seat - 0.05, 0.1));
        let lean = superellipsoid(vec3(0.5 * each - 0.006, 0.5 * back_h, 0.09), (0.4, 0.35), 36);
        let at = Pose::at(x, seat + 0.5 * back_h, -0.5 * depth + 0.27).pitch(-0.18);
        mesh.add(&lean, at);
    }
    for _ in 0..rng.below(4) {
        let loose =
            cushion(vec3(0.42, 0.14, 0.42), rng).at(Pose::IDENTITY.pitch(FRAC_PI_2).shift(0.0, -0.07, 0.0));
        let x = rng.spread(0.5 * inner - 0.2);
        let pose = Pose::at(x, seat + 0.24, rng.range(-0.02, 0.06)).yaw(rng.spread(0.4)).pitch(-0.45);
        mesh.add(&loose, pose.roll(rng.spread(0.5)));
    }
    mesh
}

/// A bed with a headboard, a mattress, pillows and a folded blanket.
pub(super) fn bed(rng: &mut Rng) -> Mesh {
    let (w, l, h) = (rng.range(0.95, 1.8), rng.range(1.95, 2.15), rng.range(0.25, 0.4));
    let mut mesh = Mesh::default();
    at_corners(&mut mesh, &leg(h, 0.08, rng), vec2(0.5 * w - 0.05, 0.5 * l - 0.05), 0.0);
    mesh.add(&block(vec3(w, 0.14, l), 0.015), Pose::at(0.0, h - 0.1, 0.0));
    let head = rng.range(0.4, 0.8);
    mesh.add(&block(vec3(w + 0.06, h + head, 0.06), 0.015), Pose::at(0.0, 0.05, -0.5 * l - 0.03));
    let mattress = superellipsoid(vec3(0.5 * w - 0.02, 0.1, 0.5 * l - 0.02), (0.3, 0.1), 48);
    mesh.add(&mattress, Pose::at(0.0, h + 0.13, 0.0));
    let pillows = if w > 1.3 { 2 } else { 1 };
    for i in 0..pillows {
        let each = w / pillows as f32;
        let pillow = cushion(vec3(0.85 * each, 0.17, 0.42), rng);
        let pose = Pose::at((i as f32 + 0.5) * each - 0.5 * w, h + 0.2, -0.5 * l + 0.28);
        mesh.add(&pillow, pose.yaw(rng.spread(0.1)).pitch(0.12));
    }
    mesh.add(&blanket(vec3(w, h + 0.23, l), rng), Pose::IDENTITY);
    mesh
}

/// A blanket over the foot of a bed whose top is at `bed.y`, hanging over its sides in folds.
fn blanket(bed: Vec3, rng: &mut Rng) -> Mesh {
    let noise = Noise::new(rng);
    let (half, hang) = (0.5 * bed.x + 0.012, rng.range(0.12, 0.3));
    let from = rng.range(-0.25, 0.1) * bed.z;
    surface((60, 90), |u, v| {
        let z = from + u * (0.5 * bed.z - from);
        let across = (v - 0.5) * 2.0 * (half + hang);
        let over = (across.abs() - half).max(0.0);
        let folds = noise.fractal(vec3(across * 3.0, z * 5.0, 0.0), 3);
        let out = 0.012 + (0.4 * over) * (0.5 + 0.5 * noise.at(vec3(z * 7.0, 3.0, across.signum())));
        let x = across.clamp(-half, half) + across.signum() * if over > 0.0 { out } else { 0.0 };
        vec3(x, bed.y + 0.014 + 0.012 * folds - over, z)
    })
}

/// A cabinet of `size`: a carcass divided into drawers, doors, and open compartments with things.
pub(super) fn cabinet(size: Vec3, rng: &mut Rng) -> Mesh {
    let (wall, foot) = (0.02, if rng.chance(0.5) { 0.04 } else { rng.range(0.08, 0.2) });
    let mut mesh = Mesh::default();
    if foot < 0.05 {
        let plinth = block(vec3(size.x - 0.04, foot, size.z - 0.06), 0.003);
        mesh.add(&plinth, Pose::at(0.0, 0.0, -0.02));
    } else {
        let half = vec2(size.x, size.z) * 0.5 - Vec2::splat(0.05);
        at_corners(&mut mesh, &leg(foot, 0.05, rng), half, 0.0);
    }
    let inner = vec3(size.x, size.y - foot, size.z);
    let body = Pose::at(0.0, foot, 0.0);
    for y in [0.0, inner.y - wall] {
        mesh.add(&block(vec3(inner.x, wall, inner.z), 0.002), body.shift(0.0, y, 0.0));
    }
    let top = block(vec3(inner.x + 0.03, 0.02, inner.z + 0.015), 0.005);
    mesh.add(&top, body.shift(0.0, inner.y, 0.0075));
    mesh.add(&block(vec3(inner.x, inner.y, 0.008), 0.001), body.shift(0.0, 0.0, -0.5 * size.z + 0.004));
    let (columns, rows) = ((size.x / rng.range(0.4, 0.8)).ceil(), (inner.y / rng.range(0.25, 0.45)).ceil());
    let cell = vec2((inner.x - wall) / columns, (inner.y - wall) / rows);
    for i in 0..=columns as usize {
        let x = i as f32 * cell.x - 0.5 * (inner.x - wall);
        let board = block(vec3(wall, inner.y - 2.0 * wall, inner.z - 0.004), 0.002);
        mesh.add(&board, body.shift(x, wall, 0.0));
    }
    let openness = rng.unit();
    for (i, j) in (0..columns as usize).flat_map(|i| (0..rows as usize).map(move |j| (i, j))) {
        let x = (i as f32 + 0.5) * cell.x - 0.5 * (inner.x - wall);
        let at = body.shift(x, j as f32 * cell.y, 0.0);
        if j > 0 {
            mesh.add(&block(vec3(cell.x - wall, wall, inner.z - 0.01), 0.002), at);
        }
        let hole = vec3(cell.x - wall, cell.y - wall, inner.z);
        compartment(&mut mesh, hole, at.shift(0.0, wall, 0.0), (openness, rng));
    }
    mesh
}

/// The front of a compartment (`hole`: its inner size), or what stands in an open one.
fn compartment(mesh: &mut Mesh, hole: Vec3, at: Pose, (openness, rng): (f32, &mut Rng)) {
    if rng.chance(openness) {
        if rng.chance(0.7) {
            let row = books((hole.x - 0.01, hole.y, hole.z - 0.03), rng);
            mesh.add(&row, at.shift(-0.5 * hole.x + 0.005, 0.0, 0.5 * hole.z - 0.03));
        } else if rng.chance(0.7) {
            let room = hole.y.min(hole.x);
            let pot = vessel(rng.range(0.15, 0.3) * room, rng.range(0.4, 0.85) * room, rng);
            mesh.add(&pot, at.shift(rng.spread(0.2 * hole.x), 0.0, 0.0));
        }
        return;
    }
    let gap = 0.003;
    let pull = if rng.chance(0.15) { rng.range(0.02, 0.5) * hole.z } else { 0.0 };
    let front = at.shift(0.0, gap, 0.5 * hole.z - 0.004 + pull);
    mesh.add(&block(vec3(hole.x - 2.0 * gap, hole.y - 2.0 * gap, 0.018), 0.003), front);
    if rng.chance(0.4) {
        let inset = vec2(hole.x, hole.y) - Vec2::splat(0.12 + 2.0 * gap);
        if inset.min_element() > 0.03 {
            let raised = super::architecture::frame(inset, vec2(0.05, 0.012));
            mesh.add(&raised, front.shift(0.0, 0.06, 0.012));
        }
    }
    if pull > 0.0 {
        let tray = super::props::crate_of_slats(vec3(hole.x - 0.03, 0.6 * hole.y, 0.95 * hole.z), rng);
        mesh.add(&tray, at.shift(0.0, 0.02, pull));
    }
    let handle = front.shift(0.0, 0.5 * hole.y, 0.0);
    if rng.chance(0.5) {
        mesh.add(&ball(0.014, 12), handle.shift(0.0, 0.0, 0.03));
        mesh.add(&cylinder((0.006, 0.006), 0.03, 8), handle.pitch(FRAC_PI_2));
    } else {
        let bow = |t: f32| vec3(0.06 * (2.0 * t - 1.0), 0.0, 0.03 * (4.0 * t * (1.0 - t)).sqrt());
        let path: Vec<Vec3> = (0..=10).map(|i| bow(i as f32 / 10.0)).collect();
        mesh.add(&super::shapes::tube(&path, &[0.006; 11], 8), handle);
    }
}

/// A potted plant with long arched leaves, about `height` tall.
pub(super) fn potted_plant(height: f32, rng: &mut Rng) -> Mesh {
    let pot = rng.range(0.25, 0.4) * height;
    let mut mesh = vessel(0.55 * pot, pot, rng);
    let soil = cylinder((0.25 * pot, 0.25 * pot), 0.8 * pot, 20);
    mesh.add(&soil, Pose::IDENTITY);
    let wide = rng.range(0.02, 0.07) * height.max(0.4);
    for _ in 0..rng.count(9, 28) {
        let (long, droop) = (rng.range(0.5, 1.0) * (height - pot), rng.range(0.4, 1.6));
        let leaf = surface((12, 4), |u, v| {
            let bend = turn(u * droop);
            let side = (0.5 - v) * 2.0;
            let width = wide * (4.0 * u * (1.0 - u)).max(0.0).sqrt().max(0.08 * (1.0 - u));
            let fold = 0.3 * side.abs() * width;
            vec3(side * width, long * bend.y / droop + fold, long * (1.0 - bend.x) / droop + 0.02)
        });
        mesh.add(&leaf, Pose::at(0.0, 0.75 * pot, 0.0).yaw(rng.angle()).pitch(rng.range(0.0, 0.35)));
    }
    mesh
}

/// Two curtains on a rod, hanging down by `drop` from y = 0.
pub(super) fn curtains(width: f32, drop: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let rod = cylinder((0.012, 0.012), width + 0.2, 12);
    mesh.add(&rod, Pose::at(0.5 * width + 0.1, 0.0, 0.0).roll(FRAC_PI_2));
    let noise = Noise::new(rng);
    let (folds, deep) = (rng.range(5.0, 11.0), rng.range(0.02, 0.045));
    let closed = rng.range(0.2, 0.5);
    for side in [-1.0f32, 1.0] {
        let cloth = surface((24, 110), |u, v| {
            let gather = 1.0 - 0.25 * (u * PI).min(PI - u * PI).max(0.0) / PI;
            let phase = v * folds * TAU + 1.5 * noise.at(vec3(v * 4.0, u * 1.5, side));
            let z = turn(phase).y * deep * (0.6 + 0.5 * u);
            let from_middle = if side > 0.0 { 1.0 - v } else { v };
            let across = from_middle * closed * width * gather;
            vec3(side * (0.5 * width - across), -u * drop, z)
        });
        mesh.add(&cloth, Pose::IDENTITY);
    }
    mesh
}

/// A radiator of ribs about `width` wide.
pub(super) fn radiator(width: f32, height: f32) -> Mesh {
    let mut mesh = Mesh::default();
    let ribs = (width / 0.06) as usize;
    let rib = block(vec3(0.045, height, 0.09), 0.02);
    for i in 0..ribs {
        mesh.add(&rib, Pose::at((i as f32 + 0.5) * 0.06 - 0.03 * ribs as f32, 0.0, 0.0));
    }
    for y in [0.08, height - 0.12] {
        mesh.add(&block(vec3(0.06 * ribs as f32, 0.04, 0.05), 0.01), Pose::at(0.0, y, 0.0));
    }
    mesh
}

/// A board on brackets with books.
pub(super) fn shelf(mesh: &mut Mesh, at: Pose, rng: &mut Rng) {
    let wide = rng.range(0.5, 0.9);
    mesh.add(&block(vec3(wide, 0.025, 0.22), 0.003), at.shift(0.0, 0.0, 0.11));
    for side in [-1.0, 1.0] {
        let bracket = extrude(&[Vec2::ZERO, vec2(0.15, 0.15), vec2(0.0, 0.15)], 0.02, 0.002);
        mesh.add(&bracket, at.shift(side * 0.35 * wide, -0.15, 0.0).yaw(-FRAC_PI_2));
    }
    let row = books((wide * rng.range(0.4, 0.9), 0.28, 0.2), rng);
    mesh.add(&row, at.shift(-0.45 * wide, 0.025, 0.2));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of flat triangles that face the same way in one plane, one with its middle in the other.
    fn doubles(mesh: &Mesh) -> usize {
        let corners = |t: &[u32; 3]| t.map(|i| mesh.position[i as usize]);
        let flat = |t: &&[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.normal[i as usize]);
            a == b && b == c
        };
        let flat: Vec<_> =
            mesh.triangle.iter().filter(flat).map(|t| (corners(t), mesh.normal[t[0] as usize])).collect();
        let doubled = |(a, n): &([Vec3; 3], Vec3), (b, m): &([Vec3; 3], Vec3)| {
            let middle = (a[0] + a[1] + a[2]) / 3.0;
            let inside = (0..3).all(|i| {
                let (from, to) = (b[i], b[(i + 1) % 3]);
                m.dot((to - from).cross(middle - from)) > 1e-6
            });
            n.dot(*m) > 0.9999 && n.dot(middle - b[0]).abs() < 1e-4 && inside
        };
        let of = |i: usize| (0..flat.len()).filter(|&k| k != i && doubled(&flat[i], &flat[k])).count();
        (0..flat.len()).map(of).sum()
    }

    #[test]
    fn no_two_faces_of_a_sofa_share_a_plane() {
        for seed in 0..16 {
            let mut rng = Rng::new(seed);
            assert_eq!(doubles(&sofa(rng.range(0.8, 2.4), &mut rng)), 0, "sofa {seed}");
        }
        // The search finds a block in a larger one.
        let mut twice = block(vec3(1.0, 1.0, 1.0), 0.1);
        twice.add(&block(vec3(0.5, 0.5, 1.0), 0.1), Pose::at(0.0, 0.2, 0.0));
        assert!(doubles(&twice) > 0);
    }
}
