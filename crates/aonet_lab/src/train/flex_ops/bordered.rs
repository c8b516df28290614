//! Images with a border, a band of rows at a time.

/// Values beyond an image's border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Beyond {
    /// The edge is repeated.
    Edge,
    Zero,
}

/// Floats of a band: 256 KiB stay in the cache.
const BAND: usize = 1 << 16;
/// Least rows of a band, so that rows shared by two bands cost little. guess
const LEAST_ROWS: usize = 4;
/// Most lanes of a vector; rows are longer by one vector.
const LANES: usize = 16;

/// Consecutive rows of an image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rows {
    pub(super) first: usize,
    pub(super) count: usize,
}

/// The layout of an image with a border.
pub(super) struct Bordered {
    planes: usize,
    height: usize,
    pub(super) width: usize,
    border: usize,
    beyond: Beyond,
    /// Floats from one row to the next.
    pub(super) stride: usize,
}

impl Bordered {
    pub(super) fn new([planes, height, width]: [usize; 3], border: usize, beyond: Beyond) -> Self {
        let stride = (width + 2 * border).next_multiple_of(LANES) + LANES;
        Self { planes, height, width, border, beyond, stride }
    }

    /// Number of `height` rows to process at a time.
    pub(super) fn rows(&self, height: usize) -> usize {
        (BAND / (self.planes * self.stride)).max(LEAST_ROWS).min(height)
    }

    /// Allocates a band.
    pub(super) fn band(&self, rows: usize) -> Vec<f32> {
        vec![0.0; self.planes * rows * self.stride]
    }

    /// Writes some rows of every plane of `image`, one plane after the other. Row 0 is the border's first.
    pub(super) fn fill(&self, image: &[f32], rows: Rows, band: &mut [f32]) {
        let Rows { first, count } = rows;
        let planes = image.chunks_exact(self.height * self.width);
        for (plane, band) in planes.zip(band.chunks_exact_mut(count * self.stride)) {
            for (row, line) in band.chunks_exact_mut(self.stride).enumerate() {
                let y = (first + row).checked_sub(self.border).filter(|y| *y < self.height);
                let y = match self.beyond {
                    Beyond::Edge => (first + row).saturating_sub(self.border).min(self.height - 1),
                    Beyond::Zero if y.is_none() => {
                        line.fill(0.0);
                        continue;
                    }
                    Beyond::Zero => first + row - self.border,
                };
                self.fill_row(&plane[y * self.width..][..self.width], line);
            }
        }
    }

    fn fill_row(&self, from: &[f32], line: &mut [f32]) {
        let (left, right) = match self.beyond {
            Beyond::Edge => (from[0], from[self.width - 1]),
            Beyond::Zero => (0.0, 0.0),
        };
        line[..self.border].fill(left);
        line[self.border..][..self.width].copy_from_slice(from);
        line[self.border + self.width..].fill(right);
    }
}
