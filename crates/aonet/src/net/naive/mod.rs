//! The oracle: the network as plain loops. Slow, obvious, and what every other backend is compared with. It calls nothing
//! of the runtimes: search, features and operations are written again from their definitions. (Only the noise pattern of the
//! search is shared: it is data.)

mod arcs;
mod features;
mod filter;
mod lens;
mod screen;
mod search;
#[cfg(test)]
mod tests;
mod vbao;

use crate::error::Result;
use crate::frame::ao_image::{AoImage, AoParams};
use crate::frame::bent_normals::BentNormals;
use crate::frame::gbuffer::GBuffer;
use crate::net::config::{KernelWeights, SearchConfig};
use crate::net::graph::{Activation, LEAKY_SLOPE, Op};
use crate::net::kernel::{FIRST_TAP, GUIDE_CHANNELS, TAPS, WINDOW};
use crate::net::model::Model;
use crate::net::neighbours;
use crate::search::{ArcsParams, KEEP, Pass};

pub use features::features;
pub use vbao::vbao;

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

    /// An image of rows in which its planes alternate: what
    /// [`search_planes`](crate::net::features::search_planes) returns.
    ///
    /// # Panics
    /// When there are fewer values.
    pub fn from_rows((channels, height, width): (usize, usize, usize), rows: &[f32]) -> Self {
        Self::from_fn((channels, height, width), |c, y, x| rows[(y * channels + c) * width + x])
    }

    /// The value at (c, y, x); coordinates outside the image repeat its edge.
    pub fn at(&self, c: usize, y: isize, x: isize) -> f32 {
        let y = y.clamp(0, self.height as isize - 1) as usize;
        let x = x.clamp(0, self.width as isize - 1) as usize;
        self.values[(c * self.height + y) * self.width + x]
    }

    /// The image with its last column and row repeated until both sides are multiples of `step` (px).
    pub fn padded(&self, step: usize) -> Self {
        let (height, width) = (self.height.next_multiple_of(step), self.width.next_multiple_of(step));
        Self::from_fn((self.channels, height, width), |c, y, x| self.at(c, y as isize, x as isize))
    }
}

/// What a network reads of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Inputs {
    /// CxHxW.
    pub features: Planes,
    /// The visibility that the search found and the shares that it reports, if the network has a search.
    pub search: Option<Planes>,
    /// A cell for every patch of the frame that is padded to the graph's alignment, if the network has a survey.
    pub survey: Option<Planes>,
}

impl Inputs {
    /// The same with features and search padded as [`Planes::padded`] does.
    pub fn padded(self, step: usize) -> Self {
        let search = self.search.as_ref().map(|found| found.padded(step));
        Self { features: self.features.padded(step), search, survey: self.survey }
    }
}

impl From<Planes> for Inputs {
    /// The inputs of a network without a search.
    fn from(features: Planes) -> Self {
        Self { features, search: None, survey: None }
    }
}

/// Visibility of a frame: search, features, network, clamp, background 1.
///
/// # Errors
/// When the frame's size is out of range.
pub fn run(model: &Model, gbuffer: &GBuffer, params: AoParams) -> Result<AoImage> {
    run_on(model, (gbuffer, params), &inputs(model, gbuffer, params))
}

/// The same with what the network reads of the frame, padded to the graph's alignment.
///
/// # Errors
/// When the frame's size is out of range.
///
/// # Panics
/// When the inputs are not those of the network, or of another size than the frame.
pub fn run_on(model: &Model, (gbuffer, params): (&GBuffer, AoParams), inputs: &Inputs) -> Result<AoImage> {
    let mut output = evaluate(model, inputs);
    if let (true, Some(search), Some(found)) = (model.config().smooth, model.config().search, &inputs.search)
    {
        output =
            smoothed(&output, found, |pass, image| search::filter((&search, pass), gbuffer, params, image));
    }
    let width = gbuffer.width();
    let visibility = (0..width * gbuffer.height()).map(|i| match gbuffer.is_foreground(i) {
        true => output.at(0, (i / width) as isize, (i % width) as isize),
        false => 1.0,
    });
    let window = gbuffer.window();
    AoImage::new(window.size(), window.cropped(visibility.collect()))
}

