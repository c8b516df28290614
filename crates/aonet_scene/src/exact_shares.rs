//! The exact shares of a pixel's light: what a search would report that finds all that a frame shows.

use crate::knowledge::{Grid, Seer};
use crate::reference::{Disk, Point, Sampling};
use crate::trace::Tracer;
use crate::view::{Surround, View};
use crate::{Result, gbuffer};
use aonet::internals::shares::{GAPS, SHARES};
use aonet::{GBuffer, Size};
use glam::Vec3A;
use rayon::prelude::*;

/// Places along a ray where its depth is compared with the frame's. guess
const STEPS: usize = 32;
/// Exponent of their spacing: above 1, more of them lie near the pixel. guess
const DISTRIBUTION: f32 = 1.5;
/// How far behind a surface a place has to lie to be hidden, as a share of the depth, and of the AO radius on top. guess: a pixel's
/// plane is only roughly the surface.
const SLACK: (f32, f32) = (1e-3, 2e-3);

/// Values of pixels on a grid, row by row, for each share but the open one: in the order of [`Share::ALL`](aonet::search::Share::ALL).
pub type ExactShares = [Vec<f32>; SHARES];

/// The shares of light of every `every`-th pixel of every `every`-th row of a view's picture, in frames of each of these `kinds`, on all
/// cores, and the grid's columns and rows; 0 on the background. The first pixel is in the middle of the first square of `every` pixels.
///
/// The rays are those of the reference. A ray is hit if it meets a surface that the frame shows ([`knowledge`](crate::knowledge)).
/// Another one is hidden if it passes behind the last layer of the frame, or behind the first of two by less than the first of the gaps, where no
/// second layer shows anything; the least gap along its way counts. It is off if it leaves the frame before that.
///
/// # Errors
/// When the view, a kind or the sampling is out of range, or `every` is 0.
pub fn exact_shares(
    tracer: &Tracer,
    view: &View,
    kinds: &[Surround],
    (sampling, every): (Sampling, usize),
) -> Result<(Size, Vec<ExactShares>)> {
    sampling.check()?;
    kinds.iter().try_for_each(Surround::check)?;
    let grid = Grid::new(view, every)?;
    let size = Size::new(grid.size[0], grid.size[1])?;
    let view = view.clone().surrounded(Surround::default());
    let picture = gbuffer::render(tracer, &view)?;
    let buffer = |kind: &Surround| Ok(gbuffer::render(tracer, &view.clone().surrounded(*kind))?.gbuffer);
    let buffers: Vec<_> = kinds.iter().map(buffer).collect::<Result<_>>()?;
    let seer = Seer::new(tracer, &view, kinds)?;
    let disk = Disk::new(sampling);
    let of_pixel = |i: &usize| {
        let mut shares = vec![[0.0; SHARES]; kinds.len()];
        let Some(point) = Point::new(tracer.scene(), &picture, *i) else { return shares };
        for direction in disk.directions(&point) {
            let hit = seer.follow(&point, direction);
            for ((shares, buffer), hit) in shares.iter_mut().zip(&buffers).zip(hit) {
                let share = if hit { Some(0) } else { passed(buffer, &point, direction, view.radius) };
                share.into_iter().for_each(|share| shares[share] += 1.0 / sampling.spp as f32);
            }
        }
        shares
    };
    let found: Vec<_> = grid.pixels.par_iter().map(of_pixel).collect();
    let plane = |kind: usize, share: usize| found.iter().map(|pixel| pixel[kind][share]).collect();
    Ok((size, (0..kinds.len()).map(|kind| std::array::from_fn(|share| plane(kind, share))).collect()))
}

/// The share that a ray is in that meets nothing seen: 1 to 3 if it is hidden, 4 if it is off, `None` if it is open.
fn passed(buffer: &GBuffer, point: &Point, direction: Vec3A, radius: f32) -> Option<usize> {
    let camera = buffer.camera();
    let ([cx, cy], [fx, fy]) = (camera.centre_px(), camera.focal_px());
    let (mut least, mut off) = (f32::INFINITY, false);
    for step in 0..STEPS {
        let along = ((step as f32 + 0.5) / STEPS as f32).powf(DISTRIBUTION) * radius;
        let place = camera.view_from_world().transform_point3a(point.origin + direction * along);
        let depth = -place.z;
        let px = camera.projected_px(1.0, depth);
        let (x, y) = ((cx + place.x * px * (fx / fy)).floor(), (cy - place.y * px).floor());
        let inside = |at: f32, side: usize| at >= 0.0 && at < side as f32;
        if depth <= camera.near() || !inside(x, buffer.width()) || !inside(y, buffer.height()) {
            off = true;
            break;
        }
        // Along the camera's ray, as a search measures it.
        let stretch = if camera.is_perspective() { place.length() / depth } else { 1.0 };
        for (layer, is_last) in [(0, buffer.second().is_none()), (1, true)] {
            if let Some(seen) = depth_of(buffer, layer, (x as usize, y as usize), place)
                && depth > seen * (1.0 + SLACK.0) + SLACK.1 * radius
            {
                let gap = (depth - seen) * stretch / radius;
                if is_last || gap < GAPS[0] {
                    least = least.min(gap);
                }
            }
        }
    }
    match (least.is_finite(), off) {
        // The last gap is beyond the radius.
        (true, _) => Some(1 + GAPS[..GAPS.len() - 1].iter().filter(|gap| least >= **gap).count()),
        (false, true) => Some(4),
        (false, false) => None,
    }
}

/// The depth of a layer at a pixel, on the camera's ray through a place (view space): that of the plane which the pixel shows. `None` on the
/// background, which hides nothing, and where there is no such layer.
fn depth_of(buffer: &GBuffer, layer: usize, (x, y): (usize, usize), place: Vec3A) -> Option<f32> {
    let i = y * buffer.width() + x;
    let (depth, normal) = match (layer, buffer.second()) {
        (0, _) => (buffer.depth()[i], Some(buffer.normal()[i])),
        (_, Some(second)) => (second.depth[i], second.normal.as_ref().map(|normal| normal[i])),
        (_, None) => return None,
    };
    if !depth.is_finite() {
        return None;
    }
    let camera = buffer.camera();
    let Some(normal) = normal.map(Vec3A::from).filter(|_| camera.is_perspective()) else {
        return Some(depth);
    };
    let share = normal.dot(camera.position_view(x, y, depth)) / normal.dot(place);
    let planar = share * -place.z;
    // A plane that is seen from its edge says nothing about the next pixel.
    Some(if (planar / depth - 1.0).abs() < 0.1 { planar } else { depth })
}
