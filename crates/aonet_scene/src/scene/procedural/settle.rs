//! Things dropped on a ground until they lie: each slides and tips as long as that lowers it.

use super::mesh::{Mesh, Pose};
use super::rng::Rng;
use glam::{Vec2, Vec3, vec3};

/// Attempts to lower a body before it counts as lying. guess: more gains little
const ATTEMPTS: usize = 90;

/// The highest surface so far on a square lattice about x = z = 0.
pub(super) struct Ground {
    cell: f32,
    side: usize,
    height: Vec<f32>,
}

impl Ground {
    /// A ground of `half` extent whose height is `start`(x, z); about 5 cells a `detail`.
    pub(super) fn new(half: f32, detail: f32, start: impl Fn(f32, f32) -> f32) -> Self {
        let side = (2.0 * half / detail * 5.0).clamp(32.0, 700.0) as usize;
        let cell = 2.0 * half / side as f32;
        let at = |k: usize| (k as f32 + 0.5) * cell - half;
        let height = (0..side * side).map(|i| start(at(i % side), at(i / side))).collect();
        Self { cell, side, height }
    }

    fn index(&self, p: Vec2) -> Option<usize> {
        let g = p / self.cell + Vec2::splat(0.5 * self.side as f32);
        let inside = g.cmpge(Vec2::ZERO).all() && g.cmplt(Vec2::splat(self.side as f32)).all();
        inside.then(|| g.y as usize * self.side + g.x as usize)
    }

    /// Height at (x, z); nothing holds what is outside.
    fn height(&self, p: Vec3) -> f32 {
        self.index(Vec2::new(p.x, p.z)).map_or(f32::INFINITY, |i| self.height[i])
    }

    /// Raises the ground to the top of a mesh.
    pub(super) fn cover(&mut self, mesh: &Mesh) {
        samples(mesh, 0.7 * self.cell, |p| {
            if let Some(i) = self.index(Vec2::new(p.x, p.z)) {
                self.height[i] = self.height[i].max(p.y);
            }
        });
    }

    /// Drops `body` near `from` (x, z): returns its pose at rest, and covers the ground with it. None
    /// where it falls off the ground.
    pub(super) fn drop(&mut self, body: &Mesh, from: Vec2, rng: &mut Rng) -> Option<Pose> {
        let (lo, hi) = body.extent();
        let size = (hi - lo).max_element();
        let skin = skin(body, (0.06 * size).max(0.8 * self.cell));
        let centre = skin.iter().sum::<Vec3>() / skin.len().max(1) as f32;
        let mut pose =
            Pose::at(from.x, 0.0, from.y) * random_turn(rng).shift(-centre.x, -centre.y, -centre.z);
        let mut lift = self.lift(&skin, pose);
        for attempt in 0..ATTEMPTS {
            let reach = 1.0 - attempt as f32 / ATTEMPTS as f32;
            let slide = rng.in_rect(Vec2::splat(0.3 * size * reach));
            let tip = rng.direction() * rng.range(0.0, 1.2) * reach;
            let about = Pose::at(pose.apply(centre).x + slide.x, 0.0, pose.apply(centre).z + slide.y);
            let centred = Pose { offset: pose.linear * -centre, ..pose };
            let tried = about * Pose::IDENTITY.yaw(tip.y).pitch(tip.x).roll(tip.z) * centred;
            let tried_lift = self.lift(&skin, tried);
            if tried_lift < lift {
                (pose, lift) = (tried, tried_lift);
            }
        }
        if !lift.is_finite() {
            return None;
        }
        pose.offset.y += lift;
        self.cover(&body.at(pose));
        Some(pose)
    }

    /// How far `pose` must rise so that no point of `skin` is under the ground.
    fn lift(&self, skin: &[Vec3], pose: Pose) -> f32 {
        skin.iter().map(|p| pose.apply(*p)).map(|p| self.height(p) - p.y).fold(f32::NEG_INFINITY, f32::max)
    }
}

/// One of the six sides down, any yaw: where flat things start and mostly stay.
fn random_turn(rng: &mut Rng) -> Pose {
    let quarter = std::f32::consts::FRAC_PI_2;
    let pose = Pose::IDENTITY.yaw(rng.angle());
    match rng.below(4) {
        0 => pose.pitch(quarter),
        1 => pose.roll(quarter),
        2 => pose.pitch(rng.spread(3.0)),
        _ => pose,
    }
}

/// Points of the surface, about one in each cube of side `spacing`.
fn skin(body: &Mesh, spacing: f32) -> Vec<Vec3> {
    let mut points = Vec::new();
    samples(body, spacing, |p| points.push(((p / spacing).floor().as_ivec3().to_array(), p)));
    points.sort_by_key(|(cube, _)| *cube);
    points.dedup_by_key(|(cube, _)| *cube);
    points.into_iter().map(|(_, p)| p).collect()
}

/// Points on every triangle, at most `spacing` apart.
fn samples(mesh: &Mesh, spacing: f32, mut visit: impl FnMut(Vec3)) {
    for t in &mesh.triangle {
        let [a, b, c] = t.map(|i| mesh.position[i as usize]);
        let longest = (b - a).length().max((c - a).length()).max((c - b).length());
        let n = (longest / spacing).ceil().clamp(1.0, 400.0) as usize;
        for i in 0..=n {
            for j in 0..=n - i {
                let w = vec3((n - i - j) as f32, i as f32, j as f32) / n as f32;
                visit(a * w.x + b * w.y + c * w.z);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::procedural::shapes::block;

    #[test]
    fn things_rest_on_the_ground_and_on_each_other() {
        let tile = block(vec3(0.3, 0.04, 0.2), 0.002);
        for seed in 0..8 {
            let mut rng = Rng::new(seed);
            let mut ground = Ground::new(1.0, 0.1, |_, _| 0.0);
            let first = tile.at(ground.drop(&tile, Vec2::ZERO, &mut rng).unwrap());
            let (lo, hi) = first.extent();
            assert!(lo.y.abs() < 1e-3 && hi.y < 0.31, "seed {seed}: {lo} {hi}");
            let before = ground.height.iter().copied().fold(0.0, f32::max);
            assert!((before - hi.y).abs() < 0.01, "seed {seed}: covered to {before}, top {}", hi.y);
        }
    }

    #[test]
    fn what_falls_off_the_ground_is_told() {
        let mut ground = Ground::new(0.05, 0.1, |_, _| 0.0);
        let log = block(vec3(3.0, 0.1, 0.1), 0.0);
        assert!(ground.drop(&log, Vec2::ZERO, &mut Rng::new(1)).is_none());
    }
}
