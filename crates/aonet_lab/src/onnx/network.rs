//! A network in ONNX, operation by operation as `net::naive` computes it.

use super::Form;
use super::kernels::{self, Head};
use super::nodes::{
    self, Conv, PatchSize, avg_pool2, channels, concat, patch_partition, pixel_shuffle, upsample2,
};
use super::tuned;
use super::writer::{Attribute, Writer};
use aonet::internals::graph::{Activation, Op, ValueId};
use aonet::internals::neighbours;
use aonet::internals::weights::Tensor;
use aonet::net::{Features, KernelWeights, Model};
use std::ops::Range;

/// Names of the values that a network reads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inputs<'a> {
    pub(super) features: &'a str,
    /// What the search found, for networks with a search.
    pub(super) search: Option<&'a str>,
    /// What the survey found, for networks with a survey.
    pub(super) survey: Option<&'a str>,
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
            Op::Survey { .. } => inputs.survey.expect("what the survey found").to_owned(),
            Op::Input { features, search } => {
                let found = search.map(|id| (values[id].as_str(), model.graph().nodes()[id].channels));
                match found {
                    Some(found) => with_found(writer, features, inputs.features, found),
                    None => inputs.features.to_owned(),
                }
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
            Op::Correct { search, correction, neighbours, .. } => {
                let of = |id: ValueId| (values[id].as_str(), model.graph().nodes()[id].channels);
                correct(writer, of(*search), of(*correction), neighbours)
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

/// See [`Op::Correct`]; values with their numbers of channels.
fn correct(
    writer: &mut Writer,
    search: (&str, usize),
    correction: (&str, usize),
    distances: &[usize],
) -> String {
    let planes = correction.1 - neighbours::count(distances);
    let plane = |writer: &mut Writer, name: &str, (of, all): (&str, usize), which: usize| match all {
        1 => of.to_owned(),
        _ => channels(writer, &format!("{name}{which}"), of, which..which + 1),
    };
    let both = |writer: &mut Writer, which: usize| {
        [plane(writer, "found", search, which), plane(writer, "correction", correction, which)]
    };
    let [found, added] = both(writer, 0);
    let mut sum = writer.node(("corrected", "Add"), &[&found, &added], &[]);
    for which in 1..planes {
        let [share, weight] = both(writer, which);
        let product = writer.node((&format!("weighed{which}"), "Mul"), &[&share, &weight], &[]);
        sum = writer.node((&format!("corrected{which}"), "Add"), &[&sum, &product], &[]);
    }
    if distances.is_empty() {
        return sum;
    }
    let visibility = plane(writer, "visibility", search, 0);
    let differences = differences(writer, &visibility, distances);
    let weights = channels(writer, "neighbours/weights", correction.0, planes..correction.1);
    let weighed = writer.node(("neighbours/weighed", "Mul"), &[&differences, &weights], &[]);
    let axes = ("axes", Attribute::Ints(&[1]));
    let mixed = writer.node(("neighbours/mixed", "ReduceMean"), &[&weighed], &[axes]);
    writer.node(("mixed", "Add"), &[&sum, &mixed], &[])
}

/// What neighbours have more than a pixel, a channel for each, times what a mean of the channels has to be multiplied with: a convolution.
fn differences(writer: &mut Writer, plane: &str, distances: &[usize]) -> String {
    let offsets = neighbours::offsets(distances);
    let reach = distances.iter().copied().max().unwrap_or(0);
    let side = 2 * reach + 1;
    let mut values = vec![0.0; offsets.len() * side * side];
    let unit = neighbours::UNIT * offsets.len() as f32;
    for (filter, [down, right]) in values.chunks_exact_mut(side * side).zip(&offsets) {
        let [row, column] = [down, right].map(|offset| reach.saturating_add_signed(*offset));
        filter[row * side + column] = unit;
        filter[reach * side + reach] = -unit;
    }
    let weight = Tensor { shape: vec![offsets.len(), 1, side, side], values };
    let bias = Tensor { shape: vec![offsets.len()], values: vec![0.0; offsets.len()] };
    let activation = Activation::Linear;
    nodes::conv(
        writer,
        plane,
        Conv { name: "neighbours", weight: &weight, bias: &bias, groups: 1, activation },
    )
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
        Op::Search { .. } | Op::Survey { .. } => false,
        Op::Input { search, .. } => *search == Some(value),
        Op::PatchPartition { input, .. }
        | Op::PatchMerge { input, .. }
        | Op::Conv { input, .. }
        | Op::AvgPool2 { input }
        | Op::Upsample2 { input } => *input == value,
        Op::Concat { first, second } => [*first, *second].contains(&value),
        Op::Correct { search, correction, .. } => [*search, *correction].contains(&value),
        Op::KernelPredict { kernels, guide, .. } => [*kernels, *guide].contains(&value),
    };
    model.graph().nodes().iter().map(|node| &node.op).filter(move |op| reads(op))
}

/// A part of the features: channels of a value side by side.
struct Part {
    of: String,
    channels: Range<usize>,
    /// Channels of the whole value.
    all: usize,
}

impl Part {
    /// Appends a part, or lengthens the last one.
    fn push(self, parts: &mut Vec<Self>) {
        match parts.last_mut() {
            Some(last) if last.of == self.of && last.channels.end == self.channels.start => {
                last.channels.end = self.channels.end;
            }
            Some(_) | None => parts.push(self),
        }
    }

    /// Its name as a value, with a slice where it is not the whole one.
    fn value(&self, writer: &mut Writer, index: usize) -> String {
        match self.channels == (0..self.all) {
            true => self.of.clone(),
            false => channels(writer, &format!("features/part{index}"), &self.of, self.channels.clone()),
        }
    }
}

/// All features: those that the file takes, and the planes of what the search found.
fn with_found(writer: &mut Writer, features: &Features, own: &str, (found, planes): (&str, usize)) -> String {
    let all = features.channels().iter().filter(|channel| channel.search_plane().is_none()).count();
    let (mut parts, mut taken) = (Vec::new(), 0);
    for channel in features.channels() {
        let part = match channel.search_plane() {
            None => {
                taken += 1;
                Part { of: own.to_owned(), channels: taken - 1..taken, all }
            }
            Some(0) => {
                let visibility = Part { of: found.to_owned(), channels: 0..1, all: planes }.value(writer, 0);
                let one = writer.scalar(1.0);
                let occlusion = writer.node(("occlusion", "Sub"), &[&one, &visibility], &[]);
                Part { of: occlusion, channels: 0..1, all: 1 }
            }
            Some(plane) => Part { of: found.to_owned(), channels: plane..plane + 1, all: planes },
        };
        part.push(&mut parts);
    }
    let values: Vec<_> = parts.iter().enumerate().map(|(i, part)| part.value(writer, i + 1)).collect();
    concat(writer, "features/all", &values.iter().map(String::as_str).collect::<Vec<_>>())
}
