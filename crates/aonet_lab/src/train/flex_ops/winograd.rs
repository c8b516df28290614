//! 3x3 convolution by Winograd's minimal filtering, forward and backward: a quarter of the multiplications. Lavin and Gray 2016, §4.
//!
//! Every square of 4x4 outputs is Aᵀ (Σ U V) A, where U = G g Gᵀ is a filter and V = Bᵀ d B are the 6x6 inputs of the square at 36 points. So each point is a
//! product of matrices over the channels, and so is each of the gradients: that of U is Σ V M over the squares, that of V is Σ U M over the outputs,
//! with M = A m Aᵀ for the gradients m of the outputs.

use super::blocked::{Blocked, Size, vectors};
use super::bordered::{Beyond, Rows};
use super::convolution::Wanted;
use super::direct::Filter;
use super::matrix::{Matrix, multiply, multiply_add};
use super::points::{self, TAPS};
use aonet::internals::simd::{Isa, Kernel, MAX_LANES, Simd};
use aonet::internals::winograd::{IN, OUT, PRODUCTS, input, output};

/// Floats at the points that are in use at a time: 2 MiB. On a Zen 3, the network at full resolution takes 1.15 times as long with half as many.
const AT_POINTS: usize = 1 << 19;
/// Floats between the matrices of two points, so that the distance is no power of two.
const GAP: usize = 16;

/// The convolution of one group of one image, and the instructions that compute it.
#[derive(Clone, Copy)]
pub(super) struct Winograd {
    pub(super) isa: Isa,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) height: usize,
    pub(super) width: usize,
}

impl Winograd {
    /// `out` is the filter's output plus bias, with its slope.
    pub(super) fn forward(&self, x: &[f32], filter: Filter<'_>, out: &mut [f32]) {
        self.isa.run(Forward { conv: *self, x, filter, out });
    }

    /// Adds the gradients that are wanted; `slope` is the gradient of the outputs.
    pub(super) fn backward(&self, x: &[f32], weight: &[f32], slope: &[f32], wanted: Wanted<'_>) {
        self.isa.run(Backward { conv: *self, x, weight, slope, wanted });
    }

    fn size(&self, channels: usize) -> Size {
        Size { channels, height: self.height, width: self.width }
    }

    /// Squares in a row.
    fn columns(&self) -> usize {
        self.width.div_ceil(OUT)
    }

    /// Most rows of squares in a strip.
    fn strip(&self) -> usize {
        let row = PRODUCTS * self.columns() * (self.inputs + self.outputs);
        (AT_POINTS / row).clamp(1, self.height.div_ceil(OUT))
    }

    /// Strips of squares: the rows of the image that they show.
    fn strips(&self) -> impl Iterator<Item = Rows> + use<> {
        let (rows, height) = (OUT * self.strip(), self.height);
        (0..height).step_by(rows).map(move |first| Rows { first, count: rows.min(height - first) })
    }

    fn points(&self, lanes: usize, channels: usize) -> Points {
        Points::new(self.strip() * self.columns(), channels.next_multiple_of(lanes))
    }

    fn band(&self, lanes: usize, channels: usize, border: usize) -> Blocked {
        Blocked::new(lanes, channels, [self.strip() * OUT, self.columns() * OUT], border)
    }

    /// Squares of a strip, row by row: number, first row and first column in the strip.
    fn squares(&self, rows: Rows) -> impl Iterator<Item = (usize, usize, usize)> + use<> {
        let columns = self.columns();
        (0..rows.count.div_ceil(OUT) * columns).map(move |i| (i, i / columns * OUT, i % columns * OUT))
    }
}

/// A matrix at every point: squares or channels times channels.
struct Points {
    values: Vec<f32>,
    /// Floats in a row.
    row: usize,
    /// Floats from point to point.
    pitch: usize,
}

impl Points {
    fn new(rows: usize, row: usize) -> Self {
        let pitch = rows * row + GAP;
        Self { values: vec![0.0; PRODUCTS * pitch], row, pitch }
    }

    /// Writes a vector to every point's matrix.
    #[inline(always)]
    fn store<S: Simd>(&mut self, simd: S, at: usize, values: &[[S::F; IN]; IN]) {
        for (i, matrix) in self.values.chunks_exact_mut(self.pitch).enumerate() {
            simd.store(values[i / IN][i % IN], &mut matrix[at..]);
        }
    }

    /// Reads a vector from every point's matrix.
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, at: usize) -> [[S::F; IN]; IN] {
        let mut values = [[simd.splat(0.0); IN]; IN];
        for (i, matrix) in self.values.chunks_exact(self.pitch).enumerate() {
            values[i / IN][i % IN] = simd.load(&matrix[at..]);
        }
        values
    }

    /// The first rows and columns of a point's matrix.
    fn matrix(&self, point: usize, [rows, columns]: [usize; 2]) -> Matrix<'_> {
        let values = &self.values[point * self.pitch..][..self.pitch];
        Matrix { values, rows, columns, stride: (self.row, 1) }
    }

    fn matrix_mut(&mut self, point: usize) -> &mut [f32] {
        &mut self.values[point * self.pitch..][..self.pitch]
    }
}

