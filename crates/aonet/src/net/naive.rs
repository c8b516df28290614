//! The oracle: the network as plain loops. Slow, obvious, and what every other backend is compared with.

use crate::error::Result;
use crate::frame::ao_image::{AoImage, AoParams};
use crate::frame::gbuffer::GBuffer;
use crate::net::config::KernelWeights;
use crate::net::features::{repeat_edge, write_features};
use crate::net::graph::{Activation, FIRST_TAP, GUIDE_CHANNELS, LEAKY_SLOPE, Op, TAPS, WINDOW};
use crate::net::model::Model;

/// A CxHxW image, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct Planes {
    /// Number of planes.
    pub channels: usize,
    /// Rows.
    pub height: usize,
    /// Columns.
    pub width: usize,
    /// C·H·W values.
    pub values: Vec<f32>,
}

impl Planes {
    /// An image whose pixel (c, y, x) is `value(c, y, x)`.
    pub fn from_fn(
        (channels, height, width): (usize, usize, usize),
        value: impl Fn(usize, usize, usize) -> f32,
    ) -> Self {
        let mut values = Vec::with_capacity(channels * height * width);
        for c in 0..channels {
            for y in 0..height {
                values.extend((0..width).map(|x| value(c, y, x)));
            }
        }
        Self { channels, height, width, values }
    }

    /// The value at (c, y, x); coordinates outside the image repeat its edge.
    pub fn at(&self, c: usize, y: isize, x: isize) -> f32 {
        let y = y.clamp(0, self.height as isize - 1) as usize;
        let x = x.clamp(0, self.width as isize - 1) as usize;
        self.values[(c * self.height + y) * self.width + x]
    }
}

/// Visibility of a frame: features, network, clamp, background 1.
///
/// # Errors
/// When the frame's size is out of range.
pub fn run(model: &Model, gbuffer: &GBuffer, params: AoParams) -> Result<AoImage> {
    let output = evaluate(model, padded_features(model, gbuffer, params));
    let width = gbuffer.width();
    let visibility = (0..width * gbuffer.height()).map(|i| match gbuffer.is_foreground(i) {
        true => output.at(0, (i / width) as isize, (i % width) as isize),
        false => 1.0,
    });
    let window = gbuffer.window();
    AoImage::new(window.size(), window.cropped(visibility.collect()))
}

/// Features of a frame, padded to the graph's alignment by repeating the edge.
pub fn padded_features(model: &Model, gbuffer: &GBuffer, params: AoParams) -> Planes {
    let (width, height) = (gbuffer.width(), gbuffer.height());
    let step = model.graph().alignment();
    let (row, rows) = (width.next_multiple_of(step), height.next_multiple_of(step));
    let channels = model.config().features.channels().len();
    let mut values = vec![0.0; channels * rows * row];
    write_features(model.config().features, (gbuffer, params), &mut values, (row, rows * row));
    repeat_edge(&mut values, (width, height), (row, rows * row));
    Planes { channels, height: rows, width: row, values }
}

/// The network's raw output, 1xHxW, for features whose size is a multiple of the graph's alignment.
pub fn evaluate(model: &Model, features: Planes) -> Planes {
    let mut values: Vec<Planes> = Vec::new();
    for node in model.graph().nodes() {
        let result = match &node.op {
            Op::Input => features.clone(),
            Op::PatchPartition { input, patch } => patch_partition(&values[*input], *patch),
            Op::PatchMerge { input, patch } => patch_merge(&values[*input], *patch),
            Op::Conv { input, name, size, activation, .. } => {
                let weight = &model.weights().get(&format!("{name}.weight")).values;
                let bias = &model.weights().get(&format!("{name}.bias")).values;
                conv(&values[*input], (weight, bias, *size), *activation)
            }
            Op::AvgPool2 { input } => avg_pool2(&values[*input]),
            Op::Upsample2 { input } => upsample2(&values[*input]),
            Op::Concat { first, second } => concat(&values[*first], &values[*second]),
            Op::Correct { input, channel, correction } => {
                correct((&values[*input], *channel), &values[*correction])
            }
            Op::KernelPredict { kernels, guide, patch, weights } => {
                kernel_predict(&values[*kernels], &values[*guide], *patch, *weights)
            }
        };
        values.push(result);
    }
    values.pop().expect("a graph has an output")
}

