//! Optimisers on host vectors, so that a checkpoint is plain tensors and resuming is exact on every device.

use super::config::Optimizer;
use crate::adam::Adam;
use aonet::internals::weights::{Tensor, Weights};
use std::collections::BTreeMap;

/// Gradients by parameter name, in the parameters' layout.
pub(crate) type Gradients = BTreeMap<String, Vec<f32>>;

/// Two running means for every weight, and the number of steps taken.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Moments {
    pub(crate) step: u64,
    /// Adam: mean of the gradients. AdaDelta: mean of the squared changes, before the learning rate.
    pub(crate) mean: Gradients,
    /// Mean of the squared gradients.
    pub(crate) square: Gradients,
}

impl Moments {
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
        (optimizer, rate): (Optimizer, f64),
    ) -> BTreeMap<String, Tensor> {
        self.step += 1;
        let adam = Adam::at(self.step);
        let mut tensors = weights.tensors().clone();
        for (name, tensor) in &mut tensors {
            let mean = self.mean.get_mut(name).expect("a moment for every parameter");
            let square = self.square.get_mut(name).expect("a moment for every parameter");
            let moments = mean.iter_mut().zip(square);
            for ((w, (m, s)), g) in tensor.values.iter_mut().zip(moments).zip(&gradients[name]) {
                let g = f64::from(*g);
                let change = match optimizer {
                    Optimizer::Adam => adam.change([m, s], g),
                    Optimizer::AdaDelta => ada_delta(m, s, g),
                };
                *w -= (rate * change) as f32;
            }
        }
        tensors
    }
}

/// Weight of the past in AdaDelta's means, as in Deep Shading's solver (its `momentum`); Zeiler tries 0.9 to 0.99.
const DECAY: f64 = 0.9;
/// Zeiler 2012, §4.1; sets the size of the first changes.
const ADA_DELTA_EPSILON: f64 = 1e-6;

/// A change of AdaDelta. Zeiler 2012, Algorithm 1; the learning rate is a factor outside of it, as in Caffe.
fn ada_delta(changes: &mut f32, square: &mut f32, g: f64) -> f64 {
    *square = (DECAY * f64::from(*square) + (1.0 - DECAY) * g * g) as f32;
    let ratio = (f64::from(*changes) + ADA_DELTA_EPSILON) / (f64::from(*square) + ADA_DELTA_EPSILON);
    let change = ratio.sqrt() * g;
    *changes = (DECAY * f64::from(*changes) + (1.0 - DECAY) * change * change) as f32;
    change
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::internals::graph::Graph;
    use aonet::net::{KernelWeights, ModelConfig};

    fn graph() -> Graph {
        let config = ModelConfig {
            encoder: vec![1],
            decoder: vec![],
            kernel: KernelWeights::Off,
            patch: 1,
            ..ModelConfig::paper()
        };
        Graph::new(&config).unwrap()
    }

    fn gradients(weights: &Weights, value: f32) -> Gradients {
        weights.tensors().iter().map(|(n, t)| (n.clone(), vec![value; t.values.len()])).collect()
    }

    #[test]
    fn adams_first_step_moves_every_weight_by_the_rate_against_its_gradient() {
        let weights = Weights::init(&graph(), 3);
        let by = (Optimizer::Adam, 0.1);
        let after = Moments::new(&weights).update(&weights, &gradients(&weights, -0.02), by);
        for (name, tensor) in &after {
            for (new, old) in tensor.values.iter().zip(&weights.get(name).values) {
                assert!((new - old - 0.1).abs() < 1e-5, "{name}: {old} -> {new}");
            }
        }
    }

    /// With e = 1e-6 and gradients g, then h: the first change is u = g sqrt(e / (0.1 g² + e)), the second
    /// h sqrt((0.1 u² + e) / (0.09 g² + 0.1 h² + e)).
    #[test]
    fn ada_deltas_first_two_steps_have_the_closed_form() {
        let (g, h, e) = (-0.02f64, 0.05f64, 1e-6f64);
        let first = g * (e / (0.1 * g * g + e)).sqrt();
        let second = h * ((0.1 * first * first + e) / (0.09 * g * g + 0.1 * h * h + e)).sqrt();
        let before = Weights::init(&graph(), 3);
        let mut moments = Moments::new(&before);
        let mut weights = before.clone();
        for gradient in [g, h] {
            let gradients = gradients(&weights, gradient as f32);
            let tensors = moments.update(&weights, &gradients, (Optimizer::AdaDelta, 2.0));
            weights = Weights::new(&graph(), tensors).unwrap();
        }
        let expected = -2.0 * (first + second);
        for (name, tensor) in weights.tensors() {
            for (new, old) in tensor.values.iter().zip(&before.get(name).values) {
                assert!((f64::from(new - old) - expected).abs() < 1e-6, "{name}: {old} -> {new}");
            }
        }
    }
}
