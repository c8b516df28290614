//! An edge-aware 5x5 filter: neighbours count as far as they lie on the pixel's plane and face its way.
// As XeGTAO's denoiser in purpose; that one finds edges by depth alone and is 3x3, repeated.

use super::bent::{BENT_PLANES, BENT_SHARES};
use super::cubic::{Power, Raise};
use super::screen::{Pixels, Screen};
use super::shares::PLANES;
use crate::simd::lanes::F;
use crate::simd::vector::V3;
use crate::simd::{Isa, Kernel, PIXEL_LANES, Simd};

/// What the filter does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Denoise {
    pub(crate) passes: u32,
    /// Distance from the pixel's plane at which a neighbour stops counting (share of the AO radius).
    pub(crate) plane: f32,
    /// Exponent on the cosine between the normals.
    pub(crate) normal: f32,
    /// If above 0, a last pass settles the result: differences from the neighbours' mean that are smaller shrink.
    pub(crate) keep: f32,
}

impl Denoise {
    /// All passes, the one that settles included.
    pub(crate) fn passes(self) -> impl Iterator<Item = Pass> {
        let settling = (self.keep > 0.0).then_some(Pass::Settle { keep: self.keep });
        (0..self.passes).map(|_| Pass::Smooth).chain(settling)
    }
}

/// What a pass does with the weighted mean of a pixel and its neighbours.
///
/// What is left of a search's noise after a pass are small differences, which a second mean removes; but a second mean blurs shadows
/// beside contacts. So a pass that settles keeps a difference `d` from the mean times min(|d| / keep, 1)².
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pass {
    /// Takes the mean.
    Smooth,
    /// Keeps large differences from it.
    Settle {
        /// Differences of this size and more stay as they are.
        keep: f32,
    },
    /// Of two planes, settles the first, takes the mean of the second, and writes their sum, in [0, 1], as one plane.
    Correct {
        /// As in [`Pass::Settle`].
        keep: f32,
    },
}

impl Pass {
    /// Least differences that stay in the first plane, and in the others; 0 for the mean.
    pub(crate) const fn keeps(self) -> [f32; 2] {
        match self {
            Self::Smooth => [0.0, 0.0],
            Self::Settle { keep } => [keep, keep],
            Self::Correct { keep } => [keep, 0.0],
        }
    }
}

/// [`Pass::Settle`] and [`Pass::Correct`] of networks.
pub(crate) const KEEP: f32 = 0.02;

/// Pixels on each side.
pub(crate) const REACH: usize = 2;
/// Rows, and columns, of the filter.
const ROWS: usize = 2 * REACH + 1;
/// Weights by distance: a Gaussian with a spread of 1.5 px. guess
pub(crate) const SPATIAL: [f32; 3] = [1.0, 0.8007, 0.4111];

/// One pass of the filter over the visibility of a frame.
pub(crate) struct Filter<'a> {
    screen: &'a Screen<'a>,
    by: Denoise,
    pass: Pass,
    input: Input<'a>,
    /// Number of planes: 1, 2, [`BENT_PLANES`], [`PLANES`] or [`BENT_SHARES`].
    count: usize,
}

/// What a filter reads, images of the frame's size.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Input<'a> {
    /// Row by row, plane by plane; the first plane is a visibility.
    Planes(&'a [f32]),
    /// Two planes, for [`Pass::Correct`]: what a search found, the first of its planes, and what was added to that in the corrected image.
    Corrected { found: &'a [f32], image: &'a [f32] },
}

impl<'a> Filter<'a> {
    pub(crate) fn new(screen: &'a Screen<'a>, by: Denoise, pass: Pass, input: Input<'a>) -> Self {
        let count = match input {
            Input::Planes(planes) => planes.len() / screen.size().pixels(),
            Input::Corrected { .. } => 2,
        };
        Self { screen, by, pass, input, count }
    }

