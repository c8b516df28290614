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

impl Size {
    fn area(self) -> usize {
        self.height * self.width
    }
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

    /// Copies an image's rows from `first` on to all rows of the band. Columns beyond the border on the right are not written.
    #[inline(always)]
    pub(super) fn fill(&mut self, image: &[f32], size: Size, first: usize, beyond: Beyond) {
        let Size { channels, height, width } = size;
        let (lanes, border) = (self.lanes, self.border);
        let nothing = vec![0.0; width];
        let rows = self.values.chunks_exact_mut(self.columns * lanes);
        for (i, line) in rows.enumerate() {
            let (block, row) = (i / self.rows, i % self.rows);
            let nearest = (first + row).saturating_sub(border).min(height - 1);
            let y = (beyond == Beyond::Edge || nearest + border == first + row).then_some(nearest);
            for quad in (0..lanes).step_by(4) {
                let line_of = |i: usize| {
                    let channel = block * lanes + quad + i;
                    match y {
                        Some(y) if channel < channels => &image[(channel * height + y) * width..][..width],
                        _ => &nothing,
                    }
                };
                interleave([0, 1, 2, 3].map(line_of), &mut line[border * lanes + quad..], lanes);
            }
            if border > 0 {
                let end = (width + border) * lanes;
                line.copy_within(lanes..2 * lanes, 0);
                line.copy_within(end - lanes..end, end);
            }
        }
    }

    /// Writes the band's rows to those of an image. For bands without a border.
    #[inline(always)]
    pub(super) fn write(&self, image: &mut [f32], size: Size, rows: Rows) {
        for row in 0..rows.count {
            let at = (rows.first + row) * size.width;
            self.each_line(size, row, |channel, line| {
                image[channel * size.area() + at..][..size.width].copy_from_slice(line);
            });
        }
    }

    /// Adds the band's rows to those of an image, its border to the edge: the transpose of [`Self::fill`] with [`Beyond::Edge`].
    #[inline(always)]
    pub(super) fn add(&self, image: &mut [f32], size: Size, rows: Rows) {
        let Size { height, width, .. } = size;
        for row in 0..rows.count + 2 * self.border {
            let y = (rows.first + row).saturating_sub(self.border).min(height - 1);
            self.each_line(size, row, |channel, line| {
                let to = &mut image[channel * size.area() + y * width..][..width];
                to.iter_mut().zip(&line[self.border..]).for_each(|(to, from)| *to += from);
                if self.border > 0 {
                    to[0] += line[0];
                    to[width - 1] += line[width + 1];
                }
            });
        }
    }

    /// Calls `visit` with every channel and its values in a row of the band, those of the border, too.
    #[inline(always)]
    fn each_line(&self, size: Size, row: usize, mut visit: impl FnMut(usize, &[f32])) {
        let width = size.width + 2 * self.border;
        let mut lines = vec![0.0; 4 * width];
        for first in (0..size.channels).step_by(4) {
            let (block, quad) = (first / self.lanes, first % self.lanes);
            deinterleave(&self.values[self.at(block, row, 0) + quad..], &mut lines, self.lanes);
            let channels = first..size.channels;
            channels.zip(lines.chunks_exact(width)).for_each(|(channel, line)| visit(channel, line));
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
