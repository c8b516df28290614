//! One row for every method, size and number of threads.

use super::subject::{Case, Method, Subject};
use super::{Args, progress};
use crate::output::{self, Style, number, table};
use anyhow::Result;
use aonet::Size;
use aonet::net::Model;
use aonet::net::cpu::{Options, Precision};
use aonet_lab::timing::{self, Times};
use serde::Serialize;
use serde_json::{Value, json};

const MIB: f64 = (1u64 << 20) as f64;

#[derive(Debug, Serialize)]
struct Row {
    method: String,
    width: usize,
    height: usize,
    threads: usize,
    /// None for classic methods.
    precision: Option<String>,
    #[serde(flatten)]
    times: Times,
    /// The time with the first number of threads divided by this time.
    scaling: f64,
    gflop: Option<f64>,
    gflop_per_s: Option<f64>,
    /// Taps a pixel of a classic method, without its filter's.
    taps: Option<u32>,
    peak_mib: Option<f64>,
}

/// Measures and prints.
pub(super) fn run(args: &Args, subjects: &[Subject]) -> Result<()> {
    let (mut rows, mut networks) = (Vec::new(), Vec::new());
    for subject in subjects {
        let (name, method) = (&subject.name, &subject.load(args)?);
        networks.extend(facts(name, method));
        for size in args.sizes() {
            for precision in args.precisions()?.iter().take(method.precisions()) {
                rows.extend(by_threads(Case { name, method, size }, *precision, args)?);
            }
        }
    }
    if args.json {
        return output::json(&json!({ "machine": args.machine(), "networks": networks, "timings": rows }));
    }
    output::text(&format!("{}\n{}; {} runs each\n", text(&rows), args.machine(), args.runs()))
}

/// Configuration and size of a network.
fn facts(name: &str, method: &Method) -> Option<Value> {
    let Method::Network(model) = method else { return None };
    let graph = model.graph();
    let (macs, parameters) = (graph.macs_per_pixel(), graph.params_count());
    let config = model.config();
    Some(json!({ "name": name, "config": config, "macs_per_pixel": macs, "parameters": parameters }))
}

/// A row for each number of threads.
fn by_threads(case: Case<'_>, precision: Precision, args: &Args) -> Result<Vec<Row>> {
    let mut rows: Vec<Row> = Vec::new();
    for options in args.options_of(precision) {
        progress(case.name, case.size, options);
        let row = measure(case, options, args.runs())?;
        let scaling = rows.first().map_or(1.0, |first| first.times.median_ms / row.times.median_ms);
        rows.push(Row { scaling, ..row });
    }
    Ok(rows)
}

fn measure(case: Case<'_>, options: Options, runs: usize) -> Result<Row> {
    let (size, threads) = (case.size, options.threads);
    timing::reset_peak();
    Ok(match case.method {
        Method::Network(model) => {
            let times = timing::time(model, size, options, runs)?;
            let gflop = gflop(model, size);
            Row {
                precision: Some(options.precision.to_string()),
                gflop: Some(gflop),
                gflop_per_s: Some(1e3 * gflop / times.median_ms),
                ..row(case, threads, times)
            }
        }
        Method::Classic(method) => {
            let times = timing::time_classic(method, size, options, runs)?;
            Row { taps: Some(method.taps()), ..row(case, threads, times) }
        }
    })
}

fn row(case: Case<'_>, threads: usize, times: Times) -> Row {
    Row {
        method: case.name.to_owned(),
        width: case.size.width(),
        height: case.size.height(),
        threads,
        precision: None,
        times,
        scaling: 1.0,
        gflop: None,
        gflop_per_s: None,
        taps: None,
        peak_mib: timing::peak_mib(),
    }
}

/// Operations of a frame (1e9), two for each multiply-add.
fn gflop(model: &Model, size: Size) -> f64 {
    let step = model.graph().alignment();
    let padded = (size.width().next_multiple_of(step) * size.height().next_multiple_of(step)) as f64;
    2e-9 * model.graph().macs_per_pixel() * padded
}

fn text(rows: &[Row]) -> String {
    let header = "method|size|threads|precision|median ms|min..max ms|scaling|first ms|ns/px|taps|GFLOP|GFLOP/s|session MiB|peak MiB";
    let header: Vec<_> = header.split('|').collect();
    let cells = |r: &Row| {
        let session_mib = r.gflop.map(|_| r.times.session_bytes as f64 / MIB);
        vec![
            r.method.clone(),
            format!("{}x{}", r.width, r.height),
            r.threads.to_string(),
            r.precision.clone().unwrap_or_else(|| "f32".to_owned()),
            number(r.times.median_ms, 1),
            format!("{:.1}..{:.1}", r.times.min_ms, r.times.max_ms),
            number(r.scaling, 2),
            number(r.times.first_ms, 1),
            number(1e6 * r.times.median_ms / (r.width * r.height) as f64, 1),
            number(r.taps.map(f64::from), 0),
            number(r.gflop, 1),
            number(r.gflop_per_s, 0),
            number(session_mib, 1),
            number(r.peak_mib, 0),
        ]
    };
    table(&header, &rows.iter().map(cells).collect::<Vec<_>>(), Style::Text)
}
