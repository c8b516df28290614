//! Training: crops of a dataset in, a model file out. AO-Net §3.4 and §4.1.
//!
//! The loop reads top to bottom: draw crops, loss and gradients, a step of the optimiser, from time to time validate and save.
//! A run directory holds `config.json`, `log.jsonl`, `checkpoint.safetensors` (exact state), `best.safetensors`
//! and `last.safetensors` (models) and `curves.svg`.

mod agreement;
mod checkpoint;
#[cfg(feature = "cuda")]
mod cuda;
mod exact_survey;
mod flex_ops;
mod frames;
mod log;
mod loss;
mod net;
mod optimizer;
pub mod queue;
mod samples;
mod ssim;
mod start;
mod step;
mod survey;
#[cfg(test)]
mod tests;
mod ties;
#[cfg(test)]
mod timings;
mod validate;
mod vgg;
mod widths;

pub use crate::train_config as config;
pub use config::{Augment, ExactSurvey, LossConfig, Optimizer, SsimWindow, TrainConfig};
pub use frames::Frames;
pub use validate::ValidationScores;

use crate::adam::cosine_decay;
use crate::dataset::Manifest;
use aonet::internals::graph::Graph;
use aonet::internals::weights::Weights;
use aonet::net::{Model, TrainingFacts};
use aonet_scene::error::{Error, Result};
use burn::tensor::Device;
use checkpoint::State;
use frames::Loaded;
use log::Log;
use loss::Loss;
use net::Kernels;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use step::Stepper;
use ties::Ties;

/// Device of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrainDevice {
    /// The CPU, with this many workers.
    Flex {
        /// Crops computed side by side, > 0.
        threads: usize,
    },
    /// The first NVIDIA GPU.
    #[cfg(feature = "cuda")]
    Cuda,
}

/// Options of a run besides its configuration.
#[derive(Debug, Clone)]
pub struct TrainRun {
    /// Folder of the run; made if missing, resumed if it holds a checkpoint.
    pub dir: PathBuf,
    /// Network that a new run starts from; random weights if absent. It may have seen other channels: see `start.rs`. A run that
    /// continues has its own.
    pub start: Option<Model>,
    /// VGG-19 weights for the perceptual term; without them the term is off.
    pub vgg: Option<PathBuf>,
    /// Where to compute.
    pub device: TrainDevice,
    /// Stop with a checkpoint after this time; the run can be resumed.
    pub time_limit: Option<Duration>,
    /// Facts to record in the model: dataset, radius, command, commit. The rest is filled in.
    pub facts: TrainingFacts,
}

