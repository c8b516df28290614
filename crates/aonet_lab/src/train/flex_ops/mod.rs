//! Convolution, resampling and kernel prediction on the CPU, with gradients written by hand.
//!
//! The framework's own convolution copies every tensor several times in each direction and pads by concatenation.
//! With these operations a training step takes half the time.

mod blocked;
mod bordered;
mod convolution;
mod direct;
mod matrix;
mod neighbours;
mod points;
mod resample;
mod softmax;
#[cfg(test)]
mod tests;
mod winograd;

use aonet::internals::kernel::TAPS;
use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Dispatch, Flex, backend_extension};
use burn::tensor::{Tensor, TensorData};
use convolution::{Convolution, Wanted};
use direct::Filter;
use neighbours::Neighbours;
use resample::Resample;

/// Convolution BxOxHxW of `x` BxCxHxW with `weight` OIHW, odd and square, and `bias` O, in C/I groups; beyond its border
/// the image repeats its edge. Negative results are multiplied by `slope`, in (0, 1]. On the CPU only.
pub(super) fn conv(x: Tensor<4>, (weight, bias): (Tensor<4>, Tensor<1>), slope: f32) -> Tensor<4> {
    let y = Dispatch::edge_conv(x.into_dispatch(), weight.into_dispatch(), bias.into_dispatch(), slope);
    Tensor::from_dispatch(y)
}

/// The 4x4 neighbourhoods of `guide` Bx3xHxW weighted by `kernels` B x patch²·48 x H/patch x W/patch, their sum over
/// the components divided by three: Bx1xHxW. No gradient for `guide`. On the CPU only. // AO-Net Eq. 2
pub(super) fn weigh(kernels: Tensor<4>, guide: Tensor<4>) -> Tensor<4> {
    Tensor::from_dispatch(Dispatch::weigh_guide(kernels.into_dispatch(), guide.into_dispatch()))
}

/// Of `kernels` B x patch²·48 x H/patch x W/patch, the softmax over the 16 taps of each component. On the CPU only.
pub(super) fn softmax(kernels: Tensor<4>) -> Tensor<4> {
    Tensor::from_dispatch(Dispatch::softmax_taps(kernels.into_dispatch()))
}

/// Means of 2x2 pixels. On the CPU only.
pub(super) fn pool(x: Tensor<4>) -> Tensor<4> {
    Tensor::from_dispatch(Dispatch::resample(x.into_dispatch(), Resample::Pool))
}

/// Bilinear interpolation to twice the size; the edge is repeated. On the CPU only.
pub(super) fn upsample(x: Tensor<4>) -> Tensor<4> {
    Tensor::from_dispatch(Dispatch::resample(x.into_dispatch(), Resample::Upsample))
}

#[backend_extension(Flex, Autodiff)]
trait GraphOps: Backend {
    fn edge_conv(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        slope: f32,
    ) -> FloatTensor<Self>;
    fn weigh_guide(kernels: FloatTensor<Self>, guide: FloatTensor<Self>) -> FloatTensor<Self>;
    fn softmax_taps(kernels: FloatTensor<Self>) -> FloatTensor<Self>;
    fn resample(x: FloatTensor<Self>, to: Resample) -> FloatTensor<Self>;
}

type Values = FloatTensor<Flex>;

impl GraphOps for Flex {
    fn edge_conv(x: Values, weight: Values, bias: Values, slope: f32) -> Values {
        let (x, weight, bias) = (x.to_contiguous(), weight.to_contiguous(), bias.to_contiguous());
        let shape = Convolution::of(&x, &weight);
        let outputs = shape.groups * shape.outputs;
        let mut out = vec![0.0; shape.batch * outputs * shape.pixels()];
        let filter = Filter { weight: floats(&weight), bias: floats(&bias), slope };
        shape.forward(floats(&x), filter, &mut out);
        tensor(out, [shape.batch, outputs, shape.height, shape.width])
    }

    fn weigh_guide(kernels: Values, guide: Values) -> Values {
        let (kernels, guide) = (kernels.to_contiguous(), guide.to_contiguous());
        let neighbours = Neighbours::new(&kernels, &guide);
        let mut out = vec![0.0; neighbours.pixels()];
        neighbours.weigh(floats(&kernels), &mut out);
        tensor(out, [neighbours.batch, 1, neighbours.height, neighbours.width])
    }

    fn softmax_taps(kernels: Values) -> Values {
        let kernels = kernels.to_contiguous();
        let dims: [usize; 4] = kernels.layout().shape().dims();
        tensor(softmax::forward(floats(&kernels), dims[2] * dims[3]), dims)
    }

    fn resample(x: Values, to: Resample) -> Values {
        let x = x.to_contiguous();
        let dims: [usize; 4] = x.layout().shape().dims();
        tensor(to.forward(floats(&x), dims), to.size_of(dims))
    }
}

