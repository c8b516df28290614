//! The transposes of the transforms of Winograd's minimal filtering F(4x4, 3x3), which gradients pass through. Lavin and Gray 2016, §4.3.

use aonet::internals::simd::Simd;
use aonet::internals::winograd::{IN, OUT};

/// Taps of a line of the filter.
pub(super) const TAPS: usize = 3;

/// B v: what a line of inputs gets from the gradients at the points.
#[inline(always)]
pub(super) fn of_input<S: Simd>(simd: S, v: [S::F; IN]) -> [S::F; IN] {
    let plus = |a, factor: f32, b| simd.mul_add(simd.splat(factor), b, a);
    let (near, near_odd) = (simd.add(v[1], v[2]), simd.sub(v[1], v[2]));
    let (far, far_odd) = (simd.add(v[3], v[4]), simd.sub(v[3], v[4]));
    let four = |a| simd.mul(simd.splat(4.0), a);
    [
        four(v[0]),
        plus(plus(four(v[5]), -4.0, near_odd), -2.0, far_odd),
        plus(plus(simd.sub(simd.splat(0.0), far), -4.0, near), -5.0, v[0]),
        plus(plus(near_odd, 2.0, far_odd), -5.0, v[5]),
        simd.add(v[0], simd.add(near, far)),
        v[5],
    ]
}

/// A y: what the products at the points get from the gradients of a line of outputs.
#[inline(always)]
pub(super) fn of_output<S: Simd>(simd: S, y: [S::F; OUT]) -> [S::F; IN] {
    let plus = |a, factor: f32, b| simd.mul_add(simd.splat(factor), b, a);
    let (even, odd) = (simd.add(y[0], y[2]), simd.add(y[1], y[3]));
    let (far_even, far_odd) = (plus(y[0], 4.0, y[2]), plus(y[1], 4.0, y[3]));
    [
        y[0],
        simd.add(even, odd),
        simd.sub(even, odd),
        plus(far_even, 2.0, far_odd),
        plus(far_even, -2.0, far_odd),
        y[3],
    ]
}

/// G g: a line of taps at every point.
#[inline(always)]
pub(super) fn filter<S: Simd>(simd: S, g: [S::F; TAPS]) -> [S::F; IN] {
    let times = |factor: f32, a| simd.mul(simd.splat(factor), a);
    let even = simd.add(g[0], g[2]);
    let (far, far_odd) =
        (simd.mul_add(simd.splat(1.0 / 6.0), g[2], times(1.0 / 24.0, g[0])), times(1.0 / 12.0, g[1]));
    [
        times(0.25, g[0]),
        times(-1.0 / 6.0, simd.add(even, g[1])),
        times(-1.0 / 6.0, simd.sub(even, g[1])),
        simd.add(far, far_odd),
        simd.sub(far, far_odd),
        g[2],
    ]
}

/// Gᵀ v: what a line of taps gets from the gradients at the points.
#[inline(always)]
pub(super) fn of_filter<S: Simd>(simd: S, v: [S::F; IN]) -> [S::F; TAPS] {
    let plus = |a, factor: f32, b| simd.mul_add(simd.splat(factor), b, a);
    let (near, near_odd) = (simd.add(v[1], v[2]), simd.sub(v[2], v[1]));
    let (far, far_odd) = (simd.add(v[3], v[4]), simd.sub(v[3], v[4]));
    let zero = simd.splat(0.0);
    [
        plus(plus(plus(zero, 0.25, v[0]), -1.0 / 6.0, near), 1.0 / 24.0, far),
        plus(plus(zero, 1.0 / 6.0, near_odd), 1.0 / 12.0, far_odd),
        plus(v[5], 1.0 / 6.0, simd.sub(far, near)),
    ]
}

/// A filter of 3x3 taps at all points.
#[inline(always)]
pub(super) fn filters<S: Simd>(simd: S, taps: &[[S::F; TAPS]; TAPS]) -> [[S::F; IN]; IN] {
    let mut rows = [[simd.splat(0.0); IN]; TAPS];
    for y in 0..TAPS {
        rows[y] = filter(simd, taps[y]);
    }
    let mut points = [[simd.splat(0.0); IN]; IN];
    for x in 0..IN {
        let column = filter(simd, [rows[0][x], rows[1][x], rows[2][x]]);
        for y in 0..IN {
            points[y][x] = column[y];
        }
    }
    points
}

/// The transpose of [`filters`].
#[inline(always)]
pub(super) fn of_filters<S: Simd>(simd: S, points: &[[S::F; IN]; IN]) -> [[S::F; TAPS]; TAPS] {
    let mut rows = [[simd.splat(0.0); TAPS]; IN];
    for y in 0..IN {
        rows[y] = of_filter(simd, points[y]);
    }
    let mut taps = [[simd.splat(0.0); TAPS]; TAPS];
    for x in 0..TAPS {
        let column =
            of_filter(simd, [rows[0][x], rows[1][x], rows[2][x], rows[3][x], rows[4][x], rows[5][x]]);
        for y in 0..TAPS {
            taps[y][x] = column[y];
        }
    }
    taps
}
