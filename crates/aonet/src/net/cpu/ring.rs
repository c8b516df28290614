//! Inputs of a convolution, row by row: read as they are, or pooled, upsampled, laid out in blocks or packed just before
//! they are needed.

use super::dot::Dot;
use super::packing::Packing;
use super::resample::{avg_pool, block_lines, upsample2};
use crate::net::plan::{Buffer, HALO, Layout, Resample};
use crate::simd::Simd;

/// An input of a convolution, which reads blocks of packed words.
#[derive(Debug)]
pub(super) struct Input {
    pub(super) buffer: Buffer,
    pub(super) packing: Packing,
    resample: Resample,
    /// Columns of a prepared row, without the halo.
    width: usize,
    /// Length of a prepared row before it is packed.
    row_len: usize,
}

impl Input {
    /// A buffer that is read with `width` columns.
    pub(super) fn new(buffer: Buffer, resample: Resample, width: usize, packing: Packing) -> Self {
        let row_len = Buffer { width, layout: Layout::Blocked, ..buffer.clone() }.row_len();
        Self { buffer, packing, resample, width, row_len }
    }

    /// Length of the ring of `rows` that it needs.
    pub(super) fn ring_len(&self, rows: usize) -> usize {
        match (self.is_plain(), self.packing.numbers) {
            (true, 1) => 0,
            (false, 1) => rows * self.row_len,
            (_, packed) => rows * self.row_len / packed + self.row_len,
        }
    }

    /// Whether its rows need no preparation but packing.
    fn is_plain(&self) -> bool {
        self.resample == Resample::None && self.buffer.layout == Layout::Blocked
    }

    /// Row `y` of the buffer; rows below the image repeat the last one.
    fn stored<'s>(&self, source: &'s [f32], y: usize) -> &'s [f32] {
        let len = self.buffer.row_len();
        &source[y.min(self.buffer.height - 1) * len..][..len]
    }

    /// Row `y` pooled, upsampled or laid out in blocks.
    #[inline(always)]
    fn prepare<S: Simd>(&self, simd: S, source: &[f32], y: usize, out: &mut [f32]) {
        let (row, width) = (|y: usize| self.stored(source, y), self.width);
        match self.resample {
            Resample::AvgPool(side) => avg_pool(simd, side, |i| row(side * y + i), out, width),
            Resample::Upsample2 if y.is_multiple_of(2) => {
                upsample2(simd, [row(y / 2), row((y / 2).saturating_sub(1))], out, width);
            }
            Resample::Upsample2 => upsample2(simd, [row(y / 2), row(y / 2 + 1)], out, width),
            Resample::None => block_lines::<S>(row(y), out, width),
        }
    }

    #[inline(always)]
    fn pack<D: Dot>(&self, dot: D, row: &[f32], words: &mut [f32]) {
        let (lanes, steps) = (D::Simd::LANES, &self.packing.steps);
        let pitch = (self.width + 2 * HALO) * lanes;
        let lines = row.chunks_exact(pitch).zip(words.chunks_exact_mut(pitch / D::PACKED));
        for (block, (line, words)) in lines.enumerate() {
            let (per_unit, zero) = (&steps.per_unit[block * lanes..], &steps.zero[block * lanes..]);
            for (values, words) in line.chunks_exact(lanes).zip(words.chunks_exact_mut(lanes / D::PACKED)) {
                dot.pack(dot.simd().load(values), per_unit, zero, words);
            }
        }
    }
}

/// What a convolution writes, and what each of its one or two inputs reads.
///
/// # Panics
/// When they overlap: no plan lets live buffers do so.
pub(super) fn borrow<'a>(
    arena: &'a mut [f32],
    output: &Buffer,
    inputs: &[Input],
) -> (&'a mut [f32], [&'a [f32]; 2]) {
    let range = |i: usize| inputs.get(i).map_or(0..0, |input| input.buffer.range());
    let [out, first, second] =
        arena.get_disjoint_mut([output.range(), range(0), range(1)]).expect("live buffers do not overlap");
    (out, [first, second])
}

/// The last `ROWS` rows that were prepared of an input: row y is in slot y mod `ROWS`.
pub(super) struct Ring<'a, const ROWS: usize> {
    slots: &'a mut [f32],
    held: [usize; ROWS],
    /// A row on its way, before it is packed.
    unpacked: &'a mut [f32],
}

impl<'a, const ROWS: usize> Ring<'a, ROWS> {
    pub(super) fn new(input: &Input, values: &'a mut [f32]) -> Self {
        let unpacked_len = if input.packing.numbers == 1 { 0 } else { input.row_len };
        let (unpacked, slots) = values.split_at_mut(unpacked_len.min(values.len()));
        Self { slots, held: [usize::MAX; ROWS], unpacked }
    }

    /// Makes sure that the ring holds neighbouring `rows` of the prepared input.
    #[inline(always)]
    pub(super) fn fill<D: Dot>(&mut self, dot: D, input: &Input, source: &[f32], rows: [usize; ROWS]) {
        if input.is_plain() && D::PACKED == 1 {
            return;
        }
        let slot_len = input.row_len / D::PACKED;
        for y in rows {
            if self.held[y % ROWS] == y {
                continue;
            }
            self.held[y % ROWS] = y;
            let slot = &mut self.slots[y % ROWS * slot_len..][..slot_len];
            if D::PACKED == 1 {
                input.prepare(dot.simd(), source, y, slot);
            } else if input.is_plain() {
                input.pack(dot, input.stored(source, y), slot);
            } else {
                input.prepare(dot.simd(), source, y, self.unpacked);
                input.pack(dot, self.unpacked, slot);
            }
        }
    }

    /// Row `y` of the input as the convolution reads it.
    #[inline(always)]
    pub(super) fn row<'s>(&'s self, input: &Input, source: &'s [f32], y: usize) -> &'s [f32] {
        match input.is_plain() && input.packing.numbers == 1 {
            true => input.stored(source, y),
            false => {
                let slot_len = input.row_len / input.packing.numbers;
                &self.slots[y % ROWS * slot_len..][..slot_len]
            }
        }
    }
}
