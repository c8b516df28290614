//! Small things that stand on floors, tables and shelves. All stand on y = 0 about x = z = 0.

use super::mesh::{Mesh, Pose, turn};
use super::rng::Rng;
use super::shapes::{ball, block, cuboid, curve, cylinder, extrude, lathe, tube};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// A closed book of `size` (thickness, height, depth) standing with its spine towards +z.
pub(super) fn book(size: Vec3) -> Mesh {
    let (t, board) = (size.x, (0.08 * size.x).clamp(0.0015, 0.004));
    let h = 0.5 * t;
    let bulge = |k: usize| {
        let a = turn(k as f32 / 6.0 * PI);
        vec2(a.x * h, size.z - 0.25 * h + 0.25 * h * a.y)
    };
    let inner = h - board;
    let mut outline = vec![vec2(h, 0.0)];
    outline.extend((0..=6).map(bulge));
    outline.extend([vec2(-h, 0.0), vec2(-inner, 0.0), vec2(-inner, size.z - h * 0.5 - board)]);
    outline.extend([vec2(inner, size.z - h * 0.5 - board), vec2(inner, 0.0)]);
    let cover = extrude(&outline, size.y, 0.0);
    let mut mesh = cover.at(Pose::at(0.0, 0.5 * size.y, -0.5 * size.z).pitch(FRAC_PI_2));
    let lip = (0.02 * size.y).min(0.004);
    let pages = cuboid(vec3(2.0 * inner, size.y - 2.0 * lip, size.z - lip - 0.6 * h));
    mesh.add(&pages, Pose::at(0.0, lip, -0.2 * h));
    mesh
}

/// Books side by side along x over `width`, at most `height` tall and `depth` deep: upright, leaning,
/// in piles, with gaps. Stands on y = 0 from x = 0, spines at about z = 0.
pub(super) fn books((width, height, depth): (f32, f32, f32), rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let (mut x, deep) = (0.0, depth * 0.9);
    let fullness = rng.range(0.5, 1.0);
    while x < width - 0.06 {
        if !rng.chance(fullness) {
            x += rng.range(0.03, 0.3);
            continue;
        }
        if rng.chance(0.12) && width - x > 0.3 {
            let long = rng.range(0.18, 0.26).min(width - x);
            let lying = pile((long, height, deep.min(0.2)), rng);
            mesh.add(&lying, Pose::at(x + 0.5 * long, 0.0, -0.55 * deep));
            x += long + 0.01;
            continue;
        }
        let tall = height * rng.range(0.6, 0.95);
        let mut last = 0.0;
        for _ in 0..rng.count(2, 9) {
            let size = vec3(rng.range(0.012, 0.05), tall * rng.range(0.85, 1.0), deep * rng.range(0.7, 1.0));
            if x + size.x > width {
                return mesh;
            }
            let pull = rng.range(0.0, 0.015);
            mesh.add(&book(size), Pose::at(x + 0.5 * size.x, 0.0, -0.5 * size.z - pull));
            x += size.x + 0.0008;
            last = size.y;
        }
        let (thick, lean) = (rng.range(0.012, 0.03), rng.range(0.12, 0.3));
        let tall = last * 0.95;
        let reach = tall * turn(lean).y + thick;
        if rng.chance(0.5) && x + reach + 0.01 < width {
            // Its lower left corner stands at x + reach, its left side leans on the row.
            let foot = Pose::at(x + tall * turn(lean).y, 0.0, -0.5 * deep).roll(lean);
            mesh.add(&book(vec3(thick, tall, deep * 0.9)), foot.shift(0.5 * thick, 0.0, 0.0));
            x += reach + 0.02;
        }
    }
    mesh
}

/// Books lying on each other within (`long`, `height`, `deep`), about x = z = 0.
fn pile((long, height, deep): (f32, f32, f32), rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    let mut y = 0.0;
    for _ in 0..rng.count(2, 5) {
        let size = vec3(rng.range(0.015, 0.045), long * rng.range(0.85, 1.0), deep * rng.range(0.8, 1.0));
        if y + size.x > height {
            break;
        }
        let flat = Pose::at(0.0, y + 0.5 * size.x, 0.0).yaw(rng.spread(0.06)).roll(FRAC_PI_2);
        mesh.add(&book(size), flat.shift(0.0, -0.5 * size.y, 0.0));
        y += size.x + 0.0005;
    }
    mesh
}

