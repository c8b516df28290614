//! Convolution and kernel prediction on the CPU, with gradients written by hand.
//!
//! The framework's own convolution copies every tensor several times in each direction and pads by concatenation:
//! with these two operations a training step takes half the time.
#![allow(unsafe_code, reason = "matrix products by pointer and stride")]

use aonet::net::graph::{FIRST_TAP, GUIDE_CHANNELS, TAPS, WINDOW};
use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Dispatch, Flex, backend_extension};
use burn::tensor::{Tensor, TensorData};

/// Floats of the unfolded image that are worked on at a time: 1 MiB stays in the cache.
const BLOCK: usize = 1 << 18;

/// Convolution BxOxHxW of `x` BxCxHxW with `weight` OIHW, odd and square, and `bias` O; beyond its border the image
/// repeats its edge. On the CPU only.
pub(super) fn conv(x: Tensor<4>, weight: Tensor<4>, bias: Tensor<1>) -> Tensor<4> {
    let y = Dispatch::edge_conv(x.into_dispatch(), weight.into_dispatch(), bias.into_dispatch());
    Tensor::from_dispatch(y)
}

/// The 4x4 neighbourhoods of `guide` Bx3xHxW weighed by `kernels` B x patch²·48 x H/patch x W/patch, their sum over
/// the components divided by three: Bx1xHxW. No gradient for `guide`. On the CPU only. // AO-Net Eq. 2
pub(super) fn weigh(kernels: Tensor<4>, guide: Tensor<4>) -> Tensor<4> {
    Tensor::from_dispatch(Dispatch::weigh_guide(kernels.into_dispatch(), guide.into_dispatch()))
}

#[backend_extension(Flex, Autodiff)]
trait GraphOps: Backend {
    fn edge_conv(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
    ) -> FloatTensor<Self>;
    fn weigh_guide(kernels: FloatTensor<Self>, guide: FloatTensor<Self>) -> FloatTensor<Self>;
}

type Values = FloatTensor<Flex>;

impl GraphOps for Flex {
    fn edge_conv(x: Values, weight: Values, bias: Values) -> Values {
        let (x, weight, bias) = (x.to_contiguous(), weight.to_contiguous(), bias.to_contiguous());
        let shape = ConvShape::of(&x, &weight);
        let mut out = vec![0.0; shape.batch * shape.outputs * shape.pixels()];
        shape.forward((floats(&x), floats(&weight), floats(&bias)), &mut out);
        tensor(out, [shape.batch, shape.outputs, shape.height, shape.width])
    }

    fn weigh_guide(kernels: Values, guide: Values) -> Values {
        let (kernels, guide) = (kernels.to_contiguous(), guide.to_contiguous());
        let neighbours = Neighbours::new(&kernels, &guide);
        let mut out = vec![0.0; neighbours.pixels()];
        neighbours.weigh(floats(&kernels), &mut out);
        tensor(out, [neighbours.batch, 1, neighbours.height, neighbours.width])
    }
}

impl<C: CheckpointStrategy> GraphOps for Autodiff<Flex, C> {
    fn edge_conv(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
    ) -> FloatTensor<Self> {
        let nodes = [x.node(), weight.node(), bias.node()];
        let (x, weight, bias) = (x.into_primitive(), weight.into_primitive(), bias.into_primitive());
        match ConvBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                let y = Flex::edge_conv(x.clone(), weight.clone(), bias);
                prep.finish((x, weight), y)
            }
            OpsKind::UnTracked(prep) => prep.finish(Flex::edge_conv(x, weight, bias)),
        }
    }

    fn weigh_guide(kernels: FloatTensor<Self>, guide: FloatTensor<Self>) -> FloatTensor<Self> {
        let nodes = [kernels.node()];
        let (kernels, guide) = (kernels.into_primitive(), guide.into_primitive());
        match WeighBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                let y = Flex::weigh_guide(kernels.clone(), guide.clone());
                prep.finish((kernels, guide), y)
            }
            OpsKind::UnTracked(prep) => prep.finish(Flex::weigh_guide(kernels, guide)),
        }
    }
}

#[derive(Debug)]
struct ConvBackward;

impl Backward<Flex, 3> for ConvBackward {
    type State = (Values, Values);

