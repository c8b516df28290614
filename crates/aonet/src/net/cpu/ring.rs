//! Inputs of a convolution, row by row: read as they are, or pooled or upsampled just before they are needed.

use super::resample::{avg_pool, upsample2};
use super::simd::Simd;
use crate::net::plan::{Buffer, Resample};

/// Rows of resampled input that a thread keeps.
const RING: usize = 3;

/// An input of a convolution.
#[derive(Debug)]
pub(super) struct Input {
    pub(super) buffer: Buffer,
    resample: Resample,
    /// Length of a row after resampling.
    row_len: usize,
}

impl Input {
    /// A buffer that has `width` columns after resampling.
    pub(super) fn new(buffer: Buffer, resample: Resample, width: usize) -> Self {
        let row_len = Buffer { width, ..buffer.clone() }.row_len();
        Self { buffer, resample, row_len }
    }

    /// Length of the ring that it needs.
    pub(super) fn ring_len(&self) -> usize {
        match self.resample {
            Resample::None => 0,
            Resample::AvgPool(_) | Resample::Upsample2 => RING * self.row_len,
        }
    }
}

/// The last resampled rows of an input: row y is in slot y mod 3.
pub(super) struct Ring<'a> {
    values: &'a mut [f32],
    held: [usize; RING],
}

impl<'a> Ring<'a> {
    pub(super) fn new(values: &'a mut [f32]) -> Self {
        Self { values, held: [usize::MAX; RING] }
    }

    /// Makes sure that the ring holds `rows` of the resampled input.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(
        &mut self,
        simd: S,
        input: &Input,
        source: &[f32],
        (rows, width): ([usize; 3], usize),
    ) {
        if input.resample == Resample::None {
            return;
        }
        for y in rows {
            if self.held[y % RING] == y {
                continue;
            }
            self.held[y % RING] = y;
            let out = &mut self.values[y % RING * input.row_len..][..input.row_len];
            let last = input.buffer.height - 1;
            let row = |y: usize| &source[y.min(last) * input.buffer.row_len()..][..input.buffer.row_len()];
            match input.resample {
                Resample::AvgPool(side) => avg_pool(simd, (side, |i| row(side * y + i)), out, width),
                Resample::Upsample2 if y % 2 == 0 => {
                    upsample2(simd, [row(y / 2), row((y / 2).saturating_sub(1))], out, width);
                }
                Resample::Upsample2 => upsample2(simd, [row(y / 2), row(y / 2 + 1)], out, width),
                Resample::None => {}
            }
        }
    }

    /// Row `y` of the input after resampling.
    #[inline(always)]
    pub(super) fn row<'s>(&'s self, input: &Input, source: &'s [f32], y: usize) -> &'s [f32] {
        match input.resample {
            Resample::None => &source[y * input.row_len..][..input.row_len],
            Resample::AvgPool(_) | Resample::Upsample2 => {
                &self.values[y % RING * input.row_len..][..input.row_len]
            }
        }
    }
}
