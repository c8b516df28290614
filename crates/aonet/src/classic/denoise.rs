//! An edge-aware 5x5 filter: neighbours count as far as they lie on the pixel's plane and face its way.
// As XeGTAO's denoiser in purpose; that one finds edges by depth alone and is 3x3, repeated.

use super::lanes::{F, LANES, Mask};
use super::screen::Screen;
use crate::net::cpu::{Isa, Kernel, Simd};
use rayon::prelude::*;

/// What the filter does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Denoise {
    pub(crate) passes: u32,
    /// Distance from the pixel's plane at which a neighbour stops counting [share of the AO radius].
    pub(crate) plane: f32,
    /// Exponent on the cosine between the normals.
    pub(crate) normal: f32,
}

/// Pixels on each side.
const REACH: isize = 2;
/// Weights by distance: a Gaussian with a spread of 1.5 px. guess
const SPATIAL: [f32; 3] = [1.0, 0.8007, 0.4111];

/// Filters HxW visibility in place.
pub(crate) fn denoise(screen: &Screen<'_>, by: Denoise, visibility: &mut Vec<f32>, isa: Isa) {
    let (width, height) = screen.size();
    let mut result = vec![0.0; width * height];
    for _ in 0..by.passes {
        let rows = result.par_chunks_mut(width).enumerate();
        rows.for_each(|at| row(screen, by, visibility, at, isa));
        std::mem::swap(visibility, &mut result);
    }
}

/// One row (number and values) of the filtered visibility.
pub(crate) fn row(
    screen: &Screen<'_>,
    by: Denoise,
    visibility: &[f32],
    (y, line): (usize, &mut [f32]),
    isa: Isa,
) {
    isa.run(Row { screen, by, visibility, y, line });
}

struct Row<'a> {
    screen: &'a Screen<'a>,
    by: Denoise,
    visibility: &'a [f32],
    y: usize,
    line: &'a mut [f32],
}

impl Kernel for Row<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let y = self.y;
        for (i, out) in self.line.chunks_mut(LANES).enumerate() {
            let filtered = filtered((self.screen, self.by), self.visibility, (i * LANES, y));
            out.copy_from_slice(&filtered.0[..out.len()]);
        }
    }
}

#[inline(always)]
fn filtered((screen, by): (&Screen<'_>, Denoise), visibility: &[f32], (x, y): (usize, usize)) -> F {
    let p = screen.pixels(x, y);
    let tolerance = 1.0 / (by.plane * screen.radius);
    let (mut sum, mut weights) = (F::from(0.0), F::from(0.0));
    for dy in -REACH..=REACH {
        for dx in -REACH..=REACH {
            let tap = screen.tap(p.x + dx as f32, p.y + dy as f32);
            let away = (tap.position - p.position).dot(p.normal).abs();
            let facing = screen.normal(tap.index).dot(p.normal);
            let spatial = SPATIAL[dx.unsigned_abs()] * SPATIAL[dy.unsigned_abs()];
            let weight =
                (1.0 - away * tolerance).saturate() * super::gtao::power(facing.saturate(), by.normal);
            let counts: Mask = tap.inside;
            let weight = counts.select(weight * spatial, 0.0);
            sum += weight * gather(visibility, tap.index);
            weights += weight;
        }
    }
    let centre = gather(visibility, screen.tap(p.x, p.y).index);
    F::from(1e-6).lt(weights).select(sum / weights, centre)
}

#[inline(always)]
fn gather(values: &[f32], index: [u32; LANES]) -> F {
    let mut out = [0.0; LANES];
    for i in 0..LANES {
        out[i] = values[index[i] as usize];
    }
    F(out)
}