/// U: filters at the points. A matrix has `rows` rows of `row` values; `strides` are the distances between filters of a row and of a column, in filters.
#[inline(always)]
fn filters<S: Simd>(simd: S, weight: &[f32], [rows, row]: [usize; 2], strides: [usize; 2]) -> Points {
    let mut points = Points::new(rows, row.next_multiple_of(S::LANES));
    let mut lines = [[0.0; MAX_LANES]; TAPS * TAPS];
    for (k, first) in (0..rows).flat_map(|k| (0..row).step_by(S::LANES).map(move |n| (k, n))) {
        for n in first..row.min(first + S::LANES) {
            let taps = &weight[(k * strides[0] + n * strides[1]) * TAPS * TAPS..][..TAPS * TAPS];
            for tap in 0..TAPS * TAPS {
                lines[tap][n - first] = taps[tap];
            }
        }
        let mut taps = [[simd.splat(0.0); TAPS]; TAPS];
        for tap in 0..TAPS * TAPS {
            taps[tap / TAPS][tap % TAPS] = simd.load(&lines[tap]);
        }
        let filters = points::filters(simd, &taps);
        points.store(simd, k * points.row + first, &filters);
    }
    points
}

/// The vectors at one place of every line.
#[inline(always)]
fn column_of<V: Copy, const N: usize, const LINES: usize>(lines: &[[V; N]; LINES], at: usize) -> [V; LINES] {
    lines.map(|line| line[at])
}

/// V: the inputs of a strip at the points.
#[inline(always)]
fn inputs<S: Simd>(simd: S, conv: &Winograd, band: &Blocked, rows: Rows, to: &mut Points) {
    for block in 0..band.blocks() {
        for (square, y, x) in conv.squares(rows) {
            let mut lines = [[simd.splat(0.0); IN]; IN];
            for (i, line) in lines.iter_mut().enumerate() {
                *line = input(simd, vectors::<S, IN>(simd, &band.values[band.at(block, y + i, x)..]));
            }
            let mut points = [[simd.splat(0.0); IN]; IN];
            for i in 0..IN {
                let column = input(simd, column_of(&lines, i));
                for (row, value) in points.iter_mut().zip(column) {
                    row[i] = value;
                }
            }
            to.store(simd, square * to.row + block * S::LANES, &points);
        }
    }
}

/// M: the gradients of a strip's outputs at the points.
#[inline(always)]
fn slopes<S: Simd>(simd: S, conv: &Winograd, band: &Blocked, rows: Rows, to: &mut Points) {
    for block in 0..band.blocks() {
        for (square, y, x) in conv.squares(rows) {
            let mut lines = [[simd.splat(0.0); IN]; OUT];
            for (i, line) in lines.iter_mut().enumerate() {
                let outputs = vectors::<S, OUT>(simd, &band.values[band.at(block, y + i, x)..]);
                *line = points::of_output(simd, outputs);
            }
            let mut points = [[simd.splat(0.0); IN]; IN];
            for i in 0..IN {
                let column = points::of_output(simd, column_of(&lines, i));
                for (row, value) in points.iter_mut().zip(column) {
                    row[i] = value;
                }
            }
            to.store(simd, square * to.row + block * S::LANES, &points);
        }
    }
}

struct Forward<'a> {
    conv: Winograd,
    x: &'a [f32],
    filter: Filter<'a>,
    out: &'a mut [f32],
}

impl Kernel for Forward<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { conv, x, filter, out } = self;
        let Winograd { inputs: channels, outputs, .. } = conv;
        let at_points = filters(simd, filter.weight, [channels, outputs], [1, channels]);
        let (mut band, mut out_band) = (conv.band(S::LANES, channels, 1), conv.band(S::LANES, outputs, 0));
        let mut seen = conv.points(S::LANES, channels);
        let mut products = conv.points(S::LANES, outputs);
        for rows in conv.strips() {
            band.fill(x, conv.size(channels), rows.first, Beyond::Edge);
            inputs(simd, &conv, &band, rows, &mut seen);
            let squares = conv.squares(rows).count();
            for point in 0..PRODUCTS {
                let seen = seen.matrix(point, [squares, channels]);
                let weight = at_points.matrix(point, [channels, products.row]);
                multiply(seen, weight, products.matrix_mut(point), weight.columns);
            }
            write(simd, &conv, filter, &products, rows, &mut out_band);
            out_band.write(out, conv.size(outputs), rows);
        }
    }
}

