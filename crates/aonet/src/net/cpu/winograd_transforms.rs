//! Winograd's minimal filtering of 4x4 outputs by 3x3 taps, F(4x4, 3x3): Lavin and Gray 2016, §4.3. Interpolation points
//! 0, 1, -1, 2, -2 and infinity.

use crate::simd::Simd;

/// Side of a square of outputs.
pub const OUT: usize = 4;
/// Side of the square of inputs that they see, and of the square of products.
pub const IN: usize = OUT + 2;
/// Products.
pub const PRODUCTS: usize = IN * IN;

/// G: a row of three taps at every point.
const TAPS_AT_POINTS: [[f64; 3]; IN] = [
    [1.0 / 4.0, 0.0, 0.0],
    [-1.0 / 6.0, -1.0 / 6.0, -1.0 / 6.0],
    [-1.0 / 6.0, 1.0 / 6.0, -1.0 / 6.0],
    [1.0 / 24.0, 1.0 / 12.0, 1.0 / 6.0],
    [1.0 / 24.0, -1.0 / 12.0, 1.0 / 6.0],
    [0.0, 0.0, 1.0],
];

/// G g Gᵀ: what a filter of 3x3 taps becomes.
pub(super) fn filter(taps: &[f32; 9]) -> [f32; PRODUCTS] {
    let at_points = |line: [f64; 3]| TAPS_AT_POINTS.map(|g| g[0] * line[0] + g[1] * line[1] + g[2] * line[2]);
    let tap = |y: usize, x: usize| f64::from(taps[3 * y + x]);
    let columns = [0, 1, 2].map(|x| at_points([tap(0, x), tap(1, x), tap(2, x)]));
    let mut out = [0.0; PRODUCTS];
    for (y, row) in out.chunks_exact_mut(IN).enumerate() {
        let products = at_points([columns[0][y], columns[1][y], columns[2][y]]);
        row.iter_mut().zip(products).for_each(|(out, product)| *out = product as f32);
    }
    out
}

/// Bᵀ d: a line of inputs at every point.
#[inline(always)]
pub fn input<S: Simd>(simd: S, d: [S::F; IN]) -> [S::F; IN] {
    let plus = |a, factor: f32, b| simd.mul_add(simd.splat(factor), b, a);
    let (even, odd) = (plus(d[4], -4.0, d[2]), plus(d[3], -4.0, d[1]));
    let (far, near) = (plus(d[4], -1.0, d[2]), plus(d[3], -1.0, d[1]));
    [
        plus(plus(d[4], -5.0, d[2]), 4.0, d[0]),
        simd.add(even, odd),
        plus(even, -1.0, odd),
        plus(far, 2.0, near),
        plus(far, -2.0, near),
        plus(plus(d[5], -5.0, d[3]), 4.0, d[1]),
    ]
}

/// Aᵀ m: a line of outputs from the products at every point.
#[inline(always)]
pub fn output<S: Simd>(simd: S, m: [S::F; IN]) -> [S::F; OUT] {
    let plus = |a, factor: f32, b| simd.mul_add(simd.splat(factor), b, a);
    let (even, odd) = (simd.add(m[1], m[2]), plus(m[1], -1.0, m[2]));
    let (far_even, far_odd) = (simd.add(m[3], m[4]), plus(m[3], -1.0, m[4]));
    [
        simd.add(simd.add(m[0], even), far_even),
        plus(odd, 2.0, far_odd),
        plus(even, 4.0, far_even),
        simd.add(plus(odd, 8.0, far_odd), m[5]),
    ]
}
