//! Cloth: sheets fallen over things, and hanging drapes.

use super::mesh::{Mesh, Pose, turn};
use super::rng::{Noise, Rng};
use super::shapes::{ball, block, cuboid, cylinder, lathe, surface};
use super::solid::{capsule, cube};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Threads along each side of a sheet.
const THREADS: usize = 64;

/// Steps of a sheet's fall. guess: most lie still by then
const STEPS: usize = 110;

/// What lies under a sheet: a mesh to show and a distance to fall on.
enum Support {
    Ball(Vec3, f32),
    Box(Vec3, Vec3),
    Post(Vec3, f32),
}

impl Support {
    fn mesh(&self) -> Mesh {
        match self {
            Self::Ball(centre, r) => ball(*r, 48).at(Pose::at(centre.x, centre.y, centre.z)),
            Self::Box(centre, half) => {
                block(2.0 * *half, 0.02).at(Pose::at(centre.x, centre.y - half.y, centre.z))
            }
            Self::Post(top, r) => {
                let mut post = cylinder((*r, *r), top.y, 32);
                post.add(&ball(*r, 32), Pose::at(0.0, top.y, 0.0));
                post.at(Pose::at(top.x, 0.0, top.z))
            }
        }
    }

    /// Height of its highest point.
    fn top(&self) -> f32 {
        match self {
            Self::Ball(centre, r) | Self::Post(centre, r) => centre.y + r,
            Self::Box(centre, half) => centre.y + half.y,
        }
    }

    fn distance(&self, p: Vec3) -> f32 {
        match self {
            Self::Ball(centre, r) => p.distance(*centre) - r,
            Self::Box(centre, half) => cube(p - *centre, *half - 0.02) - 0.02,
            Self::Post(top, r) => capsule(p, (top.with_y(0.0), *top), (*r, *r)),
        }
    }
}

/// Covered things in front of drapes.
pub(super) fn drapes(rng: &mut Rng) -> Mesh {
    let half = vec2(rng.range(1.3, 1.9), rng.range(1.0, 1.3));
    let mut mesh = super::architecture::floor(half, &mut rng.fork());
    let height = rng.range(2.2, 3.0);
    mesh.add(&cuboid(vec3(2.0 * half.x + 0.4, height, 0.2)), Pose::at(0.0, 0.0, -half.y - 0.1));
    let rod = cylinder((0.018, 0.018), 2.0 * half.x, 16);
    mesh.add(&rod, Pose::at(half.x, height - 0.12, 0.16 - half.y).roll(FRAC_PI_2));
    let spans = rng.count(2, 4);
    for k in 0..spans {
        let wide = 2.0 * half.x / spans as f32;
        let x = (k as f32 + 0.5) * wide - half.x;
        let cloth = hanging(vec2(wide * rng.range(0.6, 0.98), height - 0.14), &mut rng.fork());
        mesh.add(&cloth, Pose::at(x, 0.02, 0.16 - half.y));
    }
    let sheets = rng.count(2, 3);
    for k in 0..sheets {
        let x = (k as f32 + 0.5 - 0.5 * sheets as f32) * 2.0 * half.x / sheets as f32;
        let size = rng.range(0.9, 1.5).min(1.8 * half.x / sheets as f32 + 0.3);
        let covered = covered(size, &mut rng.fork());
        mesh.add(&covered, Pose::at(x, 0.0, rng.range(-0.1, 0.35)).yaw(rng.angle()));
    }
    mesh
}

/// A drape of `size` that hangs from z = 0 in folds, gathered or tied back.
fn hanging(size: Vec2, rng: &mut Rng) -> Mesh {
    let noise = Noise::new(rng);
    let (folds, deep, tied) = (rng.range(5.0, 12.0), rng.range(0.03, 0.07), rng.chance(0.4));
    let (waist, pull) = (rng.range(0.3, 0.5), *rng.pick(&[-1.0, 1.0]));
    let sharp = rng.range(0.0, 0.6);
    surface((60, 220), |u, v| {
        let y = size.y * (1.0 - u);
        let at_waist = 1.0 - ((y / size.y - waist).abs() / 0.55).min(1.0);
        let gather =
            if tied { 1.0 - 0.75 * at_waist * at_waist * (3.0 - 2.0 * at_waist) } else { 1.0 - 0.1 * u };
        let phase = v * folds * TAU + 1.6 * noise.at(vec3(v * 5.0, 2.0 * u, 0.0));
        let wave = turn(phase).y + sharp * turn(2.0 * phase).x * 0.4;
        let grow = 0.35 + 0.65 * u.min(0.5) * 2.0;
        let z = deep * grow * wave * (0.6 + 0.4 * gather) + 0.03 * noise.at(vec3(v * 3.0, u * 2.0, 5.0));
        let x = (v - 0.5) * size.x * gather + pull * 0.5 * size.x * (1.0 - gather) * f32::from(tied);
        vec3(x, y, z)
    })
}

