//! The edge-aware 5x5 filter after a search, pixel by pixel in f64.

use super::Planes;
use super::search::Frame;

/// Pixels on each side.
const REACH: isize = 2;
/// Weights by distance along an axis: a Gaussian with a spread of 1.5 px.
const SPATIAL: [f64; 3] = [1.0, 0.8007, 0.4111];

/// One pass over 1xHxW visibility: neighbours count as far as they lie on the pixel's plane and face its way. `plane` is the
/// distance from it at which they stop to count (share of the AO radius), `facing` the exponent on the cosine between the
/// normals.
pub(super) fn filter(frame: &Frame<'_>, (plane, facing): (f32, f32), visibility: &Planes) -> Planes {
    let (width, height) = (frame.gbuffer.width() as isize, frame.gbuffer.height() as isize);
    let shows_geometry = |x: isize, y: isize| frame.gbuffer.is_foreground((y * width + x) as usize);
    let position = |x: isize, y: isize| {
        let (x, y) = (x as usize, y as usize);
        frame.lens.position(x, y, frame.depth(x, y))
    };
    Planes::from_fn((1, visibility.height, visibility.width), |_, y, x| {
        let normal = frame.normal(x, y);
        let (x, y) = (x as isize, y as isize);
        if !shows_geometry(x, y) {
            return 1.0;
        }
        let (mut sum, mut weights) = (0.0, 0.0);
        for (dy, dx) in (-REACH..=REACH).flat_map(|dy| (-REACH..=REACH).map(move |dx| (dy, dx))) {
            let (nx, ny) = (x + dx, y + dy);
            let inside = (0..width).contains(&nx) && (0..height).contains(&ny);
            if !inside || !shows_geometry(nx, ny) {
                continue;
            }
            let away = (position(nx, ny) - position(x, y)).dot(normal).abs();
            let on_plane = (1.0 - away / (f64::from(plane) * frame.radius)).max(0.0);
            let cosine = frame.normal(nx as usize, ny as usize).dot(normal).max(0.0);
            let spatial = SPATIAL[dx.unsigned_abs()] * SPATIAL[dy.unsigned_abs()];
            let weight = spatial * on_plane * cosine.powf(f64::from(facing));
            sum += weight * f64::from(visibility.at(0, ny, nx));
            weights += weight;
        }
        if weights > 1e-6 { (sum / weights) as f32 } else { visibility.at(0, y, x) }
    })
}
