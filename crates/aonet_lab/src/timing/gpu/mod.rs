//! Run-times of methods on a graphics processor, pass by pass.
//!
//! A timed frame has its textures on the device: nothing is uploaded or read back.

mod cost;
mod queries;
mod scene;

pub use cost::{PassCost, classic_costs, network_costs};

use super::{median, ms_since};
use aonet::Size;
use aonet::gpu::{BoundFrame, Device, Kernels, Options, Precision, Timestamps, wgpu};
use aonet::net::Model;
use aonet::net::gpu::Session;
use aonet::search::Classic;
use aonet::search::gpu::ClassicSession;
use aonet_scene::{Error, Result};
use queries::Queries;
use scene::Scene;
use serde::Serialize;
use std::time::Instant;

/// Frames submitted before waiting for the first: enough to keep the device busy. guess
const BATCH: usize = 8;

/// A method and how to run it.
#[derive(Debug, Clone, Copy)]
pub enum GpuMethod<'a> {
    /// A network, its precision and its kernels.
    Network(&'a Model, Precision, Kernels),
    /// A classic method.
    Classic(&'a Classic),
}

/// Times of many frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Median (ms).
    pub median_ms: f64,
    /// Shortest time (ms).
    pub min_ms: f64,
    /// Longest time (ms).
    pub max_ms: f64,
}

/// Run-time of a method at one size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GpuTimes {
    /// Time per frame while the device is never idle: means of eight frames.
    pub frame: Spread,
    /// From the start of the first pass to the end of the last, when every pass waits for the one before it; none if the device
    /// has no timestamps.
    pub whole: Option<Spread>,
    /// Times of every pass, in order; empty if the device has no timestamps.
    pub passes: Vec<Spread>,
    /// Memory of the session on the device (bytes): activations, without parameters.
    pub memory_bytes: u64,
}

impl Spread {
    fn of(mut times_ms: Vec<f64>) -> Self {
        let median_ms = median(&mut times_ms);
        Self { median_ms, min_ms: times_ms[0], max_ms: times_ms[times_ms.len() - 1] }
    }
}

/// A session to time.
enum Runs {
    Network(Session),
    Classic(ClassicSession),
}

impl Runs {
    fn new(device: &Device, of: GpuMethod<'_>, size: Size) -> Result<Self> {
        let at = (&device.device, &device.queue);
        Ok(match of {
            GpuMethod::Network(model, precision, kernels) => {
                let options = Options { kernels, ..scene::options(precision) };
                Self::Network(Session::new(at, model, size, options)?)
            }
            GpuMethod::Classic(method) => {
                Self::Classic(ClassicSession::new(at, method, size, scene::options(Precision::F32))?)
            }
        })
    }

    fn bind(&self, scene: &Scene) -> Result<BoundFrame> {
        Ok(match self {
            Self::Network(session) => session.bind(scene.textures())?,
            Self::Classic(session) => session.bind(scene.textures())?,
        })
    }

    /// Runs every pass separately and times it, if there are timestamps.
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (view, scene): (&BoundFrame, &Scene),
        timestamps: Option<Timestamps<'_>>,
    ) -> Result<()> {
        let frame = &scene.frame;
        match (self, timestamps) {
            (Self::Network(session), None) => session.encode(encoder, view, frame)?,
            (Self::Network(session), Some(t)) => session.encode_timed(encoder, view, frame, t)?,
            (Self::Classic(session), None) => session.encode(encoder, view, frame)?,
            (Self::Classic(session), Some(t)) => session.encode_timed(encoder, view, frame, t)?,
        }
        Ok(())
    }

    fn passes(&self) -> usize {
        match self {
            Self::Network(session) => session.pass_labels().len(),
            Self::Classic(session) => session.pass_labels().len(),
        }
    }

    fn memory_bytes(&self) -> u64 {
        match self {
            Self::Network(session) => session.memory_bytes(),
            Self::Classic(session) => session.memory_bytes(),
        }
    }
}

