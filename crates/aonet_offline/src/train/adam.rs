//! Adam on host vectors, so that a checkpoint is plain tensors and resuming is exact on every device.
// Kingma and Ba 2015, Algorithm 1.

use aonet::net::{Tensor, Weights};
use std::collections::BTreeMap;

const BETA1: f64 = 0.9;
const BETA2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// Gradients by parameter name, in the parameters' layout.
pub(crate) type Gradients = BTreeMap<String, Vec<f32>>;

/// First and second moments of every parameter, and the number of steps taken.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Adam {
    pub(crate) step: u64,
    pub(crate) mean: Gradients,
    pub(crate) square: Gradients,
}

impl Adam {
    pub(crate) fn new(weights: &Weights) -> Self {
        let zeros = |(name, tensor): (&String, &Tensor)| (name.clone(), vec![0.0; tensor.values.len()]);
        let mean: Gradients = weights.tensors().iter().map(zeros).collect();
        Self { step: 0, square: mean.clone(), mean }
    }

    /// One step: returns the new tensors.
    pub(crate) fn update(
        &mut self,
        weights: &Weights,
        gradients: &Gradients,
        rate: f64,
    ) -> BTreeMap<String, Tensor> {
        self.step += 1;
        let power = self.step.min(i32::MAX as u64) as i32;
        let (bias1, bias2) = (1.0 - BETA1.powi(power), 1.0 - BETA2.powi(power));
        let mut tensors = weights.tensors().clone();
        for (name, tensor) in &mut tensors {
            let mean = self.mean.get_mut(name).expect("a moment for every parameter");
            let square = self.square.get_mut(name).expect("a moment for every parameter");
            let moments = mean.iter_mut().zip(square);
            for ((w, (m, s)), g) in tensor.values.iter_mut().zip(moments).zip(&gradients[name]) {
                let g = f64::from(*g);
                *m = (BETA1 * f64::from(*m) + (1.0 - BETA1) * g) as f32;
                *s = (BETA2 * f64::from(*s) + (1.0 - BETA2) * g * g) as f32;
                let change = f64::from(*m) / bias1 / ((f64::from(*s) / bias2).sqrt() + EPSILON);
                *w -= (rate * change) as f32;
            }
        }
        tensors
    }
}

/// Half a cosine from `initial` at step 0 to zero at `steps`.
pub(crate) fn cosine_decay(initial: f64, step: u64, steps: u64) -> f64 {
    0.5 * initial * (1.0 + (std::f64::consts::PI * step as f64 / steps as f64).cos())
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::net::{Graph, KernelWeights, ModelConfig};

    #[test]
    fn the_first_step_moves_every_weight_by_the_rate_against_its_gradient() {
        let config = ModelConfig {
            encoder: vec![1],
            decoder: vec![],
            kernel: KernelWeights::Off,
            patch: 1,
            ..ModelConfig::paper()
        };
        let weights = Weights::init(&Graph::new(&config).unwrap(), 3);
        let gradients: Gradients =
            weights.tensors().iter().map(|(n, t)| (n.clone(), vec![-0.02; t.values.len()])).collect();
        let mut adam = Adam::new(&weights);
        let after = adam.update(&weights, &gradients, 0.1);
        for (name, tensor) in &after {
            for (new, old) in tensor.values.iter().zip(&weights.get(name).values) {
                assert!((new - old - 0.1).abs() < 1e-5, "{name}: {old} -> {new}");
            }
        }
    }

    #[test]
    fn the_rate_decays_from_the_initial_to_zero() {
        assert_eq!(cosine_decay(1e-3, 0, 100), 1e-3);
        assert!((cosine_decay(1e-3, 50, 100) - 5e-4).abs() < 1e-12);
        assert!(cosine_decay(1e-3, 100, 100) < 1e-18);
    }
}
