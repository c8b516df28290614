//! Convolution without unfolding, for narrow images: the sums of a few outputs over a few vectors of neighbouring pixels
//! stay in registers.

use super::bordered::{Beyond, Bordered, Rows};
use super::convolution::Wanted;
use aonet::internals::simd::{Isa, Kernel, Simd};
use std::ops::Range;

/// Side of the filter.
pub(super) const SIZE: usize = 3;
const TAPS: usize = SIZE * SIZE;
/// Most outputs in registers at a time.
const TILE: usize = 8;
/// Most lanes of a vector.
const LANES: usize = 16;

/// The numbers from 0 to `count` in ranges whose lengths are powers of two, at most `most`.
fn tiles(count: usize, most: usize) -> impl Iterator<Item = Range<usize>> {
    let next = move |range: &Range<usize>| {
        let left = count - range.end;
        (left > 0).then(|| range.end..range.end + (1 << left.min(most).ilog2()))
    };
    std::iter::successors(Some(0..0), next).skip(1)
}

/// One row of a few outputs.
struct Row<'a> {
    /// Rows of the first input from the first tap's on.
    source: &'a [f32],
    bordered: &'a Bordered,
    rows: usize,
    /// By input, tap and output.
    weights: &'a [f32],
    bias: &'a [f32],
    /// Factor of negative results.
    slope: f32,
    width: usize,
    /// A row of every output, `bordered.stride` apart.
    out: &'a mut [f32],
}

impl Kernel for Row<'_> {
    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        match self.bias.len() {
            1 => self.blocks::<S, 1, 8>(simd),
            2 => self.blocks::<S, 2, 4>(simd),
            4 => self.blocks::<S, 4, 2>(simd),
            // Two vectors per output would fit the registers of AVX-512, and took twice the time.
            TILE => self.blocks::<S, TILE, 1>(simd),
            outputs => unreachable!("a tile of {outputs} outputs"),
        }
    }
}

impl Row<'_> {
    #[inline(always)]
    fn blocks<S: Simd, const O: usize, const V: usize>(&mut self, simd: S) {
        let end = self.width.next_multiple_of(S::LANES);
        let mut x = 0;
        while x + V * S::LANES <= end {
            self.block::<S, O, V>(simd, x);
            x += V * S::LANES;
        }
        while x < end {
            self.block::<S, O, 1>(simd, x);
            x += S::LANES;
        }
    }

    #[inline(always)]
    fn block<S: Simd, const O: usize, const V: usize>(&mut self, simd: S, x: usize) {
        let mut sums = [[simd.splat(0.0); V]; O];
        for (sums, bias) in sums.iter_mut().zip(self.bias) {
            *sums = [simd.splat(*bias); V];
        }
        let stride = self.bordered.stride;
        for (input, weights) in self.weights.chunks_exact(TAPS * O).enumerate() {
            for (ty, weights) in weights.chunks_exact(SIZE * O).enumerate() {
                let from = (input * self.rows + ty) * stride + x;
                let line = &self.source[from..from + V * S::LANES + SIZE - 1];
                for (tx, weights) in weights.chunks_exact(O).enumerate() {
                    let mut pixels = [simd.splat(0.0); V];
                    for v in 0..V {
                        pixels[v] = simd.load(&line[tx + v * S::LANES..]);
                    }
                    for o in 0..O {
                        let weight = simd.splat(weights[o]);
                        for v in 0..V {
                            sums[o][v] = simd.mul_add(weight, pixels[v], sums[o][v]);
                        }
                    }
                }
            }
        }
        let slope = simd.splat(self.slope);
        for (o, sums) in sums.iter().enumerate() {
            for (v, sum) in sums.iter().enumerate() {
                let to = &mut self.out[o * stride + x + v * S::LANES..];
                simd.store(simd.max(*sum, simd.mul(slope, *sum)), to);
            }
        }
    }
}

/// Sums over some rows of every product of an input's pixel and an output's slope, a tap apart; a lane each.
struct Products<'a> {
    inputs: (&'a Bordered, &'a [f32]),
    slopes: (&'a Bordered, &'a [f32]),
    rows: usize,
    /// By input, row of taps, output and tap: [`LANES`] lanes.
    sums: &'a mut [f32],
    outputs: usize,
}

impl Kernel for Products<'_> {
    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        match self.outputs {
            1 => self.tile::<S, 1, 1>(simd),
            2 => self.tile::<S, 2, 2>(simd),
            4 if const { 4 * SIZE <= S::ACCUMULATORS } => self.tile::<S, 4, 4>(simd),
            4 => self.tile::<S, 4, 2>(simd),
            TILE if const { TILE * SIZE <= S::ACCUMULATORS } => self.tile::<S, TILE, TILE>(simd),
            outputs => unreachable!("a tile of {outputs} outputs"),
        }
    }
}

