//! Parts of buildings: walls with openings, windows, doors, columns, floors.

use super::mesh::{Mesh, Pose, turn};
use super::rng::Rng;
use super::shapes::{Segments, ball, block, cuboid, grid, lathe, moulding, torus};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// A rectangular hole in a wall: its lower left and upper right corner.
pub(super) type Opening = (Vec2, Vec2);

/// A wall of `size` that stands along x with its middle at z = 0, with sharp-edged openings.
pub(super) fn wall(size: Vec3, openings: &[Opening]) -> Mesh {
    let (half, h) = (0.5 * size.x, 0.5 * size.z);
    let cuts = |ends: [f32; 2], of: fn(&Vec2) -> f32| {
        let inner = openings.iter().flat_map(|(lo, hi)| [of(lo), of(hi)]);
        let mut all: Vec<f32> = inner.map(|c| c.clamp(ends[0], ends[1])).chain(ends).collect();
        all.sort_by(f32::total_cmp);
        all.dedup();
        all
    };
    let (xs, ys) = (cuts([-half, half], |p| p.x), cuts([0.0, size.y], |p| p.y));
    let solid = |i: isize, j: isize| {
        let inside = i >= 0 && j >= 0 && i + 1 < xs.len() as isize && j + 1 < ys.len() as isize;
        inside && {
            let (i, j) = (i as usize, j as usize);
            let c = 0.5 * vec2(xs[i] + xs[i + 1], ys[j] + ys[j + 1]);
            !openings.iter().any(|(lo, hi)| c.cmpgt(*lo).all() && c.cmplt(*hi).all())
        }
    };
    let mut mesh = Mesh::default();
    for i in 0..xs.len() as isize - 1 {
        for j in 0..ys.len() as isize - 1 {
            if !solid(i, j) {
                continue;
            }
            let corner =
                |right: usize, top: usize, z: f32| vec3(xs[i as usize + right], ys[j as usize + top], z);
            let ring = [(0, 0), (1, 0), (1, 1), (0, 1)];
            mesh.push_quad(ring.map(|(r, t)| corner(r, t, h)));
            mesh.push_quad([ring[3], ring[2], ring[1], ring[0]].map(|(r, t)| corner(r, t, -h)));
            let around = [solid(i, j - 1), solid(i + 1, j), solid(i, j + 1), solid(i - 1, j)];
            for k in (0..4).filter(|&k| !around[k]) {
                let ((ar, at), (br, bt)) = (ring[k], ring[(k + 1) % 4]);
                mesh.push_quad([
                    corner(ar, at, -h),
                    corner(br, bt, -h),
                    corner(br, bt, h),
                    corner(ar, at, h),
                ]);
            }
        }
    }
    mesh.shade(0.0)
}

/// Four bars around a rectangle in the x, y plane; inner size `size`, bars of `section` (wide, deep).
pub(super) fn frame(size: Vec2, section: Vec2) -> Mesh {
    let mut mesh = Mesh::default();
    let bevel = 0.15 * section.min_element();
    let rail = block(vec3(size.x + 2.0 * section.x, section.x, section.y), bevel);
    mesh.add(&rail, Pose::at(0.0, -section.x, 0.0));
    mesh.add(&rail, Pose::at(0.0, size.y, 0.0));
    let post = block(vec3(section.x, size.y, section.y), bevel);
    for side in [-1.0, 1.0] {
        mesh.add(&post, Pose::at(side * 0.5 * (size.x + section.x), 0.0, 0.0));
    }
    mesh
}

