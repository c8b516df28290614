//! Coarser depth for far taps: fewer cache misses, and a far tap stands for all that it covers.

use super::lanes::{F, LANES};
use super::screen::{BACKGROUND, Screen, Tap};
use std::f32::consts::SQRT_2;

/// Levels of the pyramid at most: the frame itself and four coarser ones, as in XeGTAO.
const LEVELS: usize = 5;

/// Depth at full, half, quarter, ... resolution.
#[derive(Debug)]
pub(crate) struct Pyramid {
    levels: Vec<Level>,
    /// Level 0 has taps up to 2^`offset` pixels away.
    offset: f32,
}

#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    depth: Vec<f32>,
}

impl Pyramid {
    /// Levels above the frame's own; `range` [world units] is the depth difference beyond which near surfaces do not
    /// count in a coarse cell, and `soft` the part of it over which they fade.
    // Intel's XeGTAO 1.30, `XeGTAO_DepthMIPFilter`: a mean of four depths that prefers the farthest.
    pub(crate) fn new(screen: &Screen<'_>, (count, offset): (u32, f32), (range, soft): (f32, f32)) -> Self {
        let mut levels: Vec<Level> = Vec::new();
        for _ in 1..(count as usize).clamp(1, LEVELS) {
            let finer = levels.last().map_or_else(
                || (screen.size().0, screen.size().1, screen.gbuffer().depth()),
                |l| (l.width, l.height, l.depth.as_slice()),
            );
            levels.push(Level::above(finer, (range, soft.max(1e-3) * range)));
        }
        Self { levels, offset }
    }

    /// The cell nearest to a place on the screen that is `pixels` away.
    #[inline(always)]
    pub(crate) fn tap(&self, screen: &Screen<'_>, (x, y): (F, F), pixels: F) -> Tap {
        let mut tap = screen.tap(x, y);
        if self.levels.is_empty() {
            return tap;
        }
        // Compared instead of a logarithm.
        let near = self.offset.exp2() * SQRT_2;
        if pixels.le(near).all() {
            return tap;
        }
        let (mut cx, mut cy, mut depth) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let (width, height) = screen.size();
        let (columns, rows) = (x.index(width - 1), y.index(height - 1));
        for i in 0..LANES {
            let mut limit = near;
            let mut level = 0;
            while level < self.levels.len() && pixels.0[i] > limit {
                level += 1;
                limit *= 2.0;
            }
            let (column, row) = (columns[i] as usize >> level, rows[i] as usize >> level);
            let side = (1 << level) as f32;
            (cx[i], cy[i]) = ((column as f32 + 0.5) * side - 0.5, (row as f32 + 0.5) * side - 0.5);
            depth[i] = match level.checked_sub(1).map(|l| &self.levels[l]) {
                None => screen.gbuffer().depth()[row * width + column],
                Some(l) => l.depth[row.min(l.height - 1) * l.width + column.min(l.width - 1)],
            };
        }
        tap.position = screen.position(F(cx), F(cy), F(depth).min(BACKGROUND));
        tap
    }
}

impl Level {
    fn above((width, height, depth): (usize, usize, &[f32]), (range, soft): (f32, f32)) -> Self {
        let (w, h) = (width.div_ceil(2), height.div_ceil(2));
        let cell = |i: usize| {
            let (x, y) = (i % w * 2, i / w * 2);
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| {
                depth[(y + dy).min(height - 1) * width + (x + dx).min(width - 1)].min(BACKGROUND)
            });
            let farthest = four.into_iter().fold(0.0, f32::max);
            let weight = |d: f32| ((range - (farthest - d)) / soft).clamp(0.0, 1.0);
            let sum: f32 = four.iter().map(|d| weight(*d)).sum();
            four.iter().map(|d| weight(*d) / sum * d).sum()
        };
        Self { width: w, height: h, depth: (0..w * h).map(cell).collect() }
    }
}