/// Things of about `size` under a square sheet.
fn covered(size: f32, rng: &mut Rng) -> Mesh {
    let mut supports = Vec::new();
    for _ in 0..rng.count(1, 4) {
        let at = rng.in_rect(Vec2::splat(0.28 * size));
        let r = size * rng.range(0.1, 0.22);
        supports.push(match rng.below(3) {
            0 => Support::Ball(vec3(at.x, r, at.y), r),
            1 => {
                let half = size * vec3(rng.range(0.1, 0.25), rng.range(0.1, 0.3), rng.range(0.1, 0.25));
                Support::Box(vec3(at.x, half.y, at.y), half)
            }
            _ => Support::Post(vec3(at.x, size * rng.range(0.2, 0.4), at.y), 0.5 * r),
        });
    }
    let mut mesh = Mesh::default();
    supports.iter().for_each(|s| mesh.add(&s.mesh(), Pose::IDENTITY));
    mesh.add(&fallen(size * rng.range(1.2, 1.7), &supports, rng), Pose::IDENTITY);
    if rng.chance(0.5) {
        let urn = lathe(
            &[
                vec2(0.0, 0.0),
                vec2(0.08, 0.0),
                vec2(0.14, 0.2),
                vec2(0.05, 0.34),
                vec2(0.09, 0.4),
                vec2(0.0, 0.4),
            ],
            32,
        );
        mesh.add(&urn, Pose::at(0.75 * size, 0.0, 0.3 * size));
    }
    mesh
}

/// A square sheet of side `size` after its fall over `supports` and the floor.
// Position-based dynamics: Mueller et al. 2007.
fn fallen(size: f32, supports: &[Support], rng: &mut Rng) -> Mesh {
    let n = THREADS;
    let rest = size / (n - 1) as f32;
    let top = supports.iter().map(Support::top).fold(0.0, f32::max) + 0.03;
    let skew = turn(rng.angle());
    let start = |i: usize| {
        let p = (vec2((i % n) as f32, (i / n) as f32) - 0.5 * (n - 1) as f32) * rest;
        vec3(p.x * skew.x - p.y * skew.y, top + ripple(p), p.x * skew.y + p.y * skew.x)
    };
    let mut p: Vec<Vec3> = (0..n * n).map(start).collect();
    let mut last = p.clone();
    let links = links(n);
    for _ in 0..STEPS {
        for (p, last) in p.iter_mut().zip(&mut last) {
            let move_by = (*p - *last) * 0.985 - Vec3::Y * 0.0006 * size;
            *last = *p;
            *p += move_by.clamp_length_max(0.7 * rest);
        }
        for pass in 0..5 {
            for &(a, b, length, stiff) in &links {
                let (a, b) = (a as usize, b as usize);
                let way = p[b] - p[a];
                let now = way.length().max(1e-9);
                let fix = way * (0.5 * stiff * (now - length * rest) / now);
                p[a] += fix;
                p[b] -= fix;
            }
            if pass % 2 == 0 {
                p.iter_mut().zip(&mut last).for_each(|(p, last)| push_out(p, last, supports));
            }
        }
    }
    let row = |i: usize, v: f32| spline(|j| p[i * n + j], v * (n - 1) as f32);
    surface((2 * n, 2 * n), |u, v| spline(|i| row(i, v), u * (n - 1) as f32))
}

/// A smooth curve (Catmull-Rom) through the points of a sheet's thread.
fn spline(point: impl Fn(usize) -> Vec3, at: f32) -> Vec3 {
    let i = (at as usize).min(THREADS - 2);
    let t = at - i as f32;
    let [a, b, c, d] = [i.saturating_sub(1), i, i + 1, (i + 2).min(THREADS - 1)].map(point);
    0.5 * (2.0 * b
        + (c - a) * t
        + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t
        + (3.0 * b - a - 3.0 * c + d) * t * t * t)
}

/// A slight unevenness so that folds know where to go.
fn ripple(p: Vec2) -> f32 {
    0.004 * Noise(11).fractal(vec3(p.x, 0.0, p.y) * 9.0, 2)
}

/// Pairs of threads, their distance in rests, and how hard they keep it: weave, shear and bend.
fn links(n: usize) -> Vec<(u32, u32, f32, f32)> {
    let mut links = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let shear = std::f32::consts::SQRT_2;
        for (di, dj, length, stiff) in
            [(0, 1, 1.0, 1.0), (1, 0, 1.0, 1.0), (1, 1, shear, 0.5), (0, 2, 2.0, 0.12), (2, 0, 2.0, 0.12)]
        {
            if i + di < n && j + dj < n {
                links.push(((i * n + j) as u32, ((i + di) * n + j + dj) as u32, length, stiff));
            }
        }
        if i + 1 < n && j > 0 {
            links.push(((i * n + j) as u32, ((i + 1) * n + j - 1) as u32, shear, 0.5));
        }
    }
    links
}

/// Moves a point out of floor and supports; touching stops it.
fn push_out(p: &mut Vec3, last: &mut Vec3, supports: &[Support]) {
    let skin = 0.006;
    if p.y < skin {
        p.y = skin;
        *last = last.lerp(*p, 0.4);
    }
    for s in supports {
        let d = s.distance(*p) - skin;
        if d < 0.0 {
            let e = 1e-3;
            let slope = |axis: Vec3| s.distance(*p + axis * e) - s.distance(*p - axis * e);
            let out = vec3(slope(Vec3::X), slope(Vec3::Y), slope(Vec3::Z)).normalize_or(Vec3::Y);
            *p -= out * d;
            *last = last.lerp(*p, 0.5);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_lies_on_what_is_under_it() {
        let supports = [Support::Ball(vec3(0.0, 0.3, 0.0), 0.3)];
        let sheet = fallen(1.2, &supports, &mut Rng::new(1));
        let (lo, hi) = sheet.extent();
        assert!(lo.y > 0.0 && (0.59..0.68).contains(&hi.y), "{lo} {hi}");
        assert!(sheet.position.iter().all(|p| supports[0].distance(*p) > -0.01));
        let edge =
            sheet.position.iter().filter(|p| vec2(p.x, p.z).length() > 0.45).map(|p| p.y).fold(0.0, f32::max);
        assert!(edge < 0.45, "it hangs down: {edge}");
    }
}
