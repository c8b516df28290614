//! Named tensors of one network and their file: safetensors with the configuration in its metadata.

use crate::error::{Error, Result};
use crate::net::config::KernelWeights;
use crate::net::graph::{Graph, Init, Op, ParamSpec, ValueId};
use crate::net::kernel::{GUIDE_CHANNELS, WINDOW};
use crate::random::SplitMix64;
use std::collections::BTreeMap;

/// A dense tensor, row-major f32.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    /// Sizes, outermost first.
    pub shape: Vec<usize>,
    /// Product-of-shape values.
    pub values: Vec<f32>,
}

/// Parameters of a network: exactly the tensors that its graph asks for, all finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    tensors: BTreeMap<String, Tensor>,
}

impl Weights {
    /// Weights for `graph` from named tensors.
    ///
    /// # Errors
    /// When a tensor is missing, superfluous, of another shape, or holds a value that is not finite.
    pub fn new(graph: &Graph, tensors: BTreeMap<String, Tensor>) -> Result<Self> {
        let params = graph.params();
        for spec in &params {
            let tensor = tensors.get(&spec.name).ok_or_else(|| {
                Error::weights(&spec.name, format!("a tensor of shape {:?}", spec.shape), "none")
            })?;
            if tensor.shape != spec.shape || tensor.values.len() != spec.shape.iter().product::<usize>() {
                return Err(Error::weights(
                    &spec.name,
                    format!("shape {:?}", spec.shape),
                    format!("{:?}", tensor.shape),
                ));
            }
            if let Some(bad) = tensor.values.iter().find(|v| !v.is_finite()) {
                return Err(Error::weights(&spec.name, "finite values", bad));
            }
        }
        match tensors.keys().find(|name| !params.iter().any(|p| p.name == **name)) {
            Some(name) => Err(Error::weights(name, "no such tensor", "one")),
            None => Ok(Self { tensors }),
        }
    }

    /// Random weights to start training from, as the topology's authors chose them. Equal seeds give equal weights.
    // He et al. 2015, Delving Deep into Rectifiers, §2.2: uniform with variance 2 / fan_in, biases zero.
    pub fn init(graph: &Graph, seed: u64) -> Self {
        let mut random = SplitMix64::new(seed);
        let mut tensors: BTreeMap<_, _> = graph
            .params()
            .into_iter()
            .map(|spec| {
                let count: usize = spec.shape.iter().product();
                let spread = if spec.shape.len() > 1 { graph.init.spread(&spec) } else { 0.0 };
                // Variance 1, as the spread asks for.
                let values = (0..count).map(|_| (2.0 * random.unit() - 1.0) * 3f32.sqrt() * spread).collect();
                (spec.name, Tensor { shape: spec.shape, values })
            })
            .collect();
        brighten_head(graph, &mut tensors);
        Self { tensors }
    }

    /// The tensor called `name`.
    ///
    /// # Panics
    /// When the graph has no such parameter: a bug of the caller.
    pub fn get(&self, name: &str) -> &Tensor {
        &self.tensors[name]
    }

    /// All tensors by name.
    pub fn tensors(&self) -> &BTreeMap<String, Tensor> {
        &self.tensors
    }

    /// Becomes the mean of itself, with the weight `past`, and of `new`, with the rest.
    ///
    /// # Panics
    /// When `new` belongs to another graph.
    pub fn move_to(&mut self, new: &Self, past: f64) {
        let past = past as f32;
        for (name, tensor) in &mut self.tensors {
            let pairs = tensor.values.iter_mut().zip(&new.get(name).values);
            pairs.for_each(|(mean, new)| *mean = past * *mean + (1.0 - past) * new);
        }
    }

    /// Rounds every value to the nearest half float, as a half-precision file does.
    pub fn rounded_to_half(mut self) -> Self {
        for tensor in self.tensors.values_mut() {
            for v in &mut tensor.values {
                *v = half::f16::from_f32(*v).to_f32();
            }
        }
        self
    }
}

impl Init {
    /// Standard deviation of the weights of a convolution.
    fn spread(self, spec: &ParamSpec) -> f32 {
        match self {
            Self::He => (2.0 / spec.shape[1..].iter().product::<usize>() as f32).sqrt(),
            Self::DeepShading if spec.name.starts_with("down") => 0.011,
            Self::DeepShading => 0.01,
        }
    }
}

/// Starts near a bright image: kernels over normals, in particular, are slow to find it.
fn brighten_head(graph: &Graph, tensors: &mut BTreeMap<String, Tensor>) {
    if graph.init != Init::He {
        return;
    }
    let of_output = |value: ValueId| match &graph.nodes()[value].op {
        Op::KernelPredict { weights, .. } => *weights,
        _ => KernelWeights::Off,
    };
    let (kernel, corrected) = match &graph.nodes()[graph.output()].op {
        Op::Correct { correction, .. } => (of_output(*correction), Some(graph.nodes()[*correction].channels)),
        _ => (of_output(graph.output()), None),
    };
    let (shrink, start) = match corrected {
        Some(_) => (CORRECTION_SHRINK, OVERSHOOT),
        None => (HEAD_SHRINK, BRIGHT),
    };
    if let Some(weight) = tensors.get_mut("head.weight") {
        weight.values.iter_mut().for_each(|w| *w *= shrink);
    }
    if let Some(bias) = tensors.get_mut("head.bias") {
        // Weights of shares start at zero.
        let first_plane = bias.values.len() / corrected.unwrap_or(1);
        for (i, b) in bias.values.iter_mut().enumerate() {
            let taps = (WINDOW * WINDOW) as f32;
            *b = match kernel {
                KernelWeights::Off if i < first_plane => start,
                KernelWeights::Off => 0.0,
                // z of the normal alone.
                KernelWeights::Linear if i % GUIDE_CHANNELS == 2 => {
                    start / MEAN_NORMAL_Z * GUIDE_CHANNELS as f32 / taps
                }
                KernelWeights::Linear | KernelWeights::Softmax => 0.0,
            };
        }
    }
}

/// Visibility of the first image, and the mean z of view-space normals that it is made from: about those of our
/// training frames. guess
const BRIGHT: f32 = 0.9;
const MEAN_NORMAL_Z: f32 = 0.65;
/// How much smaller than elsewhere the head's weights start. guess
const HEAD_SHRINK: f32 = 0.1;
/// The same of a correction, which starts as nothing: at [`HEAD_SHRINK`] its first noise costs so much SSIM that training
/// switches the units off for good instead (seen: no change after 600 steps).
const CORRECTION_SHRINK: f32 = 1e-3;
/// Where a correction starts: open surfaces, most of a frame, then lie above 1, where the clamp hides the noise of
/// learning.
const OVERSHOOT: f32 = 0.06;
