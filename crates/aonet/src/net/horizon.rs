//! One slice of horizon-based visibility a pixel: what a screen-space method sees in one direction, noisy by design.
//!
//! The direction depends on the pixel's place in a 4x4 tile, so that any 4x4 window holds all sixteen. The network
//! takes the place of the denoiser, and of everything that a height field cannot know.
// Jimenez et al. 2016, Practical Real-Time Strategies for Accurate Indirect Occlusion, Alg. 1 and Eq. 7: the
// cosine-weighted integral of a slice between its two horizons.

#![allow(clippy::needless_range_loop, reason = "loops over lanes of several arrays become vectors")]
#![allow(clippy::manual_clamp, reason = "NaN, of the background, must become a number")]

use crate::ao_image::AoParams;
use crate::camera::Projection;
use crate::gbuffer::GBuffer;
use std::f32::consts::PI;

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

/// Pixels that are computed together: loops over so many lanes become vectors.
const LANES: usize = 16;
type Lanes = [f32; LANES];

/// Slices of a frame.
pub(crate) struct Horizons<'a> {
    gbuffer: &'a GBuffer,
    radius: f32,
    /// View-space units a pixel: the first times the depth plus the second. One of them is 0.
    pixel_size: [f32; 2],
    /// 1 for perspective, 0 for parallel rays.
    perspective: f32,
    /// Direction of every pixel of a row of the tile, by row, and the place of its taps along the radius.
    tile: [TileRow; TILE],
}

/// One row of the tile, repeated.
#[derive(Clone, Copy)]
struct TileRow {
    direction: [Lanes; 2],
    taps: [Lanes; STEPS],
}

impl TileRow {
    fn new(y: usize) -> Self {
        let of = |x: usize| DIRECTION[y * TILE + x % TILE];
        let angle = |x: usize| PI * f32::from(of(x)) / DIRECTION.len() as f32;
        let jitter = |x: usize| f32::from(of(x) * 7 % 16) / DIRECTION.len() as f32;
        // Dense near the pixel, where most occluders are.
        let tap = |k: usize, x: usize| ((k as f32 + 0.25 + 0.75 * jitter(x)) / STEPS as f32).powi(2);
        let lanes = |value: &dyn Fn(usize) -> f32| std::array::from_fn(value);
        Self {
            direction: [lanes(&|x| angle(x).cos()), lanes(&|x| angle(x).sin())],
            taps: std::array::from_fn(|k| lanes(&|x| tap(k, x))),
        }
    }
}

/// Neighbouring pixels of a row and what all their taps need. The slice of a pixel is spanned by the unit vectors
/// `to_viewer` and `along`, `axis` is across.
struct Pixels {
    centre: [Lanes; 3],
    to_viewer: [Lanes; 3],
    /// Cosine between `to_viewer` and the direction in the image plane, and one over the sine.
    view_slope: Lanes,
    inverse_along: Lanes,
    axis: [Lanes; 3],
    /// The tangent plane: how far to go towards the viewer for a step along `axis`.
    slide: Lanes,
    /// The normal in the slice.
    cos_n: Lanes,
    sin_n: Lanes,
    radius_px: Lanes,
}

impl<'a> Horizons<'a> {
    pub(crate) fn new(gbuffer: &'a GBuffer, params: AoParams) -> Self {
        let camera = gbuffer.camera();
        let inverse_focal = 1.0 / camera.focal_px();
        let perspective = match camera.projection {
            Projection::Perspective { .. } => 1.0,
            Projection::Orthographic { .. } => 0.0,
        };
        Self {
            gbuffer,
            radius: params.radius,
            pixel_size: [inverse_focal * perspective, inverse_focal * (1.0 - perspective)],
            perspective,
            tile: std::array::from_fn(TileRow::new),
        }
    }

    /// 1 minus the share of the light of a pixel's slice that arrives, for as many pixels of row `y` as `line` has: 0
    /// on open surfaces, whatever their slope, and on the background.
    #[inline(always)]
    pub(crate) fn write_occlusion(&self, y: usize, line: &mut [f32]) {
        for (i, out) in line.chunks_mut(LANES).enumerate() {
            let occlusion = self.occlusion(i * LANES, y);
            out.copy_from_slice(&occlusion[..out.len()]);
        }
    }

