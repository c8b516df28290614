//! Run-times of methods on this machine, and the machine's peak rates.
//!
//! A time is that of a frame whose buffers are in memory: features, network and clamping.

mod bent;
#[cfg(feature = "gpu")]
pub mod gpu;
mod memory;
mod ops;
mod peaks;
mod searches;

pub use bent::{BentTimes, time_bent_normals, time_classic_bent_normals};
pub use memory::{peak_mib, reset_peak};
pub use ops::{OpCost, OpTime, time_ops};
pub use peaks::Peaks;

use aonet::internals::plan::Step;
use aonet::net::cpu::{Options, Precision, Session};
use aonet::net::{Model, Ranges};
use aonet::search::{self, Classic};
use aonet::{AoImage, AoParams, Camera, GBuffer, Size};
use aonet_scene::Result;
use glam::Vec3;
use serde::Serialize;
use std::time::Instant;

/// Run-time of a method at one size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Times {
    /// Median of the runs (ms).
    pub median_ms: f64,
    /// Fastest run (ms).
    pub min_ms: f64,
    /// Slowest run (ms).
    pub max_ms: f64,
    /// From a model in memory to its first image: making the session and one run (ms). For classic methods: the first run.
    pub first_ms: f64,
    /// Median time until a network's features are written (ms), part of the others: search, filter, features, patches. 0 for
    /// classic methods.
    pub features_ms: f64,
    /// Memory of the session (bytes): activations and scratch, without parameters. 0 for classic methods.
    pub session_bytes: usize,
}

impl Times {
    fn new(first_ms: f64, times_ms: &mut [f64]) -> Self {
        let median_ms = median(times_ms);
        let [min_ms, max_ms] = [times_ms.first(), times_ms.last()].map(|ms| ms.copied().unwrap_or(0.0));
        Self { median_ms, min_ms, max_ms, first_ms, features_ms: 0.0, session_bytes: 0 }
    }
}

/// The radius of every timed frame (world units); the frame's depth is about 3.
const RADIUS: f32 = 0.5;

/// Size of the frame that [`calibrated`] runs.
const CALIBRATION_SIZE: Size = Size::px(256, 128);

/// Times `runs` runs (at least one) of `model` on a synthetic frame of `size`, after a first one.
///
/// # Errors
/// When the threads are none or cannot be started, the machine does not have the instructions, or the
/// model does not know the ranges that integers need: see [`calibrated`].
pub fn time(model: &Model, size: Size, options: Options, runs: usize) -> Result<Times> {
    let (gbuffer, mut image) = (bump(size)?, AoImage::open(size));
    let start = Instant::now();
    let mut session = Session::with_options(model, gbuffer.window(), options)?;
    session.run(&gbuffer, AoParams::new(RADIUS)?, &mut image)?;
    let first_ms = ms_since(start);
    let is_features = |step: &Step| matches!(step, Step::Features { .. });
    let last_of_features = session.plan().steps.iter().position(is_features).unwrap_or(0);
    let (mut times_ms, mut features_ms) = (Vec::with_capacity(runs), Vec::with_capacity(runs));
    for _ in 0..runs.max(1) {
        let start = Instant::now();
        session.run_observed(&gbuffer, AoParams::new(RADIUS)?, &mut image, &mut |step| {
            if step == last_of_features {
                features_ms.push(ms_since(start));
            }
        })?;
        times_ms.push(ms_since(start));
    }
    let times = Times::new(first_ms, &mut times_ms);
    Ok(Times { features_ms: median(&mut features_ms), session_bytes: session.memory_bytes(), ..times })
}

/// Times a classic method, as [`time`] times a network; memory is not counted, and the precision is f32.
///
/// # Errors
/// When a parameter is out of range, the threads cannot be started, or the machine does not have the instructions.
pub fn time_classic(method: &Classic, size: Size, options: Options, runs: usize) -> Result<Times> {
    let (gbuffer, mut image) = (bump(size)?, AoImage::open(size));
    let options = of_search(options);
    let mut session = search::Session::new(method, gbuffer.size(), options)?;
    let mut run = || -> Result<f64> {
        let start = Instant::now();
        session.run(&gbuffer, AoParams::new(RADIUS)?, &mut image)?;
        Ok(ms_since(start))
    };
    let first_ms = run()?;
    let mut times_ms = (0..runs.max(1)).map(|_| run()).collect::<Result<Vec<_>>>()?;
    Ok(Times::new(first_ms, &mut times_ms))
}

