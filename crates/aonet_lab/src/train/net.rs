//! The graph on Burn tensors: the same operations as every other backend, with gradients.

use super::flex_ops;
use super::samples::sampled;
use aonet::internals::graph::{Activation, Graph, LEAKY_SLOPE, Op};
use aonet::internals::kernel::{FIRST_TAP, GUIDE_CHANNELS, TAPS, WINDOW};
use aonet::internals::neighbours::{self, MAX_DISTANCE};
use aonet::internals::weights::Weights;
use aonet::net::{Channel, KernelWeights, SearchConfig};
use burn::tensor::activation::{leaky_relu, softmax};
use burn::tensor::module::{avg_pool2d, conv2d};
use burn::tensor::ops::{AvgPoolOptions, ConvOptions};
use burn::tensor::{Device, Tensor, TensorData};
use std::collections::BTreeMap;

/// A parameter on the device; biases are stored as O.
#[derive(Debug, Clone)]
pub(crate) enum Param {
    /// OIHW.
    Weight(Tensor<4>),
    /// O.
    Bias(Tensor<1>),
}

/// Parameters of a graph on a device, by name; leaves of the gradient tape when `device` records one.
pub(crate) fn upload(weights: &Weights, device: &Device) -> BTreeMap<String, Param> {
    let of = |tensor: &aonet::internals::weights::Tensor| {
        let data = TensorData::new(tensor.values.clone(), tensor.shape.clone());
        match tensor.shape.len() {
            1 => Param::Bias(Tensor::from_data(data, device).require_grad()),
            _ => Param::Weight(Tensor::from_data(data, device).require_grad()),
        }
    };
    weights.tensors().iter().map(|(name, tensor)| (name.clone(), of(tensor))).collect()
}

/// Who computes what takes the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kernels {
    /// The framework, on any device.
    Framework,
    /// [`flex_ops`], on the CPU only.
    Own,
}

/// What a network reads of crops whose size is a multiple of its alignment.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    /// BxCxHxW: the network's features and what its search found, as far as they do not show it: see
    /// [`sampled`](super::samples::sampled).
    pub(crate) planes: Tensor<4>,
    /// BxSxH'xW': a cell for every patch, if the network has a survey.
    pub(crate) survey: Option<Tensor<4>>,
}

/// The graph's raw output BxHxW (as Bx1xHxW).
pub(crate) fn forward(
    graph: &Graph,
    params: &BTreeMap<String, Param>,
    Seen { planes, survey }: Seen,
    by: Kernels,
) -> Tensor<4> {
    let mut values: Vec<Tensor<4>> = Vec::with_capacity(graph.nodes().len());
    for node in graph.nodes() {
        let of = |value: &usize| values[*value].clone();
        let result = match &node.op {
            Op::Search { search } => found(graph, *search, &planes),
            Op::Input { .. } => first_planes(&planes, node.channels),
            Op::Survey { .. } => survey.clone().expect("what the survey found"),
            Op::PatchPartition { input, patch } => patch_partition(of(input), *patch),
            Op::PatchMerge { input, patch } => patch_merge(of(input), *patch),
            Op::Conv { input, name, size, groups, activation } => {
                let slope = match activation {
                    Activation::Linear => 1.0,
                    Activation::LeakyRelu => LEAKY_SLOPE,
                };
                conv(of(input), Conv::new(params, name, *size, *groups, slope), by)
            }
            Op::AvgPool2 { input } => match by {
                Kernels::Own => flex_ops::pool(of(input)),
                Kernels::Framework => avg_pool2d(of(input), AvgPoolOptions::new([2, 2])),
            },
            Op::Upsample2 { input } => match by {
                Kernels::Own => flex_ops::upsample(of(input)),
                Kernels::Framework => upsample_axis(upsample_axis(of(input), 2), 3),
            },
            Op::Concat { first, second } => Tensor::cat(vec![of(first), of(second)], 1),
            Op::Correct { search, correction, neighbours, .. } => {
                correct(of(search), of(correction), neighbours)
            }
            Op::KernelPredict { kernels, guide, patch, weights } => {
                kernel_predict((of(kernels), of(guide)), *patch, *weights, by)
            }
        };
        values.push(result);
    }
    values.pop().expect("a graph has an output")
}

