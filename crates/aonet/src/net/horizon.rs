//! One slice of horizon-based visibility a pixel: what a screen-space method sees in one direction, noisy by design.
//!
//! The direction depends on the pixel's place in a 4x4 tile, so that any 4x4 window holds all sixteen. The network
//! takes the place of the denoiser, and of everything that a height field cannot know.
// Jimenez et al. 2016, Practical Real-Time Strategies for Accurate Indirect Occlusion, Alg. 1 and Eq. 7: the
// cosine-weighted integral of a slice between its two horizons.

use crate::ao_image::AoParams;
use crate::camera::Projection;
use crate::gbuffer::GBuffer;
use glam::{Vec2, Vec3A};
use std::f32::consts::{FRAC_PI_2, PI};

/// Side of the tile of directions [px].
pub const TILE: usize = 4;

/// Taps on each side of a slice.
const STEPS: usize = 4;

/// Share of the radius over which a tap fades out. guess
const FADE: f32 = 0.3;

/// Least cosine between normal and view that the tangent plane is followed at. guess
const MOST_GRAZING: f32 = 0.1;

/// Direction of each pixel of the tile, in sixteenths of a half turn: an ordered dither (Bayer 1973), so that
/// neighbours look far apart.
const DIRECTION: [u8; TILE * TILE] = [0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5];

/// Slices of a frame.
pub(crate) struct Horizons<'a> {
    gbuffer: &'a GBuffer,
    radius: f32,
    perspective: bool,
    focal_px: f32,
    /// Direction and jitter of every pixel of the tile.
    tile: [(Vec2, f32); TILE * TILE],
}

impl<'a> Horizons<'a> {
    pub(crate) fn new(gbuffer: &'a GBuffer, params: AoParams) -> Self {
        let camera = gbuffer.camera();
        let tile = DIRECTION.map(|d| {
            let angle = PI * f32::from(d) / 16.0;
            (Vec2::from_angle(angle), f32::from(d * 7 % 16) / 16.0)
        });
        Self {
            gbuffer,
            radius: params.radius,
            perspective: matches!(camera.projection, Projection::Perspective { .. }),
            focal_px: camera.focal_px(),
            tile,
        }
    }

    /// Position in view space of a point of the image [px from the left and the top].
    fn position(&self, x: f32, y: f32, depth: f32) -> Vec3A {
        let (width, height) = (self.gbuffer.width() as f32, self.gbuffer.height() as f32);
        let scale = if self.perspective { depth } else { 1.0 } / self.focal_px;
        Vec3A::new((x + 0.5 - 0.5 * width) * scale, (0.5 * height - y - 0.5) * scale, -depth)
    }