    fn backward(self, ops: Ops<Self::State, 3>, grads: &mut Gradients, _: &mut Checkpointer) {
        let [of_x, of_weight, of_bias] = ops.parents;
        let slope = grads.consume::<Flex>(&ops.node).to_contiguous();
        let (x, weight) = (ops.state.0.to_contiguous(), ops.state.1.to_contiguous());
        let shape = ConvShape::of(&x, &weight);
        let image = of_x.is_some().then(|| vec![0.0; floats(&x).len()]);
        let (image, filter) = shape.backward((floats(&x), floats(&weight)), floats(&slope), image);
        if let (Some(node), Some(image)) = (of_x, image) {
            let dims = [shape.batch, shape.inputs, shape.height, shape.width];
            grads.register::<Flex>(node.id, tensor(image, dims));
        }
        if let Some(node) = of_weight {
            let dims = [shape.outputs, shape.inputs, shape.size, shape.size];
            grads.register::<Flex>(node.id, tensor(filter, dims));
        }
        if let Some(node) = of_bias {
            let mut sums = vec![0.0; shape.outputs];
            for (i, plane) in floats(&slope).chunks_exact(shape.pixels()).enumerate() {
                sums[i % shape.outputs] += plane.iter().sum::<f32>();
            }
            grads.register::<Flex>(node.id, tensor(sums, [shape.outputs]));
        }
    }
}

#[derive(Debug)]
struct WeighBackward;

impl Backward<Flex, 1> for WeighBackward {
    type State = (Values, Values);

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let [of_kernels] = ops.parents;
        let slope = grads.consume::<Flex>(&ops.node).to_contiguous();
        let (kernels, guide) = (ops.state.0, ops.state.1.to_contiguous());
        let Some(node) = of_kernels else { return };
        let neighbours = Neighbours::new(&kernels, &guide);
        let mut out = vec![0.0; neighbours.pixels() * TAPS];
        neighbours.spread(floats(&slope), &mut out);
        let (h, w) = (neighbours.cells(), neighbours.row());
        let channels = neighbours.patch * neighbours.patch * TAPS;
        grads.register::<Flex>(node.id, tensor(out, [neighbours.batch, channels, h, w]));
    }
}

fn floats(tensor: &Values) -> &[f32] {
    tensor.as_slice().expect("made contiguous, f32")
}

fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> Values {
    Values::from_data(TensorData::new(values, shape))
}

/// A convolution's sizes.
struct ConvShape {
    batch: usize,
    inputs: usize,
    outputs: usize,
    height: usize,
    width: usize,
    /// Side of the filter.
    size: usize,
}

impl ConvShape {
    fn of(x: &Values, weight: &Values) -> Self {
        let (x, weight) = (x.layout().shape(), weight.layout().shape());
        Self { batch: x[0], inputs: x[1], outputs: weight[0], height: x[2], width: x[3], size: weight[2] }
    }

    fn pixels(&self) -> usize {
        self.height * self.width
    }

    /// Rows of the unfolded image: every value that one output sees.
    fn unfolded(&self) -> usize {
        self.inputs * self.size * self.size
    }

    /// The image's rows in blocks: first row and number of rows.
    fn blocks(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let rows = (BLOCK / (self.unfolded() * self.width)).clamp(1, self.height);
        let height = self.height;
        (0..height).step_by(rows).map(move |y| (y, rows.min(height - y)))
    }

