//! Coarser depth for far taps: fewer cache misses, and a far tap stands for all that it covers.

use super::screen::{Screen, Tap};
use crate::error::Result;
use crate::frame::BACKGROUND;
use crate::frame::size::Size;
use crate::simd::aligned::Aligned;
use crate::simd::integers::Integer;
use crate::simd::lanes::F;
use crate::simd::{Isa, Kernel, Simd};
use crate::threads::Workers;
use std::f32::consts::SQRT_2;

/// Levels of the pyramid at most: the frame itself and four coarser ones, as in XeGTAO.
const LEVELS: usize = 5;

/// Depth at full, half, quarter, ... resolution.
#[derive(Debug)]
pub(crate) struct Pyramid {
    /// Levels below each other, with rows as long as the frame's. Empty if the frame itself is the only level.
    depth: Aligned,
    /// Rows of the finest level, padded so that the rows of every coarser level are an integer.
    rows: usize,
    /// Number of coarser levels.
    coarser: usize,
    /// Taps up to so many pixels away read the frame itself; every level doubles it.
    near: f32,
}

/// Which depths count in a coarse cell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Range {
    /// Depth difference from the farthest one beyond which nearer surfaces do not count (world units).
    pub(crate) reach: f32,
    /// The part of it over which they fade.
    pub(crate) soft: f32,
}

impl Pyramid {
    /// Memory for `count` levels, the frame's own included, of frames of one size; taps farther than
    /// two to the power of `offset` (px) read coarser levels.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn new(size: Size, count: u32, offset: f32) -> Result<Self> {
        let coarser = (count as usize).clamp(1, LEVELS) - 1;
        let rows = size.height().next_multiple_of(1 << LEVELS);
        let len = if coarser == 0 { 0 } else { 2 * rows * size.width() };
        // Compared instead of a logarithm.
        Ok(Self { depth: Aligned::zeros(len)?, rows, coarser, near: offset.exp2() * SQRT_2 })
    }

    /// Number of values.
    pub(crate) fn len(&self) -> usize {
        self.depth.len()
    }

    /// Computes the levels of a frame of this size.
    pub(crate) fn fill(&mut self, screen: &Screen<'_>, range: Range, isa: Isa, workers: &mut Workers) {
        if self.coarser == 0 {
            return;
        }
        let (width, height) = (screen.size().width(), screen.size().height());
        let frame = screen.gbuffer().depth();
        workers.for_each_band(&mut self.depth[..height * width], width, |band| {
            let lines = band.values.iter_mut().zip(&frame[band.first * width..]);
            lines.for_each(|(to, depth)| *to = depth.min(BACKGROUND));
        });
        let soft = range.soft.max(1e-3) * range.reach;
        for level in 0..self.coarser {
            let size = (width.div_ceil(1 << level), height.div_ceil(1 << level));
            let (start, next) = (self.start(level) * width, self.start(level + 1) * width);
            let (finer, above) = self.depth.split_at_mut(next);
            let finer = &finer[start..];
            workers.for_each_band(&mut above[..size.1.div_ceil(2) * width], width, |band| {
                for (i, line) in band.values.chunks_exact_mut(width).enumerate() {
                    let y = 2 * (band.first + i);
                    let pair = [y, (y + 1).min(size.1 - 1)].map(|y| &finer[y * width..][..size.0]);
                    isa.run_on_pixels(Coarser {
                        pair,
                        line: &mut line[..size.0.div_ceil(2)],
                        reach: range.reach,
                        soft,
                    });
                }
            });
        }
    }

    /// First row of a level: each takes half as many as the one before.
    fn start(&self, level: usize) -> usize {
        2 * self.rows - ((2 * self.rows) >> level)
    }

    /// The cell nearest to a place on the screen that is `pixels` away.
    #[inline(always)]
    pub(crate) fn tap<S: Simd>(&self, screen: &Screen<'_>, place: (F<S>, F<S>), pixels: F<S>) -> Tap<S> {
        if self.coarser == 0 {
            return screen.tap(place);
        }
        let ([column, row], inside) = screen.nearest(place);
        // The exponent of a number in [1/2, 1) is 126 with its bias.
        let ratio = (pixels * (1.0 / self.near)).max(0.5).min((1 << (self.coarser - 1)) as f32);
        let level = (ratio.bits() >> 23) - 126;
        let (column, row) = (column >> level, row >> level);
        let start = 2 * self.rows as u32;
        let first = start.integer_lanes(level.simd());
        let index = (first - (first >> level) + row) * screen.size().width() as u32 + column;
        let side = ((level + 127) << 23).float_of_bits();
        // Half a cell less half a pixel.
        let middle = side.mul_add(0.5, -0.5);
        let (x, y) = (column.float().mul_add(side, middle), row.float().mul_add(side, middle));
        Tap { position: screen.position(x, y, index.gather(&self.depth)), place: (x, y), index, inside }
    }
}