/// Median time (ms) of every step of the session's plan, measured as [`time`] does.
///
/// # Errors
/// As [`time`].
pub fn time_steps(model: &Model, size: Size, options: Options, runs: usize) -> Result<Vec<f64>> {
    let (gbuffer, mut image) = (bump(size)?, AoImage::open(size));
    let mut session = Session::with_options(model, gbuffer.window(), options)?;
    session.run(&gbuffer, AoParams::new(RADIUS)?, &mut image)?;
    let mut by_step: Vec<Vec<f64>> = vec![Vec::with_capacity(runs); session.plan().steps.len()];
    for _ in 0..runs.max(1) {
        let mut last = Instant::now();
        session.run_observed(&gbuffer, AoParams::new(RADIUS)?, &mut image, &mut |step| {
            let now = Instant::now();
            by_step[step].push((now - last).as_secs_f64() * 1e3);
            last = now;
        })?;
    }
    Ok(by_step.iter_mut().map(|times| median(times)).collect())
}

/// A model that can run in int8. A model without ranges gets those of a synthetic frame, which are good enough for
/// times, not for images.
///
/// # Errors
/// When there is not enough memory.
pub fn calibrated(model: Model, precision: Precision) -> Result<Model> {
    if precision != Precision::Int8 || model.ranges().is_some() {
        return Ok(model);
    }
    let (gbuffer, mut image) = (bump(CALIBRATION_SIZE)?, AoImage::open(CALIBRATION_SIZE));
    let mut ranges = Ranges::new();
    Session::new(&model, CALIBRATION_SIZE, 1)?.calibrate(
        &gbuffer,
        AoParams::new(RADIUS)?,
        &mut image,
        &mut ranges,
    )?;
    Ok(model.with_ranges(ranges)?)
}

/// Threads and instructions for a classic method.
fn of_search(Options { threads, level, .. }: Options) -> search::Options {
    search::Options { threads, level }
}

fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// A bump that fills the image: foreground everywhere, normals that turn.
fn bump(size: Size) -> Result<GBuffer<'static>> {
    let (width, height) = (size.width(), size.height());
    let camera = Camera::perspective(1.0, size)?.with_near(0.1)?;
    let at = |i: usize| {
        let x = (i % width) as f32 / width as f32 - 0.5;
        let y = 0.5 - (i / width) as f32 / height as f32;
        Vec3::new(x, y, 1.5).normalize()
    };
    let normal = (0..size.pixels()).map(|i| at(i).to_array()).collect::<Vec<_>>();
    let depth = (0..size.pixels()).map(|i| 4.0 - at(i).z).collect::<Vec<_>>();
    Ok(GBuffer::new(camera, depth, normal)?)
}

/// The median of `values`, which are sorted; the mean of the middle two if their number is even. NaN without values.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        return f64::NAN;
    }
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}

/// Name of the processor if the system reports it, else of its architecture.
pub fn device() -> String {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = cpuinfo.lines().find(|l| l.starts_with("model name")).and_then(|l| l.split_once(':'));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::internals::graph::Graph;
    use aonet::internals::weights::Weights;
    use aonet::net::{ModelConfig, TrainingFacts};

    pub(super) fn model(config: ModelConfig) -> Model {
        let weights = Weights::init(&Graph::new(&config).unwrap(), 1);
        Model::new(config, weights, TrainingFacts::default()).unwrap()
    }

    #[test]
    fn every_step_has_its_own_time() {
        let model = model(ModelConfig { encoder: vec![16, 16], decoder: vec![16], ..ModelConfig::paper() });
        let options = Options::default();
        // The steps of one run never take longer than the whole call.
        let start = Instant::now();
        let steps = time_steps(&model, Size::px(320, 200), options, 1).unwrap();
        let whole_ms = start.elapsed().as_secs_f64() * 1e3;
        // Features, six convolutions, head.
        assert_eq!(steps.len(), 8);
        assert!(steps.iter().all(|ms| *ms > 0.0), "{steps:?}");
        assert!(steps.iter().sum::<f64>() < whole_ms, "{steps:?} in {whole_ms}");
        let times = time(&model, Size::px(320, 200), options, 3).unwrap();
        assert!(times.min_ms > 0.0 && times.min_ms <= times.median_ms && times.median_ms <= times.max_ms);
        assert!(times.first_ms > 0.0 && times.session_bytes > 320 * 200);
        assert!(times.features_ms > 0.0 && times.features_ms < times.median_ms);
        let none = Options { threads: 0, ..options };
        assert!(time(&model, Size::px(320, 200), none, 1).is_err());
        assert!(time_steps(&model, Size::px(320, 200), none, 1).is_err());
    }

    #[test]
    fn every_precision_of_the_machine_can_be_timed() {
        for precision in Precision::available() {
            let small = ModelConfig { encoder: vec![16, 16], decoder: vec![16], ..ModelConfig::paper() };
            let model = calibrated(model(small), precision).unwrap();
            assert_eq!(model.ranges().is_some(), precision == Precision::Int8);
            let options = Options { precision, ..Options::default() };
            assert!(time(&model, Size::px(320, 200), options, 1).unwrap().median_ms > 0.0);
        }
    }

    #[test]
    fn medians_are_in_the_middle() {
        assert_eq!((median(&mut [3.0, 1.0, 2.0]), median(&mut [4.0, 1.0, 2.0, 3.0])), (2.0, 2.5));
        assert!(!device().is_empty());
    }
}