    /// Row `y` of each plane; of a corrected image the last is the image itself.
    #[inline(always)]
    fn rows<const N: usize>(&self, y: usize) -> [&'a [f32]; N] {
        let width = self.screen.size().width();
        std::array::from_fn(|c| match self.input {
            Input::Planes(planes) => &planes[(y * N + c) * width..][..width],
            Input::Corrected { found, .. } if c == 0 => {
                &found[y * (found.len() / self.screen.size().height())..][..width]
            }
            Input::Corrected { image, .. } => &image[y * width..][..width],
        })
    }

    /// Number of planes that a pass writes.
    fn written(&self) -> usize {
        if matches!(self.pass, Pass::Correct { .. }) { 1 } else { self.count }
    }

    /// Writes consecutive rows of the filtered planes, from row `first` on. The background is 1, and 0 in the planes after the first.
    /// Allocates nothing.
    pub(crate) fn run(&self, isa: Isa, first: usize, rows: &mut [f32]) {
        match self.count {
            1 => isa.run_on_pixels(FilteredRows::<1> { filter: self, first, rows }),
            2 => isa.run_on_pixels(FilteredRows::<2> { filter: self, first, rows }),
            BENT_PLANES => isa.run_on_pixels(FilteredRows::<BENT_PLANES> { filter: self, first, rows }),
            PLANES => isa.run_on_pixels(FilteredRows::<PLANES> { filter: self, first, rows }),
            BENT_SHARES => isa.run_on_pixels(FilteredRows::<BENT_SHARES> { filter: self, first, rows }),
            count => unreachable!("no search reports {count} values for a pixel"),
        }
    }
}

struct FilteredRows<'a, const N: usize> {
    filter: &'a Filter<'a>,
    first: usize,
    /// Row by row, plane by plane.
    rows: &'a mut [f32],
}

/// Pixels that share what they read of their neighbours.
const TILE: usize = 128;
/// Values for a row of them, whole vectors.
const COLUMNS: usize = TILE + PIXEL_LANES;

/// Five rows of a tile and of what is beside it, from the column [`REACH`] to the left of it on. Row `y` of the frame, plus [`REACH`],
/// is in slot `y % ROWS`, so that the next row takes the place of the first one.
#[repr(align(64))]
struct Neighbours<const N: usize> {
    /// Infinite outside the frame and on the background.
    depth: [[f32; COLUMNS]; ROWS],
    normal: [[[f32; COLUMNS]; 3]; ROWS],
    planes: [[[f32; COLUMNS]; N]; ROWS],
}

impl<const N: usize> Kernel for FilteredRows<'_, N> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let FilteredRows { filter, first, rows } = self;
        let width = filter.screen.size().width();
        let mut seen = Neighbours {
            depth: [[0.0; COLUMNS]; ROWS],
            normal: [[[0.0; COLUMNS]; 3]; ROWS],
            planes: [[[0.0; COLUMNS]; N]; ROWS],
        };
        let weights = Weights::new(filter.by, filter.screen.radius);
        for x in (0..width).step_by(TILE) {
            let pixels = TILE.min(width - x);
            let columns = (pixels + 2 * REACH).next_multiple_of(S::LANES);
            for y in first..first + ROWS - 1 {
                seen.fill(simd, filter, Span { x, y, columns });
            }
            for (i, lines) in rows.chunks_exact_mut(width * filter.written()).enumerate() {
                let y = first + i;
                seen.fill(simd, filter, Span { x, y: y + ROWS - 1, columns });
                for from in (0..pixels).step_by(S::LANES) {
                    let p = filter.screen.pixels(simd, x + from, y);
                    let mut values = filter.values(&p, &weights, &seen, [from, y]);
                    if matches!(filter.pass, Pass::Correct { .. }) {
                        let (first, rest) = values.split_first_mut().expect("planes to add");
                        for added in rest {
                            *first += *added;
                        }
                        *first = first.saturate();
                    }
                    let shown = load(simd, &seen.depth[(y + REACH) % ROWS], from + REACH).lt(f32::INFINITY);
                    let to = pixels.min(from + S::LANES);
                    for (c, values) in values[..filter.written()].iter().enumerate() {
                        let values = shown.select(*values, if c == 0 { 1.0 } else { 0.0 });
                        values.store(&mut lines[c * width + x + from..c * width + x + to]);
                    }
                }
            }
        }
    }
}

