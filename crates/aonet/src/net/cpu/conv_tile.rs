//! The inner loops of convolution: a few output pixels by a few vectors of output channels in registers.

use super::conv_weights::Group;
use super::dot::Dot;
use crate::net::plan::HALO;
use crate::simd::Simd;
use std::ops::Range;

/// Numbers of pixels, or squares, that there are tiles for: every one of them is code of its own.
const TILE_LENS: [usize; 6] = [12, 8, 6, 4, 2, 1];

/// How many of `left` pixels the next tile of `vectors` vectors takes.
#[inline(always)]
pub(super) fn tile_len<D: Dot>(vectors: usize, left: usize) -> usize {
    let most = left.min(D::Simd::ACCUMULATORS / vectors);
    let mut lens = TILE_LENS.into_iter().filter(|len| *len <= most);
    lens.next().expect("a tile of one pixel")
}

/// Three neighbouring rows of one input, edges repeated.
pub(super) struct Lines<'a> {
    /// Above, at, below; in blocks of packed words.
    pub(super) rows: [&'a [f32]; 3],
    /// Those that are seen; the first is a multiple of the vector's length.
    pub(super) channels: Range<usize>,
}

/// Where a tile reads and writes.
pub(super) struct Tile<'a> {
    pub(super) inputs: &'a [Lines<'a>],
    pub(super) group: &'a Group,
    /// Factor of negative results.
    pub(super) slope: f32,
    /// Side of the filter.
    pub(super) size: usize,
    /// Width of the image, without the halo.
    pub(super) width: usize,
}

impl Tile<'_> {
    /// Computes a row of `N` blocks. `out` starts at the first block's halo.
    #[inline(always)]
    pub(super) fn row<D: Dot, const N: usize>(&self, dot: D, out: &mut [f32]) {
        let mut x = 0;
        while x < self.width {
            let pixels = tile_len::<D>(N, self.width - x);
            match pixels {
                12 if const { 12 * N <= D::Simd::ACCUMULATORS } => self.pixels::<D, N, 12>(dot, out, x),
                8 if const { 8 * N <= D::Simd::ACCUMULATORS } => self.pixels::<D, N, 8>(dot, out, x),
                6 if const { 6 * N <= D::Simd::ACCUMULATORS } => self.pixels::<D, N, 6>(dot, out, x),
                4 => self.pixels::<D, N, 4>(dot, out, x),
                2 => self.pixels::<D, N, 2>(dot, out, x),
                1 => self.pixels::<D, N, 1>(dot, out, x),
                _ => unreachable!("a tile of {pixels} pixels"),
            }
            x += pixels;
        }
    }

    #[inline(always)]
    fn pixels<D: Dot, const N: usize, const P: usize>(&self, dot: D, out: &mut [f32], x: usize) {
        let (simd, lanes) = (dot.simd(), D::Simd::LANES);
        let mut sums = [[dot.zero(); P]; N];
        let mut weights = &*self.group.weights;
        for lines in self.inputs {
            weights = self.add(dot, lines, weights, x, &mut sums);
        }
        let pitch = (self.width + 2 * HALO) * lanes;
        let slope = simd.splat(self.slope);
        for (n, sums) in sums.into_iter().enumerate() {
            let scale = simd.load(&self.group.scale[n * lanes..]);
            let bias = simd.load(&self.group.bias[n * lanes..]);
            let out = &mut out[n * pitch + (x + HALO) * lanes..][..P * lanes];
            for (sum, out) in sums.into_iter().zip(out.chunks_exact_mut(lanes)) {
                let value = dot.finish(sum, scale, bias);
                simd.store(simd.max(value, simd.mul(slope, value)), out);
            }
        }
    }

    #[inline(always)]
    fn add<'w, D: Dot, const N: usize, const P: usize>(
        &self,
        dot: D,
        lines: &Lines<'_>,
        mut weights: &'w [f32],
        x: usize,
        sums: &mut [[D::Sums; P]; N],
    ) -> &'w [f32] {
        let (lanes, words) = (D::Simd::LANES, D::Simd::LANES / D::PACKED);
        let pitch = (self.width + 2 * HALO) * words;
        let skip = HALO - self.size / 2;
        for first in lines.channels.clone().step_by(lanes) {
            let count = (lines.channels.end - first).min(lanes).div_ceil(D::PACKED);
            for row in &lines.rows[skip..3 - skip] {
                let line = &row[first / lanes * pitch..][..pitch];
                for kx in skip..3 - skip {
                    let pixels = &line[(x + kx) * words..][..P * words];
                    let (taps, rest) = weights.split_at(count * N * lanes);
                    for (c, taps) in taps.chunks_exact(N * lanes).enumerate().take(words) {
                        for p in 0..P {
                            let value = dot.splat(pixels[p * words + c]);
                            for n in 0..N {
                                sums[n][p] = dot.add(value, dot.load(&taps[n * lanes..]), sums[n][p]);
                            }
                        }
                    }
                    weights = rest;
                }
            }
        }
        weights
    }
}
