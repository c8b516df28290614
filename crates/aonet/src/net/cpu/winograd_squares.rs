//! A few squares of a row on their way through Winograd's convolution: factors, products, outputs.

use super::conv_tile::tile_len;
use super::dot::Dot;
use super::winograd_transforms::{IN, OUT, PRODUCTS, input, output};
use super::winograd_weights::Group;
use crate::net::plan::{CHANNEL_BLOCK, HALO};
use crate::simd::Simd;
use std::ops::Range;

/// Six neighbouring rows of one input, edges repeated.
pub(super) type Lines<'a> = [&'a [f32]; IN];

/// Neighbouring squares of a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Squares {
    /// Index of the first square.
    pub(super) first: usize,
    pub(super) count: usize,
    /// Width of the row (px).
    pub(super) width: usize,
}

/// How products become a blocked image.
pub(super) struct Outputs<'a> {
    /// Their biases are added.
    pub(super) groups: &'a [Group],
    /// Factor of negative results.
    pub(super) slope: f32,
    /// Values in a row of the image.
    pub(super) row_len: usize,
}

/// Inputs at the points: by product, block of channels, square, channel.
pub(super) struct Factors<'a> {
    values: &'a mut [f32],
    rest: &'a mut [f32],
    /// Channels of every block.
    block_channels: &'a [usize],
    squares: Squares,
    /// From product to product: not a power of two, for the caches' sake.
    pitch: usize,
}

impl<'a> Factors<'a> {
    /// Factors of inputs in blocks of these channels, in memory that is long enough.
    pub(super) fn new<D: Dot>(scratch: &'a mut [f32], block_channels: &'a [usize], squares: Squares) -> Self {
        let pitch = block_channels.len() * squares.count * (D::Simd::LANES / D::PACKED) + CHANNEL_BLOCK;
        let (values, rest) = scratch.split_at_mut(PRODUCTS * pitch);
        Self { values, rest, block_channels, squares, pitch }
    }

    /// Transforms an input, whose blocks become `blocks` of all blocks.
    #[inline(always)]
    pub(super) fn fill<D: Dot>(&mut self, dot: D, lines: &Lines<'_>, blocks: Range<usize>) {
        let Squares { first, count, width } = self.squares;
        let pitch = (width + 2 * HALO) * D::Simd::LANES;
        for (i, block) in blocks.enumerate() {
            let line = |y: usize| &lines[y][i * pitch..][..pitch];
            let lines = [line(0), line(1), line(2), line(3), line(4), line(5)];
            for square in 0..count {
                let to = (block * count + square) * (D::Simd::LANES / D::PACKED);
                self.square(dot, &lines, (first + square) * OUT, to);
            }
        }
    }

    #[inline(always)]
    fn square<D: Dot>(&mut self, dot: D, lines: &Lines<'_>, x: usize, to: usize) {
        let (simd, lanes) = (dot.simd(), D::Simd::LANES);
        let last = lines[0].len() - lanes;
        let mut columns = [[simd.splat(0.0); IN]; IN];
        for (i, column) in columns.iter_mut().enumerate() {
            // Beyond the image only outputs are computed that nobody sees.
            let at = ((x + i) * lanes).min(last);
            let line = |y: usize| simd.load(&lines[y][at..]);
            *column = input(simd, [line(0), line(1), line(2), line(3), line(4), line(5)]);
        }
        for (y, factors) in self.values.chunks_exact_mut(IN * self.pitch).enumerate() {
            let of = |x: usize| columns[x][y];
            let row = input(simd, [of(0), of(1), of(2), of(3), of(4), of(5)]);
            for (value, factors) in row.into_iter().zip(factors.chunks_exact_mut(self.pitch)) {
                dot.pack(value, &[], &[], &mut factors[to..]);
            }
        }
    }

    /// Room for the products of the same squares with `vectors` vectors of output channels.
    pub(super) fn then_products<D: Dot>(self, vectors: usize) -> (Self, Products<'a>) {
        let Self { values, rest, block_channels, squares, pitch } = self;
        let products_pitch = vectors * squares.count * D::Simd::LANES + CHANNEL_BLOCK;
        let products =
            Products { values: &mut rest[..PRODUCTS * products_pitch], squares, pitch: products_pitch };
        (Self { values, rest: &mut [], block_channels, squares, pitch }, products)
    }
}

/// Sums over the input channels: by product, vector of output channels, square, channel.
pub(super) struct Products<'a> {
    values: &'a mut [f32],
    squares: Squares,
    pitch: usize,
}