    #[inline(always)]
    fn occlusion(&self, x: usize, y: usize) -> Lanes {
        let row = y * self.gbuffer.width();
        let pixels = self.pixels((x, y), row);
        let mut sum = [0.0; LANES];
        for sign in [1.0, -1.0] {
            let highest = self.highest_cosine(&pixels, (x, y), sign);
            for i in 0..LANES {
                sum[i] += arc(highest[i], sign, (pixels.cos_n[i], pixels.sin_n[i]));
            }
        }
        for i in 0..LANES {
            let (cos_n, sin_n) = (pixels.cos_n[i], pixels.sin_n[i]);
            let open = 4.0 * (cos_n + acos(cos_n) * sin_n.abs());
            sum[i] = (1.0 - sum[i] / open).max(0.0).min(1.0);
            if pixels.centre[2][i] == BACKGROUND {
                sum[i] = 0.0;
            }
        }
        sum
    }

    #[inline(always)]
    fn pixels(&self, (x, y): (usize, usize), row: usize) -> Pixels {
        let zero = [0.0; LANES];
        let last = row + self.gbuffer.width() - 1;
        let (mut depth, mut normal) = (zero, [zero; 3]);
        for i in 0..LANES {
            let at = (row + x + i).min(last);
            // Any depth will do where there is none.
            let found = self.gbuffer.depth()[at];
            depth[i] = if found == f32::INFINITY { -BACKGROUND } else { found };
            for c in 0..3 {
                normal[c][i] = self.gbuffer.normal()[at][c];
            }
        }
        let mut p = Pixels {
            centre: [zero; 3],
            to_viewer: [zero; 3],
            view_slope: zero,
            inverse_along: zero,
            axis: [zero; 3],
            slide: zero,
            cos_n: zero,
            sin_n: zero,
            radius_px: zero,
        };
        let [dx, dy] = &self.tile[y % TILE].direction;
        for i in 0..LANES {
            let [px, py, pz] = self.position((x + i) as f32, y as f32, depth[i]);
            let inverse = -self.perspective / (px * px + py * py + pz * pz).sqrt();
            let (vx, vy, vz) = (px * inverse, py * inverse, pz * inverse + (1.0 - self.perspective));
            let slope = dx[i] * vx + dy[i] * vy;
            let inverse_along = 1.0 / (1.0 - slope * slope).max(1e-6).sqrt();
            let axis = [dy[i] * vz, -dx[i] * vz, dx[i] * vy - dy[i] * vx].map(|a| a * inverse_along);
            let (nx, ny, nz) = (normal[0][i], normal[1][i], normal[2][i]);
            let facing = nx * vx + ny * vy + nz * vz;
            let along = (dx[i] * nx + dy[i] * ny - slope * facing) * inverse_along;
            let inverse_length = 1.0 / (facing * facing + along * along).max(1e-12).sqrt();
            p.centre[0][i] = px;
            p.centre[1][i] = py;
            p.centre[2][i] = pz;
            p.to_viewer[0][i] = vx;
            p.to_viewer[1][i] = vy;
            p.to_viewer[2][i] = vz;
            p.view_slope[i] = slope;
            p.inverse_along[i] = inverse_along;
            for c in 0..3 {
                p.axis[c][i] = axis[c];
            }
            p.slide[i] = (nx * axis[0] + ny * axis[1] + nz * axis[2]) / facing.max(MOST_GRAZING);
            p.cos_n[i] = facing * inverse_length;
            p.sin_n[i] = along * inverse_length;
            p.radius_px[i] = self.radius / (self.pixel_size[0] * depth[i] + self.pixel_size[1]);
        }
        p
    }

