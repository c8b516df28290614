//! Convolution and kernel prediction on the CPU, with gradients written by hand.
//!
//! The framework's own convolution copies every tensor several times in each direction and pads by concatenation:
//! with these two operations a training step takes half the time.

mod convolution;
mod neighbours;

use aonet::net::graph::TAPS;
use burn::backend::autodiff::checkpoint::base::Checkpointer;
use burn::backend::autodiff::checkpoint::strategy::CheckpointStrategy;
use burn::backend::autodiff::grads::Gradients;
use burn::backend::autodiff::ops::{Backward, Ops, OpsKind};
use burn::backend::tensor::FloatTensor;
use burn::backend::{Autodiff, Backend, Dispatch, Flex, backend_extension};
use burn::tensor::{Tensor, TensorData};
use convolution::Convolution;
use neighbours::Neighbours;

/// Convolution BxOxHxW of `x` BxCxHxW with `weight` OIHW, odd and square, and `bias` O, in C/I groups; beyond its border
/// the image repeats its edge. On the CPU only.
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
        let shape = Convolution::of(&x, &weight);
        let outputs = shape.groups * shape.outputs;
        let mut out = vec![0.0; shape.batch * outputs * shape.pixels()];
        shape.forward((floats(&x), floats(&weight), floats(&bias)), &mut out);
        tensor(out, [shape.batch, outputs, shape.height, shape.width])
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
        let shape = Convolution::of(&x, &weight);
        let outputs = shape.groups * shape.outputs;
        let image = of_x.is_some().then(|| vec![0.0; floats(&x).len()]);
        let filter = of_weight.is_some().then(|| vec![0.0; floats(&weight).len()]);
        let (image, filter) = shape.backward((floats(&x), floats(&weight)), floats(&slope), (image, filter));
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
            for (i, plane) in floats(&slope).chunks_exact(shape.pixels()).enumerate() {
                sums[i % outputs] += plane.iter().sum::<f32>();
            }
            grads.register::<Flex>(node.id, tensor(sums, [outputs]));
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
