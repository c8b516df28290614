//! A network in ONNX, operation by operation as `net::naive` computes it.

use super::Form;
use super::kernels::{self, Head};
use super::nodes::{
    self, Conv, PatchSize, avg_pool2, channels, concat, patch_partition, pixel_shuffle, upsample2,
};
use super::tuned;
use super::writer::Writer;
use aonet::internals::graph::{Activation, Op, ValueId};
use aonet::net::{KernelWeights, Model};

/// Names of the values that a network reads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inputs<'a> {
    pub(super) features: &'a str,
    /// The visibility of the search, for networks with a search.
    pub(super) search: Option<&'a str>,
}

/// Appends a network; returns the name of the visibility before clamping, 1x1xHxW.
///
/// # Panics
/// When the network has a search and the inputs have none.
pub(super) fn write(writer: &mut Writer, model: &Model, form: Form, inputs: Inputs<'_>) -> String {
    // Kernels write the head that predicts them.
    let is_head = |value| {
        let reads = |op: &Op| matches!(op, Op::KernelPredict { kernels, .. } if *kernels == value);
        model.graph().nodes().iter().any(|node| reads(&node.op))
    };
    let mut values: Vec<String> = Vec::new();
    for (id, node) in model.graph().nodes().iter().enumerate() {
        let value = match &node.op {
            Op::Search { .. } => inputs.search.expect("the visibility of the search").to_owned(),
            Op::Input { features, search } => {
                let shown = features.horizon().zip(search.map(|id| values[id].as_str()));
                let own = features.channels().len() - 1;
                shown.map_or(inputs.features.to_owned(), |(channel, found)| {
                    with_occlusion(writer, Own { name: inputs.features, count: own }, channel, found)
                })
            }
            Op::PatchPartition { input, patch } => {
                let size = PatchSize { channels: node.channels / (patch * patch), side: *patch };
                patch_partition(writer, &format!("partition{id}"), &values[*input], size)
            }
            Op::PatchMerge { input, patch } => {
                pixel_shuffle(writer, &format!("merge{id}"), &values[*input], *patch)
            }
            Op::Conv { input, .. } if is_head(id) => values[*input].clone(),
            Op::Conv { input, .. } => nodes::conv(writer, &values[*input], conv(model, &node.op)),
            Op::AvgPool2 { input } => avg_pool2(writer, &format!("pool{id}"), &values[*input]),
            Op::Upsample2 { input } => upsample2(writer, &format!("upsample{id}"), &values[*input]),
            Op::Concat { first, second } => {
                concat(writer, &format!("concat{id}"), &[&values[*first], &values[*second]])
            }
            Op::Correct { search, correction } => {
                writer.node(("corrected", "Add"), &[&values[*search], &values[*correction]], &[])
            }
            Op::KernelPredict { kernels, guide, patch, weights } => {
                let head = Head { conv: head(model, *kernels), patch: *patch, weights: *weights };
                let (features, guide) = (&values[*kernels], &values[*guide]);
                match (form, weights) {
                    (Form::Tuned, KernelWeights::Linear) => tuned::apply_head(writer, features, guide, head),
                    (Form::Plain | Form::Tuned, _) => kernels::predict(writer, features, guide, head),
                }
            }
        };
        values.push(value);
    }
    values.pop().expect("a graph has an output")
}

/// A convolution of the graph with its parameters.
///
/// # Panics
/// When the operation is no convolution.
fn conv<'a>(model: &'a Model, op: &'a Op) -> Conv<'a> {
    let Op::Conv { name, groups, activation, .. } = op else { panic!("{op:?} is no convolution") };
    let [weight, bias] = ["weight", "bias"].map(|part| model.weights().get(&format!("{name}.{part}")));
    Conv { name, weight, bias, groups: *groups, activation: *activation }
}

/// The convolution that predicts kernels.
///
/// # Panics
/// When the graph holds a combination that no topology builds: kernels that something else reads or computes.
fn head(model: &Model, kernels: ValueId) -> Conv<'_> {
    match &model.graph().nodes()[kernels].op {
        op @ Op::Conv { size: 1, groups: 1, activation: Activation::Linear, .. }
            if readers(model, kernels).count() == 1 =>
        {
            conv(model, op)
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

/// The features that a file takes.
#[derive(Debug, Clone, Copy)]
struct Own<'a> {
    name: &'a str,
    /// Number of channels.
    count: usize,
}

/// The features of a file with one more channel, number `channel`: 1 minus the visibility of the search.
fn with_occlusion(writer: &mut Writer, features: Own<'_>, channel: usize, found: &str) -> String {
    let Own { name, count } = features;
    let one = writer.scalar(1.0);
    let occlusion = writer.node(("occlusion", "Sub"), &[&one, found], &[]);
    if channel == count {
        return concat(writer, "features/all", &[name, &occlusion]);
    }
    let before = channels(writer, "features/before", name, 0..channel);
    let after = channels(writer, "features/after", name, channel..count);
    concat(writer, "features/all", &[&before, &occlusion, &after])
}