/// A row of a level from two of the finer one.
// Intel's XeGTAO 1.30, `XeGTAO_DepthMIPFilter`: a mean of four depths that prefers the farthest.
struct Coarser<'a> {
    pair: [&'a [f32]; 2],
    line: &'a mut [f32],
    reach: f32,
    soft: f32,
}

impl Kernel for Coarser<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let last = self.pair[0].len() - 1;
        for (i, out) in self.line.chunks_mut(S::LANES).enumerate() {
            let x = F::counting_from(simd, (i * S::LANES) as f32) * 2.0;
            let (left, right) = (x.index(last), (x + 1.0).index(last));
            let [above, below] = self.pair;
            let four = [left.gather(above), right.gather(above), left.gather(below), right.gather(below)];
            let farthest = four[0].max(four[1]).max(four[2].max(four[3]));
            let (mut sum, mut weights) = (F::new(simd, 0.0), F::new(simd, 0.0));
            for depth in four {
                let weight = ((self.reach - (farthest - depth)) * (1.0 / self.soft)).saturate();
                sum = depth.mul_add(weight, sum);
                weights += weight;
            }
            (sum / weights).store(out);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::ao_image::AoParams;
    use crate::frame::camera::{Camera, Projection};
    use crate::frame::gbuffer::GBuffer;
    use crate::frame::size::Size;
    use crate::simd::{Level, Portable};

    /// 20x12 pixels whose depth is 4 and a hundredth for every column and row.
    fn slope() -> GBuffer<'static> {
        let projection = Projection::Orthographic { height: 12.0 };
        let camera = Camera::new(projection, Size::px(20, 12)).unwrap();
        let depth = (0..240).map(|i| 4.0 + (i % 20 + i / 20) as f32 * 0.01).collect::<Vec<_>>();
        GBuffer::new(camera, depth, vec![[0.0, 0.0, 1.0]; 240]).unwrap()
    }

    #[test]
    fn far_taps_see_the_middle_of_their_cell() {
        let frame = slope();
        let screen = Screen::new(&frame, AoParams::new(1.0).unwrap());
        for level in Level::available() {
            // Nothing is too near to count: cells are plain means.
            let mut pyramid = Pyramid::new(screen.size(), 3, 2.0).unwrap();
            let range = Range { reach: 1e3, soft: 1.0 };
            pyramid.fill(&screen, range, Isa::new(level).unwrap(), &mut Workers::new(2, 0).unwrap());
            for (pixels, side) in [(5.6, 1), (5.7, 2), (11.3, 2), (11.4, 4), (1e6, 4)] {
                let [x, y, away] = [9.0, 7.0, pixels].map(|v| F::new(Portable, v));
                let tap = pyramid.tap(&screen, (x, y), away);
                let middle = |v: usize| (v / side * side) as f32 + 0.5 * (side - 1) as f32;
                let found = [tap.position.x, tap.position.y, tap.position.z].map(|v| v.array()[3]);
                let expected = [middle(9) - 9.5, 5.5 - middle(7), -4.0 - (middle(9) + middle(7)) * 0.01];
                for c in 0..3 {
                    assert!(
                        (found[c] - expected[c]).abs() < 1e-5,
                        "{level:?} {pixels}: {found:?} {expected:?}"
                    );
                }
            }
            let outside =
                pyramid.tap(&screen, (F::new(Portable, 20.0), F::new(Portable, 3.0)), F::new(Portable, 99.0));
            assert_eq!(outside.inside.select(1.0, 0.0).array()[0], 0.0);
        }
    }
}