/// The image in [0, 1] after the filter; `found` is what the search found. See [`ModelConfig::smooth`](crate::net::ModelConfig::smooth).
fn smoothed(output: &Planes, found: &Planes, filter: impl Fn(Pass, &Planes) -> Planes) -> Planes {
    let image = |y: usize, x: usize| output.at(0, y as isize, x as isize).clamp(0.0, 1.0);
    if found.channels > 1 {
        let image = Planes::from_fn((1, output.height, output.width), |_, y, x| image(y, x));
        return filter(Pass::Settle { keep: KEEP }, &image);
    }
    let parts = Planes::from_fn((2, output.height, output.width), |c, y, x| {
        let found = found.at(0, y as isize, x as isize);
        if c == 0 { found } else { image(y, x) - found }
    });
    let parts = filter(Pass::Correct { keep: KEEP }, &parts);
    Planes::from_fn((1, parts.height, parts.width), |_, y, x| {
        [0, 1].map(|c| parts.at(c, y as isize, x as isize)).iter().sum::<f32>().clamp(0.0, 1.0)
    })
}

/// The visibility that the network's search finds on a frame, and the shares that it reports, if it has a search.
pub fn search(model: &Model, gbuffer: &GBuffer, params: AoParams) -> Option<Planes> {
    model.config().search.map(|config| search::search(&config, gbuffer, params))
}

/// The bent normals that a search finds on a frame without a guard band.
///
/// # Panics
/// Never: there is a direction for each pixel.
pub fn bent_normals(search: &SearchConfig, gbuffer: &GBuffer, params: AoParams) -> BentNormals {
    let found = search::bent_normals(search, gbuffer, params);
    BentNormals::new(gbuffer.size(), found).expect("a direction for each pixel")
}

/// What the network reads of a frame, padded to the graph's alignment by repeating the edge.
pub fn inputs(model: &Model, gbuffer: &GBuffer, params: AoParams) -> Inputs {
    let (config, step) = (model.config(), model.graph().alignment());
    let search = search(model, gbuffer, params);
    let features = features::features(&config.features, gbuffer, params, search.as_ref());
    let survey = |arcs: &ArcsParams| {
        let cells =
            [gbuffer.width(), gbuffer.height()].map(|side| side.next_multiple_of(step) / config.patch);
        arcs::survey(arcs, gbuffer, params, (cells, config.patch))
    };
    let survey = config.survey.as_ref().map(survey);
    Inputs { features, search, survey }.padded(step)
}

/// The network's raw output, 1xHxW, for inputs whose size is a multiple of the graph's alignment.
///
/// # Panics
/// When the network has a search and the inputs do not.
pub fn evaluate(model: &Model, inputs: &Inputs) -> Planes {
    let mut values: Vec<Planes> = Vec::new();
    for node in model.graph().nodes() {
        let result = match &node.op {
            Op::Search { .. } => inputs.search.clone().expect("what the search found"),
            Op::Input { .. } => inputs.features.clone(),
            Op::Survey { .. } => inputs.survey.clone().expect("what the survey found"),
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
            Op::Correct { search, correction, neighbours, .. } => {
                correct(&values[*search], &values[*correction], neighbours)
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
pub fn correct(search: &Planes, correction: &Planes, distances: &[usize]) -> Planes {
    let offsets = neighbours::offsets(distances);
    let planes = correction.channels - offsets.len();
    Planes::from_fn((1, search.height, search.width), |_, y, x| {
        let (y, x) = (y as isize, x as isize);
        let weighed = (1..planes).map(|c| correction.at(c, y, x) * search.at(c, y, x));
        let mixed = offsets.iter().zip(planes..).map(|([down, right], c)| {
            let difference = search.at(0, y + down, x + right) - search.at(0, y, x);
            neighbours::UNIT * correction.at(c, y, x) * difference
        });
        search.at(0, y, x) + correction.at(0, y, x) + weighed.chain(mixed).sum::<f32>()
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
            KernelWeights::Linear | KernelWeights::Off => kernel,
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