/// Consecutive pixels of a row of the frame.
#[derive(Clone, Copy)]
struct Span {
    /// The first pixel, plus [`REACH`]: it may lie outside the frame.
    x: usize,
    y: usize,
    columns: usize,
}

impl<const N: usize> Neighbours<N> {
    /// Fills a row's slot.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, filter: &Filter<'_>, span: Span) {
        let (screen, Span { x, y, columns }) = (filter.screen, span);
        let row = y % ROWS;
        let (width, height) = (screen.size().width(), screen.size().height());
        let inside = y >= REACH && y < height + REACH;
        let y = y.saturating_sub(REACH).min(height - 1);
        let depth = screen.row(screen.gbuffer().depth(), y);
        let normal = screen.row(screen.gbuffer().normal(), y);
        let planes: [&[f32]; N] = filter.rows(y);
        let added = matches!(filter.input, Input::Corrected { .. });
        for to in (0..columns).step_by(S::LANES) {
            if !inside || x + to < REACH || x + to + S::LANES > width + REACH {
                for i in to..to + S::LANES {
                    let found = (x + i).wrapping_sub(REACH);
                    let at = (x + i).saturating_sub(REACH).min(width - 1);
                    self.depth[row][i] = if inside && found == at { depth[at] } else { f32::INFINITY };
                    (0..3).for_each(|c| self.normal[row][c][i] = normal[at][c]);
                    (0..N).for_each(|c| self.planes[row][c][i] = planes[c][at]);
                    if added {
                        self.planes[row][N - 1][i] -= planes[0][at];
                    }
                }
                continue;
            }
            let from = x + to - REACH..x + to - REACH + S::LANES;
            self.depth[row][to..to + S::LANES].copy_from_slice(&depth[from.clone()]);
            for (c, plane) in planes.iter().enumerate() {
                let values = F::load(simd, &plane[from.clone()]);
                let values =
                    if added && c > 0 { values - F::load(simd, &planes[0][from.clone()]) } else { values };
                values.store(&mut self.planes[row][c][to..]);
            }
            let normal = V3::from_triples(simd, &normal[from]);
            for (c, values) in [normal.x, normal.y, normal.z].into_iter().enumerate() {
                values.store(&mut self.normal[row][c][to..]);
            }
        }
    }
}

/// What the weights of neighbours depend on.
struct Weights {
    facing: Power,
    /// For each neighbour, row by row: the most that it weighs, by its distance on the screen, and how much of that it loses for each
    /// world unit from the pixel's plane.
    rows: [[[f32; ROWS]; 2]; ROWS],
}

impl Weights {
    fn new(by: Denoise, radius: f32) -> Self {
        let tolerance = 1.0 / (by.plane * radius);
        let rows = std::array::from_fn(|dy| {
            let most = SPATIAL.map(|weight| weight * SPATIAL[dy.abs_diff(REACH)]);
            let most: [f32; ROWS] = std::array::from_fn(|dx| most[dx.abs_diff(REACH)]);
            [most, most.map(|weight| -tolerance * weight)]
        });
        Self { facing: Power::new(by.normal), rows }
    }
}