    /// Calls `visit` with the row of the unfolded block and the row of the image it comes from, as ranges, and the
    /// filter column's offset.
    fn each_row(&self, (first, rows): (usize, usize), mut visit: impl FnMut(usize, usize, isize)) {
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

    /// The values that the pixels of a block see, as a matrix of `unfolded` x rows·width.
    fn unfold(&self, image: &[f32], block: (usize, usize), out: &mut [f32]) {
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
    fn fold(&self, unfolded: &[f32], block: (usize, usize), image: &mut [f32]) {
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

    fn forward(&self, (x, weight, bias): (&[f32], &[f32], &[f32]), out: &mut [f32]) {
        let (k, area) = (self.unfolded(), self.pixels());
        let mut columns = vec![0.0; self.buffer()];
        for (x, out) in x.chunks_exact(self.inputs * area).zip(out.chunks_exact_mut(self.outputs * area)) {
            out.chunks_exact_mut(area).zip(bias).for_each(|(plane, bias)| plane.fill(*bias));
            for (first, rows) in self.blocks() {
                let n = rows * self.width;
                let (columns, stride) = self.columns(x, (first, rows), &mut columns);
                let weight = Matrix { values: weight, rows: self.outputs, columns: k, stride: (k, 1) };
                let columns = Matrix { values: columns, rows: k, columns: n, stride: (stride, 1) };
                multiply_add(weight, columns, &mut out[first * self.width..], area);
            }
        }
    }

    /// Gradients of the image, added to the zeros given, and of the filter.
    fn backward(
        &self,
        (x, weight): (&[f32], &[f32]),
        slope: &[f32],
        mut image: Option<Vec<f32>>,
    ) -> (Option<Vec<f32>>, Vec<f32>) {
        let (k, area) = (self.unfolded(), self.pixels());
        let mut filter = vec![0.0; self.outputs * k];
        let mut columns = vec![0.0; self.buffer()];
        let mut back = vec![0.0; if image.is_some() { k * self.block() } else { 0 }];
        for (item, (x, slope)) in
            x.chunks_exact(self.inputs * area).zip(slope.chunks_exact(self.outputs * area)).enumerate()
        {
            for (first, rows) in self.blocks() {
                let n = rows * self.width;
                let slope = &slope[first * self.width..];
                let (columns, stride) = self.columns(x, (first, rows), &mut columns);
                let error = Matrix { values: slope, rows: self.outputs, columns: n, stride: (area, 1) };
                let seen = Matrix { values: columns, rows: n, columns: k, stride: (1, stride) };
                multiply_add(error, seen, &mut filter, k);
                if let Some(image) = &mut image {
                    let back = &mut back[..k * n];
                    back.fill(0.0);
                    let error = Matrix { values: slope, rows: self.outputs, columns: n, stride: (area, 1) };
                    let weight = Matrix { values: weight, rows: k, columns: self.outputs, stride: (1, k) };
                    multiply_add(weight, error, back, n);
                    let image = &mut image[item * self.inputs * area..][..self.inputs * area];
                    self.fold(back, (first, rows), image);
                }
            }
        }
        (image, filter)
    }

    /// Most pixels in a block.
    fn block(&self) -> usize {
        self.blocks().map(|(_, rows)| rows * self.width).max().unwrap_or(0)
    }

    fn buffer(&self) -> usize {
        if self.size == 1 { 0 } else { self.unfolded() * self.block() }
    }

    /// The unfolded block and the distance of its rows; an image seen through a 1x1 filter is its own.
    fn columns<'a>(
        &self,
        image: &'a [f32],
        (first, rows): (usize, usize),
        buffer: &'a mut [f32],
    ) -> (&'a [f32], usize) {
        if self.size == 1 {
            return (&image[first * self.width..], self.pixels());
        }
        self.unfold(image, (first, rows), buffer);
        (buffer, rows * self.width)
    }
}

/// A matrix inside a slice; `stride` is the distance between its rows and between its columns.
struct Matrix<'a> {
    values: &'a [f32],
    rows: usize,
    columns: usize,
    stride: (usize, usize),
}

impl Matrix<'_> {
    fn check(&self) {
        let last = (self.rows - 1) * self.stride.0 + (self.columns - 1) * self.stride.1;
        assert!(last < self.values.len(), "a matrix ends outside its slice");
    }
}

/// Adds the product of `a` and `b` to the matrix in `out` with rows `stride` apart. On the calling thread.
fn multiply_add(a: Matrix, b: Matrix, out: &mut [f32], stride: usize) {
    let (m, n, k) = (a.rows, b.columns, a.columns);
    if m * n * k == 0 {
        return;
    }
    a.check();
    b.check();
    assert_eq!(k, b.rows);
    assert!((m - 1) * stride + n <= out.len() && n <= stride);
    let at = |stride: usize| stride as isize;
    // SAFETY: all three matrices lie inside their slices, checked above, and `out` is borrowed alone.
    unsafe {
        gemm::gemm(
            m,
            n,
            k,
            out.as_mut_ptr(),
            1,
            at(stride),
            true,
            a.values.as_ptr(),
            at(a.stride.1),
            at(a.stride.0),
            b.values.as_ptr(),
            at(b.stride.1),
            at(b.stride.0),
            1.0,
            1.0,
            false,
            false,
            false,
            gemm::Parallelism::None,
        );
    }
}

/// The neighbourhoods of a guide image, sorted so that pixels at one place of their patches lie side by side.
struct Neighbours {
    batch: usize,
    height: usize,
    width: usize,
    patch: usize,
    /// B x 3 x (H + 3) x patch x (W/patch + 1): column `x` of the padded guide is at (x % patch, x / patch).
    guide: Vec<f32>,
}