/// Times `runs` frames (at least one) of `size` pass by pass, and as many batches of frames; after a first
/// frame that is not counted.
///
/// # Errors
/// When the device lacks something or is lost, or the method has no shaders.
pub fn time_on_gpu(device: &Device, of: GpuMethod<'_>, size: Size, runs: usize) -> Result<GpuTimes> {
    let (runs, session, scene) = (runs.max(1), Runs::new(device, of, size)?, Scene::new(device, size)?);
    let view = session.bind(&scene)?;
    let batch = |frames: usize| -> Result<f64> {
        let start = Instant::now();
        for _ in 0..frames {
            let mut encoder = device.device.create_command_encoder(&Default::default());
            session.encode(&mut encoder, (&view, &scene), None)?;
            device.queue.submit([encoder.finish()]);
        }
        device.device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
        Ok(ms_since(start) / frames as f64)
    };
    batch(1)?;
    let frame = Spread::of((0..runs).map(|_| batch(BATCH)).collect::<Result<_>>()?);
    let (mut whole, mut passes) = (Vec::new(), vec![Vec::new(); session.passes()]);
    if let Some(queries) = Queries::new(device, passes.len()) {
        for _ in 0..runs {
            let mut encoder = device.device.create_command_encoder(&Default::default());
            session.encode(&mut encoder, (&view, &scene), Some(queries.timestamps()))?;
            let times = queries.submit(device, encoder)?;
            passes.iter_mut().zip(&times).for_each(|(all, [begin, end])| all.push(end - begin));
            whole.extend(times.first().zip(times.last()).map(|(first, last)| last[1] - first[0]));
        }
    }
    passes.retain(|times| !times.is_empty());
    Ok(GpuTimes {
        frame,
        whole: (!whole.is_empty()).then(|| Spread::of(whole)),
        passes: passes.into_iter().map(Spread::of).collect(),
        memory_bytes: session.memory_bytes(),
    })
}

fn lost(found: impl std::fmt::Display) -> Error {
    Error::Core(aonet::Error::device("timed frame", "an end", found))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::tests::model;
    use aonet::net::{ModelConfig, shipped};

    /// A device, or none with a message.
    fn device() -> Option<Device> {
        match Device::wait_for() {
            Ok(device) => Some(device),
            Err(error) if std::env::var_os("AONET_REQUIRE_GPU").is_some_and(|v| v == "1") => {
                panic!("{error}")
            }
            Err(error) => {
                eprintln!("skipped: {error}");
                None
            }
        }
    }

    #[test]
    fn every_pass_has_a_cost_and_a_time() {
        let Some(device) = device() else { return };
        let (paper, any, size) =
            (model(ModelConfig::paper()), model(ModelConfig::correcting()), Size::px(64, 48));
        let [surveying, sharing] = [shipped::BALANCED, shipped::HIGH].map(|b| Model::from_bytes(b).unwrap());
        let gtao = Classic::named("gtao:tuned").unwrap();
        let arcs = Classic::named("arcs").unwrap();
        let flat = Classic::named("ssao").unwrap();
        for (of, costs) in [
            (
                GpuMethod::Network(&paper, Precision::F32, Kernels::Plain),
                network_costs(&paper, size, Precision::F32),
            ),
            (
                GpuMethod::Network(&any, Precision::F16, Kernels::Subgroups),
                network_costs(&any, size, Precision::F16),
            ),
            (
                GpuMethod::Network(&surveying, Precision::F32, Kernels::Plain),
                network_costs(&surveying, size, Precision::F32),
            ),
            (
                GpuMethod::Network(&sharing, Precision::F32, Kernels::Plain),
                network_costs(&sharing, size, Precision::F32),
            ),
            (GpuMethod::Classic(&gtao), Ok(classic_costs(&gtao, size))),
            (GpuMethod::Classic(&arcs), Ok(classic_costs(&arcs, size))),
            (GpuMethod::Classic(&flat), Ok(classic_costs(&flat, size))),
        ] {
            let session = Runs::new(&device, of, size).unwrap();
            let labels = match &session {
                Runs::Network(session) => session.pass_labels(),
                Runs::Classic(session) => session.pass_labels(),
            };
            let costs = costs.unwrap();
            assert_eq!(costs.iter().map(|c| c.pass.as_str()).collect::<Vec<_>>(), labels);
            assert!(costs.iter().all(|c| c.flop > 0.0 && c.bytes > 0.0), "{costs:?}");
            let start = Instant::now();
            let times = time_on_gpu(&device, of, size, 2).unwrap();
            let wall_ms = ms_since(start);
            assert!(times.frame.min_ms > 0.0 && times.memory_bytes > 0);
            assert!(2.0 * BATCH as f64 * times.frame.min_ms < wall_ms, "{times:?} in {wall_ms}");
            let whole = times.whole.expect("timestamps");
            assert_eq!(times.passes.len(), labels.len());
            // Passes run one after the other.
            let sum: f64 = times.passes.iter().map(|p| p.min_ms).sum();
            assert!(sum > 0.0 && sum <= whole.max_ms * 1.001, "{times:?}");
        }
    }
}