/// Events of a run, for a progress bar.
#[derive(Debug, Clone, PartialEq)]
pub enum TrainEvent {
    /// A frame was read: this many of so many.
    Loaded(usize, usize),
    /// A step was taken: number and loss.
    Step(u64, f64),
    /// The validation frames were scored: step and names with values.
    Validated(u64, Vec<(&'static str, f64)>),
    /// The perceptual term is off because no VGG-19 weights were given.
    NoPerceptualTerm,
}

/// Callback for events.
pub type TrainEvents<'a> = &'a (dyn Fn(TrainEvent) + Sync);

/// Trains until `config.steps` or the time limit. Returns the number of steps taken so far.
///
/// # Errors
/// When a file is broken, the dataset has no frames to train on, the folder belongs to another configuration, or the weights to start
/// from belong to another network.
pub fn train(
    config: &TrainConfig,
    manifests: &[Manifest],
    run: &TrainRun,
    events: TrainEvents,
) -> Result<u64> {
    train_on(config, &mut Frames::new(manifests), run, events)
}

/// [`train`] on frames that the previous run may have read already.
///
/// # Errors
/// As [`train`].
pub fn train_on(
    config: &TrainConfig,
    frames: &mut Frames,
    run: &TrainRun,
    events: TrainEvents,
) -> Result<u64> {
    let started = Instant::now();
    claim_dir(&run.dir, config)?;
    let graph = Graph::new(&config.model)?;
    let device = device_of(run.device)?;
    let loss = loss_of(config, run, (&device, kernels_of(run.device)), events)?;
    let ties = config.symmetric.then(|| Ties::of(&config.model, &graph));
    let course = Course { config, frames: frames.load(config, events)?, run, ties, events, started };
    let workers = workers_of(run.device);
    let stepper = Stepper {
        graph: &graph,
        loss: &loss,
        device: &device,
        workers: &workers,
        side: config.crop,
        leak: step::LEAK,
    };
    let checkpoint = run.dir.join(CHECKPOINT);
    let mut state = match checkpoint.exists() {
        true => State::load(&checkpoint, &graph)?,
        false => State::new(course.first_weights(&graph)?),
    };
    if workers.is_empty() {
        course.compare_with_the_cpu(&stepper, &state.weights)?;
    }
    let mut log = Log::open(&run.dir, state.moments.step)?;
    while state.moments.step < config.steps {
        course.step(&stepper, &mut state, &mut log)?;
        let (step, last) = (state.moments.step, state.moments.step == config.steps);
        if step.is_multiple_of(config.validate_every) || last {
            course.validate(&mut state, &mut log)?;
        }
        let out_of_time = run.time_limit.is_some_and(|limit| started.elapsed() >= limit);
        if step.is_multiple_of(config.checkpoint_every) || last || out_of_time {
            log.flush()?;
            state.save(&checkpoint)?;
        }
        if out_of_time {
            break;
        }
    }
    Ok(state.moments.step)
}

/// The exact state of a run inside its folder.
const CHECKPOINT: &str = "checkpoint.safetensors";

/// Parts of a run that do not change between steps.
struct Course<'a> {
    config: &'a TrainConfig,
    frames: &'a Loaded,
    run: &'a TrainRun,
    /// Of a symmetric network.
    ties: Option<Ties>,
    events: TrainEvents<'a>,
    started: Instant,
}

impl Course<'_> {
    /// Fails where the stepper's device has other gradients than the CPU, on two crops at most.
    fn compare_with_the_cpu(&self, stepper: &Stepper, weights: &Weights) -> Result<()> {
        let (config, device) = (self.config, Device::flex().autodiff());
        let loss = loss_of(config, self.run, (&device, Kernels::Own), &|_| ())?;
        let crops: Vec<_> =
            (0..config.batch.min(2)).map(|i| samples::draw(&self.frames.samples, config, 0, i)).collect();
        let workers = step::single_threaded_pools(crops.len());
        let cpu = Stepper { loss: &loss, device: &device, workers: &workers, ..*stepper };
        agreement::check(stepper, &cpu, weights, &crops)
    }

    fn first_weights(&self, graph: &Graph) -> Result<Weights> {
        let config = self.config;
        let start = self.run.start.as_ref();
        let given =
            start.map(|start| Weights::new(graph, start::fitted(&config.model, start))).transpose()?;
        match (given, &self.ties) {
            (Some(given), Some(ties)) => ties.expect(graph, given),
            (Some(given), None) => Ok(given),
            (None, Some(ties)) => ties.of_random(graph, &Weights::init(graph, config.seed)),
            (None, None) => Ok(Weights::init(graph, config.seed)),
        }
    }

    fn step(&self, stepper: &Stepper, state: &mut State, log: &mut Log) -> Result<()> {
        let (config, step) = (self.config, state.moments.step);
        let draw = |i| samples::draw(&self.frames.samples, config, step, i);
        let crops: Vec<_> = (0..config.batch).map(draw).collect();
        let risen = ((step + 1) as f64 / config.warm_up.max(1) as f64).min(1.0);
        let rate = risen * cosine_decay(config.learning_rate, step, config.steps);
        let (losses, mut gradients) = stepper.gradients(&state.weights, &crops);
        if !losses.total.is_finite() {
            return Err(Error::request(format!("loss at step {step}"), "a finite number", losses.total));
        }
        if let Some(ties) = &self.ties {
            ties.tie(&mut gradients);
        }
        let tensors = state.moments.update(&state.weights, &gradients, (config.optimizer, rate));
        state.take(Weights::new(stepper.graph, tensors)?, config.average);
        log.step(step + 1, &losses, rate, self.started.elapsed())?;
        (self.events)(TrainEvent::Step(step + 1, losses.total));
        Ok(())
    }

