//! Operations of a network as ONNX nodes.

use super::writer::{Attribute, Writer};
use aonet::internals::graph::Activation;
use aonet::internals::graph::LEAKY_SLOPE;
#[cfg(doc)]
use aonet::internals::graph::Op;
use aonet::internals::kernel::{FIRST_TAP, GUIDE_CHANNELS, WINDOW};
use aonet::internals::weights::Tensor;
use std::ops::Range;

/// Position in a slice that stands for the end.
pub(super) const END: i64 = i64::MAX;

/// Channels of an image before it is partitioned, and the side of a patch (px).
#[derive(Debug, Clone, Copy)]
pub(super) struct PatchSize {
    pub(super) channels: usize,
    pub(super) side: usize,
}

/// See [`Op::PatchPartition`]. ONNX puts the channel last, `(dy * patch + dx) * C + c`, so each channel is partitioned alone.
/// (One `Gather` that reorders channels would be shorter, but then OpenVINO 2026.4 computes the next convolution wrongly; the
/// gathered channels themselves are right.)
pub(super) fn patch_partition(writer: &mut Writer, name: &str, input: &str, size: PatchSize) -> String {
    let PatchSize { channels: depth, side } = size;
    let mut parts = Vec::new();
    for c in 0..depth {
        let plane = channels(writer, &format!("{name}/channel{c}"), input, c..c + 1);
        let part = format!("{name}/patches{c}");
        let blocksize = ("blocksize", Attribute::Int(side));
        parts.push(writer.node((&part, "SpaceToDepth"), &[&plane], &[blocksize]));
    }
    concat(writer, name, &parts.iter().map(String::as_str).collect::<Vec<_>>())
}

/// See [`Op::PatchMerge`]. ONNX has two orders of the channels; pnnx, ncnn's converter, knows this one only.
pub(super) fn pixel_shuffle(writer: &mut Writer, name: &str, input: &str, patch: usize) -> String {
    let attributes = [("blocksize", Attribute::Int(patch)), ("mode", Attribute::Text("CRD"))];
    writer.node((name, "DepthToSpace"), &[input], &attributes)
}

/// A convolution with its parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Conv<'a> {
    pub(super) name: &'a str,
    /// OIHW.
    pub(super) weight: &'a Tensor,
    /// O.
    pub(super) bias: &'a Tensor,
    pub(super) groups: usize,
    pub(super) activation: Activation,
}

/// See [`Op::Conv`].
pub(super) fn conv(writer: &mut Writer, input: &str, conv: Conv<'_>) -> String {
    let Conv { name, weight, bias, groups, activation } = conv;
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

/// A range of channels.
pub(super) fn channels(writer: &mut Writer, name: &str, input: &str, range: Range<usize>) -> String {
    let bounds = [range.start as i64, range.end as i64, 1].map(|value| writer.ints(&[value]));
    writer.node((name, "Slice"), &[input, &bounds[0], &bounds[1], &bounds[2]], &[])
}

/// Ranges of rows and columns; a negative end counts from the last one.
#[derive(Debug, Clone)]
pub(super) struct Crop {
    pub(super) rows: Range<i64>,
    pub(super) columns: Range<i64>,
}

/// A part of an image.
pub(super) fn crop(writer: &mut Writer, name: &str, input: &str, part: &Crop) -> String {
    let Crop { rows, columns } = part;
    let bounds = [[rows.start, columns.start], [rows.end, columns.end], [2, 3]];
    let bounds = bounds.map(|values| writer.ints(&values));
    writer.node((name, "Slice"), &[input, &bounds[0], &bounds[1], &bounds[2]], &[])
}

/// The guide's three channels, padded by as many pixels as the taps reach.
pub(super) fn padded_normal(writer: &mut Writer, guide: &str) -> String {
    let normal = channels(writer, "normal", guide, 0..GUIDE_CHANNELS);
    let before = FIRST_TAP.unsigned_abs();
    let after = WINDOW - 1 - before;
    pad_edge(writer, "normal/pad", &normal, [before, before, after, after])
}
