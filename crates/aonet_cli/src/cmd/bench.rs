//! `aonet bench`: run-time of a network, or of classic methods, on this machine.

use crate::output::{self, Style, number, table};
use crate::setup;
use anyhow::Result;
use aonet::net::Model;
use aonet_offline::timing;
use clap::Parser;
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

/// Time a network on the CPU: features, network and clamping of a frame whose buffers are in memory.
///
/// The floor is what the multiplications and the least memory traffic (weights, G-buffer and AO once) would take; both are
/// printed so that any machine's peak can be held against them. With --classic: those methods instead, with nanoseconds a
/// pixel beside the taps that a pixel takes.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet bench --threads 1 --threads 2 --size 1920x1080
  aonet bench --classic all --size 1280x720")]
pub(crate) struct Args {
    /// Network; the shipped one that serves any radius if absent.
    #[arg(long, value_name = "M.safetensors")]
    model: Option<PathBuf>,
    /// Classic method, or `all`; may be repeated.
    #[arg(long, value_name = "METHOD", conflicts_with = "model")]
    classic: Vec<String>,
    /// Image size; may be repeated [default: the paper's 540x540, 1280x720, 2048x1024].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Vec<(usize, usize)>,
    /// Threads; may be repeated [default: 1 and all cores].
    #[arg(long)]
    threads: Vec<usize>,
    /// Counted runs, after one that is not.
    #[arg(long, default_value_t = 15)]
    runs: usize,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Timing {
    width: usize,
    height: usize,
    threads: usize,
    median_ms: f64,
    min_ms: f64,
    features_ms: f64,
    gflop_per_s: f64,
    session_mib: f64,
}

/// A size [px] from `WxH`.
pub(crate) fn parse_size(text: &str) -> Result<(usize, usize)> {
    let (width, height) =
        text.split_once('x').ok_or_else(|| anyhow::anyhow!("expected WxH, such as 1280x720"))?;
    let size = (width.parse()?, height.parse()?);
    aonet::camera::check_size("--size", size.0, size.1)?;
    Ok(size)
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let or = |given: &[(usize, usize)], default: &[(usize, usize)]| {
        if given.is_empty() { default.to_vec() } else { given.to_vec() }
    };
    let sizes = or(&args.size, &[(540, 540), (1280, 720), (2048, 1024)]);
    let mut threads = args.threads.clone();
    if threads.is_empty() {
        threads = vec![1, setup::threads(None)];
        threads.dedup();
    }
    if !args.classic.is_empty() {
        return classic(args, &sizes, &threads);
    }
    let model = setup::model(args.model.as_deref())?;
    let mut timings = Vec::new();
    for &size in &sizes {
        for &threads in &threads {
            timings.push(time(&model, size, threads.clamp(1, 1024), args.runs.max(1))?);
        }
    }
    let macs = model.graph().macs_per_pixel();
    if args.json {
        let model = json!({ "config": model.config(), "macs_per_pixel": macs });
        return output::json(&json!({ "model": model, "peak_process_mib": peak_mib(), "timings": timings }));
    }
    let cells = |t: &Timing| {
        let floor_mib = (t.width * t.height * (4 * 4 + 4)) as f64 / (1u64 << 20) as f64;
        vec![
            format!("{}x{}", t.width, t.height),
            t.threads.to_string(),
            number(t.median_ms, 1),
            number(t.min_ms, 1),
            number(t.gflop_per_s, 0),
            number(2e-9 * macs * (t.width * t.height) as f64, 1),
            number(floor_mib, 1),
            number(t.session_mib, 1),
        ]
    };
    let header = ["size", "threads", "median ms", "min ms", "GFLOP/s", "GFLOP", "floor MiB", "session MiB"];
    let mut text = table(&header, &timings.iter().map(cells).collect::<Vec<_>>(), Style::Text);
    text += &format!("\n{} runs each; peak of the process {} MiB\n", args.runs, number(peak_mib(), 0));
    output::text(&text)
}

#[derive(Serialize)]
struct ClassicTiming {
    method: String,
    width: usize,
    height: usize,
    threads: usize,
    median_ms: f64,
    min_ms: f64,
    ns_per_pixel: f64,
    taps: u32,
}

fn classic(args: &Args, sizes: &[(usize, usize)], threads: &[usize]) -> Result<()> {
    let mut timings = Vec::new();
    for (name, method) in setup::classic(&args.classic)? {
        for &(width, height) in sizes {
            for &threads in threads {
                let pool = setup::pool(Some(threads))?;
                let times = timing::time_classic(&method, (width, height), &pool, args.runs)?;
                let (median_ms, min_ms) = (times.median_ms, times.min_ms);
                let ns_per_pixel = median_ms * 1e6 / (width * height) as f64;
                let (method, taps) = (name.clone(), method.taps());
                timings.push(ClassicTiming {
                    method,
                    width,
                    height,
                    threads,
                    median_ms,
                    min_ms,
                    ns_per_pixel,
                    taps,
                });
            }
        }
    }
    if args.json {
        return output::json(&json!({ "timings": timings }));
    }
    let cells = |t: &ClassicTiming| {
        vec![
            t.method.clone(),
            format!("{}x{}", t.width, t.height),
            t.threads.to_string(),
            number(t.median_ms, 1),
            number(t.min_ms, 1),
            number(t.ns_per_pixel, 1),
            t.taps.to_string(),
        ]
    };
    let header = ["method", "size", "threads", "median ms", "min ms", "ns/pixel", "taps"];
    let text = table(&header, &timings.iter().map(cells).collect::<Vec<_>>(), Style::Text);
    output::text(&format!("{text}\n{} runs each; taps without the filter's\n", args.runs))
}

fn time(model: &Model, size: (usize, usize), threads: usize, runs: usize) -> Result<Timing> {
    let (width, height) = size;
    let times = timing::time(model, size, threads, runs)?;
    let flop = 2.0 * model.graph().macs_per_pixel() * (width * height) as f64;
    let gflop_per_s = flop / times.median_ms / 1e6;
    let session_mib = times.session_bytes as f64 / (1u64 << 20) as f64;
    Ok(Timing {
        width,
        height,
        threads,
        median_ms: times.median_ms,
        min_ms: times.min_ms,
        features_ms: times.features_ms,
        gflop_per_s,
        session_mib,
    })
}

/// Largest resident size of this process so far [MiB], where the system tells.
fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}