impl Products<'_> {
    /// `ALL` outputs, `O` at a time.
    #[inline(always)]
    fn tile<S: Simd, const ALL: usize, const O: usize>(&mut self, simd: S) {
        let len = O * SIZE * LANES;
        for part in 0..self.sums.len() / len {
            let (line, first) = (part / (ALL / O), part % (ALL / O) * O);
            let mut sums = [[simd.splat(0.0); SIZE]; O];
            let memory = &mut self.sums[part * len..][..len];
            for (sum, memory) in sums.as_flattened_mut().iter_mut().zip(memory.chunks_exact(LANES)) {
                *sum = simd.load(memory);
            }
            let (input, ty) = (line / SIZE, line % SIZE);
            let (bordered, source) = self.inputs;
            for row in 0..self.rows {
                let from = (input * (self.rows + SIZE - 1) + row + ty) * bordered.stride;
                let pixels = &source[from..from + bordered.stride];
                let (bordered, slopes) = self.slopes;
                let slopes = SlopeRow { bordered, slopes, first, row, rows: self.rows };
                add_products::<S, O>(simd, pixels, slopes, &mut sums);
            }
            let memory = &mut self.sums[part * len..][..len];
            for (sum, memory) in sums.as_flattened().iter().zip(memory.chunks_exact_mut(LANES)) {
                simd.store(*sum, memory);
            }
        }
    }
}

/// A row of the slopes of some outputs.
#[derive(Clone, Copy)]
struct SlopeRow<'a> {
    bordered: &'a Bordered,
    /// `rows` rows of each output.
    slopes: &'a [f32],
    /// The first of the outputs.
    first: usize,
    row: usize,
    rows: usize,
}

/// Adds the products of one row.
#[inline(always)]
fn add_products<S: Simd, const O: usize>(
    simd: S,
    pixels: &[f32],
    slopes: SlopeRow<'_>,
    sums: &mut [[S::F; SIZE]; O],
) {
    let SlopeRow { bordered, slopes, first, row, rows } = slopes;
    let mut x = 0;
    while x < bordered.width {
        let line = &pixels[x..x + S::LANES + SIZE - 1];
        let pixels = [simd.load(line), simd.load(&line[1..]), simd.load(&line[2..])];
        for o in 0..O {
            let slope = simd.load(&slopes[((first + o) * rows + row) * bordered.stride + x..]);
            for tx in 0..SIZE {
                sums[o][tx] = simd.mul_add(slope, pixels[tx], sums[o][tx]);
            }
        }
        x += S::LANES;
    }
}

/// The parameters of a convolution.
#[derive(Debug, Clone, Copy)]
pub(super) struct Filter<'a> {
    pub(super) weight: &'a [f32],
    pub(super) bias: &'a [f32],
    /// Factor of negative results.
    pub(super) slope: f32,
}

/// Rows that a convolution computes.
struct Pass<'a> {
    /// The image that it reads.
    source: &'a [f32],
    /// The filter, packed as [`Row`] reads it.
    filter: Filter<'a>,
    height: usize,
    width: usize,
}

/// The convolution of one group of one image, and the instructions that compute it.
pub(super) struct Direct {
    pub(super) isa: Isa,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) height: usize,
    pub(super) width: usize,
}

impl Direct {
    /// One group of one image: `out` is the filter's output plus bias, with its slope.
    pub(super) fn forward(&self, x: &[f32], filter: Filter<'_>, out: &mut [f32]) {
        let (inputs, outputs) = (self.inputs, self.outputs);
        let at = |o: usize, i: usize, tap: usize| filter.weight[(o * inputs + i) * TAPS + tap];
        let packed = pack((inputs, outputs), self.tile(), at);
        let (height, w, area) = (self.height, self.width, self.height * self.width);
        let bordered = self.bordered(inputs, 1, Beyond::Edge);
        let filter = Filter { weight: &packed, ..filter };
        self.rows(&bordered, Pass { source: x, filter, height, width: w }, |o, y, line| {
            out[o * area + y * w..][..w].copy_from_slice(&line[..w]);
        });
    }

    /// One group of one image: adds the gradients that are wanted; `slope` is the gradient of the outputs.
    pub(super) fn backward(&self, x: &[f32], weight: &[f32], slope: &[f32], wanted: Wanted<'_>) {
        if let Some(filter) = wanted.filter {
            self.filter((x, slope), filter);
        }
        if let Some(image) = wanted.image {
            self.image((weight, slope), image);
        }
    }

