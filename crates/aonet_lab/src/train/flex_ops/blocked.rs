//! Bands of rows whose channels lie in blocks, a vector each.

use super::bordered::{Beyond, Rows};
use aonet::internals::simd::{Simd, columns, four};

/// A band of rows: by block of channels, row, column, channel.
pub(super) struct Blocked {
    pub(super) values: Vec<f32>,
    /// Lanes of a vector.
    lanes: usize,
    channels: usize,
    /// Rows and columns with the border.
    rows: usize,
    columns: usize,
    /// Pixels of the border: 0 or 1.
    border: usize,
}

/// The image that a band is a part of: planes of rows.
#[derive(Clone, Copy)]
pub(super) struct Size {
    pub(super) channels: usize,
    pub(super) height: usize,
    pub(super) width: usize,
}

impl Blocked {
    /// A band of zeros; `rows` and `columns` without the border.
    pub(super) fn new(lanes: usize, channels: usize, [rows, columns]: [usize; 2], border: usize) -> Self {
        let (rows, columns) = (rows + 2 * border, columns + 2 * border);
        let values = vec![0.0; channels.div_ceil(lanes) * rows * columns * lanes];
        Self { values, lanes, channels, rows, columns, border }
    }

    pub(super) fn blocks(&self) -> usize {
        self.channels.div_ceil(self.lanes)
    }

    /// The index of a vector.
    #[inline(always)]
    pub(super) fn at(&self, block: usize, row: usize, column: usize) -> usize {
        ((block * self.rows + row) * self.columns + column) * self.lanes
    }

    /// The row of the image that a row of the band shows, for a band whose first row without the border is `first`.
    fn row_of(&self, row: usize, first: usize, height: usize) -> Option<usize> {
        (first + row).checked_sub(self.border).filter(|y| *y < height)
    }

    /// Copies rows of an image, from `rows.first` on; without the border, `rows.count` of the band's are of use. What lies beyond the right border
    /// is finite, and zero if everything beyond is.
    #[inline(always)]
    pub(super) fn fill(&mut self, image: &[f32], size: Size, rows: Rows, beyond: Beyond) {
        let Size { channels, height, width } = size;
        let nothing = vec![0.0; width];
        for block in 0..self.blocks() {
            for row in 0..rows.count + 2 * self.border {
                let y = match (self.row_of(row, rows.first, height), beyond) {
                    (Some(y), _) => Some(y),
                    (None, Beyond::Zero) => None,
                    (None, Beyond::Edge) => {
                        Some((rows.first + row).saturating_sub(self.border).min(height - 1))
                    }
                };
                let start = self.at(block, row, 0);
                let line = &mut self.values[start..start + self.columns * self.lanes];
                for quad in (0..self.lanes).step_by(4) {
                    let line_of = |i: usize| {
                        let channel = block * self.lanes + quad + i;
                        match y {
                            Some(y) if channel < channels => {
                                &image[(channel * height + y) * width..][..width]
                            }
                            _ => &nothing,
                        }
                    };
                    interleave(
                        [0, 1, 2, 3].map(line_of),
                        &mut line[self.border * self.lanes + quad..],
                        self.lanes,
                    );
                }
                if self.border > 0 {
                    let (lanes, end) = (self.lanes, (width + self.border) * self.lanes);
                    line.copy_within(lanes..2 * lanes, 0);
                    line.copy_within(end - lanes..end, end);
                }
            }
        }
    }

    /// Writes the band's rows to those of an image. Without a border only.
    #[inline(always)]
    pub(super) fn write(&self, image: &mut [f32], size: Size, rows: Rows) {
        let Size { channels, height, width } = size;
        let mut line = vec![0.0; 4 * width];
        for (block, row) in (0..self.blocks()).flat_map(|block| (0..rows.count).map(move |row| (block, row)))
        {
            let y = rows.first + row;
            for quad in (0..self.lanes).step_by(4) {
                deinterleave(&self.values[self.at(block, row, 0) + quad..], &mut line, self.lanes);
                let first = block * self.lanes + quad;
                for (channel, line) in (first..channels).zip(line.chunks_exact(width)) {
                    image[(channel * height + y) * width..][..width].copy_from_slice(line);
                }
            }
        }
    }

    /// Adds the band's rows to those of an image, its border to the edge: the transpose of [`Self::fill`] with [`Beyond::Edge`].
    #[inline(always)]
    pub(super) fn add(&self, image: &mut [f32], size: Size, rows: Rows) {
        let Size { channels, height, width } = size;
        let wide = width + 2 * self.border;
        let mut line = vec![0.0; 4 * wide];
        let all = rows.count + 2 * self.border;
        for (block, row) in (0..self.blocks()).flat_map(|block| (0..all).map(move |row| (block, row))) {
            let y = (rows.first + row).saturating_sub(self.border).min(height - 1);
            for quad in (0..self.lanes).step_by(4) {
                deinterleave(&self.values[self.at(block, row, 0) + quad..], &mut line, self.lanes);
                let first = block * self.lanes + quad;
                for (channel, line) in (first..channels).zip(line.chunks_exact(wide)) {
                    let to = &mut image[(channel * height + y) * width..][..width];
                    to.iter_mut().zip(&line[self.border..]).for_each(|(to, from)| *to += from);
                    if self.border > 0 {
                        to[0] += line[0];
                        to[width - 1] += line[wide - 1];
                    }
                }
            }
        }
    }
}

/// Writes four rows as columns of four, `lanes` apart.
#[inline(always)]
fn interleave(rows: [&[f32]; 4], to: &mut [f32], lanes: usize) {
    let width = rows[0].len();
    let whole = width / 4 * 4;
    for x in (0..whole).step_by(4) {
        let pixels = columns(rows.map(|row| four(row, x)));
        for (i, pixel) in pixels.iter().enumerate() {
            to[(x + i) * lanes..][..4].copy_from_slice(pixel);
        }
    }
    for x in whole..width {
        to[x * lanes..][..4].copy_from_slice(&rows.map(|row| row[x]));
    }
}

/// The transpose of [`interleave`]: four rows, one after the other.
#[inline(always)]
fn deinterleave(from: &[f32], rows: &mut [f32], lanes: usize) {
    let width = rows.len() / 4;
    let whole = width / 4 * 4;
    for x in (0..whole).step_by(4) {
        let pixels = columns([0, 1, 2, 3].map(|i| four(from, (x + i) * lanes)));
        for (i, pixels) in pixels.iter().enumerate() {
            rows[i * width + x..][..4].copy_from_slice(pixels);
        }
    }
    for (x, i) in (whole..width).flat_map(|x| (0..4).map(move |i| (x, i))) {
        rows[i * width + x] = from[x * lanes + i];
    }
}

/// Vectors of a row of a band.
#[inline(always)]
pub(super) fn vectors<S: Simd, const N: usize>(simd: S, from: &[f32]) -> [S::F; N] {
    let from = &from[..N * S::LANES];
    let mut vectors = [simd.splat(0.0); N];
    for i in 0..N {
        vectors[i] = simd.load(&from[i * S::LANES..]);
    }
    vectors
}