/// A turned vessel of random silhouette: vase, jar, bottle or bowl; hollow with a wall.
pub(super) fn vessel(radius: f32, height: f32, rng: &mut Rng) -> Mesh {
    let n = rng.count(3, 5);
    let mut points = vec![vec2(rng.range(0.35, 0.8), 0.0)];
    points.extend((1..n).map(|i| vec2(rng.range(0.35, 1.0), i as f32 / n as f32)));
    points.push(vec2(rng.range(0.3, 0.9), 1.0));
    hollow(&points.iter().map(|p| *p * vec2(radius, height)).collect::<Vec<_>>(), 0.08 * radius)
}

/// A vessel from its outer silhouette: foot, wall of `thickness`, rounded rim, inside.
pub(super) fn hollow(outer: &[Vec2], thickness: f32) -> Mesh {
    let smooth = curve(outer, 6);
    let mut profile = vec![vec2(0.0, 0.3 * thickness), vec2(0.8 * smooth[0].x, 0.3 * thickness)];
    profile.push(vec2(0.85 * smooth[0].x, 0.0));
    profile.extend(&smooth);
    let rim = profile[profile.len() - 1];
    let half = 0.5 * thickness;
    profile.extend((1..6).map(|k| rim - vec2(half, 0.0) + half * turn(k as f32 / 6.0 * PI)));
    let inside = smooth.iter().rev().map(|p| vec2((p.x - thickness).max(0.0), p.y.max(thickness)));
    profile.extend(inside);
    profile.push(vec2(0.0, thickness));
    lathe(&profile, 32)
}

/// A mug with a handle.
pub(super) fn mug(rng: &mut Rng) -> Mesh {
    let (r, h) = (rng.range(0.035, 0.05), rng.range(0.08, 0.12));
    let belly = rng.range(0.9, 1.1);
    let mut mesh = hollow(&[vec2(r * 0.9, 0.0), vec2(r * belly, 0.4 * h), vec2(r, h)], 0.005);
    let bend = |i: usize| {
        let t = turn((i as f32 / 12.0 - 0.5) * PI);
        vec3(r * 0.95 + 0.6 * r * t.x, 0.52 * h + 0.32 * h * t.y, 0.0)
    };
    let path: Vec<Vec3> = (0..=12).map(bend).collect();
    mesh.add(&tube(&path, &[0.005; 13], 10), Pose::IDENTITY);
    mesh
}

/// A wine or water bottle.
pub(super) fn bottle(rng: &mut Rng) -> Mesh {
    let (r, h) = (rng.range(0.03, 0.045), rng.range(0.22, 0.34));
    let (shoulder, neck) = (rng.range(0.5, 0.68), rng.range(0.28, 0.4));
    let side =
        [vec2(1.0, 0.02), vec2(1.0, shoulder * 0.5), vec2(0.98, shoulder), vec2(neck, shoulder + 0.18)];
    let mut outer: Vec<Vec2> = vec![vec2(0.9 * r, 0.0)];
    outer.extend(side.iter().map(|p| vec2(p.x * r, p.y * h)));
    outer.extend([vec2(neck * r, 0.95 * h), vec2(neck * r * 1.2, 0.96 * h), vec2(neck * r * 1.2, h)]);
    let mut profile = vec![Vec2::ZERO];
    profile.extend(curve(&outer, 4));
    profile.push(vec2(0.0, h));
    lathe(&profile, 28)
}

/// A plate.
pub(super) fn plate(radius: f32) -> Mesh {
    let outer = [vec2(0.55, 0.0), vec2(0.62, 0.03), vec2(0.72, 0.08), vec2(1.0, 0.12)];
    hollow(&outer.map(|p| p * radius), 0.03 * radius)
}

/// A bowl.
pub(super) fn bowl(radius: f32, height: f32) -> Mesh {
    let outer = [vec2(0.4, 0.0), vec2(0.42, 0.06), vec2(0.8, 0.4), vec2(1.0, 1.0)];
    hollow(&outer.map(|p| p * vec2(radius, height)), 0.05 * radius)
}