impl Products<'_> {
    /// Multiplies the factors with the weights of a group of outputs, whose first vector is number `first_vector`.
    #[inline(always)]
    pub(super) fn fill<D: Dot>(&mut self, dot: D, factors: &Factors<'_>, group: &Group, first_vector: usize) {
        let (squares, block_channels) = (self.squares.count, factors.block_channels);
        let weights_len = group.weights.len() / PRODUCTS;
        let products =
            self.values.chunks_exact_mut(self.pitch).zip(factors.values.chunks_exact(factors.pitch));
        for ((sums, factors), weights) in products.zip(group.weights.chunks_exact(weights_len)) {
            let sums = &mut sums[first_vector * squares * D::Simd::LANES..];
            let product = Product { factors, weights, block_channels, squares };
            match group.vectors {
                1 => product.run::<D, 1>(dot, sums),
                2 => product.run::<D, 2>(dot, sums),
                3 if const { D::Simd::ACCUMULATORS >= 24 } => product.run::<D, 3>(dot, sums),
                n => unreachable!("a group of {n} vectors"),
            }
        }
    }

    /// Writes the outputs of the squares to `rows` of a blocked image.
    #[inline(always)]
    pub(super) fn write<S: Simd>(&self, simd: S, outputs: &Outputs<'_>, rows: &mut [f32]) {
        let Squares { first, count, width } = self.squares;
        let pitch = (width + 2 * HALO) * S::LANES;
        let slope = simd.splat(outputs.slope);
        let biases = outputs.groups.iter().flat_map(|group| group.bias.chunks_exact(S::LANES));
        for (vector, bias) in biases.enumerate() {
            let bias = simd.load(bias);
            for square in 0..count {
                let from = (vector * count + square) * S::LANES;
                let x = (first + square) * OUT;
                let pixels = (width - x).min(OUT);
                let values = self.square(simd, from);
                for (row, out) in values.iter().zip(rows.chunks_exact_mut(outputs.row_len)) {
                    let out = &mut out[vector * pitch + (x + HALO) * S::LANES..][..pixels * S::LANES];
                    for (value, out) in row.iter().zip(out.chunks_exact_mut(S::LANES)) {
                        let value = simd.add(*value, bias);
                        simd.store(simd.max(value, simd.mul(slope, value)), out);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn square<S: Simd>(&self, simd: S, from: usize) -> [[S::F; OUT]; OUT] {
        let mut columns = [[simd.splat(0.0); OUT]; IN];
        for (x, column) in columns.iter_mut().enumerate() {
            let at = |y: usize| simd.load(&self.values[(y * IN + x) * self.pitch + from..]);
            *column = output(simd, [at(0), at(1), at(2), at(3), at(4), at(5)]);
        }
        let mut rows = [[simd.splat(0.0); OUT]; OUT];
        for (y, row) in rows.iter_mut().enumerate() {
            let of = |x: usize| columns[x][y];
            *row = output(simd, [of(0), of(1), of(2), of(3), of(4), of(5)]);
        }
        rows
    }
}

/// One of the matrix multiplications.
struct Product<'a> {
    factors: &'a [f32],
    weights: &'a [f32],
    block_channels: &'a [usize],
    squares: usize,
}

impl Product<'_> {
    #[inline(always)]
    fn run<D: Dot, const N: usize>(&self, dot: D, sums: &mut [f32]) {
        let mut first = 0;
        while first < self.squares {
            let squares = tile_len::<D>(N, self.squares - first);
            match squares {
                12 if const { 12 * N <= D::Simd::ACCUMULATORS } => self.squares::<D, N, 12>(dot, first, sums),
                8 if const { 8 * N <= D::Simd::ACCUMULATORS } => self.squares::<D, N, 8>(dot, first, sums),
                6 if const { 6 * N <= D::Simd::ACCUMULATORS } => self.squares::<D, N, 6>(dot, first, sums),
                4 => self.squares::<D, N, 4>(dot, first, sums),
                2 => self.squares::<D, N, 2>(dot, first, sums),
                1 => self.squares::<D, N, 1>(dot, first, sums),
                n => unreachable!("{n} squares in registers"),
            }
            first += squares;
        }
    }

    #[inline(always)]
    fn squares<D: Dot, const N: usize, const P: usize>(&self, dot: D, first: usize, out: &mut [f32]) {
        let (simd, lanes, words) = (dot.simd(), D::Simd::LANES, D::Simd::LANES / D::PACKED);
        let mut sums = [[dot.zero(); P]; N];
        let mut weights = self.weights;
        let blocks = self.factors.chunks_exact(self.squares * words);
        for (block, channels) in blocks.zip(self.block_channels) {
            let squares = &block[first * words..][..P * words];
            let (now, rest) = weights.split_at(channels.div_ceil(D::PACKED) * N * lanes);
            for (c, weights) in now.chunks_exact(N * lanes).enumerate().take(words) {
                for p in 0..P {
                    let value = dot.splat(squares[p * words + c]);
                    for n in 0..N {
                        sums[n][p] = dot.add(value, dot.load(&weights[n * lanes..]), sums[n][p]);
                    }
                }
            }
            weights = rest;
        }
        let (one, zero) = (simd.splat(1.0), simd.splat(0.0));
        for (n, sums) in sums.into_iter().enumerate() {
            let out = &mut out[(n * self.squares + first) * lanes..][..P * lanes];
            for (sum, out) in sums.into_iter().zip(out.chunks_exact_mut(lanes)) {
                simd.store(dot.finish(sum, one, zero), out);
            }
        }
    }
}
