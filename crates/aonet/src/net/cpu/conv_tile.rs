//! The inner loops of convolution: a few output pixels by a few vectors of output channels in registers.

use super::simd::Simd;
use crate::net::plan::HALO;
use std::ops::Range;

/// Most pixels in a tile.
pub(super) const MAX_PIXELS: usize = 12;

/// Three neighbouring rows of one input, edges repeated.
pub(super) struct Lines<'a> {
    /// Above, at, below.
    pub(super) rows: [&'a [f32]; 3],
    /// Those that are seen; the first is a multiple of the vector's length.
    pub(super) channels: Range<usize>,
    /// Planar rather than blocked.
    pub(super) planar: bool,
}

/// Where a tile reads and writes.
pub(super) struct Tile<'a> {
    pub(super) inputs: &'a [Lines<'a>],
    /// Of the tile's output channels: for every input channel in blocks, every tap, every channel of the block.
    pub(super) weights: &'a [f32],
    /// Of the tile's output channels.
    pub(super) bias: &'a [f32],
    /// Factor of negative results.
    pub(super) slope: f32,
    /// Side of the filter.
    pub(super) size: usize,
    /// Width of the image, without the halo.
    pub(super) width: usize,
}

impl Tile<'_> {
    /// Computes `pixels` pixels from `x` on of `N` blocks of a row. `out` starts at the first block's halo.
    #[inline(always)]
    pub(super) fn run<S: Simd, const N: usize>(&self, simd: S, out: &mut [f32], (x, pixels): (usize, usize)) {
        match pixels {
            1 if const { N <= S::ACCUMULATORS } => self.pixels::<S, N, 1>(simd, out, x),
            2 if const { 2 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 2>(simd, out, x),
            3 if const { 3 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 3>(simd, out, x),
            4 if const { 4 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 4>(simd, out, x),
            5 if const { 5 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 5>(simd, out, x),
            6 if const { 6 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 6>(simd, out, x),
            7 if const { 7 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 7>(simd, out, x),
            8 if const { 8 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 8>(simd, out, x),
            9 if const { 9 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 9>(simd, out, x),
            10 if const { 10 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 10>(simd, out, x),
            11 if const { 11 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 11>(simd, out, x),
            12 if const { 12 * N <= S::ACCUMULATORS } => self.pixels::<S, N, 12>(simd, out, x),
            _ => unreachable!("a tile of {pixels} pixels"),
        }
    }

    #[inline(always)]
    fn pixels<S: Simd, const N: usize, const P: usize>(&self, simd: S, out: &mut [f32], x: usize) {
        let mut sums = [[simd.splat(0.0); P]; N];
        for (n, sums) in sums.iter_mut().enumerate() {
            *sums = [simd.load(&self.bias[n * S::LANES..]); P];
        }
        let mut weights = self.weights;
        for lines in self.inputs {
            weights = match lines.planar {
                true => self.add_planar(simd, lines, (weights, x), &mut sums),
                false => self.add_blocked(simd, lines, (weights, x), &mut sums),
            };
        }
        let pitch = (self.width + 2 * HALO) * S::LANES;
        let slope = simd.splat(self.slope);
        for (n, sums) in sums.iter().enumerate() {
            let out = &mut out[n * pitch + (x + HALO) * S::LANES..][..P * S::LANES];
            for (sum, out) in sums.iter().zip(out.chunks_exact_mut(S::LANES)) {
                simd.store(simd.max(*sum, simd.mul(slope, *sum)), out);
            }
        }
    }

    #[inline(always)]
    fn add_blocked<'w, S: Simd, const N: usize, const P: usize>(
        &self,
        simd: S,
        lines: &Lines<'_>,
        (mut weights, x): (&'w [f32], usize),
        sums: &mut [[S::V; P]; N],
    ) -> &'w [f32] {
        let pitch = (self.width + 2 * HALO) * S::LANES;
        let skip = HALO - self.size / 2;
        for first in lines.channels.clone().step_by(S::LANES) {
            let count = (lines.channels.end - first).min(S::LANES);
            for row in &lines.rows[skip..3 - skip] {
                let line = &row[first / S::LANES * pitch..][..pitch];
                for kx in skip..3 - skip {
                    let pixels = &line[(x + kx) * S::LANES..][..P * S::LANES];
                    let (taps, rest) = weights.split_at(count * N * S::LANES);
                    for (c, taps) in taps.chunks_exact(N * S::LANES).enumerate().take(S::LANES) {
                        for p in 0..P {
                            let value = simd.splat(pixels[p * S::LANES + c]);
                            for n in 0..N {
                                sums[n][p] =
                                    simd.mul_add(value, simd.load(&taps[n * S::LANES..]), sums[n][p]);
                            }
                        }
                    }
                    weights = rest;
                }
            }
        }
        weights
    }

    #[inline(always)]
    fn add_planar<'w, S: Simd, const N: usize, const P: usize>(
        &self,
        simd: S,
        lines: &Lines<'_>,
        (mut weights, x): (&'w [f32], usize),
        sums: &mut [[S::V; P]; N],
    ) -> &'w [f32] {
        let pitch = self.width + 2 * HALO;
        let skip = HALO - self.size / 2;
        for row in &lines.rows[skip..3 - skip] {
            for kx in skip..3 - skip {
                let (taps, rest) = weights.split_at(lines.channels.end * N * S::LANES);
                for (taps, line) in taps.chunks_exact(N * S::LANES).zip(row.chunks_exact(pitch)) {
                    let pixels = &line[x + kx..][..P];
                    for p in 0..P {
                        let value = simd.splat(pixels[p]);
                        for n in 0..N {
                            sums[n][p] = simd.mul_add(value, simd.load(&taps[n * S::LANES..]), sums[n][p]);
                        }
                    }
                }
                weights = rest;
            }
        }
        weights
    }
}