/// See [`Op::PatchPartition`].
pub fn patch_partition(input: &Planes, patch: usize) -> Planes {
    let area = patch * patch;
    Planes::from_fn((input.channels * area, input.height / patch, input.width / patch), |c, y, x| {
        let (dy, dx) = (c % area / patch, c % patch);
        input.at(c / area, (y * patch + dy) as isize, (x * patch + dx) as isize)
    })
}

/// See [`Op::PatchMerge`].
pub fn patch_merge(input: &Planes, patch: usize) -> Planes {
    let area = patch * patch;
    Planes::from_fn((input.channels / area, input.height * patch, input.width * patch), |c, y, x| {
        let channel = c * area + (y % patch) * patch + x % patch;
        input.at(channel, (y / patch) as isize, (x / patch) as isize)
    })
}

/// See [`Op::Conv`]. `weight` is OIHW, `bias` is O; the number of groups follows from their sizes.
pub fn conv(input: &Planes, (weight, bias, size): (&[f32], &[f32], usize), activation: Activation) -> Planes {
    let half = (size / 2) as isize;
    let taps = size * size;
    let inputs = weight.len() / (bias.len() * taps);
    let groups = input.channels / inputs;
    Planes::from_fn((bias.len(), input.height, input.width), |o, y, x| {
        let mut sum = f64::from(bias[o]);
        let first = o / (bias.len() / groups) * inputs;
        for i in 0..inputs {
            for t in 0..taps {
                let (dy, dx) = ((t / size) as isize - half, (t % size) as isize - half);
                let w = weight[(o * inputs + i) * taps + t];
                sum += f64::from(w) * f64::from(input.at(first + i, y as isize + dy, x as isize + dx));
            }
        }
        let sum = sum as f32;
        match activation {
            Activation::Linear => sum,
            Activation::LeakyRelu => sum.max(LEAKY_SLOPE * sum),
        }
    })
}

/// See [`Op::AvgPool2`].
pub fn avg_pool2(input: &Planes) -> Planes {
    Planes::from_fn((input.channels, input.height / 2, input.width / 2), |c, y, x| {
        let (y, x) = (2 * y as isize, 2 * x as isize);
        0.25 * (input.at(c, y, x) + input.at(c, y, x + 1) + input.at(c, y + 1, x) + input.at(c, y + 1, x + 1))
    })
}

/// See [`Op::Upsample2`].
pub fn upsample2(input: &Planes) -> Planes {
    let near_far = |i: usize| {
        let near = (i / 2) as isize;
        (near, if i.is_multiple_of(2) { near - 1 } else { near + 1 })
    };
    Planes::from_fn((input.channels, input.height * 2, input.width * 2), |c, y, x| {
        let ((y0, y1), (x0, x1)) = (near_far(y), near_far(x));
        let line = |y| 0.75 * input.at(c, y, x0) + 0.25 * input.at(c, y, x1);
        0.75 * line(y0) + 0.25 * line(y1)
    })
}

/// See [`Op::Concat`].
pub fn concat(first: &Planes, second: &Planes) -> Planes {
    let values = [first.values.as_slice(), &second.values].concat();
    Planes { channels: first.channels + second.channels, height: first.height, width: first.width, values }
}

/// See [`Op::Correct`].
pub fn correct((input, channel): (&Planes, usize), correction: &Planes) -> Planes {
    Planes::from_fn((1, input.height, input.width), |_, y, x| {
        let (y, x) = (y as isize, x as isize);
        1.0 - input.at(channel, y, x) + correction.at(0, y, x)
    })
}

/// See [`Op::KernelPredict`]. AO-Net §3.3, Eq. 2.
pub fn kernel_predict(kernels: &Planes, guide: &Planes, patch: usize, weights: KernelWeights) -> Planes {
    Planes::from_fn((1, guide.height, guide.width), |_, y, x| {
        let pixel = y % patch * patch + x % patch;
        let kernel: Vec<f32> = (0..TAPS)
            .map(|k| kernels.at(pixel * TAPS + k, (y / patch) as isize, (x / patch) as isize))
            .collect();
        let normal = |k: usize| {
            let (tap, c) = (k / GUIDE_CHANNELS, k % GUIDE_CHANNELS);
            let (dy, dx) = ((tap / WINDOW) as isize + FIRST_TAP, (tap % WINDOW) as isize + FIRST_TAP);
            guide.at(c, y as isize + dy, x as isize + dx)
        };
        let kernel = match weights {
            KernelWeights::Softmax => softmax_over_taps(&kernel),
            KernelWeights::Linear | KernelWeights::Off | KernelWeights::Correction => kernel,
        };
        kernel.iter().enumerate().map(|(k, w)| w * normal(k)).sum::<f32>() / GUIDE_CHANNELS as f32
    })
}