/// A window that fills an opening of `size` in a wall: frame, glazing bars, maybe glass, sill and
/// architrave on the +z side of a wall `depth` thick.
pub(super) fn window(size: Vec2, depth: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let bar = rng.range(0.035, 0.07);
    mesh.add(&frame(size - 2.0 * bar, vec2(bar, 0.07)), Pose::at(0.0, bar, 0.0));
    let (columns, rows) = (rng.count(1, 4), rng.count(1, 4));
    let thin = rng.range(0.015, 0.035);
    for i in 1..columns {
        let x = (i as f32 / columns as f32 - 0.5) * size.x;
        mesh.add(&block(vec3(thin, size.y - bar, 0.04), 0.005), Pose::at(x, 0.5 * bar, 0.0));
    }
    for j in 1..rows {
        let y = j as f32 / rows as f32 * size.y;
        mesh.add(&block(vec3(size.x - bar, thin, 0.045), 0.005), Pose::at(0.0, y - 0.5 * thin, 0.0));
    }
    if rng.chance(0.5) {
        mesh.add(&cuboid(vec3(size.x - bar, size.y - bar, 0.006)), Pose::at(0.0, 0.5 * bar, 0.0));
    }
    let sill = block(vec3(size.x + 0.16, 0.04, 0.5 * depth + 0.12), 0.008);
    mesh.add(&sill, Pose::at(0.0, -0.035, 0.25 * depth + 0.05));
    if rng.chance(0.6) {
        let trim = rng.range(0.06, 0.12);
        mesh.add(&frame(size, vec2(trim, 0.03)), Pose::at(0.0, 0.0, 0.5 * depth + 0.012));
    }
    mesh
}

/// A closed or ajar door with raised panels and a knob, for an opening of `size`; front towards +z.
pub(super) fn door(size: Vec2, rng: &mut Rng) -> Mesh {
    let leaf = door_leaf(size, rng);
    let ajar = if rng.chance(0.4) { -rng.range(0.1, 1.2) } else { 0.0 };
    let mut mesh = leaf.at(Pose::at(-0.5 * size.x, 0.0, 0.0).yaw(ajar));
    let jamb = vec2(rng.range(0.06, 0.1), 0.02);
    mesh.add(&frame(size, jamb), Pose::at(0.0, 0.0, 0.1 + 0.008));
    mesh
}

/// The leaf of a door for an opening of `size`, from its hinges at x = 0 along x.
pub(super) fn door_leaf(size: Vec2, rng: &mut Rng) -> Mesh {
    let mut leaf = Mesh::default();
    let thick = 0.045;
    leaf.add(&block(vec3(size.x - 0.01, size.y - 0.01, thick), 0.004), Pose::at(0.5 * size.x, 0.005, 0.0));
    let (columns, rows) = (rng.count(1, 2), rng.count(1, 4));
    let cell = vec2(size.x / columns as f32, size.y / rows as f32);
    let inner = cell - Vec2::splat(rng.range(0.16, 0.24));
    for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let centre = vec2((i as f32 + 0.5) * cell.x, (j as f32 + 0.5) * cell.y);
        for side in [-1.0, 1.0] {
            let pose = Pose::at(centre.x, centre.y - 0.5 * inner.y, side * 0.5 * thick);
            leaf.add(&frame(inner, vec2(0.03, 0.025)), pose);
            leaf.add(&block(vec3(inner.x - 0.06, inner.y - 0.06, 0.02), 0.008), pose.shift(0.0, 0.03, 0.0));
        }
    }
    for side in [-1.0, 1.0] {
        leaf.add(&ball(0.03, 14), Pose::at(size.x - 0.08, 1.0, side * 0.075));
        let stem = Pose::at(size.x - 0.08, 1.0, 0.02 * side).pitch(side * FRAC_PI_2);
        leaf.add(
            &lathe(&[vec2(0.03, 0.0), vec2(0.03, 0.008), vec2(0.01, 0.012), vec2(0.01, 0.06)], 14),
            stem,
        );
    }
    leaf
}

