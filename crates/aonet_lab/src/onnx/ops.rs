//! A network's operations in ONNX, as `net::naive` has them.

use super::Form;
use super::tuned;
use super::writer::{Attribute, Writer};
use aonet::net::graph::{FIRST_TAP, GUIDE_CHANNELS, LEAKY_SLOPE, TAPS, WINDOW};
use aonet::net::{Activation, KernelWeights, Model, Op, Tensor, ValueId};

/// Position in a slice that stands for the end.
pub(super) const END: i64 = i64::MAX;

/// Appends the network, which reads features and what the search found; returns the name of the visibility before
/// clamping, 1x1xHxW.
///
/// # Panics
/// When the network has a search and nothing was found.
pub(super) fn write(
    writer: &mut Writer,
    (model, form): (&Model, Form),
    (features, search): (&str, Option<&str>),
) -> String {
    // Kernels write the head that predicts them.
    let is_head = |value| {
        let reads = |op: &Op| matches!(op, Op::KernelPredict { kernels, .. } if *kernels == value);
        model.graph().nodes().iter().any(|node| reads(&node.op))
    };
    let mut values: Vec<String> = Vec::new();
    for (id, node) in model.graph().nodes().iter().enumerate() {
        let value = match &node.op {
            Op::Search { .. } => search.expect("what the search found").to_owned(),
            Op::Input { features: all, search } => {
                let shown = all.horizon().zip(search.map(|id| values[id].as_str()));
                shown.map_or(features.to_owned(), |shown| {
                    with_occlusion(writer, (features, all.channels().len() - 1), shown)
                })
            }
            Op::PatchPartition { input, patch } => {
                let channels = node.channels / (patch * patch);
                patch_partition(writer, (&format!("partition{id}"), &values[*input]), (channels, *patch))
            }
            Op::PatchMerge { input, patch } => {
                pixel_shuffle(writer, (&format!("merge{id}"), &values[*input]), *patch)
            }
            Op::Conv { input, .. } if is_head(id) => values[*input].clone(),
            Op::Conv { input, name, groups, activation, .. } => {
                let weights = parameters(model, name);
                conv(writer, (name, &values[*input]), weights, (*groups, *activation))
            }
            Op::AvgPool2 { input } => avg_pool2(writer, &format!("pool{id}"), &values[*input]),
            Op::Upsample2 { input } => upsample2(writer, &format!("upsample{id}"), &values[*input]),
            Op::Concat { first, second } => {
                concat(writer, &format!("concat{id}"), &[&values[*first], &values[*second]])
            }
            Op::Correct { search, correction } => {
                writer.node(("corrected", "Add"), &[&values[*search], &values[*correction]], &[])
            }
            Op::KernelPredict { kernels, guide, patch, weights } => {
                let inputs = (values[*kernels].as_str(), values[*guide].as_str());
                let name = head(model, *kernels);
                match (form, weights) {
                    (Form::Tuned, KernelWeights::Linear) => {
                        tuned::apply_head(writer, inputs, parameters(model, name), *patch)
                    }
                    (Form::Plain | Form::Tuned, _) => {
                        kernel_predict(writer, inputs, (name, parameters(model, name)), (*patch, *weights))
                    }
                }
            }
        };
        values.push(value);
    }
    values.pop().expect("a graph has an output")
}

/// The name of the convolution that predicts kernels.
///
/// # Panics
/// When the graph holds a combination that no topology builds: kernels that anything else reads or makes.
fn head(model: &Model, kernels: ValueId) -> &str {
    match &model.graph().nodes()[kernels].op {
        Op::Conv { name, size: 1, groups: 1, activation: Activation::Linear, .. }
            if readers(model, kernels).count() == 1 =>
        {
            name
        }
        other => panic!("kernels come from a 1x1 convolution that nothing else reads, found {other:?}"),
    }
}

/// The operations that read a value.
fn readers(model: &Model, value: ValueId) -> impl Iterator<Item = &Op> {
    let reads = move |op: &Op| match op {
        Op::Search { .. } => false,
        Op::Input { search, .. } => *search == Some(value),
        Op::PatchPartition { input, .. }
        | Op::PatchMerge { input, .. }
        | Op::Conv { input, .. }
        | Op::AvgPool2 { input }
        | Op::Upsample2 { input } => *input == value,
        Op::Concat { first, second } => [*first, *second].contains(&value),
        Op::Correct { search, correction } => [*search, *correction].contains(&value),
        Op::KernelPredict { kernels, guide, .. } => [*kernels, *guide].contains(&value),
    };
    model.graph().nodes().iter().map(|node| &node.op).filter(move |op| reads(op))
}

/// Weight and bias of a convolution.
fn parameters<'a>(model: &'a Model, name: &str) -> [&'a Tensor; 2] {
    ["weight", "bias"].map(|part| model.weights().get(&format!("{name}.{part}")))
}

