//! Convolution: of images with many channels by Winograd's minimal filtering, of those with few directly, of small ones by unfolding them, a
//! block of rows at a time, into a matrix product.

use super::Values;
use super::bordered::Rows;
use super::direct::{self, Direct, Filter};
use super::matrix::{Matrix, multiply_add};
use super::winograd::Winograd;
use aonet::internals::simd::Isa;
use aonet::simd::Level;

/// Floats of the unfolded image that are processed at a time: 1 MiB stays in the cache.
const BLOCK: usize = 1 << 18;
/// Most outputs of a group, and least width (px), of a convolution without unfolding. Measured with AVX-512, forward and
/// backward: 16 to 32 channels at 128 px 78 GFLOP/s instead of 61, 24 to 8 at 16 px 42 instead of 21; no gain from 48 outputs on
/// or at 8 px.
const MOST_OUTPUTS: usize = 32;
const LEAST_WIDTH: usize = 16;

/// Fewest channels in and out, and fewest pixels, for which transforms cost less than they save. With eight channels Deep Shading takes 1.5 times
/// the time. The number of pixels is a guess.
const FEWEST_CHANNELS: usize = 16;
const FEWEST_PIXELS: usize = 144;

/// Method of a convolution.
#[derive(Debug, Clone, Copy)]
pub(super) enum Way {
    Unfold,
    /// For filters of 3x3.
    Direct(Isa),
    /// For filters of 3x3.
    Winograd(Isa),
}

/// The gradients to compute, zeros at first. Frozen tensors need none.
pub(super) struct Wanted<'a> {
    pub(super) image: Option<&'a mut [f32]>,
    pub(super) filter: Option<&'a mut [f32]>,
}

/// A convolution's sizes.
pub(super) struct Convolution {
    pub(super) way: Way,
    pub(super) batch: usize,
    pub(super) groups: usize,
    /// Channels of one group.
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) height: usize,
    pub(super) width: usize,
    /// Side of the filter.
    pub(super) size: usize,
}

impl Convolution {
    pub(super) fn of(x: &Values, weight: &Values) -> Self {
        let (x, weight) = (x.layout().shape(), weight.layout().shape());
        let groups = x[1] / weight[1];
        let (inputs, outputs) = (weight[1], weight[0] / groups);
        let (height, width, size) = (x[2], x[3], weight[2]);
        let isa = Isa::new(Level::best()).ok();
        let way = match isa.filter(|_| size == direct::SIZE) {
            Some(isa) if inputs.min(outputs) >= FEWEST_CHANNELS && height * width >= FEWEST_PIXELS => {
                Way::Winograd(isa)
            }
            Some(isa) if outputs <= MOST_OUTPUTS && width >= LEAST_WIDTH => Way::Direct(isa),
            _ => Way::Unfold,
        };
        Self { way, batch: x[0], groups, inputs, outputs, height, width, size }
    }

    pub(super) fn pixels(&self) -> usize {
        self.height * self.width
    }

    /// One group of one image, without unfolding.
    fn direct(&self, isa: Isa) -> Direct {
        let Self { inputs, outputs, height, width, .. } = *self;
        Direct { isa, inputs, outputs, height, width }
    }

    /// One group of one image, with a quarter of the multiplications.
    fn winograd(&self, isa: Isa) -> Winograd {
        let Self { inputs, outputs, height, width, .. } = *self;
        Winograd { isa, inputs, outputs, height, width }
    }

    /// Rows of the unfolded image: every value that one output reads.
    fn unfolded(&self) -> usize {
        self.inputs * self.size * self.size
    }

    /// The image's rows in blocks.
    fn blocks(&self) -> impl Iterator<Item = Rows> + use<> {
        let rows = (BLOCK / (self.unfolded() * self.width)).clamp(1, self.height);
        let height = self.height;
        (0..height).step_by(rows).map(move |first| Rows { first, count: rows.min(height - first) })
    }

