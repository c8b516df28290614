//! Loss and gradients of one batch.

use super::loss::Loss;
use super::net::{self, Kernels, Param, Seen};
use super::optimizer::Gradients;
use super::samples::Crop;
use aonet::internals::graph::Graph;
use aonet::internals::weights::Weights;
use burn::tensor::{Device, Tensor, TensorData};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Slope of the loss's image beyond [0, 1]. guess: small beside 1, large beside rounding.
pub(crate) const LEAK: f64 = 0.05;

/// Mean loss of a batch and its terms.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Losses {
    pub(crate) total: f64,
    pub(crate) dssim: f64,
    pub(crate) perceptual: f64,
    pub(crate) l1: f64,
    pub(crate) psnr: f64,
}

/// Computes gradients from crops; fixed for a run.
#[derive(Clone, Copy)]
pub(crate) struct Stepper<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) loss: &'a Loss,
    pub(crate) device: &'a Device,
    /// One single-threaded pool per worker: crops run in parallel, each small enough for the caches, and without the
    /// framework's own threads. Empty: the whole batch at once, for a GPU.
    pub(crate) workers: &'a [rayon::ThreadPool],
    /// Side of the crops (px).
    pub(crate) side: usize,
    /// Slope beyond [0, 1]: [`LEAK`], or 1 for a loss without kinks.
    pub(crate) leak: f64,
}

impl Stepper<'_> {
    /// Mean loss and gradient over `crops`. The sums run in the order of the crops whatever the number of workers.
    pub(crate) fn gradients(&self, weights: &Weights, crops: &[Crop]) -> (Losses, Gradients) {
        if self.workers.is_empty() {
            return self.of_crops(weights, crops, Kernels::Framework);
        }
        let share = crops.len().div_ceil(self.workers.len());
        let work: Vec<_> = crops.chunks(share).zip(self.workers).collect();
        let one = |crop: &Crop| self.of_crops(weights, std::slice::from_ref(crop), Kernels::Own);
        let mut results: Vec<Vec<_>> = Vec::new();
        std::thread::scope(|scope| {
            let threads: Vec<_> = work
                .into_iter()
                .map(|(crops, pool)| {
                    scope.spawn(move || pool.install(|| crops.iter().map(one).collect::<Vec<_>>()))
                })
                .collect();
            results.extend(threads.into_iter().map(|t| t.join().expect("a worker does not panic")));
        });
        mean(results.into_iter().flatten().collect())
    }

    fn of_crops(&self, weights: &Weights, crops: &[Crop], by: Kernels) -> (Losses, Gradients) {
        let params = net::upload(weights, self.device);
        let patch = crops[0].survey.as_ref().map(|survey| survey.patch);
        let survey = patch.map(|patch| {
            self.stack(crops, self.side / patch, |c| &c.survey.as_ref().expect("in every crop").values)
        });
        let seen = Seen { planes: self.stack(crops, self.side, |c| &c.features), survey };
        let visibility = net::forward(self.graph, &params, seen, by);
        let visibility = leaky_clamp(visibility, self.leak);
        let foreground = self.stack(crops, self.side, |c| &c.foreground);
        let target = self.stack(crops, self.side, |c| &c.target) * foreground.clone();
        // The background is out of the loss: both images are zero there.
        let terms = self.loss.of(visibility * foreground, target);
        let mut tape = terms.total.backward();
        let mut gradients = BTreeMap::new();
        for (name, param) in &params {
            let values = match param {
                Param::Weight(w) => w.grad_remove(&mut tape).map(Tensor::into_data),
                Param::Bias(b) => b.grad_remove(&mut tape).map(Tensor::into_data),
            };
            let values =
                values.expect("every parameter is on the tape").try_into_vec::<f32>().expect("f32 gradients");
            gradients.insert(name.clone(), values);
        }
        let scalar = |t: Option<Tensor<1>>| t.map_or(0.0, |t| f64::from(t.into_scalar::<f32>()));
        let losses = Losses {
            total: scalar(Some(terms.total)),
            dssim: scalar(terms.dssim),
            perceptual: scalar(terms.perceptual),
            l1: scalar(terms.l1),
            psnr: scalar(terms.psnr),
        };
        (losses, gradients)
    }

    /// BxCxSxS from one part of every crop.
    fn stack(&self, crops: &[Crop], side: usize, part: impl Fn(&Crop) -> &Vec<f32>) -> Tensor<4> {
        let area = side * side;
        let values: Vec<f32> = crops.iter().flat_map(|c| part(c).iter().copied()).collect();
        let channels = values.len() / crops.len() / area;
        Tensor::from_data(TensorData::new(values, [crops.len(), channels, side, side]), self.device)
    }
}

fn mean(results: Vec<(Losses, Gradients)>) -> (Losses, Gradients) {
    let share = 1.0 / results.len() as f64;
    let mut losses = Losses::default();
    let mut sum = Gradients::new();
    for (l, gradients) in &results {
        losses.total += l.total * share;
        losses.dssim += l.dssim * share;
        losses.perceptual += l.perceptual * share;
        losses.l1 += l.l1 * share;
        losses.psnr += l.psnr * share;
        for (name, values) in gradients {
            let total = sum.entry(name.clone()).or_insert_with(|| vec![0.0; values.len()]);
            total.iter_mut().zip(values).for_each(|(t, v)| *t += v * share as f32);
        }
    }
    (losses, sum)
}

/// Values that inference clamps must not count as errors. Most of a frame is fully open: a network that may overshoot 1
/// gives a flat image there, one that must produce exactly 1 gives noise. A small slope keeps a gradient.
fn leaky_clamp(visibility: Tensor<4>, leak: f64) -> Tensor<4> {
    let inside = visibility.clone().clamp(0.0, 1.0);
    inside.clone() + (visibility - inside) * leak
}

/// `threads` pools of one thread each.
pub(crate) fn single_threaded_pools(threads: usize) -> Vec<rayon::ThreadPool> {
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started");
    (0..threads).into_par_iter().map(|_| pool()).collect()
}
