//! A network rewritten to be fast in ONNX Runtime, and equal to the plain form up to the order of sums.
//!
//! What is rewritten are linear kernels: they are never predicted. The head is linear, so that a pixel's visibility is
//! `sum_k (sum_d W(k,d) f(d) + b(k)) n(k) = sum_d f(d) (sum_k W(k,d) n(k)) + sum_k b(k) n(k)`: convolve the normals with
//! the head's weights, multiply with the features, add up. As many multiplications, but 32 planes for each pixel of the
//! patch instead of 48, no shifted copies of the normals, and all of it in the runtime's blocked layout.
//!
//! Measured with graphs written by hand for the paper's network, 1280x720, one thread, medians of 5 to 7 rounds in turn, beside
//! other load, each list of variants by itself: plain 544 ms;
//! plain with a 1x1 convolution as sum 411 ms; kernels applied a patch at a time, with the taps gathered, 285 to 299 ms; this
//! 226 ms. Tried without a clear gain, therefore not here: other partitions (`SpaceToDepth` of all channels with the
//! first convolution's weights reordered, a transposition, a strided convolution) and upsampling inside the convolution that
//! follows it. Padding by repeating the edge costs about 15 ms; no exact way around it was found.

use super::kernels::Head;
use super::nodes::{self, Crop};
use super::writer::{Attribute, Writer};
use aonet::internals::kernel::{GUIDE_CHANNELS, TAPS, WINDOW};
use aonet::internals::weights::Tensor;

/// Applies the linear kernels of a head without computing them: see the module. `features` is DxHxW, `guide` has full
/// resolution.
pub(super) fn apply_head(writer: &mut Writer, features: &str, guide: &str, head: Head<'_>) -> String {
    let (Head { patch, .. }, weight, bias) = (head, head.conv.weight, head.conv.bias);
    let (area, depth) = (patch * patch, weight.shape[1]);
    let normal = nodes::padded_normal(writer, guide);
    let columns: Vec<String> = (0..patch)
        .map(|dx| match dx {
            0 => normal.clone(),
            _ => {
                let part = Crop { rows: 0..nodes::END, columns: dx as i64..nodes::END };
                nodes::crop(writer, &format!("normal/from{dx}"), &normal, &part)
            }
        })
        .collect();
    let biases = spread_taps([area, patch + WINDOW - 1, patch + WINDOW - 1], |pixel, tap, c| {
        let value = bias.values[pixel * TAPS + tap * GUIDE_CHANNELS + c];
        ([pixel / patch, pixel % patch], value)
    });
    let mut sum = strided(writer, "head/bias", &normal, &biases, patch);
    for pixel in 0..area {
        let (dy, dx) = (pixel / patch, pixel % patch);
        let name = format!("head/pixel{pixel}");
        let taps = spread_taps([depth, dy + WINDOW, WINDOW], |d, tap, c| {
            let row = pixel * TAPS + tap * GUIDE_CHANNELS + c;
            ([dy, 0], weight.values[row * depth + d])
        });
        let normals = strided(writer, &format!("{name}/normals"), &columns[dx], &taps, patch);
        let products = writer.node((&format!("{name}/products"), "Mul"), &[&normals, features], &[]);
        let values = (0..area * depth).map(|i| f32::from(u8::from(i / depth == pixel))).collect();
        let collect = Tensor { shape: vec![area, depth, 1, 1], values };
        let own = strided(writer, &format!("{name}/sum"), &products, &collect, 1);
        sum = writer.node((&name, "Add"), &[&own, &sum], &[]);
    }
    match patch {
        1 => sum,
        _ => nodes::pixel_shuffle(writer, "kernel_mean", &sum, patch),
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
fn strided(writer: &mut Writer, name: &str, input: &str, weight: &Tensor, stride: usize) -> String {
    let constant = writer.tensor(&format!("{name}.weight"), weight);
    let attributes = [
        ("kernel_shape", Attribute::Ints(&weight.shape[2..])),
        ("strides", Attribute::Ints(&[stride, stride])),
    ];
    writer.node((name, "Conv"), &[input, &constant], &attributes)
}
