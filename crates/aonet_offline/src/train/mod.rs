//! Training: crops of a dataset in, a model file out. AO-Net §3.4 and §4.1.
//!
//! The loop reads top to bottom: draw crops, loss and gradients, Adam, now and then validate and save.
//! A run directory holds `config.json`, `log.jsonl`, `checkpoint.safetensors` (exact state), `best.safetensors`
//! and `last.safetensors` (models) and `curves.svg`.

mod adam;
mod checkpoint;
pub mod config;
mod flex_ops;
mod log;
mod loss;
mod net;
mod samples;
mod step;
#[cfg(test)]
mod tests;
mod validate;
mod vgg;

pub use config::{Augment, LossConfig, TrainConfig};

use crate::dataset::{Manifest, Split};
use crate::error::{Error, Result};
use adam::cosine_decay;
use aonet::net::{Graph, Model, TrainingFacts, Weights};
use burn::tensor::Device;
use checkpoint::State;
use log::Log;
use loss::Loss;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use step::Stepper;
use validate::{Scores, Validation};

/// Where a run computes.
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

/// What a run needs besides its configuration.
#[derive(Debug, Clone)]
pub struct TrainRun {
    /// Folder of the run; made if missing, resumed if it holds a checkpoint.
    pub dir: PathBuf,
    /// VGG-19 weights for the perceptual term; without them the term is off.
    pub vgg: Option<PathBuf>,
    /// Where to compute.
    pub device: TrainDevice,
    /// Stop with a checkpoint after this time; the run can be resumed.
    pub time_limit: Option<Duration>,
    /// What to write into the model: dataset, radius, command, commit. The rest is filled in.
    pub facts: TrainingFacts,
}

/// News of a run, for a progress bar.
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

/// Trains until `config.steps` or the time limit. Returns the number of steps taken so far.
///
/// # Errors
/// When a file is broken, the dataset has no frames to train on, or the folder belongs to another configuration.
pub fn train(
    config: &TrainConfig,
    manifests: &[Manifest],
    run: &TrainRun,
    events: &(dyn Fn(TrainEvent) + Sync),
) -> Result<u64> {
    let started = Instant::now();
    claim_dir(&run.dir, config)?;
    let graph = Graph::new(&config.model)?;
    let device = device_of(run.device);
    let loss = loss_of(config, run, &device, events)?;
    let samples = load_split(manifests, config, events)?;
    let validation = Validation::load(manifests, config)?;
    let mean_visibility = samples.iter().map(|s| s.mean()).sum::<f64>() / samples.len() as f64;
    let facts = TrainingFacts {
        mean_visibility: Some(mean_visibility as f32),
        train_frames: samples.len() as u64,
        ..run.facts.clone()
    };
    let workers = workers_of(run.device);
    let stepper = Stepper {
        graph: &graph,
        loss: &loss,
        device: &device,
        workers: &workers,
        side: config.crop,
        leak: step::LEAK,
    };

    let checkpoint = run.dir.join("checkpoint.safetensors");
    let mut state =
        if checkpoint.exists() { State::load(&checkpoint, &graph)? } else { State::new(&graph, config.seed) };
    let mut log = Log::open(&run.dir, state.adam.step)?;
    while state.adam.step < config.steps {
        let step = state.adam.step;
        let crops: Vec<_> = (0..config.batch).map(|i| samples::draw(&samples, config, step, i)).collect();
        let rate = cosine_decay(config.learning_rate, step, config.steps);
        let (losses, gradients) = stepper.gradients(&state.weights, &crops);
        if !losses.total.is_finite() {
            return Err(Error::request(format!("loss at step {step}"), "a finite number", losses.total));
        }
        let tensors = state.adam.update(&state.weights, &gradients, rate);
        state.weights = Weights::new(&graph, tensors)?;
        let step = step + 1;
        log.step(step, &losses, rate, started.elapsed())?;
        events(TrainEvent::Step(step, losses.total));

        let last = step == config.steps;
        let out_of_time = run.time_limit.is_some_and(|limit| started.elapsed() >= limit);
        if step.is_multiple_of(config.validate_every) || last {
            let scores = validation.score(config, &state.weights)?;
            log.validation(step, &scores)?;
            events(TrainEvent::Validated(step, scores.named()));
            let model =
                Model::new(config.model.clone(), state.weights.clone(), facts_at(&facts, step, &scores))?;
            if scores.loss < state.best {
                state.best = scores.loss;
                log::save_model(&run.dir.join("best.safetensors"), &model)?;
            }
            log::save_model(&run.dir.join("last.safetensors"), &model)?;
            log.draw_curves()?;
        }
        if step.is_multiple_of(config.checkpoint_every) || last || out_of_time {
            log.flush()?;
            state.save(&checkpoint)?;
        }
        if out_of_time {
            break;
        }
    }
    Ok(state.adam.step)
}

fn facts_at(facts: &TrainingFacts, step: u64, scores: &Scores) -> TrainingFacts {
    let validation = scores.named().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    TrainingFacts { steps: step, validation, ..facts.clone() }
}

/// Makes the folder with its configuration, or checks that it holds the same one.
fn claim_dir(dir: &Path, config: &TrainConfig) -> Result<()> {
    std::fs::create_dir_all(dir).map_err(Error::io(dir))?;
    let path = dir.join("config.json");
    if path.exists() {
        let found = TrainConfig::load(&path)?;
        if found != *config {
            return Err(Error::file(
                &path,
                "the configuration of this run",
                "another one; choose another folder",
            ));
        }
        return Ok(());
    }
    let json = serde_json::to_string_pretty(config).map_err(|e| Error::file(&path, "a configuration", e))?;
    crate::atomic_file::write(&path, json.as_bytes())
}

fn device_of(device: TrainDevice) -> Device {
    match device {
        TrainDevice::Flex { .. } => Device::flex().autodiff(),
        #[cfg(feature = "cuda")]
        TrainDevice::Cuda => Device::cuda(0).autodiff(),
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
    device: &Device,
    events: &dyn Fn(TrainEvent),
) -> Result<Loss> {
    let wanted = config.loss.perceptual > 0.0;
    let vgg = match &run.vgg {
        Some(path) if wanted => Some(vgg::Vgg::load(path, &config.loss.vgg_layers, device)?),
        None if wanted => {
            events(TrainEvent::NoPerceptualTerm);
            None
        }
        Some(_) | None => None,
    };
    if vgg.is_none() && config.loss.dssim + config.loss.l1 == 0.0 {
        return Err(Error::request(
            "training loss",
            "VGG-19 weights, or a term besides perceptual",
            "neither",
        ));
    }
    Ok(Loss::new(&config.loss, config.crop, vgg, device))
}

fn load_split(
    manifests: &[Manifest],
    config: &TrainConfig,
    events: &(dyn Fn(TrainEvent) + Sync),
) -> Result<Vec<samples::Sample>> {
    let of = |manifest| Manifest::frames(manifest, Split::Train).map(move |entry| (manifest, entry));
    let entries: Vec<_> = manifests.iter().flat_map(of).collect();
    if entries.is_empty() {
        return Err(Error::request("datasets", "frames of the split `train`", "none"));
    }
    let done = std::sync::atomic::AtomicUsize::new(0);
    samples::load_all(&entries, config, &|| {
        let n = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        events(TrainEvent::Loaded(n, entries.len()));
    })
}
