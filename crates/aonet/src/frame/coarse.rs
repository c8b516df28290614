//! Depth that was rendered at a lower resolution: guard bands and second layers need less detail than the picture.

use crate::frame::size::Size;

/// Depths on a coarser grid than the frame's.
#[derive(Debug, Clone, Copy)]
pub struct CoarseDepth<'a> {
    /// HxW distances along -Z (world units), infinite where there is nothing.
    pub depth: &'a [f32],
    /// Columns and rows.
    pub size: Size,
    /// Pixels of the frame from one column, or row, to the next.
    pub scale: usize,
    /// Where the first column and row lie in the frame (px; whole numbers are centres of pixels). A frame rendered at one `scale`-th
    /// of the size has (`scale` - 1) / 2.
    pub first: f32,
}

/// Difference of neighbouring inverse depths, for each pixel between them, below which they are one surface. guess
const SAME_SURFACE: f32 = 0.04;

impl CoarseDepth<'_> {
    /// Depth at a pixel of the frame. On a surface, inverse depths are linear on the screen, so they are interpolated; where
    /// neighbours belong to different surfaces, the nearest one counts.
    ///
    /// # Panics
    /// When `depth` has another number of values than `size`.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        assert_eq!(self.depth.len(), self.size.pixels(), "values of a coarse depth");
        let (fx, fy) = (self.place(x), self.place(y));
        let inverse = |dx: f32, dy: f32| 1.0 / self.nearest(fx.floor() + dx, fy.floor() + dy);
        let [[a, b], [c, d]] = [0.0, 1.0].map(|dy| [0.0, 1.0].map(|dx| inverse(dx, dy)));
        let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        if low > 0.0 && high <= low * (1.0 + SAME_SURFACE * self.scale as f32) {
            let (tx, ty) = (fx - fx.floor(), fy - fy.floor());
            let line = |left: f32, right: f32| left + (right - left) * tx;
            return 1.0 / (line(a, b) + (line(c, d) - line(a, b)) * ty);
        }
        self.nearest((fx + 0.5).floor(), (fy + 0.5).floor())
    }

    /// Depths of a whole frame.
    pub fn upscaled(&self, frame: Size) -> Vec<f32> {
        (0..frame.pixels()).map(|i| self.at(i % frame.width(), i / frame.width())).collect()
    }

    /// A column or row of the frame in columns or rows of this grid.
    fn place(&self, pixel: usize) -> f32 {
        (pixel as f32 - self.first) / self.scale as f32
    }

    /// Depth at a whole column and row; beyond the border, that of the border.
    fn nearest(&self, x: f32, y: f32) -> f32 {
        let (x, y) = (x.max(0.0) as usize, y.max(0.0) as usize);
        self.depth[y.min(self.size.height() - 1) * self.size.width() + x.min(self.size.width() - 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_stay_planes_and_edges_stay_sharp() {
        let frame = Size::px(64, 48);
        for scale in [2usize, 4] {
            let size = Size::px(64 / scale, 48 / scale);
            let first = (scale as f32 - 1.0) / 2.0;
            // A slanted plane on the left, a farther one on the right, nothing at the bottom.
            let depth = |x: f32, y: f32| match (x < 31.5, y < 39.5) {
                (_, false) => f32::INFINITY,
                (true, true) => 1.0 / (0.2 + 0.001 * x + 0.0005 * y),
                (false, true) => 20.0,
            };
            let at = |i: usize, side: usize| (i % side) as f32 * scale as f32 + first;
            let coarse: Vec<_> = (0..size.pixels())
                .map(|i| depth(at(i, size.width()), at(i / size.width(), usize::MAX)))
                .collect();
            let found = CoarseDepth { depth: &coarse, size, scale, first }.upscaled(frame);
            for (i, found) in found.iter().enumerate() {
                let (x, y) = (i % 64, i / 64);
                let at_border = x.min(63 - x).min(y) < scale;
                let expected = depth(x as f32, y as f32);
                let same = *found == expected || (found - expected).abs() < 1e-3 * expected;
                let near_edge = x.abs_diff(32) < scale || y.abs_diff(40) < scale;
                assert!(same || at_border || near_edge, "{found}, not {expected}, at {x}, {y}");
                assert!(*found == f32::INFINITY || *found == 20.0 || *found < 5.0, "{found} at {x}, {y}");
            }
        }
    }
}