impl Filter<'_> {
    /// The filtered values of pixels of row `y` whose neighbours begin at column `x` of `seen`.
    #[inline(always)]
    fn values<S: Simd, const N: usize>(
        &self,
        p: &Pixels<S>,
        by: &Weights,
        seen: &Neighbours<N>,
        at: [usize; 2],
    ) -> [F<S>; N] {
        // Each with its own registers: the logarithms of low powers need many.
        match by.facing {
            Power::Low(exponent) => self.values_by(p, (exponent, by), seen, at),
            Power::High(power) => self.values_by(p, (power, by), seen, at),
        }
    }

    /// The same with what raises cosines between normals to their power.
    #[inline(always)]
    fn values_by<S: Simd, const N: usize>(
        &self,
        p: &Pixels<S>,
        (facing_by, by): (impl Raise, &Weights),
        seen: &Neighbours<N>,
        [x, y]: [usize; 2],
    ) -> [F<S>; N] {
        let (screen, simd) = (self.screen, p.x.simd());
        let depth = -p.position.z;
        // From pixel to pixel on the screen, positions move by their size and by their difference in depth along the ray:
        // so does the distance from the plane.
        let size = screen.pixel_size(depth);
        let slope = screen.pixel_size_line()[0];
        let (across, down) = (p.normal.x * (size * screen.aspect), -p.normal.y * size);
        let (ray_across, ray_down) = (p.normal.x * (slope * screen.aspect), -p.normal.y * slope);
        let ray = screen.along_ray(p);
        let zero = F::new(simd, 0.0);
        let (mut sums, mut weights) = ([zero; N], zero);
        for (dy, [most, loss]) in by.rows.iter().enumerate() {
            let step_y = dy as f32 - REACH as f32;
            let (row, row_ray) = (down * step_y, ray_down.mul_add(step_y, ray));
            let slot = (y + dy) % ROWS;
            let [nx, ny, nz] = &seen.normal[slot];
            let mut facing = [zero; ROWS];
            for (dx, facing) in facing.iter_mut().enumerate() {
                let at = x + dx;
                let normal = V3 { x: load(simd, nx, at), y: load(simd, ny, at), z: load(simd, nz, at) };
                *facing = normal.dot(p.normal).max(0.0);
            }
            facing_by.raise(&mut facing);
            for dx in 0..ROWS {
                let step_x = dx as f32 - REACH as f32;
                let deeper = load(simd, &seen.depth[slot], x + dx) - depth;
                let beside = across.mul_add(step_x, row);
                let away = deeper.mul_add(ray_across.mul_add(step_x, row_ray), beside).abs();
                let weight = away.mul_add(loss[dx], most[dx]).max(0.0) * facing[dx];
                for (sum, plane) in sums.iter_mut().zip(&seen.planes[slot]) {
                    *sum = load(simd, plane, x + dx).mul_add(weight, *sum);
                }
                weights += weight;
            }
        }
        self.weighed((sums, weights), &seen.planes[(y + REACH) % ROWS], x + REACH)
    }

    /// What the pass makes of weighted sums over neighbours, the sum of the weights, and the pixels' own values, from column `x` on.
    #[inline(always)]
    fn weighed<S: Simd, const N: usize>(
        &self,
        (mut sums, weights): ([F<S>; N], F<S>),
        own: &[[f32; COLUMNS]; N],
        x: usize,
    ) -> [F<S>; N] {
        let (alone, inverse) = (weights.le(1e-6), 1.0 / weights);
        let [first, others] = self.pass.keeps();
        for (c, (sum, own)) in sums.iter_mut().zip(own).enumerate() {
            let own = load(weights.simd(), own, x);
            let mean = alone.select(own, *sum * inverse);
            let keep = if c == 0 { first } else { others };
            *sum = if keep > 0.0 { settled(own, mean, keep) } else { mean };
        }
        sums
    }
}

/// A pixel's own value, as far as it differs from the mean: see [`Pass`].
#[inline(always)]
fn settled<S: Simd>(own: F<S>, mean: F<S>, keep: f32) -> F<S> {
    let difference = own - mean;
    let stays = (difference.abs() * (1.0 / keep)).min(1.0);
    difference.mul_add(stays * stays, mean)
}

#[inline(always)]
fn load<S: Simd>(simd: S, row: &[f32; COLUMNS], x: usize) -> F<S> {
    F::load(simd, &row[x..])
}

#[cfg(test)]
mod tests;
