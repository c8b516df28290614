//! A few vectors of cells through the head. See [`crate::net::Op::KernelPredict`]; AO-Net §3.3, Eq. 2.

use super::head::{Head, VECTORS};
use super::simd::Simd;
use crate::net::config::KernelWeights;
use crate::net::graph::{FIRST_TAP, GUIDE_CHANNELS, TAPS, WINDOW};
use crate::net::plan::{Buffer, HALO};

/// Weights of one row of a kernel.
const ROW_TAPS: usize = WINDOW * GUIDE_CHANNELS;

/// Neighbouring cells of a row.
pub(super) struct Tile<'a> {
    pub(super) head: &'a Head,
    /// The row of the head's input.
    pub(super) features: &'a [f32],
    /// The whole guide.
    pub(super) guide: &'a [f32],
    /// Row of cells.
    pub(super) y: usize,
    /// First cell.
    pub(super) x: usize,
}

impl Tile<'_> {
    /// Values of scratch memory for `cells` cells: features, window, kernels and visibility.
    pub(super) fn scratch_len(head: &Head, cells: usize) -> usize {
        (head.input.channels + window_len(head) + TAPS + head.patch * head.patch) * cells
    }

    /// The visibility of `N` vectors of cells, pixel of the patch by pixel, and the number of cells.
    #[inline(always)]
    pub(super) fn run<'s, S: Simd, const N: usize>(
        &self,
        simd: S,
        scratch: &'s mut [f32],
    ) -> (&'s [f32], usize) {
        match S::ACCUMULATORS / VECTORS {
            12 => self.run_grouped::<S, N, 12>(simd, scratch),
            6 => self.run_grouped::<S, N, 6>(simd, scratch),
            4 => self.run_grouped::<S, N, 4>(simd, scratch),
            n => unreachable!("groups of {n} outputs"),
        }
    }

    #[inline(always)]
    fn run_grouped<'s, S: Simd, const N: usize, const K: usize>(
        &self,
        simd: S,
        scratch: &'s mut [f32],
    ) -> (&'s [f32], usize) {
        let cells = N * S::LANES;
        let (features, rest) = scratch.split_at_mut(self.head.input.channels * cells);
        let (window, rest) = rest.split_at_mut(window_len(self.head) * cells);
        let (kernel, rest) = rest.split_at_mut(TAPS * cells);
        let visibility = &mut rest[..self.head.patch * self.head.patch * cells];
        self.transpose_features::<S>(features, cells);
        match self.head.kernel {
            KernelWeights::Off => {
                for (group, out) in visibility.chunks_mut(K * cells).enumerate() {
                    let outputs = self.outputs::<S, N, K>(simd, features, group);
                    for (values, out) in outputs.iter().zip(out.chunks_exact_mut(cells)) {
                        store(simd, *values, out);
                    }
                }
            }
            KernelWeights::Linear => {
                self.fill_window(window, cells);
                for (pixel, out) in visibility.chunks_exact_mut(cells).enumerate() {
                    self.apply::<S, N, K>(simd, (features, window), (pixel, out));
                }
            }
            KernelWeights::Softmax => {
                self.fill_window(window, cells);
                for (pixel, out) in visibility.chunks_exact_mut(cells).enumerate() {
                    for (group, kernel) in kernel.chunks_exact_mut(K * cells).enumerate() {
                        let outputs = self.outputs::<S, N, K>(simd, features, pixel * (TAPS / K) + group);
                        for (values, out) in outputs.iter().zip(kernel.chunks_exact_mut(cells)) {
                            store(simd, *values, out);
                        }
                    }
                    self.apply_softmax((kernel, window), (pixel, out));
                }
            }
        }
        (visibility, cells)
    }

    /// Group `group` of `K` outputs of the convolution.
    #[inline(always)]
    fn outputs<S: Simd, const N: usize, const K: usize>(
        &self,
        simd: S,
        features: &[f32],
        group: usize,
    ) -> [[S::V; N]; K] {
        let channels = self.head.input.channels;
        let mut sums = [[simd.splat(0.0); N]; K];
        for (sums, bias) in sums.iter_mut().zip(&self.head.bias[group * K..]) {
            *sums = [simd.splat(*bias); N];
        }
        let weights = &self.head.weights[group * K * channels..][..K * channels];
        for (weights, features) in weights.chunks_exact(K).zip(features.chunks_exact(N * S::LANES)) {
            let mut values = [simd.splat(0.0); N];
            for n in 0..N {
                values[n] = simd.load(&features[n * S::LANES..]);
            }
            for k in 0..K {
                let weight = simd.splat(weights[k]);
                for n in 0..N {
                    sums[k][n] = simd.mul_add(weight, values[n], sums[k][n]);
                }
            }
        }
        sums
    }

    /// Predicts the kernel of one pixel of the patch, part by part, and weighs the normals with it.
    #[inline(always)]
    fn apply<S: Simd, const N: usize, const K: usize>(
        &self,
        simd: S,
        (features, window): (&[f32], &[f32]),
        (pixel, out): (usize, &mut [f32]),
    ) {
        let cells = N * S::LANES;
        let mut total = [simd.splat(0.0); N];
        for part in 0..TAPS / K {
            let kernel = self.outputs::<S, N, K>(simd, features, pixel * (TAPS / K) + part);
            let first = self.window_index(pixel, part * K);
            let normals = window[first * cells..][..K * cells].chunks_exact(cells);
            for (weight, normal) in kernel.iter().zip(normals) {
                for n in 0..N {
                    total[n] = simd.mul_add(weight[n], simd.load(&normal[n * S::LANES..]), total[n]);
                }
            }
        }
        let mean = simd.splat(1.0 / GUIDE_CHANNELS as f32);
        store(simd, total.map(|t| simd.mul(t, mean)), out);
    }

    /// Applies a kernel after a softmax over its taps, for each component of the normal.
    #[inline(always)]
    fn apply_softmax(&self, (kernel, window): (&[f32], &[f32]), (pixel, out): (usize, &mut [f32])) {
        let cells = out.len();
        for (cell, out) in out.iter_mut().enumerate() {
            let mut mean = 0.0;
            for c in 0..GUIDE_CHANNELS {
                let of_component = || (c..TAPS).step_by(GUIDE_CHANNELS);
                let weight = |k: usize| kernel[k * cells + cell];
                let largest = of_component().map(weight).fold(f32::NEG_INFINITY, f32::max);
                let (mut total, mut weighed) = (0.0, 0.0);
                for k in of_component() {
                    let e = (weight(k) - largest).exp();
                    total += e;
                    weighed += e * window[self.window_index(pixel, k) * cells + cell];
                }
                mean += weighed / total;
            }
            *out = mean / GUIDE_CHANNELS as f32;
        }
    }

    /// Where the window holds the normal that weight `k` of the kernel of a pixel of the patch belongs to. The
    /// weights of a row of the kernel lie side by side.
    #[inline(always)]
    fn window_index(&self, pixel: usize, k: usize) -> usize {
        let patch = self.head.patch;
        let (dy, dx) = (pixel / patch + k / ROW_TAPS, pixel % patch);
        (dy * window_side(patch) + dx) * GUIDE_CHANNELS + k % ROW_TAPS
    }

    /// Features of the cells, channel by channel; cells beyond the image repeat the last one.
    #[inline(always)]
    fn transpose_features<S: Simd>(&self, out: &mut [f32], cells: usize) {
        let width = self.head.input.width;
        let blocks = self.features.chunks_exact((width + 2 * HALO) * S::LANES);
        for (block, out) in blocks.zip(out.chunks_mut(S::LANES * cells)) {
            for cell in 0..cells {
                let x = (self.x + cell).min(width - 1);
                let pixel = &block[(x + HALO) * S::LANES..][..S::LANES];
                for (value, line) in pixel.iter().zip(out.chunks_exact_mut(cells)) {
                    line[cell] = *value;
                }
            }
        }
    }

    /// Normals of the window of each cell: every pixel that a kernel of the patch reaches, edges repeated.
    #[inline(always)]
    fn fill_window(&self, out: &mut [f32], cells: usize) {
        let Buffer { width, height, .. } = self.head.guide;
        let (patch, pitch) = (self.head.patch, width + 2 * HALO);
        let side = window_side(patch);
        let clamped = |cell: usize, offset: usize, len: usize| {
            let position = (cell * patch + offset) as isize + FIRST_TAP;
            position.clamp(0, (len * patch) as isize - 1) as usize
        };
        for (i, out) in out.chunks_exact_mut(cells).enumerate() {
            let (c, dx, dy) = (i % GUIDE_CHANNELS, i / GUIDE_CHANNELS % side, i / GUIDE_CHANNELS / side);
            let y = clamped(self.y, dy, height);
            let line = |dx: usize| {
                let channel = (c * patch + y % patch) * patch + dx;
                &self.guide[y / patch * self.head.guide.row_len() + channel * pitch + HALO..][..width]
            };
            let x = clamped(self.x, dx, width);
            let inside = self.x * patch + dx >= FIRST_TAP.unsigned_abs() && x / patch + cells <= width;
            if inside {
                out.copy_from_slice(&line(x % patch)[x / patch..][..cells]);
                continue;
            }
            for (cell, out) in out.iter_mut().enumerate() {
                let x = clamped(self.x + cell, dx, width);
                *out = line(x % patch)[x / patch];
            }
        }
    }
}

/// Side of the square of pixels that the kernels of one patch reach.
fn window_side(patch: usize) -> usize {
    patch + WINDOW - 1
}

/// Values of that square.
fn window_len(head: &Head) -> usize {
    window_side(head.patch) * window_side(head.patch) * GUIDE_CHANNELS
}

#[inline(always)]
fn store<S: Simd, const N: usize>(simd: S, values: [S::V; N], out: &mut [f32]) {
    for (value, out) in values.iter().zip(out.chunks_exact_mut(S::LANES)) {
        simd.store(*value, out);
    }
}
