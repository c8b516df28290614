//! A network rewritten to be fast in ONNX Runtime, and equal to the plain form up to the order of sums.
//!
//! * `SpaceToDepth` orders channels in its own way; the first convolution's weights follow it.
//! * A linear kernel is never predicted. The head is linear, so that a pixel's visibility is
//!   `sum_k (sum_d W[k,d] f[d] + b[k]) n[k] = sum_d f[d] (sum_k W[k,d] n[k]) + sum_k b[k] n[k]`: convolve the normals with
//!   the head's weights, multiply with the features, add up. As many multiplications, but 32 planes a pixel of the
//!   patch instead of 48, no shifted copies of the normals, and all of it in the runtime's blocked layout.
//!
//! Measured on the paper's network, 1280x720, one thread, medians of 7 rounds in turn: plain 544 ms; kernels applied a
//! patch at a time, with the taps gathered 285 to 300 ms; this 226 ms. Without effect, therefore not here: one strided convolution
//! as partition, upsampling inside the convolution that follows. Padding with zeros, which is another function, would save 17 ms.

use super::plain;
use super::writer::{Attribute, Writer};
use aonet::net::graph::{GUIDE_CHANNELS, TAPS, WINDOW};
use aonet::net::{Activation, KernelWeights, Model, Op, Tensor, ValueId};

/// Appends the network; returns the name of the visibility before clamping, 1x1xHxW.
pub(super) fn write(writer: &mut Writer, model: &Model, features: &str) -> String {
    let nodes = model.graph().nodes();
    let mut values: Vec<String> = Vec::new();
    for (id, node) in nodes.iter().enumerate() {
        let value = match &node.op {
            Op::Input => features.to_owned(),
            Op::PatchPartition { input, patch } if folded_partition(model, id).is_some() => {
                let blocksize = ("blocksize", Attribute::Int(*patch));
                writer.node((&format!("partition{id}"), "SpaceToDepth"), &[&values[*input]], &[blocksize])
            }
            Op::PatchPartition { input, patch } => {
                let shape = (nodes[*input].channels, *patch);
                plain::patch_partition(writer, (&format!("partition{id}"), &values[*input]), shape)
            }
            Op::PatchMerge { input, patch } => {
                plain::depth_to_space(writer, (&format!("merge{id}"), &values[*input]), (*patch, "CRD"))
            }
            // The kernels multiply with its weights themselves.
            Op::Conv { input, .. } if folded_head(model, id).is_some() => values[*input].clone(),
            Op::Conv { input, name, groups, activation, .. } => {
                let [weight, bias] = parameters(model, name);
                let reordered = folded_partition(model, *input).map(|patch| pixel_first(weight, patch));
                let weights = [reordered.as_ref().unwrap_or(weight), bias];
                plain::conv(writer, (name, &values[*input]), weights, (*groups, *activation))
            }
            Op::AvgPool2 { input } => plain::avg_pool2(writer, &format!("pool{id}"), &values[*input]),
            Op::Upsample2 { input } => plain::upsample2(writer, &format!("upsample{id}"), &values[*input]),
            Op::Concat { first, second } => {
                plain::concat(writer, &format!("concat{id}"), &[&values[*first], &values[*second]])
            }
            Op::Correct { input, channel, correction } => {
                plain::correct(writer, (&values[*input], *channel), &values[*correction])
            }
            Op::KernelPredict { kernels, guide, patch, weights } => {
                let inputs = (values[*kernels].as_str(), values[*guide].as_str());
                match folded_head(model, *kernels) {
                    Some(name) => apply_head(writer, inputs, parameters(model, name), *patch),
                    None => plain::kernel_predict(writer, inputs, (*patch, *weights)),
                }
            }
        };
        values.push(value);
    }
    values.pop().expect("a graph has an output")
}

fn parameters<'a>(model: &'a Model, name: &str) -> [&'a Tensor; 2] {
    ["weight", "bias"].map(|part| model.weights().get(&format!("{name}.{part}")))
}

/// The operations that read a value.
fn readers(model: &Model, value: ValueId) -> impl Iterator<Item = &Op> {
    let reads = move |op: &Op| match op {
        Op::Input => false,
        Op::PatchPartition { input, .. }
        | Op::PatchMerge { input, .. }
        | Op::Conv { input, .. }
        | Op::AvgPool2 { input }
        | Op::Upsample2 { input } => *input == value,
        Op::Concat { first, second } => [*first, *second].contains(&value),
        Op::Correct { input, correction, .. } => [*input, *correction].contains(&value),
        Op::KernelPredict { kernels, guide, .. } => [*kernels, *guide].contains(&value),
    };
    model.graph().nodes().iter().map(|node| &node.op).filter(move |op| reads(op))
}

/// The patch of a partition that only convolutions of one group read: the order of its channels is free.
fn folded_partition(model: &Model, value: ValueId) -> Option<usize> {
    let Op::PatchPartition { patch, .. } = &model.graph().nodes()[value].op else { return None };
    let free = |op: &Op| matches!(op, Op::Conv { groups: 1, .. });
    readers(model, value).all(free).then_some(*patch)
}

