//! `--device gpu`: one row for every method, precision and size, pass by pass.

pub(in crate::cmd) mod estimate;
mod flags;
mod methods;
mod text;

use super::Args;
use super::subject::{Case, Method};
use crate::output;
use anyhow::{Result, ensure};
use aonet::Size;
use aonet::gpu::{Device, wgpu};
use aonet_lab::timing::gpu::{GpuMethod, PassCost, Spread, classic_costs, network_costs, time_on_gpu};
use estimate::{Peaks, RTX_3060};
pub(super) use flags::Flags;
use methods::Way;
use serde::Serialize;
use serde_json::json;

/// Common screens.
const SIZES: [Size; 3] = [Size::px(1280, 720), Size::px(1920, 1080), Size::px(3840, 2160)];
/// Counted runs. guess: enough for a median.
const RUNS: usize = 50;

/// A method at one size.
#[derive(Debug, Serialize)]
struct Row {
    method: String,
    precision: String,
    kernels: String,
    width: usize,
    height: usize,
    /// Sums of the passes'.
    flop: f64,
    bytes: f64,
    floor_ms: Option<f64>,
    estimate_ms: f64,
    /// None on a driver that computes on the CPU.
    frame: Option<Spread>,
    whole: Option<Spread>,
    memory_bytes: Option<u64>,
    passes: Vec<PassRow>,
}

#[derive(Debug, Serialize)]
struct PassRow {
    #[serde(flatten)]
    cost: PassCost,
    floor_ms: Option<f64>,
    estimate_ms: f64,
    time: Option<Spread>,
}

/// Measures and prints.
pub(super) fn run(args: &Args) -> Result<()> {
    ensure!(args.threads.is_empty(), "--threads is for --device cpu");
    let device = crate::device::gpu()?;
    let adapter = &device.adapter;
    let measured = args.gpu.software || adapter.device_type != wgpu::DeviceType::Cpu;
    let why_not = format!(
        "not measured: {} computes on the CPU, and its times say nothing about a graphics processor; --software measures \
         them anyway",
        adapter.name
    );
    let mut rows = Vec::new();
    for (name, method) in methods::methods(args)? {
        for way in methods::ways(args, &device, &method)? {
            for size in if args.size.is_empty() { SIZES.to_vec() } else { args.size.clone() } {
                output::note(&format!("{name} {size}, {}, {}", way.precision, way.kernels));
                let on = measured.then_some(&device);
                rows.push(row(Case { name: &name, method: &method, size }, way, on, args)?);
            }
        }
    }
    if args.json {
        return output::json(&json!({
            "adapter": adapter.name, "backend": adapter.backend.to_string(), "driver": adapter.driver_info,
            "type": format!("{:?}", adapter.device_type), "not_measured": (!measured).then_some(why_not),
            "runs": runs(args), "peaks": peaks(args), "estimate": RTX_3060, "rows": rows,
        }));
    }
    let heading = format!("{} ({}, {})", adapter.name, adapter.backend, adapter.driver_info);
    let note = if measured { format!("medians of {} runs", runs(args)) } else { why_not };
    output::text(&text::page(&rows, args.ops, [&heading, &note]))
}

fn row(case: Case<'_>, way: Way, on: Option<&Device>, args: &Args) -> Result<Row> {
    let (Case { name, method, size }, Way { precision, kernels }) = (case, way);
    let (of, costs) = match method {
        Method::Network(model) => {
            (GpuMethod::Network(model, precision, kernels), network_costs(model, size, precision)?)
        }
        Method::Classic(method) => (GpuMethod::Classic(method), classic_costs(method, size)),
    };
    let times = on.map(|device| time_on_gpu(device, of, size, runs(args))).transpose()?;
    let time_of = |pass: usize| times.as_ref().and_then(|t| t.passes.get(pass).copied());
    let pass = |(i, cost): (usize, PassCost)| PassRow {
        floor_ms: peaks(args).floor_ms(&cost),
        estimate_ms: RTX_3060.ms(&cost),
        time: time_of(i),
        cost,
    };
    let passes: Vec<_> = costs.into_iter().enumerate().map(pass).collect();
    Ok(Row {
        method: name.to_owned(),
        precision: precision.to_string(),
        kernels: kernels.to_string(),
        width: size.width(),
        height: size.height(),
        flop: passes.iter().map(|p| p.cost.flop).sum(),
        bytes: passes.iter().map(|p| p.cost.bytes).sum(),
        floor_ms: passes.iter().map(|p| p.floor_ms).sum(),
        estimate_ms: passes.iter().map(|p| p.estimate_ms).sum(),
        frame: times.as_ref().map(|t| t.frame),
        whole: times.as_ref().and_then(|t| t.whole),
        memory_bytes: times.as_ref().map(|t| t.memory_bytes),
        passes,
    })
}

fn runs(args: &Args) -> usize {
    args.runs.unwrap_or(RUNS).max(1)
}

fn peaks(args: &Args) -> Peaks {
    Peaks { tflops: args.gpu.peak_tflops, gb_per_s: args.gpu.bandwidth }
}
