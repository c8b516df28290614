//! What kinds of G-buffers know of ambient occlusion: the reference's rays, which may only meet what a camera has seen.

use crate::Result;
use crate::gbuffer;
use crate::reference::{Disk, Point, Sampling};
use crate::trace::Tracer;
use crate::view::{Surround, View};
use aonet::Camera;
use glam::{Affine3A, Vec3A};
use rayon::prelude::*;

/// Surfaces that a ray passes through, at most. guess: more than lie within an AO radius behind one another.
const MOST_HITS: usize = 8;
/// Difference of depths that counts as none, as a share of the depth.
const SAME_DEPTH: f32 = 1e-3;

/// What is known of pixels of a view on a grid: one value for each of them, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Knowledge {
    /// Index of each pixel in the picture.
    pub pixels: Vec<usize>,
    /// Visibility, 1 on the background.
    pub visibility: Vec<f32>,
    /// For each kind of frame: share of the rays that meet a surface which such frames show, 0 on the background.
    pub hit: Vec<Vec<f32>>,
}

impl Knowledge {
    /// PSNR (dB) of the visibility that a kind of frame knows by itself: everything that it does not show is open.
    pub fn psnr(&self, kind: usize) -> f64 {
        let errors =
            self.visibility.iter().zip(&self.hit[kind]).map(|(v, hit)| f64::from(1.0 - hit - v).powi(2));
        -10.0 * (errors.sum::<f64>() / self.pixels.len() as f64).max(1e-12).log10()
    }
}

/// What frames of these `kinds` know of every `every`-th pixel of every `every`-th row of a view's picture, on all cores.
///
/// The rays are those of the reference. Each is followed through up to eight surfaces. A surface counts as hit where a frame shows
/// it: inside the picture and its guard band, and as the first surface, or the first that lies behind it by the separation at least.
///
/// # Errors
/// When the view or the sampling is out of range, or `every` is 0.
pub fn knowledge(
    tracer: &Tracer,
    view: &View,
    kinds: &[Surround],
    (sampling, every): (Sampling, usize),
) -> Result<Knowledge> {
    sampling.check()?;
    kinds.iter().try_for_each(Surround::check)?;
    let Grid { pixels, .. } = Grid::new(view, every)?;
    let view = view.clone().surrounded(Surround::default());
    let surface = gbuffer::render(tracer, &view)?;
    let seer = Seer::new(tracer, &view, kinds)?;
    let disk = Disk::new(sampling);
    let shares = |i: &usize| match Point::new(tracer.scene(), &surface, *i) {
        Some(point) => seer.shares(&disk, &point),
        None => vec![0.0; kinds.len() + 1],
    };
    let found: Vec<_> = pixels.par_iter().map(shares).collect();
    Ok(Knowledge {
        visibility: found.iter().map(|shares| 1.0 - shares[kinds.len()]).collect(),
        hit: (0..kinds.len()).map(|kind| found.iter().map(|shares| shares[kind]).collect()).collect(),
        pixels,
    })
}

/// Every `every`-th pixel of every `every`-th row of a picture, from the middle of the first `every` on.
pub(crate) struct Grid {
    /// Columns and rows.
    pub(crate) size: [usize; 2],
    /// Indices in the picture, row by row.
    pub(crate) pixels: Vec<usize>,
}

impl Grid {
    /// The grid of a view's picture.
    ///
    /// # Errors
    /// When `every` is 0.
    pub(crate) fn new(view: &View, every: usize) -> Result<Self> {
        if every == 0 {
            return Err(crate::Error::request("distance of pixels", "at least 1", every));
        }
        let (width, height) = (view.width, view.height);
        let inside = |side: usize| (every.min(side) / 2..side).step_by(every);
        let pixels = inside(height).flat_map(|y| inside(width).map(move |x| y * width + x)).collect();
        Ok(Self { size: [width, height].map(|side| inside(side).len()), pixels })
    }
}

/// A camera in a scene, and what frames of it show.
pub(crate) struct Seer<'a> {
    tracer: &'a Tracer,
    camera: Camera,
    world_from_view: Affine3A,
    /// Of the AO (world units).
    radius: f32,
    kinds: &'a [Surround],
}

