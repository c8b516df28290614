//! One row of a blocked image from rows of a finer, a coarser or a planar one.

use crate::net::plan::HALO;
use crate::simd::Simd;
use crate::simd::transpose::{self, four};

/// Copies the first and last pixel of every line of a blocked row into its halo.
#[inline(always)]
pub(super) fn repeat_ends<S: Simd>(_: S, row: &mut [f32], width: usize) {
    for line in row.chunks_exact_mut((width + 2 * HALO) * S::LANES) {
        line.copy_within(S::LANES..2 * S::LANES, 0);
        line.copy_within(width * S::LANES..(width + 1) * S::LANES, (width + 1) * S::LANES);
    }
}

/// See [`crate::net::graph::Op::AvgPool2`], once or more: `side` rows of `side` times the width to one of `width`, with its
/// halo.
#[inline(always)]
pub(super) fn avg_pool<'a, S: Simd>(
    simd: S,
    side: usize,
    row: impl Fn(usize) -> &'a [f32],
    out: &mut [f32],
    width: usize,
) {
    let [fine, coarse] = [side * width + 2 * HALO, width + 2 * HALO].map(|pixels| pixels * S::LANES);
    let share = simd.splat(1.0 / (side * side) as f32);
    for i in 0..side {
        let lines = row(i).chunks_exact(fine).zip(out.chunks_exact_mut(coarse));
        for (line, out) in lines {
            let squares = line[S::LANES..].chunks_exact(side * S::LANES);
            for (square, out) in squares.zip(out[S::LANES..].chunks_exact_mut(S::LANES).take(width)) {
                let mut sum = if i == 0 { simd.splat(0.0) } else { simd.load(out) };
                for pixel in square.chunks_exact(S::LANES) {
                    sum = simd.add(sum, simd.load(pixel));
                }
                simd.store(if i + 1 == side { simd.mul(share, sum) } else { sum }, out);
            }
        }
    }
    repeat_ends(simd, out, width);
}

/// See [`crate::net::graph::Op::Upsample2`]: the nearer and the farther of two rows of half the width to one of
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
fn mix<S: Simd>(simd: S, (near, far): (&[f32], &[f32])) -> S::F {
    lean(simd, simd.load(near), simd.load(far))
}

/// Three parts of `near`, one of `far`.
#[inline(always)]
fn lean<S: Simd>(simd: S, near: S::F, far: S::F) -> S::F {
    simd.mul_add(simd.splat(0.25), far, simd.mul(simd.splat(0.75), near))
}

/// Lays the lines of a planar row out in blocks; channels that do not exist are 0.
#[inline(always)]
pub(super) fn block_lines<S: Simd>(planes: &[f32], out: &mut [f32], width: usize) {
    let pitch = width + 2 * HALO;
    let blocks = out.chunks_exact_mut(S::LANES * pitch);
    let planes = planes.chunks(S::LANES * pitch).chain(std::iter::repeat(&[][..]));
    for (planes, block) in planes.zip(blocks) {
        if planes.len() < block.len() {
            block.fill(0.0);
        }
        let lines = planes.len() / pitch;
        let (columns, rows) = (pitch / 4 * 4, lines / 4 * 4);
        for x in (0..columns).step_by(4) {
            let out = &mut block[x * S::LANES..][..4 * S::LANES];
            for c in (0..rows).step_by(4) {
                let line = |i: usize| four(planes, (c + i) * pitch + x);
                let pixels = transpose::columns([line(0), line(1), line(2), line(3)]);
                for (i, channels) in pixels.iter().enumerate() {
                    out[i * S::LANES + c..][..4].copy_from_slice(channels);
                }
            }
        }
        for (c, line) in planes.chunks_exact(pitch).enumerate() {
            let first = if c < rows { columns } else { 0 };
            for x in first..pitch {
                block[x * S::LANES + c] = line[x];
            }
        }
    }
}