/// The first planes, without a copy where these are all.
fn first_planes(planes: &Tensor<4>, count: usize) -> Tensor<4> {
    if planes.dims()[1] == count { planes.clone() } else { planes.clone().narrow(1, 0, count) }
}

/// What the search found, its planes side by side.
fn found(graph: &Graph, search: SearchConfig, planes: &Tensor<4>) -> Tensor<4> {
    let features = |op: &Op| if let Op::Input { features, .. } = op { Some(features.clone()) } else { None };
    let features = graph.nodes().iter().find_map(|node| features(&node.op)).expect("a graph has features");
    let sampled = sampled(features, Some(search));
    let plane = |found: usize| {
        let shows = |channel: &Channel| channel.search_plane() == Some(found);
        let at = sampled.channels().iter().position(shows).expect("every plane is sampled");
        let plane = planes.clone().narrow(1, at, 1);
        if sampled.channels()[at] == Channel::HorizonOcclusion { plane.neg() + 1.0 } else { plane }
    };
    Tensor::cat((0..search.planes()).map(plane).collect(), 1)
}

/// See [`Op::Correct`].
fn correct(search: Tensor<4>, correction: Tensor<4>, distances: &[usize]) -> Tensor<4> {
    let planes = correction.dims()[1] - neighbours::count(distances);
    let visibility = search.clone().narrow(1, 0, 1);
    let mut sum = visibility.clone() + correction.clone().narrow(1, 0, 1);
    if planes > 1 {
        let shares = search.narrow(1, 1, planes - 1) * correction.clone().narrow(1, 1, planes - 1);
        sum = sum + shares.sum_dim(1);
    }
    if !distances.is_empty() {
        let weights = correction.narrow(1, planes, neighbours::count(distances));
        let mixed = weights * differences(visibility, distances);
        sum = sum + mixed.sum_dim(1) * neighbours::UNIT;
    }
    sum
}

/// What neighbours have more than a pixel: a channel for each.
fn differences(plane: Tensor<4>, distances: &[usize]) -> Tensor<4> {
    let [_, _, height, width] = plane.dims();
    let padded = repeat_edge(plane.clone(), (MAX_DISTANCE, MAX_DISTANCE));
    let difference = |[down, right]: [isize; 2]| {
        let [top, left] = [down, right].map(|offset| MAX_DISTANCE.saturating_add_signed(offset));
        padded.clone().narrow(2, top, height).narrow(3, left, width) - plane.clone()
    };
    Tensor::cat(neighbours::offsets(distances).into_iter().map(difference).collect(), 1)
}

/// A convolution with its parameters.
struct Conv {
    weight: Tensor<4>,
    bias: Tensor<1>,
    /// Side of the filter.
    size: usize,
    groups: usize,
    /// Factor of negative results.
    slope: f32,
}

impl Conv {
    fn new(params: &BTreeMap<String, Param>, name: &str, size: usize, groups: usize, slope: f32) -> Self {
        let (Param::Weight(weight), Param::Bias(bias)) =
            (&params[&format!("{name}.weight")], &params[&format!("{name}.bias")])
        else {
            unreachable!("weights have four axes and biases one")
        };
        Self { weight: weight.clone(), bias: bias.clone(), size, groups, slope }
    }
}

fn conv(x: Tensor<4>, conv: Conv, by: Kernels) -> Tensor<4> {
    let Conv { weight, bias, size, groups, slope } = conv;
    if by == Kernels::Own {
        return flex_ops::conv(x, (weight, bias), slope);
    }
    let half = size / 2;
    let options = ConvOptions::new([1, 1], [0, 0], [1, 1], groups);
    let y = conv2d(repeat_edge(x, (half, half)), weight, Some(bias), options);
    if slope == 1.0 { y } else { leaky_relu(y, f64::from(slope)) }
}