/// The name of a head without activation that only linear kernels read.
fn folded_head(model: &Model, value: ValueId) -> Option<&str> {
    let head = &model.graph().nodes()[value].op;
    let Op::Conv { name, size: 1, groups: 1, activation: Activation::Linear, .. } = head else { return None };
    let linear = |op: &Op| {
        let Op::KernelPredict { kernels, weights, .. } = op else { return false };
        *kernels == value && *weights == KernelWeights::Linear
    };
    // The output of a network without kernels has no reader.
    let read = readers(model, value).next().is_some();
    (read && readers(model, value).all(linear)).then_some(name)
}

/// Weights OIHW for inputs in the order of `SpaceToDepth`, `(dy * patch + dx) * C + c`, from ours.
fn pixel_first(weight: &Tensor, patch: usize) -> Tensor {
    let (inputs, taps) = (weight.shape[1], weight.shape[2] * weight.shape[3]);
    let (area, channels) = (patch * patch, inputs / (patch * patch));
    let input = |i: usize| i % channels * area + i / channels;
    let value = |o: usize, i: usize, t: usize| weight.values[(o * inputs + input(i)) * taps + t];
    let values =
        (0..weight.values.len()).map(|n| value(n / (inputs * taps), n / taps % inputs, n % taps)).collect();
    Tensor { shape: weight.shape.clone(), values }
}

/// Linear kernels of a head that was not evaluated: see the module. `features` DxHxW, `guide` at full resolution.
fn apply_head(
    writer: &mut Writer,
    (features, guide): (&str, &str),
    [weight, bias]: [&Tensor; 2],
    patch: usize,
) -> String {
    let (area, depth) = (patch * patch, weight.shape[1]);
    let normal = plain::padded_normal(writer, guide);
    let columns: Vec<String> = (0..patch)
        .map(|dx| match dx {
            0 => normal.clone(),
            _ => {
                let all = ([0, dx as i64], [plain::END, plain::END]);
                plain::window(writer, (&format!("normal/from{dx}"), &normal), all)
            }
        })
        .collect();
    let biases = spread_taps([area, patch + WINDOW - 1, patch + WINDOW - 1], |pixel, tap, c| {
        let value = bias.values[pixel * TAPS + tap * GUIDE_CHANNELS + c];
        ([pixel / patch, pixel % patch], value)
    });
    let mut sum = strided(writer, ("head/bias", &normal), &biases, patch);
    for pixel in 0..area {
        let (dy, dx) = (pixel / patch, pixel % patch);
        let name = format!("head/pixel{pixel}");
        let taps = spread_taps([depth, dy + WINDOW, WINDOW], |d, tap, c| {
            let row = pixel * TAPS + tap * GUIDE_CHANNELS + c;
            ([dy, 0], weight.values[row * depth + d])
        });
        let normals = strided(writer, (&format!("{name}/normals"), &columns[dx]), &taps, patch);
        let products = writer.node((&format!("{name}/products"), "Mul"), &[&normals, features], &[]);
        let values = (0..area * depth).map(|i| f32::from(u8::from(i / depth == pixel))).collect();
        let collect = Tensor { shape: vec![area, depth, 1, 1], values };
        let own = strided(writer, (&format!("{name}/sum"), &products), &collect, 1);
        sum = writer.node((&name, "Add"), &[&own, &sum], &[]);
    }
    match patch {
        1 => sum,
        _ => plain::depth_to_space(writer, ("kernel_mean", &sum), (patch, "CRD")),
    }
}

/// Weights `outputs`x3x`height`x`width` that are a third of `tap(output, tap, c)`'s value, at the tap's place in a window that
/// begins at the given (row, column); zero elsewhere.
fn spread_taps(
    [outputs, height, width]: [usize; 3],
    tap: impl Fn(usize, usize, usize) -> ([usize; 2], f32),
) -> Tensor {
    let mut values = vec![0.0; outputs * GUIDE_CHANNELS * height * width];
    for output in 0..outputs {
        for k in 0..TAPS {
            let (place, c) = (k / GUIDE_CHANNELS, k % GUIDE_CHANNELS);
            let ([y, x], value) = tap(output, place, c);
            let (y, x) = (y + place / WINDOW, x + place % WINDOW);
            let plane = output * GUIDE_CHANNELS + c;
            values[(plane * height + y) * width + x] = value / GUIDE_CHANNELS as f32;
        }
    }
    Tensor { shape: vec![outputs, GUIDE_CHANNELS, height, width], values }
}

/// A convolution without padding and bias.
fn strided(writer: &mut Writer, (name, input): (&str, &str), weight: &Tensor, stride: usize) -> String {
    let constant = writer.tensor(&format!("{name}.weight"), weight);
    let attributes = [
        ("kernel_shape", Attribute::Ints(&weight.shape[2..])),
        ("strides", Attribute::Ints(&[stride, stride])),
    ];
    writer.node((name, "Conv"), &[input, &constant], &attributes)
}