/// For each normal component, softmax over the 16 taps.
fn softmax_over_taps(kernel: &[f32]) -> Vec<f32> {
    let mut out = vec![0.0; kernel.len()];
    for c in 0..GUIDE_CHANNELS {
        let of_component = || (c..kernel.len()).step_by(GUIDE_CHANNELS);
        let largest = of_component().map(|k| kernel[k]).fold(f32::NEG_INFINITY, f32::max);
        let total: f32 = of_component().map(|k| (kernel[k] - largest).exp()).sum();
        of_component().for_each(|k| out[k] = (kernel[k] - largest).exp() / total);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(shape: (usize, usize, usize)) -> Planes {
        Planes::from_fn(shape, |c, y, x| (c * 100 + y * 10 + x) as f32)
    }

    #[test]
    fn partition_then_merge_is_the_identity() {
        let image = ramp((3, 8, 12));
        let parts = patch_partition(&image, 4);
        assert_eq!((parts.channels, parts.height, parts.width), (48, 2, 3));
        assert_eq!(parts.at(16 + 4 + 2, 1, 2), image.at(1, 5, 10));
        assert_eq!(patch_merge(&parts, 4), image);
    }

    #[test]
    fn upsampling_a_ramp_keeps_it_a_ramp() {
        let up = upsample2(&Planes::from_fn((1, 1, 4), |_, _, x| x as f32));
        assert_eq!(up.values[..8], [0.0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.0]);
        assert_eq!(avg_pool2(&up).values, [0.125, 1.0, 2.0, 2.875]);
    }

    #[test]
    fn a_shifted_delta_filter_shifts_and_repeats_the_edge() {
        let mut weight = [0.0; 9];
        weight[5] = 1.0;
        let out = conv(
            &Planes::from_fn((1, 1, 3), |_, _, x| x as f32 + 1.0),
            (&weight, &[0.5], 3),
            Activation::Linear,
        );
        assert_eq!(out.values, [2.5, 3.5, 3.5]);
        let out = conv(&ramp((1, 1, 1)), (&[0.0; 9], &[-1.0], 3), Activation::LeakyRelu);
        assert_eq!(out.values, [-0.01]);
    }

    #[test]
    fn one_kernel_weight_picks_its_tap_of_its_pixel() {
        let guide = ramp((4, 8, 8));
        for (dy, dx, ky, kx, c) in [(0, 0, 0, 0, 0), (3, 2, 3, 1, 2), (1, 3, 2, 3, 1)] {
            let channel = ((dy * 4 + dx) * 16 + ky * 4 + kx) * 3 + c;
            let kernels = Planes::from_fn((768, 2, 2), |k, _, _| if k == channel { 3.0 } else { 0.0 });
            let out = kernel_predict(&kernels, &guide, 4, KernelWeights::Linear);
            let expected = guide.at(c, 4 + dy as isize + ky as isize - 1, dx as isize + kx as isize - 1);
            assert_eq!(out.at(0, 4 + dy as isize, dx as isize), expected);
            let touched = out.values.iter().filter(|v| **v != 0.0).count();
            assert!(touched <= 4, "one pixel a patch, not {touched}");
        }
    }

    #[test]
    fn softmax_of_a_flat_wall_is_the_mean_normal() {
        let guide = Planes::from_fn((3, 4, 4), |c, _, _| [0.6, 0.0, 0.8][c]);
        let kernels = Planes::from_fn((48, 4, 4), |k, y, x| (k * 7 % 5) as f32 + y as f32 - x as f32);
        let out = kernel_predict(&kernels, &guide, 1, KernelWeights::Softmax);
        assert!(out.values.iter().all(|v| (v - 1.4 / 3.0).abs() < 1e-6));
    }
}
