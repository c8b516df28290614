//! One row of a blocked image from rows of a finer or coarser one.

use super::simd::Simd;
use crate::net::plan::HALO;

/// Copies the first and last pixel of every line of a blocked row into its halo.
#[inline(always)]
pub(super) fn repeat_ends<S: Simd>(_: S, row: &mut [f32], width: usize) {
    for line in row.chunks_exact_mut((width + 2 * HALO) * S::LANES) {
        line.copy_within(S::LANES..2 * S::LANES, 0);
        line.copy_within(width * S::LANES..(width + 1) * S::LANES, (width + 1) * S::LANES);
    }
}

/// See [`crate::net::Op::AvgPool2`]: two rows of twice the width to one of `width`, with its halo.
#[inline(always)]
pub(super) fn avg_pool2<S: Simd>(simd: S, rows: [&[f32]; 2], out: &mut [f32], width: usize) {
    let [fine, coarse] = [2 * width + 2 * HALO, width + 2 * HALO].map(|pixels| pixels * S::LANES);
    let (half, quarter) = (2 * S::LANES, simd.splat(0.25));
    for ((a, b), out) in
        rows[0].chunks_exact(fine).zip(rows[1].chunks_exact(fine)).zip(out.chunks_exact_mut(coarse))
    {
        let pairs = a[S::LANES..].chunks_exact(half).zip(b[S::LANES..].chunks_exact(half));
        for ((a, b), out) in pairs.zip(out[S::LANES..].chunks_exact_mut(S::LANES).take(width)) {
            let [a0, a1] = [simd.load(a), simd.load(&a[S::LANES..])];
            let [b0, b1] = [simd.load(b), simd.load(&b[S::LANES..])];
            simd.store(simd.mul(quarter, simd.add(simd.add(a0, a1), simd.add(b0, b1))), out);
        }
    }
    repeat_ends(simd, out, width);
}

/// See [`crate::net::Op::Upsample2`]: the nearer and the farther of two rows of half the width to one of
/// `width`, with its halo.
#[inline(always)]
pub(super) fn upsample2<S: Simd>(simd: S, [near, far]: [&[f32]; 2], out: &mut [f32], width: usize) {
    let [coarse, fine] = [width / 2 + 2 * HALO, width + 2 * HALO].map(|pixels| pixels * S::LANES);
    for ((near, far), out) in
        near.chunks_exact(coarse).zip(far.chunks_exact(coarse)).zip(out.chunks_exact_mut(fine))
    {
        let mut columns = near.chunks_exact(S::LANES).zip(far.chunks_exact(S::LANES));
        let (Some(first), Some(second)) = (columns.next(), columns.next()) else { continue };
        let (mut left, mut centre) = (mix(simd, first), mix(simd, second));
        for (out, column) in out[S::LANES..].chunks_exact_mut(2 * S::LANES).zip(columns) {
            let right = mix(simd, column);
            simd.store(lean(simd, centre, left), out);
            simd.store(lean(simd, centre, right), &mut out[S::LANES..]);
            (left, centre) = (centre, right);
        }
    }
    repeat_ends(simd, out, width);
}

/// One vector from each of two slices, [`lean`]ing to the first.
#[inline(always)]
fn mix<S: Simd>(simd: S, (near, far): (&[f32], &[f32])) -> S::V {
    lean(simd, simd.load(near), simd.load(far))
}

/// Three parts of `near`, one of `far`.
#[inline(always)]
fn lean<S: Simd>(simd: S, near: S::V, far: S::V) -> S::V {
    simd.mul_add(simd.splat(0.25), far, simd.mul(simd.splat(0.75), near))
}