/// An open crate of slats of outer `size`.
pub(super) fn crate_of_slats(size: Vec3, rng: &mut Rng) -> Mesh {
    let (thick, slats) = (0.04 * size.max_element().min(0.5), rng.count(2, 4));
    let pitch = size.y / slats as f32;
    let mut mesh = block(vec3(size.x, thick, size.z), 0.1 * thick);
    for i in 0..slats {
        let y = (i as f32 + 0.1) * pitch;
        for side in [-1.0, 1.0] {
            let long = block(vec3(size.x, 0.8 * pitch, thick), 0.1 * thick);
            mesh.add(&long, Pose::at(0.0, y, side * 0.5 * (size.z - thick)));
            let short = block(vec3(thick, 0.8 * pitch, size.z - 2.0 * thick), 0.1 * thick);
            mesh.add(&short, Pose::at(side * 0.5 * (size.x - thick), y, 0.0));
        }
    }
    for (sx, sz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let inset = size * 0.5 - 1.8 * thick;
        let post = block(vec3(1.6 * thick, size.y, 1.6 * thick), 0.1 * thick);
        mesh.add(&post, Pose::at(sx * inset.x, 0.0, sz * inset.z));
    }
    mesh
}

/// A picture: frame with moulded bars, mount, canvas. Hangs at the origin, its back on z = 0.
pub(super) fn picture(size: Vec2, rng: &mut Rng) -> Mesh {
    let bar = rng.range(0.02, 0.07);
    let deep = rng.range(0.02, 0.05);
    let mut mesh = super::architecture::frame(size, vec2(bar, deep)).at(Pose::at(0.0, 0.0, 0.5 * deep));
    if rng.chance(0.5) {
        let outer = super::architecture::frame(size + 1.4 * bar, vec2(0.3 * bar, 1.5 * deep));
        mesh.add(&outer, Pose::at(0.0, -0.7 * bar, 0.75 * deep));
    }
    mesh.add(&block(size.extend(0.3 * deep), 0.001), Pose::at(0.0, 0.0, 0.2 * deep));
    mesh
}

/// A lamp with a foot, a stem and a hollow shade, `height` tall.
pub(super) fn lamp(height: f32, rng: &mut Rng) -> Mesh {
    let shade_h = rng.range(0.2, 0.34) * height.min(1.0);
    let (low, high) = (rng.range(0.7, 1.1) * shade_h, rng.range(0.3, 0.7) * shade_h);
    let foot = rng.range(0.5, 0.8) * low;
    let mut mesh = cylinder((foot, 0.9 * foot), 0.02 * height.min(1.0) + 0.01, 32);
    let stem = height - 0.8 * shade_h;
    if rng.chance(0.5) && height < 0.8 {
        mesh.add(&vessel(0.7 * foot, stem, rng), Pose::IDENTITY);
    }
    mesh.add(&cylinder((0.012, 0.012), stem, 12), Pose::at(0.0, 0.01, 0.0));
    let wall = 0.004;
    let ring = [vec2(low - wall, 0.0), vec2(low, 0.0), vec2(high, shade_h), vec2(high - wall, shade_h)];
    let mut profile = ring.to_vec();
    profile.push(ring[0]);
    mesh.add(&lathe(&profile, 36), Pose::at(0.0, height - shade_h, 0.0));
    mesh.add(&ball(0.03, 14), Pose::at(0.0, stem + 0.02, 0.0));
    mesh
}

/// A cushion of `size`, plump with thin seams.
pub(super) fn cushion(size: Vec3, rng: &mut Rng) -> Mesh {
    let plump = rng.range(0.3, 0.6);
    super::shapes::superellipsoid(0.5 * size, (0.9, plump), 32).at(Pose::at(0.0, 0.5 * size.y, 0.0))
}

/// A regular polygon or star outline about the origin.
pub(super) fn star(points: usize, (outer, inner): (f32, f32)) -> Vec<Vec2> {
    let spoke = |i: usize| {
        let r = if i.is_multiple_of(2) { outer } else { inner };
        turn(i as f32 / (2 * points) as f32 * TAU) * r
    };
    (0..2 * points).map(spoke).collect()
}