/// The outputs of a strip, from their products at the points.
#[inline(always)]
fn write<S: Simd>(
    simd: S,
    conv: &Winograd,
    filter: Filter<'_>,
    products: &Points,
    rows: Rows,
    band: &mut Blocked,
) {
    let slope = simd.splat(filter.slope);
    let mut biases = vec![0.0; products.row];
    biases[..filter.bias.len()].copy_from_slice(filter.bias);
    for block in 0..band.blocks() {
        let bias = simd.load(&biases[block * S::LANES..]);
        for (square, y, x) in conv.squares(rows) {
            let points = products.load(simd, square * products.row + block * S::LANES);
            let mut lines = [[simd.splat(0.0); OUT]; IN];
            for i in 0..IN {
                lines[i] = output(simd, points[i]);
            }
            for i in 0..OUT {
                let column = output(simd, column_of(&lines, i));
                for (row, value) in column.into_iter().enumerate() {
                    let value = simd.add(value, bias);
                    let at = band.at(block, y + row, x + i);
                    simd.store(simd.max(value, simd.mul(slope, value)), &mut band.values[at..]);
                }
            }
        }
    }
}

struct Backward<'a> {
    conv: Winograd,
    x: &'a [f32],
    weight: &'a [f32],
    slope: &'a [f32],
    wanted: Wanted<'a>,
}

impl Kernel for Backward<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { conv, x, weight, slope, wanted: Wanted { image, filter } } = self;
        let Winograd { inputs: channels, outputs, .. } = conv;
        let mut band = conv.band(S::LANES, channels, 1);
        let mut slope_band = conv.band(S::LANES, outputs, 0);
        let mut at_inputs = conv.points(S::LANES, channels);
        let mut at_outputs = conv.points(S::LANES, outputs);
        let mut image = image.map(|image| (image, filters(simd, weight, [outputs, channels], [channels, 1])));
        let mut filter = filter.map(|filter| (filter, Points::new(channels, at_outputs.row)));
        for rows in conv.strips() {
            slope_band.fill(slope, conv.size(outputs), rows.first, Beyond::Zero);
            slopes(simd, &conv, &slope_band, rows, &mut at_outputs);
            let squares = conv.squares(rows).count();
            if let Some((_, filters)) = &mut filter {
                band.fill(x, conv.size(channels), rows.first, Beyond::Edge);
                inputs(simd, &conv, &band, rows, &mut at_inputs);
                for point in 0..PRODUCTS {
                    let seen = at_inputs.matrix(point, [squares, channels]).transposed();
                    let slope = at_outputs.matrix(point, [squares, at_outputs.row]);
                    multiply_add(seen, slope, filters.matrix_mut(point), slope.columns);
                }
            }
            if let Some((image, weight)) = &mut image {
                for point in 0..PRODUCTS {
                    let slope = at_outputs.matrix(point, [squares, outputs]);
                    let weight = weight.matrix(point, [outputs, at_inputs.row]);
                    multiply(slope, weight, at_inputs.matrix_mut(point), weight.columns);
                }
                spread(simd, &conv, &at_inputs, rows, &mut band);
                band.add(image, conv.size(channels), rows);
            }
        }
        if let Some((filter, at_points)) = filter {
            add_filters(simd, &at_points, [channels, outputs], filter);
        }
    }
}

/// Gradients of a strip's inputs from those at the points.
#[inline(always)]
fn spread<S: Simd>(simd: S, conv: &Winograd, from: &Points, rows: Rows, band: &mut Blocked) {
    band.values.fill(0.0);
    for block in 0..band.blocks() {
        for (square, y, x) in conv.squares(rows) {
            let points = from.load(simd, square * from.row + block * S::LANES);
            let mut lines = [[simd.splat(0.0); IN]; IN];
            for i in 0..IN {
                lines[i] = points::of_input(simd, points[i]);
            }
            for i in 0..IN {
                let column = points::of_input(simd, column_of(&lines, i));
                for (row, value) in column.into_iter().enumerate() {
                    let at = band.at(block, y + row, x + i);
                    let to = &mut band.values[at..];
                    simd.store(simd.add(simd.load(to), value), to);
                }
            }
        }
    }
}

/// Adds the gradients of filters from those at the points, which [`filters`] would make of filters.
#[inline(always)]
fn add_filters<S: Simd>(simd: S, from: &Points, [inputs, outputs]: [usize; 2], filter: &mut [f32]) {
    let mut lines = [[0.0; MAX_LANES]; TAPS * TAPS];
    for (k, first) in (0..inputs).flat_map(|k| (0..outputs).step_by(S::LANES).map(move |n| (k, n))) {
        let taps = points::of_filters(simd, &from.load(simd, k * from.row + first));
        for tap in 0..TAPS * TAPS {
            simd.store(taps[tap / TAPS][tap % TAPS], &mut lines[tap]);
        }
        for n in first..outputs.min(first + S::LANES) {
            let to = &mut filter[(n * inputs + k) * TAPS * TAPS..][..TAPS * TAPS];
            for tap in 0..TAPS * TAPS {
                to[tap] += lines[tap][n - first];
            }
        }
    }
}
