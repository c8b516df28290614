//! The edge-aware 5x5 filter after a search, pixel by pixel in f64.

use super::Planes;
use super::screen::Screen;
use crate::search::{Denoise, Pass};

/// Pixels on each side.
const REACH: isize = 2;
/// Weights by distance along an axis: a Gaussian with a spread of 1.5 px.
const SPATIAL: [f64; 3] = [1.0, 0.8007, 0.4111];

/// One pass over visibility and shares of light: neighbours count as far as they lie on the pixel's plane and face its way.
/// [`Pass::Correct`] returns both planes of which it is the sum.
pub(super) fn filter(screen: &Screen<'_>, (by, pass): (Denoise, Pass), found: &Planes) -> Planes {
    let (width, height) = (screen.gbuffer.width() as isize, screen.gbuffer.height() as isize);
    let shows_geometry = |x: isize, y: isize| screen.gbuffer.is_foreground((y * width + x) as usize);
    let position = |x: isize, y: isize| {
        let (x, y) = (x as usize, y as usize);
        screen.lens.position(x, y, screen.depth(x, y))
    };
    Planes::from_fn((found.channels, found.height, found.width), |c, y, x| {
        let normal = screen.normal(x, y);
        let (x, y) = (x as isize, y as isize);
        if !shows_geometry(x, y) {
            return if c == 0 { 1.0 } else { 0.0 };
        }
        let (mut sum, mut weights) = (0.0, 0.0);
        for (dy, dx) in (-REACH..=REACH).flat_map(|dy| (-REACH..=REACH).map(move |dx| (dy, dx))) {
            let (nx, ny) = (x + dx, y + dy);
            let inside = (0..width).contains(&nx) && (0..height).contains(&ny);
            if !inside || !shows_geometry(nx, ny) {
                continue;
            }
            let away = (position(nx, ny) - position(x, y)).dot(normal).abs();
            let on_plane = (1.0 - away / (f64::from(by.plane) * screen.radius)).max(0.0);
            let cosine = screen.normal(nx as usize, ny as usize).dot(normal).max(0.0);
            let spatial = SPATIAL[dx.unsigned_abs()] * SPATIAL[dy.unsigned_abs()];
            let weight = spatial * on_plane * cosine.powf(f64::from(by.normal));
            sum += weight * f64::from(found.at(c, ny, nx));
            weights += weight;
        }
        let own = f64::from(found.at(c, y, x));
        let mean = if weights > 1e-6 { sum / weights } else { own };
        let keep = f64::from(match pass {
            Pass::Smooth => 0.0,
            Pass::Correct { .. } if c > 0 => 0.0,
            Pass::Settle { keep } | Pass::Correct { keep } => keep,
        });
        let stays = if keep > 0.0 { ((own - mean).abs() / keep).min(1.0).powi(2) } else { 0.0 };
        (mean + stays * (own - mean)) as f32
    })
}
