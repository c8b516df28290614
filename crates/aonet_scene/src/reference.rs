//! Ray-traced ambient occlusion: the reference for all methods.

use crate::gbuffer::{Surface, corners, geometric_normal};
use crate::trace::{FAN, Fan, Tracer};
use crate::{Error, Result, Scene};
use aonet::internals::random::SplitMix64;
use aonet::{AoImage, AoParams, BentNormals};
use glam::{DVec3, Mat3A, Vec3A};
use rayon::prelude::*;

/// Sampling of the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampling {
    /// Rays per pixel, > 0.
    pub spp: u32,
    /// Seed of the sequence; equal seeds give identical images whatever the number of threads.
    pub seed: u64,
}

/// Most rays per pixel.
pub const MAX_SPP: u32 = 1 << 20;

impl Sampling {
    pub(crate) fn check(self) -> Result<()> {
        if (1..=MAX_SPP).contains(&self.spp) {
            return Ok(());
        }
        Err(Error::request("rays per pixel", format!("1 to {MAX_SPP}"), self.spp))
    }
}

/// AO(p) = 1/N sum V(p, w_i) of the surface's picture, cosine-weighted about the shading normal, on all cores.
/// `progress` is called from time to time with the number of rays traced since its last call.
///
/// # Errors
/// When `spp` is 0 or above [`MAX_SPP`], the radius is out of range, or `surface` shows triangles that `tracer`'s scene lacks.
pub fn reference_ao(
    tracer: &Tracer,
    surface: &Surface,
    params: AoParams,
    sampling: Sampling,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<AoImage> {
    sampling.check()?;
    surface.check_of(tracer.scene())?;
    let surface = &*surface.without_margin();
    let radius = params.radius();
    let width = surface.gbuffer.width();
    let disk = Disk::new(sampling);
    let mut image = AoImage::open(surface.gbuffer.size());
    image.visibility_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let mut rays = 0;
        for (x, visibility) in row.iter_mut().enumerate() {
            if let Some(point) = Point::new(tracer.scene(), surface, y * width + x) {
                *visibility = disk.visibility(tracer, &point, radius);
                rays += u64::from(sampling.spp);
            }
        }
        progress(rays);
    });
    Ok(image)
}

/// [`reference_ao`] with bent normals: the normalised mean of the directions of the same rays that are open, in view space; the
/// surface's normal where none is, zero on the background.
///
/// # Errors
/// As [`reference_ao`].
pub fn reference_with_bent_normals(
    tracer: &Tracer,
    surface: &Surface,
    params: AoParams,
    sampling: Sampling,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<(AoImage, BentNormals)> {
    sampling.check()?;
    surface.check_of(tracer.scene())?;
    let surface = &*surface.without_margin();
    let (radius, gbuffer) = (params.radius(), &surface.gbuffer);
    let (width, size) = (gbuffer.width(), gbuffer.size());
    let view_from_world = gbuffer.camera().view_from_world();
    let disk = Disk::new(sampling);
    let (mut image, mut bent) = (AoImage::open(size), BentNormals::zeros(size));
    let rows = image.visibility_mut().par_chunks_mut(width).zip(bent.directions_mut().par_chunks_mut(width));
    rows.enumerate().for_each(|(y, (visibilities, directions))| {
        let mut rays = 0;
        for (x, (visibility, direction)) in visibilities.iter_mut().zip(directions).enumerate() {
            let pixel = y * width + x;
            if let Some(point) = Point::new(tracer.scene(), surface, pixel) {
                let mut sum = Vec3A::ZERO;
                *visibility = disk.open_share(tracer, &point, radius, |open| sum += open);
                let bent = view_from_world.transform_vector3a(sum).try_normalize();
                *direction = bent.map_or(gbuffer.normal()[pixel], |bent| bent.to_array());
                rays += u64::from(sampling.spp);
            }
        }
        progress(rays);
    });
    Ok((image, bent))
}

/// Where the rays of a pixel start, world space.
pub(crate) struct Point {
    pixel: u64,
    pub(crate) origin: Vec3A,
    pub(crate) normal: Vec3A,
    pub(crate) geo_normal: Vec3A,
}

impl Point {
    /// The point that pixel `i` of `surface` shows; `None` on the background.
    pub(crate) fn new(scene: &Scene, surface: &Surface, i: usize) -> Option<Self> {
        let gbuffer = &surface.gbuffer;
        if !gbuffer.is_foreground(i) {
            return None;
        }
        let camera = gbuffer.camera();
        let (x, y) = (i % camera.width(), i / camera.width());
        let world_from_view = camera.view_from_world().inverse();
        let position = world_from_view.transform_point3a(camera.position_view(x, y, gbuffer.depth()[i]));
        let normal = world_from_view.transform_vector3a(gbuffer.normal()[i].into());
        let geo_normal = world_from_view.transform_vector3a(surface.geo_normal[i].into());
        let origin = above(scene, surface.triangle[i], (position, geo_normal));
        Some(Self { pixel: i as u64, origin, normal, geo_normal })
    }
}

/// The point of `triangle` next to `position`, moved along `geo_normal` by just more than rounding can
/// move it back: that of the projection, of the point itself, and of a ray against a triangle of this size.
// The idea of Wächter and Binder 2019, with the error bound in place of their constants.
fn above(scene: &Scene, triangle: u32, (position, geo_normal): (Vec3A, Vec3A)) -> Vec3A {
    let [a, b, c] = corners(scene, triangle);
    let exact = geometric_normal(scene, triangle);
    let position = position.as_dvec3();
    let offset = position - a.as_dvec3();
    let on_plane = position - exact * exact.dot(offset);
    let size = (b - a).abs().max((c - a).abs()).max((c - b).abs()).as_dvec3();
    let error = (on_plane.abs() + 4.0 * size) * f64::from(f32::EPSILON);
    let projection_error = 8.0 * f64::EPSILON * offset.length();
    let distance = error.dot(exact.abs()) + projection_error + f64::from(f32::MIN_POSITIVE);
    (on_plane + towards(exact, geo_normal) * distance).as_vec3a()
}

/// `normal` or its opposite: the one on the side of `side`.
fn towards(normal: DVec3, side: Vec3A) -> DVec3 {
    if normal.dot(side.as_dvec3()) < 0.0 { -normal } else { normal }
}

/// Points of the unit disk in a spiral. The directions on the hemisphere above them are cosine-weighted
/// (Malley's method).
// Vogel 1979: equal areas, successive angles the golden angle apart.
pub(crate) struct Disk {
    seed: u64,
    points: Vec<Spoke>,
}

/// A point of the spiral.
#[derive(Clone, Copy)]
pub(crate) struct Spoke {
    pub(crate) index: f32,
    pub(crate) cos: f32,
    pub(crate) sin: f32,
}

/// The first `n` points of the spiral; groups of `group` are next to each other.
pub(crate) fn spiral(n: u32, group: usize) -> Vec<Spoke> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let spoke = |i| {
        let (sin, cos) = (f64::from(i) * golden).sin_cos();
        Spoke { index: i as f32, cos: cos as f32, sin: sin as f32 }
    };
    let mut points: Vec<Spoke> = (0..n).map(spoke).collect();
    cluster(&mut points, 0, group);
    points
}