/// Adds `before` and `after` copies of the first and last row and column.
fn repeat_edge(x: Tensor<4>, (before, after): (usize, usize)) -> Tensor<4> {
    [2, 3].into_iter().fold(x, |x, axis| {
        let last = x.dims()[axis] - 1;
        let mut parts = vec![x.clone().narrow(axis, 0, 1); before];
        parts.push(x.clone());
        parts.extend(vec![x.narrow(axis, last, 1); after]);
        if parts.len() == 1 { parts.remove(0) } else { Tensor::cat(parts, axis) }
    })
}

/// Written out because no GPU backend of the framework differentiates its bilinear interpolation.
fn upsample_axis(x: Tensor<4>, axis: usize) -> Tensor<4> {
    let n = x.dims()[axis];
    let part = |first: usize, len: usize| (len > 0).then(|| x.clone().narrow(axis, first, len));
    let join = |parts: [Option<Tensor<4>>; 2]| Tensor::cat(parts.into_iter().flatten().collect(), axis);
    let before = join([part(0, 1), part(0, n - 1)]);
    let after = join([part(1, n - 1), part(n - 1, 1)]);
    let near = x * 0.75;
    let mut dims = near.dims();
    dims[axis] *= 2;
    let even = near.clone() + before * 0.25;
    let odd = near + after * 0.25;
    Tensor::stack::<5>(vec![even, odd], axis + 1).reshape(dims)
}

fn patch_partition(x: Tensor<4>, p: usize) -> Tensor<4> {
    let [b, c, h, w] = x.dims();
    x.reshape([b, c, h / p, p, w / p, p]).permute([0, 1, 3, 5, 2, 4]).reshape([b, c * p * p, h / p, w / p])
}

fn patch_merge(x: Tensor<4>, p: usize) -> Tensor<4> {
    let [b, c, h, w] = x.dims();
    let c = c / (p * p);
    x.reshape([b, c, p, p, h, w]).permute([0, 1, 4, 2, 5, 3]).reshape([b, c, h * p, w * p])
}

/// AO-Net §3.3, Eq. 2. Everything stays at the kernels' resolution: pixels of a patch are channels.
fn kernel_predict(
    (kernels, guide): (Tensor<4>, Tensor<4>),
    patch: usize,
    weights: KernelWeights,
    by: Kernels,
) -> Tensor<4> {
    let [b, _, h, w] = kernels.dims();
    let pixels = patch * patch;
    let kernels = match weights {
        KernelWeights::Softmax if by == Kernels::Own => flex_ops::softmax(kernels),
        KernelWeights::Softmax => {
            let by_component = kernels.reshape([b, pixels, TAPS / GUIDE_CHANNELS, GUIDE_CHANNELS, h * w]);
            softmax(by_component, 2).reshape([b, pixels * TAPS, h, w])
        }
        KernelWeights::Linear | KernelWeights::Off => kernels,
    };
    if by == Kernels::Own {
        return flex_ops::weigh(kernels, guide);
    }
    let weighted = kernels.reshape([b, pixels, TAPS, h, w]) * neighbourhoods(guide, patch);
    patch_merge(weighted.sum_dim(2).reshape([b, pixels, h, w]) / GUIDE_CHANNELS as f64, patch)
}

/// The 4x4 neighbourhood of every normal: B x patch² x 48 x H/patch x W/patch.
fn neighbourhoods(guide: Tensor<4>, patch: usize) -> Tensor<5> {
    let [b, _, height, width] = guide.dims();
    let (h, w) = (height / patch, width / patch);
    let before = FIRST_TAP.unsigned_abs();
    let padded = repeat_edge(guide.narrow(1, 0, GUIDE_CHANNELS), (before, WINDOW - 1 - before));
    let tap = |t: usize| {
        let shifted = padded.clone().narrow(2, t / WINDOW, height).narrow(3, t % WINDOW, width);
        patch_partition(shifted, patch).reshape([b, GUIDE_CHANNELS, patch * patch, h, w]).swap_dims(1, 2)
    };
    Tensor::cat((0..WINDOW * WINDOW).map(tap).collect(), 2)
}
