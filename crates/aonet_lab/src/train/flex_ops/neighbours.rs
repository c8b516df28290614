//! Kernel prediction: the values that a pixel's kernel weighs.

use super::{Values, floats};
use aonet::internals::kernel::{FIRST_TAP, GUIDE_CHANNELS, TAPS, WINDOW};

/// The neighbourhoods of a guide image, sorted so that pixels at the same position of their patches are adjacent.
pub(super) struct Neighbours {
    pub(super) batch: usize,
    pub(super) height: usize,
    pub(super) width: usize,
    pub(super) patch: usize,
    /// B x 3 x (H + 3) x patch x (W/patch + 1): column `x` of the padded guide is at (x % patch, x / patch).
    guide: Vec<f32>,
}

impl Neighbours {
    pub(super) fn new(kernels: &Values, guide: &Values) -> Self {
        let (cells, shape) = (kernels.layout().shape(), guide.layout().shape());
        let (batch, channels, height, width) = (shape[0], shape[1], shape[2], shape[3]);
        let patch = width / cells[3];
        let mut this = Self { batch, height, width, patch, guide: Vec::new() };
        let line = this.line();
        this.guide = vec![0.0; batch * GUIDE_CHANNELS * (height + WINDOW - 1) * patch * line];
        let lines = this.guide.chunks_exact_mut(patch * line).enumerate();
        let guide = floats(guide);
        for (i, out) in lines {
            let (plane, y) = (i / (height + WINDOW - 1), i % (height + WINDOW - 1));
            let plane = plane / GUIDE_CHANNELS * channels + plane % GUIDE_CHANNELS;
            let y = y.saturating_add_signed(FIRST_TAP).min(height - 1);
            let from = &guide[(plane * height + y) * width..][..width];
            for (k, value) in out.iter_mut().enumerate() {
                let x = k % line * patch + k / line;
                *value = from[x.saturating_add_signed(FIRST_TAP).min(width - 1)];
            }
        }
        this
    }

    pub(super) fn pixels(&self) -> usize {
        self.batch * self.height * self.width
    }

    /// Patches from top to bottom.
    pub(super) fn cells(&self) -> usize {
        self.height / self.patch
    }

    /// Patches from left to right.
    pub(super) fn row(&self) -> usize {
        self.width / self.patch
    }

    /// Floats from one remainder of a column to the next; a window reaches over at most WINDOW - 1 more columns.
    fn line(&self) -> usize {
        self.row() + (WINDOW - 1).div_ceil(self.patch)
    }

    /// Calls `visit` for every row of every kernel channel: where the row starts in the kernels, where the pixels
    /// that it weighs start in the image (`patch` apart), and the guide's values.
    fn each(&self, mut visit: impl FnMut(usize, usize, &[f32])) {
        let (p, cells, row, line) = (self.patch, self.cells(), self.row(), self.line());
        for item in 0..self.batch {
            for y in 0..cells {
                for pixel in 0..p * p {
                    let (dy, dx) = (pixel / p, pixel % p);
                    let to = (item * self.height + y * p + dy) * self.width + dx;
                    for tap in 0..TAPS {
                        let (component, tap_x) = (tap % GUIDE_CHANNELS, tap / GUIDE_CHANNELS % WINDOW);
                        let guide_y = y * p + dy + tap / GUIDE_CHANNELS / WINDOW;
                        let plane = item * GUIDE_CHANNELS + component;
                        let start = ((plane * (self.height + WINDOW - 1) + guide_y) * p + (dx + tap_x) % p)
                            * line
                            + (dx + tap_x) / p;
                        let kernel = ((item * p * p + pixel) * TAPS + tap) * cells + y;
                        visit(kernel * row, to, &self.guide[start..start + row]);
                    }
                }
            }
        }
    }

    pub(super) fn weigh(&self, kernels: &[f32], out: &mut [f32]) {
        let row = self.row();
        let mut sums = vec![0.0; row];
        let mut taps = 0;
        self.each(|kernel, to, guide| {
            let kernel = &kernels[kernel..kernel + row];
            for (sum, (k, g)) in sums.iter_mut().zip(kernel.iter().zip(guide)) {
                *sum += k * g;
            }
            taps += 1;
            if taps == TAPS {
                let pixels = out[to..].iter_mut().step_by(self.patch);
                pixels.zip(&sums).for_each(|(o, s)| *o = s / GUIDE_CHANNELS as f32);
                sums.fill(0.0);
                taps = 0;
            }
        });
    }

    /// The transpose of [`Self::weigh`].
    pub(super) fn spread(&self, slope: &[f32], out: &mut [f32]) {
        let row = self.row();
        let mut slopes = vec![0.0; row];
        let mut current = usize::MAX;
        self.each(|kernel, from, guide| {
            if current != from {
                let pixels = slope[from..].iter().step_by(self.patch);
                slopes.iter_mut().zip(pixels).for_each(|(t, s)| *t = s / GUIDE_CHANNELS as f32);
                current = from;
            }
            let out = &mut out[kernel..kernel + row];
            for (o, (s, g)) in out.iter_mut().zip(slopes.iter().zip(guide)) {
                *o = s * g;
            }
        });
    }
}
