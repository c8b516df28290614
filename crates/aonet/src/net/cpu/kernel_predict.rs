//! A few vectors of cells through the head. See [`crate::net::graph::Op::KernelPredict`]; AO-Net §3.3, Eq. 2.

use super::dot::Dot;
use super::guide_window::{GuideWindow, window_len, window_side};
use super::head_weights::{HeadWeights, Order, VECTORS};
use super::patch_merge::Cells;
use crate::net::config::KernelWeights;
use crate::net::kernel::{GUIDE_CHANNELS, TAPS, WINDOW};
use crate::net::plan::CHANNEL_BLOCK;
use crate::simd::Simd;

/// Weights of one row of a kernel.
const ROW_TAPS: usize = WINDOW * GUIDE_CHANNELS;

/// A vector of numbers.
type Vector<D> = <<D as Dot>::Simd as Simd>::F;

/// Neighbouring cells of a row.
pub(super) struct Tile<'a> {
    pub(super) weights: &'a HeadWeights,
    /// The row of the head's input.
    pub(super) features: &'a [f32],
    pub(super) guide: GuideWindow<'a>,
}

/// What the kernels of a tile are computed from and applied to: lines of one value for every cell.
#[derive(Clone, Copy)]
struct Seen<'a> {
    /// By word of channels.
    features: &'a [f32],
    /// By pixel of the window and component of its normal.
    window: &'a [f32],
}

