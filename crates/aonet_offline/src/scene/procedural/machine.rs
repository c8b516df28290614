//! Machines of pipes, gears, plates and bolts.

use super::mesh::{Mesh, Pose, turn};
use super::rng::Rng;
use super::shapes::extrude;
use glam::{Vec2, vec2};
use std::f32::consts::TAU;

/// A plate with the counter-clockwise `outline` (star-shaped about the origin) and a round hole of
/// radius `bore`, `depth` thick along z about z = 0.
pub(super) fn bored(outline: &[Vec2], bore: f32, depth: f32) -> Mesh {
    let n = outline.len();
    let fine = 4;
    let total = n * fine;
    let outer = |k: usize| {
        let (i, t) = (k / fine % n, (k % fine) as f32 / fine as f32);
        outline[i].lerp(outline[(i + 1) % n], t)
    };
    let inner = |k: usize| outer(k).normalize_or(Vec2::X) * bore;
    let bevel = 0.06 * depth;
    let h = 0.5 * depth;
    let ring = |k: usize, row: usize| {
        let k = k % total;
        let tight = |p: Vec2| p * (1.0 - bevel / p.length().max(bevel));
        let wide = |p: Vec2| p * (1.0 + bevel / p.length().max(bevel));
        match row % 8 {
            0 => tight(outer(k)).extend(-h),
            1 => outer(k).extend(bevel - h),
            2 => outer(k).extend(h - bevel),
            3 => tight(outer(k)).extend(h),
            4 => wide(inner(k)).extend(h),
            5 => inner(k).extend(h - bevel),
            6 => inner(k).extend(bevel - h),
            _ => wide(inner(k)).extend(-h),
        }
    };
    let at = |u: f32, v: f32| ring((u * total as f32).round() as usize, (v * 8.0).round() as usize);
    super::shapes::grid((total, 8), at).shade(30.0)
}

/// A gear wheel of `radius`, `depth` thick along z, bored, with a hub.
pub(super) fn gear(radius: f32, depth: f32, rng: &mut Rng) -> Mesh {
    let teeth = rng.count(8, 28);
    let root = radius * (1.0 - rng.range(2.0, 3.2) / (teeth as f32 + 4.0));
    let outline: Vec<Vec2> = (0..4 * teeth)
        .map(|i| {
            let phase = [0.0, 0.18, 0.42, 0.6][i % 4];
            let r = [root, radius, radius, root][i % 4];
            turn((i / 4) as f32 / teeth as f32 * TAU + phase / teeth as f32 * TAU) * r
        })
        .collect();
    let bore = rng.range(0.15, 0.6) * radius;
    let mut mesh = bored(&outline, bore, depth);
    if bore > 0.35 * radius {
        let spokes = rng.count(3, 6);
        let bar = [vec2(0.0, -0.07), vec2(1.03, -0.1), vec2(1.03, 0.1), vec2(0.0, 0.07)].map(|p| p * bore);
        for k in 0..spokes {
            mesh.add(
                &extrude(&bar, 0.5 * depth, 0.02 * depth),
                Pose::IDENTITY.roll(k as f32 / spokes as f32 * TAU),
            );
        }
    }
    let hub: Vec<Vec2> = (0..24).map(|k| turn(k as f32 / 24.0 * TAU) * 0.22 * radius).collect();
    mesh.add(&bored(&hub, 0.1 * radius, 1.5 * depth), Pose::IDENTITY);
    mesh
}