    /// The gradient of the image, added to `image`.
    fn image(&self, (weight, slope): (&[f32], &[f32]), image: &mut [f32]) {
        let (inputs, outputs) = (self.inputs, self.outputs);
        // Every pixel of the image and its border gathers from the outputs that read it: a convolution with the rotated filter.
        let at = |i: usize, o: usize, tap: usize| weight[(o * inputs + i) * TAPS + TAPS - 1 - tap];
        let packed = pack((outputs, inputs), self.tile(), at);
        let (h, w) = (self.height, self.width);
        let bordered = self.bordered(outputs, SIZE - 1, Beyond::Zero);
        let bias = vec![0.0; inputs];
        let filter = Filter { weight: &packed, bias: &bias, slope: 1.0 };
        self.rows(&bordered, Pass { source: slope, filter, height: h + 2, width: w + 2 }, |i, y, line| {
            let to = &mut image[(i * h + y.saturating_sub(1).min(h - 1)) * w..][..w];
            to[0] += line[0];
            to[w - 1] += line[w + 1];
            to.iter_mut().zip(&line[1..]).for_each(|(t, l)| *t += l);
        });
    }

    /// The gradient of the filter, added to `filter`.
    fn filter(&self, (x, slope): (&[f32], &[f32]), filter: &mut [f32]) {
        let (inputs, outputs, area) = (self.inputs, self.outputs, self.height * self.width);
        let (of_x, of_slope) = (self.bordered(inputs, 1, Beyond::Edge), self.bordered(TILE, 0, Beyond::Zero));
        let line = SIZE * LANES;
        let mut sums = vec![0.0; inputs * SIZE * outputs * line];
        let rows = of_x.rows(self.height);
        let (mut x_band, mut slope_band) = (of_x.band(rows + SIZE - 1), of_slope.band(rows));
        for first in (0..self.height).step_by(rows) {
            let rows = rows.min(self.height - first);
            of_x.fill(x, Rows { first, count: rows + SIZE - 1 }, &mut x_band);
            for tile in tiles(outputs, self.tile()) {
                let slope = &slope[tile.start * area..tile.end * area];
                of_slope.fill(slope, Rows { first, count: rows }, &mut slope_band);
                self.isa.run(Products {
                    inputs: (&of_x, &x_band),
                    slopes: (&of_slope, &slope_band),
                    rows,
                    sums: &mut sums[tile.start * inputs * SIZE * line..tile.end * inputs * SIZE * line],
                    outputs: tile.len(),
                });
            }
        }
        for tile in tiles(outputs, self.tile()) {
            let sums = &sums[tile.start * inputs * SIZE * line..];
            for (k, o) in (0..inputs * SIZE).flat_map(|k| tile.clone().map(move |o| (k, o))) {
                let lanes = &sums[(k * tile.len() + o - tile.start) * line..][..line];
                let taps = &mut filter[(o * inputs * SIZE + k) * SIZE..][..SIZE];
                for (tap, lanes) in taps.iter_mut().zip(lanes.chunks_exact(LANES)) {
                    *tap += lanes.iter().sum::<f32>();
                }
            }
        }
    }

    /// Outputs at a time. Four outputs of two vectors take six loads for eight products, eight of one take nine: with AVX2 0.75 to 0.8 of the
    /// time. AVX-512 was measured with eight, whose products have enough registers there.
    fn tile(&self) -> usize {
        if self.isa.accumulators() >= TILE * SIZE { TILE } else { 4 }
    }

    fn bordered(&self, planes: usize, border: usize, beyond: Beyond) -> Bordered {
        Bordered::new([planes, self.height, self.width], border, beyond)
    }

    /// Calls `visit` with output, row and the row's values.
    fn rows(&self, bordered: &Bordered, pass: Pass<'_>, mut visit: impl FnMut(usize, usize, &[f32])) {
        let Pass { source, filter: Filter { weight, bias, slope }, height, width } = pass;
        let (band_rows, stride) = (bordered.rows(height), bordered.stride);
        let mut band = bordered.band(band_rows + SIZE - 1);
        let mut out = vec![0.0; TILE * stride];
        for first in (0..height).step_by(band_rows) {
            let rows = band_rows.min(height - first) + SIZE - 1;
            bordered.fill(source, Rows { first, count: rows }, &mut band);
            let tiles = |row| tiles(bias.len(), self.tile()).map(move |tile| (row, tile));
            for (row, tile) in (0..rows + 1 - SIZE).flat_map(tiles) {
                let of_output = weight.len() / bias.len();
                self.isa.run(Row {
                    source: &band[row * stride..],
                    bordered,
                    rows,
                    weights: &weight[tile.start * of_output..tile.end * of_output],
                    bias: &bias[tile.clone()],
                    slope,
                    width,
                    out: &mut out,
                });
                for (line, o) in out.chunks_exact(stride).zip(tile) {
                    visit(o, first + row, line);
                }
            }
        }
    }
}

/// Filters in the order in which [`Row`] reads them, tile by tile of outputs.
fn pack((inputs, outputs): (usize, usize), tile: usize, at: impl Fn(usize, usize, usize) -> f32) -> Vec<f32> {
    let mut packed = Vec::with_capacity(inputs * outputs * TAPS);
    for tile in tiles(outputs, tile) {
        for k in 0..inputs * TAPS {
            packed.extend(tile.clone().map(|o| at(o, k / TAPS, k % TAPS)));
        }
    }
    packed
}