/// A floor of `half` extents whose top is y = 0: boards, tiles or one slab.
pub(super) fn floor(half: Vec2, rng: &mut Rng) -> Mesh {
    let mut mesh = cuboid(vec3(2.0 * half.x + 0.4, 0.2, 2.0 * half.y + 0.4)).at(Pose::at(0.0, -0.225, 0.0));
    let top = |size: Vec3, x: f32, z: f32, mesh: &mut Mesh| {
        mesh.add(&block(size, 0.004), Pose::at(x, -size.y, z));
    };
    match rng.below(3) {
        0 => {
            let width = rng.range(0.09, 0.22);
            let rows = (2.0 * half.y / width).ceil() as usize;
            for row in 0..rows {
                let z = (row as f32 + 0.5) * width - half.y;
                let (mut x, end) = (-half.x - 0.1, half.x + 0.1);
                let mut length = rng.range(0.3, 1.8);
                while x < end {
                    length = length.min(end - x);
                    top(vec3(length - 0.004, 0.025, width - 0.004), x + 0.5 * length, z, &mut mesh);
                    x += length;
                    length = rng.range(0.9, 1.8);
                }
            }
        }
        1 => {
            let side = rng.range(0.25, 0.6);
            let n = (half * 2.0 / side).ceil();
            for (i, j) in (0..n.x as usize).flat_map(|i| (0..n.y as usize).map(move |j| (i, j))) {
                let at = (vec2(i as f32, j as f32) + 0.5 - 0.5 * n) * side;
                top(vec3(side - 0.006, 0.02 + rng.range(0.0, 0.0015), side - 0.006), at.x, at.y, &mut mesh);
            }
        }
        _ => mesh.add(&cuboid(vec3(2.0 * half.x + 0.4, 0.03, 2.0 * half.y + 0.4)), Pose::at(0.0, -0.03, 0.0)),
    }
    mesh
}

/// A random profile for skirting boards and cornices: `height` up, `depth` out, against x = 0.
pub(super) fn trim_profile(height: f32, depth: f32, rng: &mut Rng) -> Vec<Vec2> {
    let steps = rng.count(2, 4);
    let mut profile = vec![vec2(-0.01, height), vec2(-0.01, 0.0), vec2(depth, 0.0)];
    for i in 0..steps {
        let out = depth * (1.0 - (i as f32 + 0.6) / steps as f32);
        let (low, high) = ((i as f32 + 0.35) / steps as f32, (i + 1) as f32 / steps as f32);
        profile.push(vec2(profile[profile.len() - 1].x, height * low));
        let round = rng.chance(0.5);
        for k in 1..=4 {
            let t = turn(k as f32 / 4.0 * FRAC_PI_2);
            let from = profile[profile.len() - 1].x;
            let blend = if round { 1.0 - t.x } else { k as f32 / 4.0 };
            let y = if round { t.y } else { blend };
            let x = if i + 1 == steps && k == 4 { 0.0 } else { from + (out - from) * blend };
            profile.push(vec2(x, height * (low + (high - low) * y)));
        }
    }
    profile
}

/// Skirting board or cornice around a room of `half` extents at height `y`.
pub(super) fn trim_around(half: Vec2, y: f32, profile: &[Vec2]) -> Mesh {
    let corners = [vec2(-1.0, -1.0), vec2(-1.0, 1.0), vec2(1.0, 1.0), vec2(1.0, -1.0)];
    let path = corners.map(|c| vec3(c.x * half.x, y, c.y * half.y));
    // Counter-clockwise seen from below: the room is to the left, so mirror the profile.
    let mirrored: Vec<Vec2> = profile.iter().rev().map(|p| vec2(-p.x, p.y)).collect();
    moulding(&path, &mirrored, true)
}