impl Disk {
    pub(crate) fn new(sampling: Sampling) -> Self {
        Self { seed: sampling.seed, points: spiral(sampling.spp, FAN) }
    }

    /// The open share of a pixel's rays.
    fn visibility(&self, tracer: &Tracer, point: &Point, radius: f32) -> f32 {
        self.open_share(tracer, point, radius, |_| ())
    }

    /// The same; calls `see` with the direction of every open ray (world space).
    #[inline]
    fn open_share(&self, tracer: &Tracer, point: &Point, radius: f32, mut see: impl FnMut(Vec3A)) -> f32 {
        let turned = Turned::new(self, point);
        let mut fan = Fan::new(point.origin, point.geo_normal, radius);
        let mut open = 0;
        for spokes in self.points.chunks(FAN) {
            fan.rays = 0;
            for (i, spoke) in spokes.iter().enumerate() {
                fan.set(i, turned.direction(spoke));
            }
            let free = fan.rays & !tracer.blocked(&fan);
            open += free.count_ones();
            (0..spokes.len()).filter(|i| free >> i & 1 == 1).for_each(|i| see(turned.direction(&spokes[i])));
        }
        open as f32 / turned.rays
    }

    /// The directions of a pixel's rays.
    pub(crate) fn directions(&self, point: &Point) -> impl Iterator<Item = Vec3A> {
        let turned = Turned::new(self, point);
        self.points.iter().map(move |spoke| turned.direction(spoke))
    }
}

/// The spiral of a pixel: each pixel turns it and shifts it outwards at random.
struct Turned {
    world_from_local: Mat3A,
    shift: f32,
    rays: f32,
}

impl Turned {
    fn new(disk: &Disk, point: &Point) -> Self {
        let random = first_bits(disk.seed ^ first_bits(point.pixel));
        let (turn, shift) = (unit(random >> 32), unit(random & 0xffff_ffff));
        Self { world_from_local: turned_frame(point.normal, turn), shift, rays: disk.points.len() as f32 }
    }

    fn direction(&self, spoke: &Spoke) -> Vec3A {
        let area = ((spoke.index + self.shift) / self.rays).min(1.0);
        let r = area.sqrt();
        self.world_from_local * Vec3A::new(r * spoke.cos, r * spoke.sin, (1.0 - area).sqrt())
    }
}

/// Sorts points so that groups of `group` are close to each other: rays with similar directions
/// meet the same nodes.
fn cluster(points: &mut [Spoke], level: usize, group: usize) {
    if points.len() <= group {
        return;
    }
    let along = |p: &Spoke| p.index.sqrt() * if level.is_multiple_of(2) { p.cos } else { p.sin };
    points.sort_by(|a, b| along(a).total_cmp(&along(b)));
    let half = points.len() / group / 2 * group;
    let (a, b) = points.split_at_mut(half.max(group));
    cluster(a, level + 1, group);
    cluster(b, level + 1, group);
}

/// Columns x, y, z = `normal`: a frame turned about `normal` by `turn` of a full turn.
// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
fn turned_frame(normal: Vec3A, turn: f32) -> Mat3A {
    let sign = 1f32.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    let x = Vec3A::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x);
    let y = Vec3A::new(b, sign + normal.y * normal.y * a, -normal.y);
    let (sin, cos) = (turn * std::f32::consts::TAU).sin_cos();
    Mat3A::from_cols(x * cos + y * sin, y * cos - x * sin, normal)
}

/// [0, 1) from the upper 24 of 32 bits.
fn unit(bits: u64) -> f32 {
    (bits >> 8) as f32 / 16_777_216.0
}

/// A bijection whose output bits all depend on all input bits; zero gives no zero.
fn first_bits(seed: u64) -> u64 {
    SplitMix64::new(seed).bits()
}
