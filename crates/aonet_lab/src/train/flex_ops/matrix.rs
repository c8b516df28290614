//! Products of small matrices whose operands are in the caches.

use aonet::internals::simd::Simd;

/// The left factor of a product: the distances of its rows and of its columns.
#[derive(Clone, Copy)]
pub(super) struct Factor<'a> {
    pub(super) values: &'a [f32],
    pub(super) row: usize,
    pub(super) column: usize,
}

/// Most rows and vectors of the result that stay in registers.
const ROWS: usize = 12;

/// Writes the product of `a`, `rows` x `depth`, and `b`, `depth` x `width`, to `out`, or adds it. The rows of `b` and `out` follow one another; `width` is a
/// multiple of the vector's length.
#[inline(always)]
pub(super) fn multiply<S: Simd, const ADD: bool>(
    simd: S,
    [rows, depth, width]: [usize; 3],
    a: Factor<'_>,
    b: &[f32],
    out: &mut [f32],
) {
    let mut first = 0;
    while first < width {
        let two = width - first >= 2 * S::LANES;
        let most = if two { S::ACCUMULATORS / 2 } else { S::ACCUMULATORS };
        let mut row = 0;
        while row < rows {
            let count = match (rows - row).min(most) {
                ROWS.. => ROWS,
                6.. => 6,
                4.. => 4,
                2.. => 2,
                left => left,
            };
            let tile = Tile {
                depth,
                width,
                a: &a.values[row * a.row..],
                strides: [a.row, a.column],
                b: &b[first..],
            };
            let out = &mut out[row * width + first..];
            match (count, two) {
                (ROWS, true) if const { 2 * ROWS <= S::ACCUMULATORS } => {
                    tile.run::<S, ROWS, 2, ADD>(simd, out)
                }
                (ROWS, false) if const { ROWS <= S::ACCUMULATORS } => tile.run::<S, ROWS, 1, ADD>(simd, out),
                (6, true) => tile.run::<S, 6, 2, ADD>(simd, out),
                (6, false) => tile.run::<S, 6, 1, ADD>(simd, out),
                (4, true) => tile.run::<S, 4, 2, ADD>(simd, out),
                (4, false) => tile.run::<S, 4, 1, ADD>(simd, out),
                (2, true) => tile.run::<S, 2, 2, ADD>(simd, out),
                (2, false) => tile.run::<S, 2, 1, ADD>(simd, out),
                (1, true) => tile.run::<S, 1, 2, ADD>(simd, out),
                (1, false) => tile.run::<S, 1, 1, ADD>(simd, out),
                (rows, _) => unreachable!("{rows} rows in registers"),
            }
            row += count;
        }
        first += if two { 2 * S::LANES } else { S::LANES };
    }
}

/// A few rows and vectors of a product.
struct Tile<'a> {
    depth: usize,
    width: usize,
    a: &'a [f32],
    strides: [usize; 2],
    b: &'a [f32],
}

impl Tile<'_> {
    #[inline(always)]
    fn run<S: Simd, const P: usize, const N: usize, const ADD: bool>(self, simd: S, out: &mut [f32]) {
        let Self { depth, width, a, strides, b } = self;
        let mut sums = [[simd.splat(0.0); N]; P];
        if ADD {
            for p in 0..P {
                for n in 0..N {
                    sums[p][n] = simd.load(&out[p * width + n * S::LANES..]);
                }
            }
        }
        for k in 0..depth {
            let b = &b[k * width..][..N * S::LANES];
            let a = &a[k * strides[1]..][..(P - 1) * strides[0] + 1];
            let mut vectors = [simd.splat(0.0); N];
            for n in 0..N {
                vectors[n] = simd.load(&b[n * S::LANES..]);
            }
            for p in 0..P {
                let value = simd.splat(a[p * strides[0]]);
                for n in 0..N {
                    sums[p][n] = simd.mul_add(value, vectors[n], sums[p][n]);
                }
            }
        }
        for p in 0..P {
            for n in 0..N {
                simd.store(sums[p][n], &mut out[p * width + n * S::LANES..]);
            }
        }
    }
}