impl<C: CheckpointStrategy> GraphOps for Autodiff<Flex, C> {
    fn edge_conv(
        x: FloatTensor<Self>,
        weight: FloatTensor<Self>,
        bias: FloatTensor<Self>,
        slope: f32,
    ) -> FloatTensor<Self> {
        let nodes = [x.node(), weight.node(), bias.node()];
        let (x, weight, bias) = (x.into_primitive(), weight.into_primitive(), bias.into_primitive());
        match ConvBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => {
                let y = Flex::edge_conv(x.clone(), weight.clone(), bias, slope);
                let activated = (slope != 1.0).then(|| (y.clone(), slope));
                prep.finish(Seen { x, weight, activated }, y)
            }
            OpsKind::UnTracked(prep) => prep.finish(Flex::edge_conv(x, weight, bias, slope)),
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

    fn softmax_taps(kernels: FloatTensor<Self>) -> FloatTensor<Self> {
        let nodes = [kernels.node()];
        let weights = Flex::softmax_taps(kernels.into_primitive());
        match SoftmaxBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => prep.finish(weights.clone(), weights),
            OpsKind::UnTracked(prep) => prep.finish(weights),
        }
    }

    fn resample(x: FloatTensor<Self>, to: Resample) -> FloatTensor<Self> {
        let nodes = [x.node()];
        let x = x.into_primitive();
        let dims: [usize; 4] = x.layout().shape().dims();
        let y = Flex::resample(x, to);
        match ResampleBackward.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prep) => prep.finish((dims, to), y),
            OpsKind::UnTracked(prep) => prep.finish(y),
        }
    }
}

#[derive(Debug)]
struct ConvBackward;

/// Saved tensors for a convolution's gradients.
#[derive(Debug, Clone)]
struct Seen {
    x: Values,
    weight: Values,
    /// The result, and the factor that its negative values contain.
    activated: Option<(Values, f32)>,
}

impl Backward<Flex, 3> for ConvBackward {
    type State = Seen;

    fn backward(self, ops: Ops<Self::State, 3>, grads: &mut Gradients, _: &mut Checkpointer) {
        let [of_x, of_weight, of_bias] = ops.parents;
        let slope = grads.consume::<Flex>(&ops.node).to_contiguous();
        let slope = before_activation(slope, ops.state.activated);
        let slope = floats(&slope);
        let (x, weight) = (ops.state.x.to_contiguous(), ops.state.weight.to_contiguous());
        let shape = Convolution::of(&x, &weight);
        let outputs = shape.groups * shape.outputs;
        let mut image = of_x.is_some().then(|| vec![0.0; floats(&x).len()]);
        let mut filter = of_weight.is_some().then(|| vec![0.0; floats(&weight).len()]);
        let wanted = Wanted { image: image.as_deref_mut(), filter: filter.as_deref_mut() };
        shape.backward(floats(&x), floats(&weight), slope, wanted);
        if let (Some(node), Some(image)) = (of_x, image) {
            let dims = [shape.batch, shape.groups * shape.inputs, shape.height, shape.width];
            grads.register::<Flex>(node.id, tensor(image, dims));
        }
        if let (Some(node), Some(filter)) = (of_weight, filter) {
            let dims = [outputs, shape.inputs, shape.size, shape.size];
            grads.register::<Flex>(node.id, tensor(filter, dims));
        }
        if let Some(node) = of_bias {
            let mut sums = vec![0.0; outputs];
            for (i, plane) in slope.chunks_exact(shape.pixels()).enumerate() {
                sums[i % outputs] += sum(plane);
            }
            grads.register::<Flex>(node.id, tensor(sums, [outputs]));
        }
    }
}

fn before_activation(slope: Values, activated: Option<(Values, f32)>) -> Values {
    let Some((y, factor)) = activated else { return slope };
    let y = y.to_contiguous();
    let dims: [usize; 4] = y.layout().shape().dims();
    let scaled = floats(&slope).iter().zip(floats(&y)).map(|(s, y)| if *y > 0.0 { *s } else { s * factor });
    tensor(scaled.collect(), dims)
}

/// Computed in lanes, so that the compiler uses vectors.
fn sum(values: &[f32]) -> f32 {
    let (lanes, rest) = values.as_chunks::<16>();
    let mut sums = [0.0; 16];
    for lanes in lanes {
        sums.iter_mut().zip(lanes).for_each(|(s, v)| *s += v);
    }
    sums.iter().chain(rest).sum()
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

#[derive(Debug)]
struct SoftmaxBackward;

impl Backward<Flex, 1> for SoftmaxBackward {
    /// The weights.
    type State = Values;

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let [of_kernels] = ops.parents;
        let slope = grads.consume::<Flex>(&ops.node).to_contiguous();
        let Some(node) = of_kernels else { return };
        let weights = ops.state;
        let dims: [usize; 4] = weights.layout().shape().dims();
        let out = softmax::backward(floats(&weights), floats(&slope), dims[2] * dims[3]);
        grads.register::<Flex>(node.id, tensor(out, dims));
    }
}

#[derive(Debug)]
struct ResampleBackward;

impl Backward<Flex, 1> for ResampleBackward {
    type State = ([usize; 4], Resample);

    fn backward(self, ops: Ops<Self::State, 1>, grads: &mut Gradients, _: &mut Checkpointer) {
        let [of_x] = ops.parents;
        let slope = grads.consume::<Flex>(&ops.node).to_contiguous();
        let Some(node) = of_x else { return };
        let (dims, to) = ops.state;
        grads.register::<Flex>(node.id, tensor(to.backward(floats(&slope), dims), dims));
    }
}

fn floats(tensor: &Values) -> &[f32] {
    tensor.as_slice().expect("made contiguous, f32")
}

fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> Values {
    Values::from_data(TensorData::new(values, shape))
}