/// See [`Op::PatchPartition`]. ONNX puts the channel last, `(dy * patch + dx) * C + c`: every channel goes by itself. (To
/// reorder channels with one `Gather` would be shorter, but then OpenVINO 2026.4 gets the convolution that follows wrong; the
/// gathered channels themselves are right.)
pub(super) fn patch_partition(
    writer: &mut Writer,
    (name, input): (&str, &str),
    (depth, patch): (usize, usize),
) -> String {
    let mut parts = Vec::new();
    for c in 0..depth {
        let plane = channels(writer, (&format!("{name}/channel{c}"), input), (c, c + 1));
        let part = format!("{name}/patches{c}");
        let blocksize = ("blocksize", Attribute::Int(patch));
        parts.push(writer.node((&part, "SpaceToDepth"), &[&plane], &[blocksize]));
    }
    concat(writer, name, &parts.iter().map(String::as_str).collect::<Vec<_>>())
}

/// See [`Op::PatchMerge`]. ONNX has two orders of the channels; pnnx, ncnn's converter, knows this one only.
pub(super) fn pixel_shuffle(writer: &mut Writer, (name, input): (&str, &str), patch: usize) -> String {
    let attributes = [("blocksize", Attribute::Int(patch)), ("mode", Attribute::Text("CRD"))];
    writer.node((name, "DepthToSpace"), &[input], &attributes)
}

/// See [`Op::Conv`]. Weight OIHW, bias O.
pub(super) fn conv(
    writer: &mut Writer,
    (name, input): (&str, &str),
    [weight, bias]: [&Tensor; 2],
    (groups, activation): (usize, Activation),
) -> String {
    let size = weight.shape[3];
    let padded = match size {
        1 => input.to_owned(),
        _ => pad_edge(writer, &format!("{name}/pad"), input, [size / 2; 4]),
    };
    let weight = writer.tensor(&format!("{name}.weight"), weight);
    let bias = writer.tensor(&format!("{name}.bias"), bias);
    let attributes = [("kernel_shape", Attribute::Ints(&[size, size])), ("group", Attribute::Int(groups))];
    let sums = writer.node((name, "Conv"), &[&padded, &weight, &bias], &attributes);
    activate(writer, &sums, activation)
}

/// See [`Activation`].
pub(super) fn activate(writer: &mut Writer, sums: &str, activation: Activation) -> String {
    match activation {
        Activation::Linear => sums.to_owned(),
        Activation::LeakyRelu => {
            let alpha = ("alpha", Attribute::Float(LEAKY_SLOPE));
            writer.node((&format!("{sums}/leaky_relu"), "LeakyRelu"), &[sums], &[alpha])
        }
    }
}

/// Repeats the edge: pixels above, left, below and right.
pub(super) fn pad_edge(writer: &mut Writer, name: &str, input: &str, sides: [usize; 4]) -> String {
    let [top, left, bottom, right] = sides.map(|side| side as i64);
    let pads = writer.ints(&[0, 0, top, left, 0, 0, bottom, right]);
    writer.node((name, "Pad"), &[input, &pads], &[("mode", Attribute::Text("edge"))])
}

/// See [`Op::AvgPool2`].
pub(super) fn avg_pool2(writer: &mut Writer, name: &str, input: &str) -> String {
    let two = Attribute::Ints(&[2, 2]);
    writer.node((name, "AveragePool"), &[input], &[("kernel_shape", two), ("strides", two)])
}

/// See [`Op::Upsample2`].
pub(super) fn upsample2(writer: &mut Writer, name: &str, input: &str) -> String {
    let scales = Tensor { shape: vec![4], values: vec![1.0, 1.0, 2.0, 2.0] };
    let scales = writer.tensor("scales", &scales);
    let centres = ("coordinate_transformation_mode", Attribute::Text("half_pixel"));
    writer.node((name, "Resize"), &[input, "", &scales], &[("mode", Attribute::Text("linear")), centres])
}

/// See [`Op::Concat`].
pub(super) fn concat(writer: &mut Writer, name: &str, inputs: &[&str]) -> String {
    writer.node((name, "Concat"), inputs, &[("axis", Attribute::Int(1))])
}

/// `count` features with one more: 1 minus what the search found, as channel number `channel`.
fn with_occlusion(
    writer: &mut Writer,
    (features, count): (&str, usize),
    (channel, found): (usize, &str),
) -> String {
    let one = writer.scalar(1.0);
    let occlusion = writer.node(("occlusion", "Sub"), &[&one, found], &[]);
    if channel == count {
        return concat(writer, "features/all", &[features, &occlusion]);
    }
    let before = channels(writer, ("features/before", features), (0, channel));
    let after = channels(writer, ("features/after", features), (channel, count));
    concat(writer, "features/all", &[&before, &occlusion, &after])
}

/// Channels `first..end`.
pub(super) fn channels(
    writer: &mut Writer,
    (name, input): (&str, &str),
    (first, end): (usize, usize),
) -> String {
    let bounds = [&[first as i64][..], &[end as i64], &[1]].map(|values| writer.ints(values));
    writer.node((name, "Slice"), &[input, &bounds[0], &bounds[1], &bounds[2]], &[])
}