    /// Calls `visit` with the row of the unfolded block and the row of the image it comes from, as ranges, and the
    /// filter column's offset.
    fn each_row(&self, block: Rows, mut visit: impl FnMut(usize, usize, isize)) {
        let Rows { first, count: rows } = block;
        let half = (self.size / 2) as isize;
        for channel in 0..self.inputs {
            for tap in 0..self.size * self.size {
                let (dy, dx) = ((tap / self.size) as isize - half, (tap % self.size) as isize - half);
                for row in 0..rows {
                    let y = (first + row).saturating_add_signed(dy).min(self.height - 1);
                    let to = ((channel * self.size * self.size + tap) * rows + row) * self.width;
                    visit(to, (channel * self.height + y) * self.width, dx);
                }
            }
        }
    }

    /// The values that the pixels of a block read, as a matrix of `unfolded` x rows·width.
    fn unfold(&self, image: &[f32], block: Rows, out: &mut [f32]) {
        let w = self.width;
        self.each_row(block, |to, from, dx| {
            let (to, from) = (&mut out[to..to + w], &image[from..from + w]);
            let shift = dx.unsigned_abs().min(w);
            if dx < 0 {
                to[..shift].fill(from[0]);
                to[shift..].copy_from_slice(&from[..w - shift]);
            } else {
                to[..w - shift].copy_from_slice(&from[shift..]);
                to[w - shift..].fill(from[w - 1]);
            }
        });
    }

    /// The transpose of [`Self::unfold`], added to `image`.
    fn fold(&self, unfolded: &[f32], block: Rows, image: &mut [f32]) {
        let w = self.width;
        let add = |to: &mut [f32], from: &[f32]| to.iter_mut().zip(from).for_each(|(t, f)| *t += f);
        self.each_row(block, |from, to, dx| {
            let (from, to) = (&unfolded[from..from + w], &mut image[to..to + w]);
            let shift = dx.unsigned_abs().min(w);
            if dx < 0 {
                to[0] += from[..shift].iter().sum::<f32>();
                add(&mut to[..w - shift], &from[shift..]);
            } else {
                to[w - 1] += from[w - shift..].iter().sum::<f32>();
                add(&mut to[shift..], &from[..w - shift]);
            }
        });
    }

    /// The filters' outputs plus bias, with their slope.
    pub(super) fn forward(&self, x: &[f32], filter: Filter<'_>, out: &mut [f32]) {
        let area = self.pixels();
        let mut columns = vec![0.0; self.buffer()];
        let images = x.chunks_exact(self.inputs * area).zip(out.chunks_exact_mut(self.outputs * area));
        for (i, (x, out)) in images.enumerate() {
            let weight = self.filters_of(i, filter.weight);
            let bias = &filter.bias[i % self.groups * self.outputs..][..self.outputs];
            let (slope, filter) = (filter.slope, Filter { weight, bias, ..filter });
            match self.way {
                Way::Direct(isa) => self.direct(isa).forward(x, filter, out),
                Way::Winograd(isa) => self.winograd(isa).forward(x, filter, out),
                Way::Unfold => {
                    self.unfold_forward(x, filter, &mut columns, out);
                    if slope != 1.0 {
                        out.iter_mut().for_each(|v| *v = v.max(slope * *v));
                    }
                }
            }
        }
    }

    /// The filters' outputs plus bias.
    fn unfold_forward(&self, x: &[f32], filter: Filter<'_>, columns: &mut [f32], out: &mut [f32]) {
        let Filter { weight, bias, .. } = filter;
        let (k, area) = (self.unfolded(), self.pixels());
        out.chunks_exact_mut(area).zip(bias).for_each(|(plane, bias)| plane.fill(*bias));
        for block in self.blocks() {
            let n = block.count * self.width;
            let (columns, stride) = self.columns(x, block, columns);
            let weight = Matrix { values: weight, rows: self.outputs, columns: k, stride: (k, 1) };
            let columns = Matrix { values: columns, rows: k, columns: n, stride: (stride, 1) };
            multiply_add(weight, columns, &mut out[block.first * self.width..], area);
        }
    }