impl<'a> Seer<'a> {
    /// Frames of these kinds of a view.
    ///
    /// # Errors
    /// When the view's camera is out of range.
    pub(crate) fn new(tracer: &'a Tracer, view: &View, kinds: &'a [Surround]) -> Result<Self> {
        let camera = view.camera()?;
        let world_from_view = camera.view_from_world().inverse();
        Ok(Self { tracer, camera, world_from_view, radius: view.radius, kinds })
    }

    /// Shares of the rays of a point that are hit in each kind of frame, and by anything.
    fn shares(&self, disk: &Disk, point: &Point) -> Vec<f32> {
        let mut hits = vec![0.0; self.kinds.len() + 1];
        let mut rays = 0.0;
        for direction in disk.directions(point) {
            rays += 1.0;
            let hit = self.follow(point, direction);
            hits.iter_mut().zip(hit).for_each(|(sum, hit)| *sum += f32::from(hit));
        }
        hits.into_iter().map(|sum| sum / rays).collect()
    }

    /// Whether a ray is hit in each kind of frame, and by anything.
    pub(crate) fn follow(&self, point: &Point, direction: Vec3A) -> Vec<bool> {
        let mut hit = vec![direction.dot(point.geo_normal) <= 0.0; self.kinds.len() + 1];
        let mut passed = 0.0;
        for _ in 0..MOST_HITS {
            if hit.iter().all(|hit| *hit) {
                break;
            }
            let origin = point.origin + direction * passed;
            let Some(met) = self.tracer.closest(origin, direction, self.radius - passed) else { break };
            passed += met.t;
            hit[self.kinds.len()] = true;
            self.look(point.origin + direction * passed, &mut hit);
            passed += 1e-4 * self.radius;
        }
        hit
    }

    /// Notes which kinds of frames show a point of a surface (world space).
    fn look(&self, point: Vec3A, hit: &mut [bool]) {
        let seen = self.camera.view_from_world().transform_point3a(point);
        let depth = -seen.z;
        if depth <= self.camera.near() {
            return;
        }
        let outside = self.outside(seen);
        if self.kinds.iter().zip(&*hit).all(|(kind, hit)| *hit || outside > kind.margin) {
            return;
        }
        let slack = SAME_DEPTH * depth;
        let first = self.nearest(seen, self.camera.near()).unwrap_or(depth);
        let is_first = first >= depth - slack;
        let is_second = |separation: f32| {
            let from = first + (separation * self.radius).max(SAME_DEPTH * first);
            from < depth + slack
                && self.nearest(seen, from).is_some_and(|second| (second - depth).abs() < slack)
        };
        // Kinds with the same separation often follow each other, and the answer costs a ray.
        let mut last = None;
        for (kind, hit) in self.kinds.iter().zip(hit).filter(|(kind, hit)| !**hit && outside <= kind.margin) {
            *hit = is_first
                || kind.separation.is_some_and(|separation| match last {
                    Some((same, answer)) if same == separation => answer,
                    _ => last.insert((separation, is_second(separation))).1,
                });
        }
    }

    /// How far outside of the picture a point is seen (view space), as a share of its size; below 0 inside.
    fn outside(&self, seen: Vec3A) -> f32 {
        let camera = &self.camera;
        let ([cx, cy], [fx, fy]) = (camera.centre_px(), camera.focal_px());
        let px = camera.projected_px(1.0, -seen.z);
        let share = |place: f32, side: usize| (-place).max(place - side as f32) / side as f32;
        let (x, y) = (cx + seen.x * px * (fx / fy), cy - seen.y * px);
        share(x, camera.width()).max(share(y, camera.height()))
    }

    /// Depth of the nearest surface from a depth on, on the camera's ray through a point (view space).
    fn nearest(&self, seen: Vec3A, from: f32) -> Option<f32> {
        let depth = -seen.z;
        let (origin, direction) = match self.camera.is_perspective() {
            true => (seen * (from / depth), seen / depth),
            false => (seen.with_z(-from), -Vec3A::Z),
        };
        let origin = self.world_from_view.transform_point3a(origin);
        let direction = self.world_from_view.transform_vector3a(direction);
        let reach = (depth * (1.0 + SAME_DEPTH) - from).max(0.0);
        self.tracer.closest(origin, direction, reach).map(|hit| from + hit.t)
    }
}