/// A column of `height` and `radius` (m) with base and capital; `rng` chooses the order.
pub(super) fn column(height: f32, radius: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let (plinth, abacus) = (rng.range(0.15, 0.5) * radius, rng.range(0.2, 0.35) * radius);
    let (base, capital) = (rng.range(0.3, 0.8) * radius, rng.range(0.5, 1.4) * radius);
    let bevel = 0.06 * radius;
    mesh.add(&block(vec3(2.9, 0.0, 2.9) * radius + Vec3::Y * plinth, bevel), Pose::IDENTITY);
    let top = Pose::at(0.0, height - abacus, 0.0);
    mesh.add(&block(vec3(2.8, 0.0, 2.8) * radius + Vec3::Y * abacus, bevel), top);
    let foot: Vec<Vec2> = (0..=8)
        .map(|i| turn((i as f32 / 8.0 - 0.5) * PI))
        .map(|t| vec2(1.15 + 0.22 * t.x, 0.3 + 0.3 * t.y))
        .chain([vec2(1.1, 0.62), vec2(1.1, 0.72), vec2(1.02, 0.85), vec2(1.0, 1.0)])
        .map(|p| vec2(p.x * radius, p.y * base))
        .collect();
    mesh.add(&lathe(&foot, 40), Pose::at(0.0, plinth, 0.0));
    let flare = rng.range(0.2, 0.45);
    let head: Vec<Vec2> = (0..=10)
        .map(|i| i as f32 / 10.0)
        .map(|t| vec2(0.86 + flare * t * t, t))
        .map(|p| vec2(p.x * radius, p.y * capital))
        .collect();
    let shaft_top = height - abacus - capital;
    mesh.add(&lathe(&head, 40), Pose::at(0.0, shaft_top, 0.0));
    mesh.add(
        &torus(0.88 * radius, 0.07 * radius, Segments { around: 40, across: 10 }),
        Pose::at(0.0, shaft_top, 0.0),
    );
    if rng.chance(0.5) {
        volutes(&mut mesh, (shaft_top + 0.35 * capital, height - abacus), radius, rng.count(4, 12));
    }
    let foot_top = plinth + base;
    mesh.add(&shaft(shaft_top - foot_top, radius, rng), Pose::at(0.0, foot_top, 0.0));
    mesh
}

/// Curled leaves around a capital between two heights.
fn volutes(mesh: &mut Mesh, (low, high): (f32, f32), radius: f32, count: usize) {
    let width = 0.7 * PI * radius / count as f32;
    let leaf = grid((10, 4), |u, v| {
        let t = turn(u * 3.6);
        let side = (0.5 - v) * 2.0;
        let out = 0.95 + 0.35 * u * u + 0.05 * (1.0 - t.x) - 0.08 * side * side;
        let y = (high - low) * (u * 0.9 + 0.06 * t.y);
        vec3(side * width * (1.0 - 0.6 * u * u), y, radius * out)
    });
    let leaf = leaf.shade(60.0);
    for k in 0..count {
        mesh.add(&leaf, Pose::at(0.0, low, 0.0).yaw(k as f32 / count as f32 * TAU));
    }
}

/// The shaft: plain, fluted, faceted, twisted or ringed, with entasis.
fn shaft(height: f32, radius: f32, rng: &mut Rng) -> Mesh {
    let style = rng.below(5);
    let flutes = rng.count(10, 24);
    let twist = if style == 3 { rng.range(1.0, 4.0) * TAU / height } else { 0.0 };
    let lobes = if style == 3 { rng.count(2, 6) } else { flutes };
    let segments = match style {
        0 | 4 => 40,
        2 => rng.count(6, 12),
        _ => lobes * 8,
    };
    let rows = if style == 3 { 80 } else { 16 };
    let at = |u: f32, v: f32| {
        let k = (v * segments as f32).round() as usize % segments;
        let theta = k as f32 / segments as f32 * TAU;
        let y = u * height;
        let entasis = 1.0 - 0.14 * u * u;
        let wave = turn(theta * lobes as f32).x;
        let groove = match style {
            1 => 1.0 - 0.09 * (1.0 - wave.abs() * wave.abs()) * f32::from(u > 0.02 && u < 0.98),
            3 => 0.88 + 0.12 * wave,
            4 => 1.0 + 0.04 * turn(y / radius * 4.0).x,
            _ => 1.0,
        };
        let t = turn(theta + twist * y) * radius * entasis * groove;
        vec3(t.x, y, t.y)
    };
    grid((rows, segments), at).shade(if style == 2 { 20.0 } else { 50.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn openings_are_cut_out_of_walls() {
        let holes = [(vec2(-1.5, 0.0), vec2(-0.5, 2.0)), (vec2(0.5, 1.0), vec2(1.0, 2.0))];
        let mesh = wall(vec3(4.0, 3.0, 0.5), &holes);
        let six: f32 =
            mesh.triangle.iter().map(|t| mesh.area_vector(*t).dot(mesh.position[t[0] as usize])).sum();
        assert!((six / 6.0 - (12.0 - 2.0 - 0.5) * 0.5).abs() < 1e-4, "{}", six / 6.0);
    }
}