    /// Adds the gradients of the image and of the filter, where they are wanted. `slope` is the gradient of the outputs.
    pub(super) fn backward(&self, x: &[f32], weight: &[f32], slope: &[f32], wanted: Wanted<'_>) {
        let Wanted { mut image, mut filter } = wanted;
        let (k, area) = (self.unfolded(), self.pixels());
        let mut columns = vec![0.0; self.buffer()];
        let images = x.chunks_exact(self.inputs * area).zip(slope.chunks_exact(self.outputs * area));
        for (i, (x, slope)) in images.enumerate() {
            let weight = self.filters_of(i, weight);
            let image =
                image.as_deref_mut().map(|image| &mut image[i * self.inputs * area..][..self.inputs * area]);
            let filter = filter
                .as_deref_mut()
                .map(|filter| &mut filter[i % self.groups * self.outputs * k..][..self.outputs * k]);
            match self.way {
                Way::Winograd(isa) => self.winograd(isa).backward(x, weight, slope, Wanted { image, filter }),
                Way::Direct(isa) => self.direct(isa).backward(x, weight, slope, Wanted { image, filter }),
                Way::Unfold => {
                    if let Some(filter) = filter {
                        self.unfold_filter((x, slope), &mut columns, filter);
                    }
                    if let Some(image) = image {
                        self.unfold_image((weight, slope), &mut columns, image);
                    }
                }
            }
        }
    }

    fn unfold_filter(&self, (x, slope): (&[f32], &[f32]), columns: &mut [f32], filter: &mut [f32]) {
        let k = self.unfolded();
        for block in self.blocks() {
            let n = block.count * self.width;
            let (columns, stride) = self.columns(x, block, columns);
            let seen = Matrix { values: columns, rows: n, columns: k, stride: (1, stride) };
            multiply_add(self.error(slope, block), seen, filter, k);
        }
    }

    fn unfold_image(&self, (weight, slope): (&[f32], &[f32]), back: &mut Vec<f32>, image: &mut [f32]) {
        let k = self.unfolded();
        back.resize(k * self.block(), 0.0);
        for block in self.blocks() {
            let n = block.count * self.width;
            let back = &mut back[..k * n];
            back.fill(0.0);
            let weight = Matrix { values: weight, rows: k, columns: self.outputs, stride: (1, k) };
            multiply_add(weight, self.error(slope, block), back, n);
            self.fold(back, block, image);
        }
    }

    fn error<'a>(&self, slope: &'a [f32], block: Rows) -> Matrix<'a> {
        let values = &slope[block.first * self.width..];
        Matrix { values, rows: self.outputs, columns: block.count * self.width, stride: (self.pixels(), 1) }
    }

    /// The filters of the group that item `i` of all groups of all images belongs to.
    fn filters_of<'a>(&self, i: usize, weight: &'a [f32]) -> &'a [f32] {
        let len = self.outputs * self.unfolded();
        &weight[i % self.groups * len..][..len]
    }

    /// Most pixels in a block.
    fn block(&self) -> usize {
        self.blocks().map(|block| block.count * self.width).max().unwrap_or(0)
    }

    fn buffer(&self) -> usize {
        match self.way {
            Way::Unfold if self.size > 1 => self.unfolded() * self.block(),
            Way::Unfold | Way::Direct(_) | Way::Winograd(_) => 0,
        }
    }

    /// The unfolded block and the distance of its rows; an image seen through a 1x1 filter is its own.
    fn columns<'a>(&self, image: &'a [f32], block: Rows, buffer: &'a mut [f32]) -> (&'a [f32], usize) {
        if self.size == 1 {
            return (&image[block.first * self.width..], self.pixels());
        }
        self.unfold(image, block, buffer);
        (buffer, block.count * self.width)
    }
}