impl Tile<'_> {
    /// Values of scratch memory for `cells` cells: features, window, kernels and values.
    pub(super) fn scratch_len(head: &HeadWeights, cells: usize) -> usize {
        (feature_lines(head) + window_len(head.patch) + TAPS + values_of(head)) * cells
    }

    /// The visibility of `N` vectors of cells.
    #[inline(always)]
    pub(super) fn run<'s, D: Dot, const N: usize>(&self, dot: D, scratch: &'s mut [f32]) -> Cells<'s> {
        match D::Simd::ACCUMULATORS / VECTORS {
            12 => self.run_grouped::<D, N, 12>(dot, scratch),
            6 => self.run_grouped::<D, N, 6>(dot, scratch),
            4 => self.run_grouped::<D, N, 4>(dot, scratch),
            n => unreachable!("groups of {n} outputs"),
        }
    }

    #[inline(always)]
    fn run_grouped<'s, D: Dot, const N: usize, const K: usize>(
        &self,
        dot: D,
        scratch: &'s mut [f32],
    ) -> Cells<'s> {
        let (cells, patch) = (N * D::Simd::LANES, self.weights.patch);
        let (features, rest) = scratch.split_at_mut(feature_lines(self.weights) * cells);
        let (window, rest) = rest.split_at_mut(window_len(patch) * cells);
        let (kernel, rest) = rest.split_at_mut(TAPS * cells);
        let values = &mut rest[..values_of(self.weights) * cells];
        self.weights.pack(dot, self.features, (self.guide.x, cells), features);
        match self.weights.kernel {
            KernelWeights::Off => {
                for (group, out) in values.chunks_mut(K * cells).enumerate() {
                    let outputs = self.outputs::<D, N, K>(dot, features, group);
                    for (values, out) in outputs.iter().zip(out.chunks_exact_mut(cells)) {
                        store(dot.simd(), *values, out);
                    }
                }
            }
            KernelWeights::Linear => {
                self.guide.copy_to(window, cells);
                for (pixel, out) in values.chunks_exact_mut(cells).enumerate() {
                    self.apply::<D, N, K>(dot, Seen { features, window }, pixel, out);
                }
            }
            KernelWeights::Softmax => {
                self.guide.copy_to(window, cells);
                for (pixel, out) in values.chunks_exact_mut(cells).enumerate() {
                    for (group, kernel) in kernel.chunks_exact_mut(K * cells).enumerate() {
                        let outputs = self.outputs::<D, N, K>(dot, features, pixel * (TAPS / K) + group);
                        for (values, out) in outputs.iter().zip(kernel.chunks_exact_mut(cells)) {
                            store(dot.simd(), *values, out);
                        }
                    }
                    self.apply_softmax(kernel, window, pixel, out);
                }
            }
        }
        Cells { values, order: Order::Cells, first: self.guide.x, count: cells, patch }
    }

    /// Group `group` of `K` outputs of the convolution.
    #[inline(always)]
    fn outputs<D: Dot, const N: usize, const K: usize>(
        &self,
        dot: D,
        features: &[f32],
        group: usize,
    ) -> [[Vector<D>; N]; K] {
        let (simd, lanes) = (dot.simd(), D::Simd::LANES);
        let words = self.weights.input.channels.div_ceil(D::PACKED);
        let mut sums = [[dot.zero(); N]; K];
        let weights = &self.weights.weights[group * K * words..][..K * words];
        for (weights, features) in weights.chunks_exact(K).zip(features.chunks_exact(N * lanes)) {
            let mut values = [dot.splat(0.0); N];
            for n in 0..N {
                values[n] = dot.load(&features[n * lanes..]);
            }
            for k in 0..K {
                let weight = dot.splat(weights[k]);
                for n in 0..N {
                    sums[k][n] = dot.add(values[n], weight, sums[k][n]);
                }
            }
        }
        let scales = &self.weights.scales[group * K..][..K];
        let biases = &self.weights.biases[group * K..][..K];
        let mut outputs = [[simd.splat(0.0); N]; K];
        for k in 0..K {
            let (scale, bias) = (simd.splat(scales[k]), simd.splat(biases[k]));
            for n in 0..N {
                outputs[k][n] = dot.finish(sums[k][n], scale, bias);
            }
        }
        outputs
    }

    /// Predicts the kernel of one pixel of the patch, part by part, and weighs the normals with it.
    #[inline(always)]
    fn apply<D: Dot, const N: usize, const K: usize>(
        &self,
        dot: D,
        seen: Seen<'_>,
        pixel: usize,
        out: &mut [f32],
    ) {
        let (simd, lanes, Seen { features, window }) = (dot.simd(), D::Simd::LANES, seen);
        let cells = N * lanes;
        // Four sums that do not wait for one another.
        let mut totals = [[simd.splat(0.0); N]; 4];
        for part in 0..TAPS / K {
            let kernel = self.outputs::<D, N, K>(dot, features, pixel * (TAPS / K) + part);
            let first = self.window_index(pixel, part * K);
            let normals = window[first * cells..][..K * cells].chunks_exact(cells);
            for (k, (weight, normal)) in kernel.iter().zip(normals).enumerate() {
                for n in 0..N {
                    let total = &mut totals[k % 4][n];
                    *total = simd.mul_add(weight[n], simd.load(&normal[n * lanes..]), *total);
                }
            }
        }
        let mean = simd.splat(1.0 / GUIDE_CHANNELS as f32);
        for (n, out) in out.chunks_exact_mut(lanes).enumerate() {
            let pairs = [simd.add(totals[0][n], totals[1][n]), simd.add(totals[2][n], totals[3][n])];
            simd.store(simd.mul(simd.add(pairs[0], pairs[1]), mean), out);
        }
    }

    /// Applies a kernel after a softmax over its taps, for each component of the normal.
    #[inline(always)]
    fn apply_softmax(&self, kernel: &[f32], window: &[f32], pixel: usize, out: &mut [f32]) {
        let cells = out.len();
        for (cell, out) in out.iter_mut().enumerate() {
            let mut mean = 0.0;
            for c in 0..GUIDE_CHANNELS {
                let of_component = || (c..TAPS).step_by(GUIDE_CHANNELS);
                let weight = |k: usize| kernel[k * cells + cell];
                let largest = of_component().map(weight).fold(f32::NEG_INFINITY, f32::max);
                let (mut total, mut weighted) = (0.0, 0.0);
                for k in of_component() {
                    let e = (weight(k) - largest).exp();
                    total += e;
                    weighted += e * window[self.window_index(pixel, k) * cells + cell];
                }
                mean += weighted / total;
            }
            *out = mean / GUIDE_CHANNELS as f32;
        }
    }

    /// Where the window holds what weight `k` of the kernel of a pixel of the patch belongs to. The
    /// weights of a row of the kernel lie side by side.
    #[inline(always)]
    fn window_index(&self, pixel: usize, k: usize) -> usize {
        let patch = self.weights.patch;
        let (dy, dx) = (pixel / patch + k / ROW_TAPS, pixel % patch);
        (dy * window_side(patch) + dx) * GUIDE_CHANNELS + k % ROW_TAPS
    }
}

/// Values of a cell.
fn values_of(head: &HeadWeights) -> usize {
    head.patch * head.patch * (head.planes + head.neighbours.len())
}

/// Channels of the head's input, whole blocks.
fn feature_lines(head: &HeadWeights) -> usize {
    head.input.channels.next_multiple_of(CHANNEL_BLOCK)
}

#[inline(always)]
fn store<S: Simd, const N: usize>(simd: S, values: [S::F; N], out: &mut [f32]) {
    for (value, out) in values.iter().zip(out.chunks_exact_mut(S::LANES)) {
        simd.store(*value, out);
    }
}
