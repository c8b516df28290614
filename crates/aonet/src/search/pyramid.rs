//! Coarser depth for far taps: fewer cache misses, and a far tap stands for all that it covers.

use super::screen::{Screen, Tap};
use crate::frame::BACKGROUND;
use crate::simd::integers::Whole;
use crate::simd::lanes::{F, LANES};
use crate::simd::{Isa, Kernel, Simd, Wide};
use rayon::prelude::*;
use std::f32::consts::SQRT_2;

/// Levels of the pyramid at most: the frame itself and four coarser ones, as in XeGTAO.
const LEVELS: usize = 5;

/// Depth at full, half, quarter, ... resolution.
#[derive(Debug)]
pub(crate) struct Pyramid {
    /// Levels below each other, with rows as long as the frame's. Nothing if the frame itself is the only one.
    depth: Vec<f32>,
    /// Rows of the finest level, with those that make the coarser levels' whole numbers.
    rows: usize,
    /// Coarser levels.
    coarser: usize,
    /// The frame itself has taps up to so many pixels away; every level doubles it.
    near: f32,
}

impl Pyramid {
    /// Levels above the frame's own; `range` (world units) is the depth difference beyond which near surfaces do not
    /// count in a coarse cell, and `soft` the part of it over which they fade.
    pub(crate) fn new(
        screen: &Screen<'_>,
        (count, offset): (u32, f32),
        (range, soft): (f32, f32),
        isa: Isa,
    ) -> Self {
        let coarser = (count as usize).clamp(1, LEVELS) - 1;
        let (width, height) = (screen.size().width(), screen.size().height());
        let rows = height.next_multiple_of(1 << LEVELS);
        // Compared instead of a logarithm.
        let mut pyramid = Self { depth: Vec::new(), rows, coarser, near: offset.exp2() * SQRT_2 };
        if coarser == 0 {
            return pyramid;
        }
        let mut depth = vec![0.0; 2 * rows * width];
        let lines = depth.par_chunks_mut(width).zip(screen.gbuffer().depth().par_chunks(width));
        lines.for_each(|(to, from)| {
            to.iter_mut().zip(from).for_each(|(to, depth)| *to = depth.min(BACKGROUND))
        });
        for level in 0..coarser {
            let size = (width.div_ceil(1 << level), height.div_ceil(1 << level));
            let (finer, above) = depth.split_at_mut(pyramid.start(level + 1) * width);
            let finer = &finer[pyramid.start(level) * width..];
            above.par_chunks_mut(width).take(size.1.div_ceil(2)).enumerate().for_each(|(y, line)| {
                let pair = [2 * y, (2 * y + 1).min(size.1 - 1)].map(|y| &finer[y * width..][..size.0]);
                isa.run(Coarser {
                    pair,
                    line: &mut line[..size.0.div_ceil(2)],
                    range,
                    soft: soft.max(1e-3) * range,
                });
            });
        }
        pyramid.depth = depth;
        pyramid
    }

    /// First row of a level: each takes half as many as the one before.
    fn start(&self, level: usize) -> usize {
        2 * self.rows - ((2 * self.rows) >> level)
    }

    /// The cell nearest to a place on the screen that is `pixels` away.
    #[inline(always)]
    pub(crate) fn tap<S: Wide>(&self, screen: &Screen<'_>, place: (F<S>, F<S>), pixels: F<S>) -> Tap<S> {
        if self.coarser == 0 {
            return screen.tap(place);
        }
        let ([column, row], inside) = screen.nearest(place);
        // The exponent of a number in [1/2, 1) is 126 with its bias.
        let ratio = (pixels * (1.0 / self.near)).max(0.5).min((1 << (self.coarser - 1)) as f32);
        let level = (ratio.bits() >> 23) - 126;
        let (column, row) = (column >> level, row >> level);
        let start = 2 * self.rows as u32;
        let first = start.whole_lanes(level.simd());
        let index = (first - (first >> level) + row) * screen.size().width() as u32 + column;
        let side = ((level + 127) << 23).float_of_bits();
        // Half a cell less half a pixel.
        let middle = side.mul_add(0.5, -0.5);
        let (x, y) = (column.float().mul_add(side, middle), row.float().mul_add(side, middle));
        Tap { position: screen.position(x, y, index.gather(&self.depth)), index, inside }
    }
}

/// A row of a level from two of the finer one.
// Intel's XeGTAO 1.30, `XeGTAO_DepthMIPFilter`: a mean of four depths that prefers the farthest.
struct Coarser<'a> {
    pair: [&'a [f32]; 2],
    line: &'a mut [f32],
    range: f32,
    soft: f32,
}

impl Kernel for Coarser<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let last = self.pair[0].len() - 1;
        for (i, out) in self.line.chunks_mut(LANES).enumerate() {
            let x = F::counting_from(simd.wide(), (i * LANES) as f32) * 2.0;
            let (left, right) = (x.index(last), (x + 1.0).index(last));
            let [above, below] = self.pair;
            let four = [left.gather(above), right.gather(above), left.gather(below), right.gather(below)];
            let farthest = four[0].max(four[1]).max(four[2].max(four[3]));
            let (mut sum, mut weights) = (F::new(simd.wide(), 0.0), F::new(simd.wide(), 0.0));
            for depth in four {
                let weight = ((self.range - (farthest - depth)) * (1.0 / self.soft)).saturate();
                sum = depth.mul_add(weight, sum);
                weights += weight;
            }
            out.copy_from_slice(&(sum / weights).array()[..out.len()]);
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
            let pyramid = Pyramid::new(&screen, (3, 2.0), (1e3, 1.0), Isa::new(level).unwrap());
            for (pixels, side) in [(5.6, 1), (5.7, 2), (11.3, 2), (11.4, 4), (1e6, 4)] {
                let [x, y, away] = [9.0, 7.0, pixels].map(|v| F::new(Portable, v));
                let tap = pyramid.tap(&screen, (x, y), away);
                let middle = |v: usize| (v / side * side) as f32 + 0.5 * (side - 1) as f32;
                let found = [tap.position.x, tap.position.y, tap.position.z].map(|v| v.array()[5]);
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