    /// Cosine between the viewer and the highest occluder on one side of the slice, the tangent plane at least.
    #[inline(always)]
    fn highest_cosine(&self, p: &Pixels, (x, y): (usize, usize), sign: f32) -> Lanes {
        let (width, height) = (self.gbuffer.width() as u32, self.gbuffer.height() as u32);
        let tile = &self.tile[y % TILE];
        let lowest = p.sin_n.map(|sin_n| -sign * sin_n);
        let mut highest = lowest;
        let inverse_fade = 1.0 / (FADE * self.radius);
        for (k, taps) in tile.taps.iter().enumerate() {
            let (mut sx, mut sy) = ([0.0; LANES], [0.0; LANES]);
            let (mut index, mut inside) = ([0; LANES], [0.0f32; LANES]);
            for i in 0..LANES {
                let pixels = (taps[i] * p.radius_px[i]).max(1.0 + k as f32) * sign;
                let fx = (x + i) as f32 + tile.direction[0][i] * pixels;
                let fy = y as f32 - tile.direction[1][i] * pixels;
                let (column, line) = (nearest(fx, width - 1), nearest(fy, height - 1));
                index[i] = line * width + column;
                (sx[i], sy[i]) = (column as f32, line as f32);
                let outside = (fx - sx[i]).abs().max((fy - sy[i]).abs());
                inside[i] = if outside <= 0.5 { 1.0 } else { 0.0 };
            }
            let mut depths = [0.0; LANES];
            for (depth, i) in depths.iter_mut().zip(index) {
                *depth = self.gbuffer.depth()[i as usize];
            }
            for i in 0..LANES {
                let [qx, qy, qz] = self.position(sx[i], sy[i], depths[i]);
                let (tx, ty, tz) = (qx - p.centre[0][i], qy - p.centre[1][i], qz - p.centre[2][i]);
                let towards = tx * p.to_viewer[0][i] + ty * p.to_viewer[1][i] + tz * p.to_viewer[2][i];
                let beside = tx * p.axis[0][i] + ty * p.axis[1][i] + tz * p.axis[2][i];
                let across = tile.direction[0][i] * tx + tile.direction[1][i] * ty;
                let along = (across - p.view_slope[i] * towards) * p.inverse_along[i];
                // Taps lie on pixels beside the slice: they are moved into it along the tangent plane.
                let towards = towards + beside * p.slide[i];
                let distance = (towards * towards + along * along).sqrt();
                let weight = ((self.radius - distance) * inverse_fade).min(1.0) * inside[i];
                let cosine = lowest[i] + (towards / distance - lowest[i]) * weight;
                // False for the background, which is infinitely far.
                if weight > 0.0 && cosine > highest[i] {
                    highest[i] = cosine;
                }
            }
        }
        highest
    }

    /// Position in view space of the centre of a pixel.
    #[inline(always)]
    fn position(&self, x: f32, y: f32, depth: f32) -> [f32; 3] {
        let (width, height) = (self.gbuffer.width() as f32, self.gbuffer.height() as f32);
        let scale = self.pixel_size[0] * depth + self.pixel_size[1];
        [(x + 0.5 - 0.5 * width) * scale, (0.5 * height - y - 0.5) * scale, -depth]
    }
}

/// The integer in 0..=`last` nearest to `x`; `last` is below 2^23. Casts of floats saturate, which costs more.
#[inline(always)]
fn nearest(x: f32, last: u32) -> u32 {
    const MAGIC: f32 = 8_388_608.0;
    let bits = (x.max(0.0).min(last as f32) + MAGIC).to_bits();
    bits - MAGIC.to_bits()
}

/// View-space z that stands for the background.
const BACKGROUND: f32 = -1e30;

/// Four times the light between the normal and a horizon, from the cosine of the horizon's angle to the viewer on the
/// side of `sign`. Jimenez et al. 2016, Eq. 7.
#[inline(always)]
fn arc(cos_h: f32, sign: f32, (cos_n, sin_n): (f32, f32)) -> f32 {
    let cos_h = cos_h.max(-1.0).min(1.0);
    let sin_h = sign * (1.0 - cos_h * cos_h).max(0.0).sqrt();
    let (cos_2h, sin_2h) = (2.0 * cos_h * cos_h - 1.0, 2.0 * cos_h * sin_h);
    cos_n + 2.0 * sign * acos(cos_h) * sin_n - (cos_2h * cos_n + sin_2h * sin_n)
}

