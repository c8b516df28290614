//! Trees, grass and rocks.

use super::mesh::{Mesh, Pose, turn};
use super::rng::{Noise, Rng};
use super::shapes::{grid, surface, tube};
use glam::{Vec3, vec3};

/// How a tree looks; drawn once a tree.
struct Habit {
    spread: f32,
    droop: f32,
    leaf: f32,
    bare: bool,
}

/// A tree of about `height` (m) with at most `leaves` leaves.
pub(super) fn tree(height: f32, leaves: usize, rng: &mut Rng) -> Mesh {
    let habit = Habit {
        spread: rng.range(0.4, 0.95),
        droop: rng.range(-0.25, 0.2),
        leaf: height * rng.range(0.018, 0.035),
        bare: leaves == 0 || rng.chance(0.12),
    };
    let mut mesh = Mesh::default();
    let mut twigs = Vec::new();
    let trunk = Branch {
        from: Vec3::ZERO,
        direction: (Vec3::Y + rng.direction() * 0.12).normalize(),
        length: 0.35 * height,
        radius: 0.035 * height,
        order: if leaves < 700 { 3 } else { 4 },
    };
    trunk.grow(&mut mesh, &mut twigs, &habit, rng);
    if !habit.bare && !twigs.is_empty() {
        let leaf = leaf(habit.leaf);
        for _ in 0..leaves {
            let (from, to) = *rng.pick(&twigs);
            let p = from.lerp(to, rng.range(0.15, 1.1)) + rng.direction() * habit.leaf * 0.6;
            let up = (rng.direction() + Vec3::Y * 0.7).normalize_or(Vec3::Y);
            mesh.add(&leaf, Pose::at(p.x, p.y, p.z).stand_on(up).yaw(rng.angle()).scale(rng.range(0.7, 1.3)));
        }
    }
    mesh
}

type Twigs = Vec<(Vec3, Vec3)>;

/// A branch of a tree.
struct Branch {
    from: Vec3,
    direction: Vec3,
    length: f32,
    radius: f32,
    /// Branchings above it; 0 for the last twigs.
    order: u32,
}

impl Branch {
    /// Adds the branch and those that grow from it.
    fn grow(&self, mesh: &mut Mesh, twigs: &mut Twigs, habit: &Habit, rng: &mut Rng) {
        let Self { from, direction: to, length, radius, order } = *self;
        let steps = if order == 0 { 3 } else { 5 };
        let (mut path, mut heading) = (vec![from], to);
        for _ in 0..steps {
            heading = (heading + rng.direction() * 0.16 - Vec3::Y * habit.droop * 0.12).normalize_or(Vec3::Y);
            path.push(path[path.len() - 1] + heading * length / steps as f32);
        }
        let taper = |i: usize| radius * (1.0 - 0.45 * i as f32 / steps as f32);
        let mut radii: Vec<f32> = (0..=steps).map(taper).collect();
        if order == 4 {
            radii[0] *= 1.7;
        }
        mesh.add(&tube(&path, &radii, 4 + 2 * order as usize), Pose::IDENTITY);
        if order <= 1 {
            twigs.push((path[1], path[steps]));
        }
        if order == 0 {
            return;
        }
        for k in 0..rng.count(3, 4) {
            let at = if k == 0 { steps } else { rng.count(2, steps) };
            let lean = rng.direction().reject_from_normalized(heading).normalize_or(Vec3::X);
            let bend = if k == 0 { 0.3 } else { habit.spread * rng.range(0.7, 1.3) };
            let to = (heading + lean * bend + Vec3::Y * 0.1).normalize_or(heading);
            let next = Self {
                from: path[at],
                direction: to,
                length: length * rng.range(0.6, 0.85),
                radius: radii[at] * rng.range(0.5, 0.75),
                order: order - 1,
            };
            next.grow(mesh, twigs, habit, rng);
        }
    }
}

/// A folded leaf of `size` lying in x, z, its stalk at the origin.
fn leaf(size: f32) -> Mesh {
    surface((3, 2), |u, v| {
        let half = [0.05, 0.3, 0.25, 0.02][(u * 3.0).round() as usize] * size;
        let side = v * 2.0 - 1.0;
        vec3(side * half, 0.25 * side.abs() * half - 0.1 * u * u * size, u * size)
    })
}

/// A conifer of `height`: a trunk with drooping rings of needled boughs.
pub(super) fn conifer(height: f32, rng: &mut Rng) -> Mesh {
    let radius = 0.02 * height;
    let mut mesh = tube(&[Vec3::ZERO, vec3(0.0, height, 0.0)], &[radius, 0.1 * radius], 10);
    let rings = rng.count(14, 24);
    let wide = rng.range(0.18, 0.32) * height;
    for i in 0..rings {
        let t = i as f32 / rings as f32;
        let reach = wide * (1.0 - t) + 0.02 * height;
        let boughs = rng.count(8, 13);
        let turned = rng.angle();
        for k in 0..boughs {
            let long = reach * rng.range(0.8, 1.1);
            let bough = surface((6, 4), |u, v| {
                let side = v * 2.0 - 1.0;
                let jag = if (u * 6.0).round() as usize % 2 == 1 { 1.0 } else { 0.55 };
                let half = 0.22 * long * (1.0 - u) * jag * if u == 0.0 { 0.2 } else { 1.0 };
                let sag = -0.35 * u * u - 0.5 * side.abs() * half / long;
                vec3(side * half, long * sag, long * u)
            });
            let yaw = turned + k as f32 / boughs as f32 * std::f32::consts::TAU + rng.spread(0.2);
            let y = height * (0.12 + 0.86 * t);
            mesh.add(&bough, Pose::at(0.0, y, 0.0).yaw(yaw).pitch(rng.spread(0.15)));
        }
    }
    mesh
}

/// A tuft of `blades` of grass, at most `height` tall.
pub(super) fn grass(height: f32, blades: usize, rng: &mut Rng) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..blades {
        let (tall, lean) = (height * rng.range(0.4, 1.0), rng.range(0.1, 1.3));
        let width = 0.025 * height;
        let blade = grid((3, 1), |u, v| {
            let bend = turn(u * lean);
            let side = (0.5 - v) * width * (1.0 - u);
            vec3(side, tall * bend.y / lean, tall * (1.0 - bend.x) / lean)
        });
        let foot = rng.in_rect(glam::Vec2::splat(0.12 * height));
        mesh.add(&blade.shade(60.0), Pose::at(foot.x, 0.0, foot.y).yaw(rng.angle()));
    }
    mesh
}

/// A boulder of `size`: a ball cut by planes, roughened; faceted or smooth.
pub(super) fn rock(size: Vec3, rng: &mut Rng) -> Mesh {
    let noise = Noise::new(rng);
    let cuts: Vec<(Vec3, f32)> =
        (0..rng.count(5, 14)).map(|_| (rng.direction(), rng.range(0.55, 0.9))).collect();
    let rough = rng.range(0.02, 0.12);
    let segments = rng.count(16, 36);
    let crease = if rng.chance(0.4) { 0.0 } else { 45.0 };
    let shape = |p: Vec3| {
        let d = p.normalize_or(Vec3::Y);
        let cut = cuts.iter().map(|(n, h)| h / d.dot(*n).max(1e-3)).fold(1.0, f32::min);
        d * (cut + rough * noise.fractal(d * 2.5, 4)) * 0.5 * size
    };
    let ball = super::shapes::ball(1.0, segments);
    let mut mesh = Mesh { position: ball.position.iter().map(|p| shape(*p)).collect(), ..ball };
    mesh = mesh.shade(crease);
    mesh
}