    /// Share of the light of the slice of pixel (`x`, `y`) that arrives, in [0, 1]: 1 on open surfaces, whatever their
    /// slope, and on the background.
    pub(crate) fn visibility(&self, x: usize, y: usize) -> f32 {
        let width = self.gbuffer.width();
        let depth = self.gbuffer.depth()[y * width + x];
        if depth == f32::INFINITY {
            return 1.0;
        }
        let centre = self.position(x as f32, y as f32, depth);
        let to_viewer = if self.perspective { -centre.normalize() } else { Vec3A::Z };
        let normal = Vec3A::from(self.gbuffer.normal()[y * width + x]);
        let (direction, jitter) = self.tile[y % TILE * TILE + x % TILE];
        // The normal in the plane of the slice.
        let across = Vec3A::new(direction.x, direction.y, 0.0);
        let along = across - across.dot(to_viewer) * to_viewer;
        let axis = along.cross(to_viewer).normalize_or_zero();
        let lean = normal.dot(axis);
        let projected = normal - lean * axis;
        // Taps lie on pixels beside the slice: they are moved into it along the tangent plane.
        let slide = lean / normal.dot(to_viewer).max(MOST_GRAZING);
        let length = projected.length().max(1e-6);
        let cos_n = (projected.dot(to_viewer) / length).clamp(-1.0, 1.0);
        let n = cos_n.acos().copysign(along.dot(projected));
        let radius_px = self.radius * self.focal_px / if self.perspective { depth } else { 1.0 };
        let (sin_n, cos_n) = n.sin_cos();
        let side = |sign: f32| {
            // No occluder: the horizon is the tangent plane.
            let lowest = (n + sign * FRAC_PI_2).cos();
            let mut highest = lowest;
            for step in 0..STEPS {
                let t = (step as f32 + 0.25 + 0.75 * jitter) / STEPS as f32;
                let pixels = (t * t * radius_px).max(1.0 + step as f32);
                let (dx, dy) = (sign * direction.x * pixels, -sign * direction.y * pixels);
                let (sx, sy) = ((x as f32 + dx).round(), (y as f32 + dy).round());
                if sx < 0.0 || sy < 0.0 || sx >= width as f32 || sy >= self.gbuffer.height() as f32 {
                    break;
                }
                let tap_depth = self.gbuffer.depth()[sy as usize * width + sx as usize];
                let to_tap = self.position(sx, sy, tap_depth) - centre;
                let beside = to_tap.dot(axis);
                let to_tap = to_tap - beside * (axis - slide * to_viewer);
                let distance = to_tap.length();
                let weight = ((self.radius - distance) / (FADE * self.radius)).clamp(0.0, 1.0);
                if weight > 0.0 {
                    let cos_tap = to_tap.dot(to_viewer) / distance;
                    highest = highest.max(lowest + (cos_tap - lowest) * weight);
                }
            }
            let horizon = sign * highest.clamp(-1.0, 1.0).acos();
            cos_n + 2.0 * horizon * sin_n - (2.0 * horizon - n).cos()
        };
        let open = 4.0 * (cos_n + n * sin_n);
        ((side(1.0) + side(-1.0)) / open).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Camera;
    use glam::Vec3;

    /// A frame whose geometry is `depth(x, y)` with one normal.
    fn frame(projection: Projection, normal: Vec3, depth: impl Fn(Vec2) -> f32) -> GBuffer {
        let (width, height) = (64, 48);
        let camera =
            Camera::look_at((Vec3::ZERO, -Vec3::Z, Vec3::Y), projection, (width, height), 0.0).unwrap();
        let at = |i: usize| camera.position_view(i % width, i / width, 1.0);
        let depth = (0..width * height).map(|i| depth(Vec2::new(at(i).x, at(i).y))).collect();
        GBuffer::new(camera, depth, vec![normal.normalize().to_array(); width * height]).unwrap()
    }

    fn mean_of_tile(gbuffer: &GBuffer, radius: f32, (x, y): (usize, usize)) -> f32 {
        let horizons = Horizons::new(gbuffer, AoParams { radius });
        (0..16).map(|i| horizons.visibility(x + i % 4, y + i / 4)).sum::<f32>() / 16.0
    }

    #[test]
    fn an_open_plane_is_fully_visible() {
        // The plane z = -2 - 0.5 x has normal (0.5, 0, 1).
        let fov = Projection::Perspective { fov_y: 1.0 };
        let sloped = frame(fov, Vec3::new(0.5, 0.0, 1.0), |p| 2.0 / (1.0 - 0.5 * p.x));
        let ortho = Projection::Orthographic { height: 2.0 };
        for gbuffer in [sloped, frame(ortho, Vec3::new(0.5, 0.0, 1.0), |p| 2.0 + 0.5 * p.x)] {
            for at in [(0, 0), (28, 20), (60, 44)] {
                let visibility = mean_of_tile(&gbuffer, 0.5, at);
                assert!((visibility - 1.0).abs() < 0.01, "{at:?}: {visibility}");
            }
        }
    }

    #[test]
    fn a_wall_takes_its_share_of_the_light() {
        // Floor seen from above; to the right of the middle a block of height h.
        let h = 0.3;
        let step = |p: Vec2| if p.x > 0.0 { 1.3 - h } else { 1.3 };
        let gbuffer = frame(Projection::Orthographic { height: 2.0 }, Vec3::Z, step);
        for x in [28, 24] {
            let d = (32 - x - 2) as f32 / 24.0;
            let expected = 0.5 * (1.0 + d / d.hypot(h));
            let visibility = mean_of_tile(&gbuffer, 1.5, (x, 20));
            // Four taps a side miss the edge by a few pixels.
            assert!((visibility - expected).abs() < 0.12, "{x}: {visibility}, in closed form {expected}");
        }
        assert!(mean_of_tile(&gbuffer, 0.05, (8, 20)) > 0.99, "out of reach");
    }
}