    /// Scores the weights, logs the scores and saves the models.
    fn validate(&self, state: &mut State, log: &mut Log) -> Result<()> {
        let (step, dir) = (state.moments.step, &self.run.dir);
        let scores = self.frames.validation.score(self.config, &state.average)?;
        log.validation(step, &scores)?;
        (self.events)(TrainEvent::Validated(step, scores.named()));
        let facts = self.facts(step, &scores);
        let model = Model::new(self.config.model.clone(), state.average.clone(), facts)?;
        if scores.loss < state.best {
            state.best = scores.loss;
            log::save_model(&dir.join("best.safetensors"), &model)?;
        }
        log::save_model(&dir.join("last.safetensors"), &model)?;
        log.draw_curves()
    }

    fn facts(&self, steps: u64, scores: &ValidationScores) -> TrainingFacts {
        let validation = scores.named().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        TrainingFacts {
            mean_visibility: Some(self.frames.mean_visibility),
            train_frames: self.frames.samples.len() as u64,
            steps,
            crops: steps * self.config.batch as u64,
            validation,
            ..self.run.facts.clone()
        }
    }
}

/// Makes the folder with its configuration, or checks that it holds the same one.
fn claim_dir(dir: &Path, config: &TrainConfig) -> Result<()> {
    if check_dir(dir, config)? {
        return Ok(());
    }
    std::fs::create_dir_all(dir).map_err(Error::io(dir))?;
    let path = dir.join("config.json");
    let json = serde_json::to_string_pretty(config).map_err(|e| Error::file(&path, "a configuration", e))?;
    aonet_scene::atomic_file::write(&path, json.as_bytes())
}

/// Whether the folder contains a run of this configuration; a run of another configuration is an error.
fn check_dir(dir: &Path, config: &TrainConfig) -> Result<bool> {
    let path = dir.join("config.json");
    if !path.exists() {
        return Ok(false);
    }
    if TrainConfig::load(&path)? != *config {
        let found = "another one; choose another folder";
        return Err(Error::file(&path, "the configuration of this run", found));
    }
    Ok(true)
}

fn device_of(device: TrainDevice) -> Result<Device> {
    match device {
        TrainDevice::Flex { .. } => Ok(Device::flex().autodiff()),
        #[cfg(feature = "cuda")]
        TrainDevice::Cuda => {
            cuda::check()?;
            Ok(Device::cuda(0).autodiff())
        }
    }
}

fn kernels_of(device: TrainDevice) -> Kernels {
    match device {
        TrainDevice::Flex { .. } => Kernels::Own,
        #[cfg(feature = "cuda")]
        TrainDevice::Cuda => Kernels::Framework,
    }
}

fn workers_of(device: TrainDevice) -> Vec<rayon::ThreadPool> {
    match device {
        TrainDevice::Flex { threads } => step::single_threaded_pools(threads.max(1)),
        #[cfg(feature = "cuda")]
        TrainDevice::Cuda => Vec::new(),
    }
}

fn loss_of(
    config: &TrainConfig,
    run: &TrainRun,
    (device, kernels): (&Device, Kernels),
    events: &dyn Fn(TrainEvent),
) -> Result<Loss> {
    let wanted = config.loss.perceptual > 0.0;
    let vgg = match &run.vgg {
        Some(path) if wanted => Some(vgg::Vgg::load(path, &config.loss.vgg_layers, (device, kernels))?),
        None if wanted => {
            events(TrainEvent::NoPerceptualTerm);
            None
        }
        Some(_) | None => None,
    };
    if vgg.is_none() && config.loss.plain_weights() == 0.0 {
        return Err(Error::request(
            "training loss",
            "VGG-19 weights, or a term besides perceptual",
            "neither",
        ));
    }
    Ok(Loss::new(&config.loss, config.crop, vgg, (device, kernels)))
}