/// Arc cosine [rad], off by less than 7e-5. Abramowitz and Stegun 1964, 4.4.45.
#[inline(always)]
fn acos(x: f32) -> f32 {
    let t = x.abs().min(1.0);
    let positive =
        (1.0 - t).sqrt() * (1.570_728_8 + t * (-0.212_114_4 + t * (0.074_261_0 + t * -0.018_729_3)));
    if x < 0.0 { PI - positive } else { positive }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Camera;
    use glam::{Vec2, Vec3, Vec3A};
    use std::f32::consts::FRAC_PI_2;

    /// A frame whose geometry is `depth(x, y)` with one normal.
    fn frame(projection: Projection, normal: Vec3, depth: impl Fn(Vec2) -> f32) -> GBuffer {
        let (width, height) = (64, 48);
        let camera =
            Camera::look_at((Vec3::ZERO, -Vec3::Z, Vec3::Y), projection, (width, height), 0.0).unwrap();
        let at = |i: usize| camera.position_view(i % width, i / width, 1.0);
        let depth: Vec<f32> = (0..width * height).map(|i| depth(Vec2::new(at(i).x, at(i).y))).collect();
        let normals = |depth: &f32| if depth.is_finite() { normal.normalize().to_array() } else { [0.0; 3] };
        let normal = depth.iter().map(normals).collect();
        GBuffer::new(camera, depth, normal).unwrap()
    }

    fn mean_of_tile(gbuffer: &GBuffer, radius: f32, (x, y): (usize, usize)) -> f32 {
        let horizons = Horizons::new(gbuffer, AoParams { radius });
        let mut line = [0.0; 64];
        let of_row = |y: usize| {
            horizons.write_occlusion(y, &mut line);
            line[x..x + 4].iter().sum::<f32>()
        };
        1.0 - (y..y + 4).map(of_row).sum::<f32>() / 16.0
    }

    /// The same slice by the book: angles, vectors, one pixel at a time.
    fn visibility(gbuffer: &GBuffer, radius: f32, (x, y): (usize, usize)) -> f32 {
        let (camera, width) = (gbuffer.camera(), gbuffer.width());
        let depth_at = |x: usize, y: usize| gbuffer.depth()[y * width + x];
        let depth = depth_at(x, y);
        let centre = camera.position_view(x, y, depth);
        let to_viewer = camera.to_viewer(centre);
        let normal = Vec3A::from(gbuffer.normal()[y * width + x]);
        let place = f32::from(DIRECTION[y % TILE * TILE + x % TILE]);
        let across = Vec3A::from((Vec2::from_angle(PI * place / 16.0), 0.0));
        let along = across - across.dot(to_viewer) * to_viewer;
        let axis = along.cross(to_viewer).normalize();
        let lean = normal.dot(axis);
        let projected = normal - lean * axis;
        let n = projected.angle_between(to_viewer).copysign(along.dot(projected));
        let side = |sign: f32| {
            let mut highest = (n + sign * FRAC_PI_2).cos();
            let lowest = highest;
            for step in 0..STEPS {
                let t = (step as f32 + 0.25 + 0.75 * (place * 7.0 % 16.0) / 16.0) / STEPS as f32;
                let pixels = (t * t * camera.projected_px(radius, depth)).max(1.0 + step as f32) * sign;
                let (sx, sy) = (x as f32 + across.x * pixels, y as f32 - across.y * pixels);
                let (sx, sy) = (sx.round_ties_even(), sy.round_ties_even());
                if sx < 0.0 || sy < 0.0 || sx >= width as f32 || sy >= gbuffer.height() as f32 {
                    continue;
                }
                let (sx, sy) = (sx as usize, sy as usize);
                if depth_at(sx, sy) == f32::INFINITY {
                    continue;
                }
                let to_tap = camera.position_view(sx, sy, depth_at(sx, sy)) - centre;
                let slide = lean / normal.dot(to_viewer).max(MOST_GRAZING);
                let to_tap = to_tap - to_tap.dot(axis) * (axis - slide * to_viewer);
                let weight = ((radius - to_tap.length()) / (FADE * radius)).clamp(0.0, 1.0);
                let cosine = to_tap.normalize().dot(to_viewer);
                highest = highest.max(lowest + (cosine - lowest) * weight);
            }
            let h = sign * highest.clamp(-1.0, 1.0).acos();
            n.cos() + 2.0 * h * n.sin() - (2.0 * h - n).cos()
        };
        ((side(1.0) + side(-1.0)) / (4.0 * (n.cos() + n * n.sin()))).clamp(0.0, 1.0)
    }

    #[test]
    fn vectors_and_the_book_agree() {
        let wave = |p: Vec2| 2.0 + 0.3 * (9.0 * p.x).sin() + if p.y > 0.3 { 0.5 } else { 0.0 };
        let hole = |p: Vec2| if p.length() < 0.1 { f32::INFINITY } else { wave(p) };
        for projection in [Projection::Perspective { fov_y: 1.0 }, Projection::Orthographic { height: 2.0 }] {
            let gbuffer = frame(projection, Vec3::new(0.3, -0.2, 1.0), hole);
            let horizons = Horizons::new(&gbuffer, AoParams { radius: 0.7 });
            let mut line = [0.0; 64];
            for y in 0..48 {
                horizons.write_occlusion(y, &mut line);
                for (x, found) in line.iter().enumerate() {
                    let background = gbuffer.depth()[y * 64 + x] == f32::INFINITY;
                    let expected = if background { 1.0 } else { visibility(&gbuffer, 0.7, (x, y)) };
                    assert!((1.0 - found - expected).abs() < 1e-3, "({x}, {y}): {} {expected}", 1.0 - found);
                }
            }
        }
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
