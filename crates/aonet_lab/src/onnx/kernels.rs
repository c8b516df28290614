//! Predicted kernels in ONNX, operation by operation.

use super::nodes::{self, Conv, Crop, END, concat, crop, padded_normal, pixel_shuffle};
use super::writer::{Attribute, Writer};
#[cfg(doc)]
use aonet::internals::graph::Op;
use aonet::internals::kernel::{GUIDE_CHANNELS, TAPS, WINDOW};
use aonet::internals::weights::Tensor;
use aonet::net::KernelWeights;

/// A head that predicts kernels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Head<'a> {
    /// The 1x1 convolution that computes the kernels.
    pub(super) conv: Conv<'a>,
    /// Side of a patch (px).
    pub(super) patch: usize,
    pub(super) weights: KernelWeights,
}

/// See [`Op::KernelPredict`]. AO-Net §3.3, Eq. 2. The head reads `features`; its kernels weigh `guide`.
pub(super) fn predict(writer: &mut Writer, features: &str, guide: &str, head: Head<'_>) -> String {
    let Head { conv, patch, weights } = head;
    let weight = &pixels_innermost(conv.weight, patch);
    let bias = &pixels_innermost(conv.bias, patch);
    let kernels = nodes::conv(writer, features, Conv { weight, bias, ..conv });
    let kernels = match patch {
        1 => kernels,
        _ => pixel_shuffle(writer, "kernels", &kernels, patch),
    };
    let neighbours = neighbours(writer, guide);
    let kernels = match weights {
        KernelWeights::Softmax => return softmax_kernels(writer, &kernels, &neighbours),
        KernelWeights::Linear | KernelWeights::Off => kernels,
    };
    let weighted = writer.node(("weighted", "Mul"), &[&kernels, &neighbours], &[]);
    mean_of_components(writer, &weighted)
}

/// The head's parameters with outputs in the order of [`pixel_shuffle`]: `k * patch² + pixel` instead of `pixel * 48 + k`.
fn pixels_innermost(tensor: &Tensor, patch: usize) -> Tensor {
    let area = patch * patch;
    let inputs = tensor.values.len() / (area * TAPS);
    let output = |i: usize| i % area * TAPS + i / area;
    let values = (0..area * TAPS).flat_map(|i| &tensor.values[output(i) * inputs..][..inputs]);
    Tensor { shape: tensor.shape.clone(), values: values.copied().collect() }
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
        let part = Crop { rows: y as i64..end(y), columns: x as i64..end(x) };
        taps.push(crop(writer, &format!("normal/tap{y}{x}"), &padded, &part));
    }
    concat(writer, "normal/taps", &taps.iter().map(String::as_str).collect::<Vec<_>>())
}

/// For each component of the normal, a softmax over the 16 taps.
fn softmax_kernels(writer: &mut Writer, kernels: &str, neighbours: &str) -> String {
    let mut weighted = Vec::new();
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
        weighted.push(writer.node((&format!("weighted{c}"), "Mul"), &[&kernel, &normal], &[]));
    }
    let weighted = concat(writer, "weighted", &weighted.iter().map(String::as_str).collect::<Vec<_>>());
    mean_of_components(writer, &weighted)
}

/// The sum of all channels over the number of components. As a mean, because pnnx forgets which channels a `ReduceSum`
/// is over: they are an input of it, but an attribute of this set's `ReduceMean`.
fn mean_of_components(writer: &mut Writer, weighted: &str) -> String {
    let axes = ("axes", Attribute::Ints(&[1]));
    let mean = writer.node(("kernel_mean", "ReduceMean"), &[weighted], &[axes]);
    let taps = writer.scalar((TAPS / GUIDE_CHANNELS) as f32);
    writer.node(("kernel_sum", "Mul"), &[&mean, &taps], &[])
}
