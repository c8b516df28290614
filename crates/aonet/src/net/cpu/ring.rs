//! Inputs of a convolution, row by row: read as they are, or pooled, upsampled or laid out in blocks just before they are
//! needed.

use super::resample::{avg_pool, block_lines, upsample2};
use super::simd::Simd;
use crate::net::plan::{Buffer, Layout, Resample};

/// An input of a convolution.
#[derive(Debug)]
pub(super) struct Input {
    pub(super) buffer: Buffer,
    resample: Resample,
    /// As the convolution reads it.
    pub(super) layout: Layout,
    /// Length of a row as the convolution reads it.
    row_len: usize,
}

impl Input {
    /// A buffer that is read with `width` columns in `layout`; blocked images cannot be read planar.
    pub(super) fn new(buffer: Buffer, resample: Resample, (layout, width): (Layout, usize)) -> Self {
        let row_len = Buffer { width, layout, ..buffer.clone() }.row_len();
        Self { buffer, resample, layout, row_len }
    }

    /// Length of the ring of `rows` that it needs.
    pub(super) fn ring_len(&self, rows: usize) -> usize {
        if self.is_in_place() { 0 } else { rows * self.row_len }
    }

    fn is_in_place(&self) -> bool {
        self.resample == Resample::None && self.layout == self.buffer.layout
    }
}

/// The last `ROWS` rows that were prepared of an input: row y is in slot y mod `ROWS`.
pub(super) struct Ring<'a, const ROWS: usize> {
    values: &'a mut [f32],
    held: [usize; ROWS],
}

impl<'a, const ROWS: usize> Ring<'a, ROWS> {
    pub(super) fn new(values: &'a mut [f32]) -> Self {
        Self { values, held: [usize::MAX; ROWS] }
    }

    /// Makes sure that the ring holds neighbouring `rows` of the prepared input.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(
        &mut self,
        simd: S,
        input: &Input,
        source: &[f32],
        (rows, width): ([usize; ROWS], usize),
    ) {
        if input.is_in_place() {
            return;
        }
        for y in rows {
            if self.held[y % ROWS] == y {
                continue;
            }
            self.held[y % ROWS] = y;
            let out = &mut self.values[y % ROWS * input.row_len..][..input.row_len];
            let last = input.buffer.height - 1;
            let row = |y: usize| &source[y.min(last) * input.buffer.row_len()..][..input.buffer.row_len()];
            match input.resample {
                Resample::AvgPool(side) => avg_pool(simd, (side, |i| row(side * y + i)), out, width),
                Resample::Upsample2 if y % 2 == 0 => {
                    upsample2(simd, [row(y / 2), row((y / 2).saturating_sub(1))], out, width);
                }
                Resample::Upsample2 => upsample2(simd, [row(y / 2), row(y / 2 + 1)], out, width),
                Resample::None => block_lines::<S>(row(y), out, width),
            }
        }
    }

    /// Row `y` of the input as the convolution reads it.
    #[inline(always)]
    pub(super) fn row<'s>(&'s self, input: &Input, source: &'s [f32], y: usize) -> &'s [f32] {
        match input.is_in_place() {
            true => &source[y * input.row_len..][..input.row_len],
            false => &self.values[y % ROWS * input.row_len..][..input.row_len],
        }
    }
}
