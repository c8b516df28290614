//! Times of a step, for developers: `cargo test --release -p aonet_lab --features train --lib
//! timings -- --ignored --nocapture --test-threads 1`.

use super::LossConfig;
use super::loss::Loss;
use super::net::Kernels;
use super::samples::{self, Crop};
use super::step::{LEAK, Stepper, single_threaded_pools};
use super::survey::CropSurvey;
use aonet::internals::graph::{Graph, SURVEYED};
use aonet::internals::weights::Weights;
use aonet::net::{KernelWeights, Model, ModelConfig, shipped};
use burn::tensor::Device;

const SIDE: usize = 256;
const BATCH: usize = 4;

/// Processor time of this process (s), on Linux, where a second has a hundred ticks. Wall-clock time would include
/// waiting for other programs.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let (_, fields) = stat.rsplit_once(')').unwrap();
    let ticks: u64 = fields.split_whitespace().skip(11).take(2).map(|f| f.parse::<u64>().unwrap()).sum();
    ticks as f64 / 100.0
}

/// A crop of this many channels, with a survey of patches of this side (px).
fn crop(channels: usize, patch: Option<usize>, seed: usize) -> Crop {
    let pixels = SIDE * SIDE;
    let wave = |i: usize| ((i * 7919 + seed * 31) % 1021) as f32 / 1021.0;
    let survey = |patch: usize| CropSurvey {
        patch,
        values: (0..SURVEYED * pixels / (patch * patch)).map(wave).collect(),
    };
    Crop {
        features: (0..channels * pixels).map(|i| 2.0 * wave(i) - 1.0).collect(),
        survey: patch.map(survey),
        target: (0..pixels).map(wave).collect(),
        foreground: vec![1.0; pixels],
    }
}

fn time(name: &str, config: &ModelConfig) {
    let device = Device::flex().autodiff();
    let graph = Graph::new(config).unwrap();
    let weights = Weights::init(&graph, 1);
    let loss =
        Loss::new(&LossConfig { dssim: 1.0, ..LossConfig::default() }, SIDE, None, (&device, Kernels::Own));
    let workers = single_threaded_pools(1);
    let stepper =
        Stepper { graph: &graph, loss: &loss, device: &device, workers: &workers, side: SIDE, leak: LEAK };
    let channels = samples::sampled(config.features.clone(), config.search).channels().len();
    let patch = config.survey.map(|_| config.patch);
    let crops: Vec<_> = (0..BATCH).map(|i| crop(channels, patch, i)).collect();
    let seconds = || {
        let start = cpu_seconds();
        stepper.gradients(&weights, &crops);
        cpu_seconds() - start
    };
    let best = (0..3).map(|_| seconds()).fold(f64::INFINITY, f64::min);
    println!("{name}: {best:.2} s a step of {BATCH} crops of {SIDE} px");
}

#[test]
#[ignore = "measures, checks nothing"]
fn deep_shading() {
    time("deep_shading", &ModelConfig::deep_shading());
}

#[test]
#[ignore = "measures, checks nothing"]
fn deep_ao() {
    time("deep_ao", &ModelConfig::deep_ao());
}

#[test]
#[ignore = "measures, checks nothing"]
fn full_resolution() {
    time("full_resolution", &ModelConfig::full_resolution());
}

#[test]
#[ignore = "measures, checks nothing"]
fn paper() {
    time("paper", &ModelConfig::paper());
}

#[test]
#[ignore = "measures, checks nothing"]
fn softmax() {
    time("softmax", &ModelConfig { kernel: KernelWeights::Softmax, ..ModelConfig::paper() });
}

#[test]
#[ignore = "measures, checks nothing"]
fn fast() {
    time("fast", Model::from_bytes(shipped::FAST).unwrap().config());
}

#[test]
#[ignore = "measures, checks nothing"]
fn balanced() {
    time("balanced", Model::from_bytes(shipped::BALANCED).unwrap().config());
}

#[test]
#[ignore = "measures, checks nothing"]
fn high() {
    time("high", Model::from_bytes(shipped::HIGH).unwrap().config());
}