/// Rows and columns `first..end`, (row, column); a negative end counts from the last one.
pub(super) fn window(
    writer: &mut Writer,
    (name, input): (&str, &str),
    (first, end): ([i64; 2], [i64; 2]),
) -> String {
    let bounds = [first, end, [2, 3]].map(|values| writer.ints(&values));
    writer.node((name, "Slice"), &[input, &bounds[0], &bounds[1], &bounds[2]], &[])
}

/// See [`Op::KernelPredict`]. AO-Net §3.3, Eq. 2. With the head of this name and these parameters, which reads `features`.
fn kernel_predict(
    writer: &mut Writer,
    (features, guide): (&str, &str),
    (head, parameters): (&str, [&Tensor; 2]),
    (patch, weights): (usize, KernelWeights),
) -> String {
    let parameters = parameters.map(|tensor| pixels_innermost(tensor, patch));
    let activation = (1, Activation::Linear);
    let kernels = conv(writer, (head, features), parameters.each_ref(), activation);
    let kernels = match patch {
        1 => kernels,
        _ => pixel_shuffle(writer, ("kernels", &kernels), patch),
    };
    let neighbours = neighbours(writer, guide);
    let kernels = match weights {
        KernelWeights::Softmax => return softmax_kernels(writer, &kernels, &neighbours),
        KernelWeights::Linear | KernelWeights::Off => kernels,
    };
    let weighed = writer.node(("weighed", "Mul"), &[&kernels, &neighbours], &[]);
    mean_of_components(writer, &weighed)
}

/// The head's parameters with outputs in the order of [`pixel_shuffle`]: `k * patch² + pixel` instead of `pixel * 48 + k`.
fn pixels_innermost(tensor: &Tensor, patch: usize) -> Tensor {
    let area = patch * patch;
    let inputs = tensor.values.len() / (area * TAPS);
    let output = |i: usize| i % area * TAPS + i / area;
    let values = (0..area * TAPS).flat_map(|i| &tensor.values[output(i) * inputs..][..inputs]);
    Tensor { shape: tensor.shape.clone(), values: values.copied().collect() }
}

/// The guide's three channels with as many pixels around them as the taps reach.
pub(super) fn padded_normal(writer: &mut Writer, guide: &str) -> String {
    let normal = channels(writer, ("normal", guide), (0, GUIDE_CHANNELS));
    let before = FIRST_TAP.unsigned_abs();
    let after = WINDOW - 1 - before;
    pad_edge(writer, "normal/pad", &normal, [before, before, after, after])
}

/// The guide's three channels at every tap: channel `tap * 3 + c`.
fn neighbours(writer: &mut Writer, guide: &str) -> String {
    let padded = padded_normal(writer, guide);
    let end = |first: usize| match WINDOW - 1 - first {
        0 => END,
        left => -(left as i64),
    };
    let mut taps = Vec::new();
    for (y, x) in (0..WINDOW).flat_map(|y| (0..WINDOW).map(move |x| (y, x))) {
        let bounds = ([y as i64, x as i64], [end(y), end(x)]);
        taps.push(window(writer, (&format!("normal/tap{y}{x}"), &padded), bounds));
    }
    concat(writer, "normal/taps", &taps.iter().map(String::as_str).collect::<Vec<_>>())
}

/// For each component of the normal, a softmax over the 16 taps.
fn softmax_kernels(writer: &mut Writer, kernels: &str, neighbours: &str) -> String {
    let mut weighed = Vec::new();
    for c in 0..GUIDE_CHANNELS {
        let bounds = [c as i64, END, 1, GUIDE_CHANNELS as i64].map(|value| writer.ints(&[value]));
        let bounds = bounds.each_ref().map(String::as_str);
        let mut component = |what: &str, of: &str| {
            let inputs = [of, bounds[0], bounds[1], bounds[2], bounds[3]];
            writer.node((&format!("{what}{c}"), "Slice"), &inputs, &[])
        };
        let (kernel, normal) = (component("kernel", kernels), component("component", neighbours));
        let axis = ("axis", Attribute::Int(1));
        let kernel = writer.node((&format!("softmax{c}"), "Softmax"), &[&kernel], &[axis]);
        weighed.push(writer.node((&format!("weighed{c}"), "Mul"), &[&kernel, &normal], &[]));
    }
    let weighed = concat(writer, "weighed", &weighed.iter().map(String::as_str).collect::<Vec<_>>());
    mean_of_components(writer, &weighed)
}

/// The sum of all channels over the number of components. As a mean, because pnnx forgets which channels a `ReduceSum`
/// is over: they are an input of it, but an attribute of this set's `ReduceMean`.
fn mean_of_components(writer: &mut Writer, weighed: &str) -> String {
    let axes = ("axes", Attribute::Ints(&[1]));
    let mean = writer.node(("kernel_mean", "ReduceMean"), &[weighed], &[axes]);
    let taps = writer.scalar((TAPS / GUIDE_CHANNELS) as f32);
    writer.node(("kernel_sum", "Mul"), &[&mean, &taps], &[])
}