impl Neighbours {
    fn new(kernels: &Values, guide: &Values) -> Self {
        let (cells, shape) = (kernels.layout().shape(), guide.layout().shape());
        let (batch, channels, height, width) = (shape[0], shape[1], shape[2], shape[3]);
        let patch = width / cells[3];
        let mut this = Self { batch, height, width, patch, guide: Vec::new() };
        let line = this.line();
        this.guide = vec![0.0; batch * GUIDE_CHANNELS * (height + WINDOW - 1) * patch * line];
        let lines = this.guide.chunks_exact_mut(patch * line).enumerate();
        let guide = floats(guide);
        for (i, out) in lines {
            let (plane, y) = (i / (height + WINDOW - 1), i % (height + WINDOW - 1));
            let plane = plane / GUIDE_CHANNELS * channels + plane % GUIDE_CHANNELS;
            let y = y.saturating_add_signed(FIRST_TAP).min(height - 1);
            let from = &guide[(plane * height + y) * width..][..width];
            for (k, value) in out.iter_mut().enumerate() {
                let x = k % line * patch + k / line;
                *value = from[x.saturating_add_signed(FIRST_TAP).min(width - 1)];
            }
        }
        this
    }

    fn pixels(&self) -> usize {
        self.batch * self.height * self.width
    }

    /// Patches from top to bottom.
    fn cells(&self) -> usize {
        self.height / self.patch
    }

    /// Patches from left to right.
    fn row(&self) -> usize {
        self.width / self.patch
    }

    /// Floats from one remainder of a column to the next; a window reaches over at most WINDOW - 1 more columns.
    fn line(&self) -> usize {
        self.row() + (WINDOW - 1).div_ceil(self.patch)
    }

    /// Calls `visit` for every row of every kernel channel: where the row starts in the kernels, where the pixels
    /// that it weighs start in the image (`patch` apart), and the guide's values.
    fn each(&self, mut visit: impl FnMut(usize, usize, &[f32])) {
        let (p, cells, row, line) = (self.patch, self.cells(), self.row(), self.line());
        for item in 0..self.batch {
            for y in 0..cells {
                for pixel in 0..p * p {
                    let (dy, dx) = (pixel / p, pixel % p);
                    let to = (item * self.height + y * p + dy) * self.width + dx;
                    for tap in 0..TAPS {
                        let (component, tap_x) = (tap % GUIDE_CHANNELS, tap / GUIDE_CHANNELS % WINDOW);
                        let guide_y = y * p + dy + tap / GUIDE_CHANNELS / WINDOW;
                        let plane = item * GUIDE_CHANNELS + component;
                        let start = ((plane * (self.height + WINDOW - 1) + guide_y) * p + (dx + tap_x) % p)
                            * line
                            + (dx + tap_x) / p;
                        let kernel = ((item * p * p + pixel) * TAPS + tap) * cells + y;
                        visit(kernel * row, to, &self.guide[start..start + row]);
                    }
                }
            }
        }
    }

    fn weigh(&self, kernels: &[f32], out: &mut [f32]) {
        let row = self.row();
        let mut sums = vec![0.0; row];
        let mut taps = 0;
        self.each(|kernel, to, guide| {
            let kernel = &kernels[kernel..kernel + row];
            for (sum, (k, g)) in sums.iter_mut().zip(kernel.iter().zip(guide)) {
                *sum += k * g;
            }
            taps += 1;
            if taps == TAPS {
                let pixels = out[to..].iter_mut().step_by(self.patch);
                pixels.zip(&sums).for_each(|(o, s)| *o = s / GUIDE_CHANNELS as f32);
                sums.fill(0.0);
                taps = 0;
            }
        });
    }

    /// The transpose of [`Self::weigh`].
    fn spread(&self, slope: &[f32], out: &mut [f32]) {
        let row = self.row();
        let mut slopes = vec![0.0; row];
        let mut current = usize::MAX;
        self.each(|kernel, from, guide| {
            if current != from {
                let pixels = slope[from..].iter().step_by(self.patch);
                slopes.iter_mut().zip(pixels).for_each(|(t, s)| *t = s / GUIDE_CHANNELS as f32);
                current = from;
            }
            let out = &mut out[kernel..kernel + row];
            for (o, (s, g)) in out.iter_mut().zip(slopes.iter().zip(guide)) {
                *o = s * g;
            }
        });
    }
}
