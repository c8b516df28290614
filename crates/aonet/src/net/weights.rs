//! Named tensors of one network and their file: safetensors with the configuration in its metadata.

use crate::error::{Error, Result};
use crate::net::graph::Graph;
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

    /// Random weights for training: He initialisation for LeakyReLU, biases zero. Equal seeds give equal weights.
    // He et al. 2015, Delving Deep into Rectifiers, §2.2: uniform with variance 2 / fan_in.
    pub fn init(graph: &Graph, seed: u64) -> Self {
        let mut state = seed;
        let mut unit = move || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            (split_mix(state) >> 40) as f32 / (1u64 << 24) as f32
        };
        let tensors = graph.params().into_iter().map(|spec| {
            let count: usize = spec.shape.iter().product();
            let fan_in: usize = spec.shape[1..].iter().product();
            let bound = if spec.shape.len() > 1 { (6.0 / fan_in as f32).sqrt() } else { 0.0 };
            let values = (0..count).map(|_| (2.0 * unit() - 1.0) * bound).collect();
            (spec.name, Tensor { shape: spec.shape, values })
        });
        Self { tensors: tensors.collect() }
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

/// Finaliser of SplitMix64 (Steele et al. 2014).
fn split_mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
