//! One row for every method, size and number of threads.

use super::subject::{Method, Subject};
use super::{Args, machine, progress};
use crate::output::{self, Style, number, table};
use crate::setup;
use anyhow::Result;
use aonet::net::Model;
use aonet_offline::timing::{self, Times};
use serde::Serialize;
use serde_json::{Value, json};

const MIB: f64 = (1u64 << 20) as f64;

#[derive(Debug, Serialize)]
struct Row {
    method: String,
    width: usize,
    height: usize,
    threads: usize,
    median_ms: f64,
    min_ms: f64,
    max_ms: f64,
    /// Making a session and its first image.
    first_ms: f64,
    /// The first step of a network.
    features_ms: Option<f64>,
    /// The time with the first number of threads over this one.
    scaling: f64,
    gflop: Option<f64>,
    gflop_per_s: Option<f64>,
    /// Taps a pixel of a classic method, without its filter's.
    taps: Option<u32>,
    session_mib: Option<f64>,
    peak_mib: Option<f64>,
}

/// Measures and prints.
pub(super) fn run(args: &Args, subjects: &[Subject]) -> Result<()> {
    let (mut rows, mut networks) = (Vec::new(), Vec::new());
    for subject in subjects {
        let method = (subject.name.as_str(), &subject.load()?);
        networks.extend(facts(method));
        for size in args.sizes() {
            let mut reference_ms = None;
            for threads in args.threads() {
                progress(&subject.name, size, threads);
                let row = measure(method, size, (threads, args.runs))?;
                let scaling = *reference_ms.get_or_insert(row.median_ms) / row.median_ms;
                rows.push(Row { scaling, ..row });
            }
        }
    }
    if args.json {
        return output::json(&json!({ "machine": machine(), "networks": networks, "timings": rows }));
    }
    output::text(&format!("{}\n{}; {} runs each\n", text(&rows), machine(), args.runs.max(1)))
}

/// Configuration and size of a network.
fn facts((name, method): (&str, &Method)) -> Option<Value> {
    let Method::Network(model) = method else { return None };
    let graph = model.graph();
    let (macs, parameters) = (graph.macs_per_pixel(), graph.params_count());
    let config = model.config();
    Some(json!({ "name": name, "config": config, "macs_per_pixel": macs, "parameters": parameters }))
}

fn measure(of: (&str, &Method), size: (usize, usize), (threads, runs): (usize, usize)) -> Result<Row> {
    let (name, method) = of;
    timing::reset_peak();
    Ok(match method {
        Method::Network(model) => {
            let times = timing::time(model, size, threads, runs)?;
            let gflop = gflop(model, size);
            Row {
                features_ms: Some(times.features_ms),
                gflop: Some(gflop),
                gflop_per_s: Some(1e3 * gflop / times.median_ms),
                session_mib: Some(times.session_bytes as f64 / MIB),
                ..row(name, size, (threads, &times))
            }
        }
        Method::Classic(method) => {
            let times = timing::time_classic(method, size, &setup::pool(Some(threads))?, runs)?;
            Row { taps: Some(method.taps()), ..row(name, size, (threads, &times)) }
        }
    })
}

fn row(name: &str, (width, height): (usize, usize), (threads, times): (usize, &Times)) -> Row {
    Row {
        method: name.to_owned(),
        width,
        height,
        threads,
        median_ms: times.median_ms,
        min_ms: times.min_ms,
        max_ms: times.max_ms,
        first_ms: times.first_ms,
        features_ms: None,
        scaling: 1.0,
        gflop: None,
        gflop_per_s: None,
        taps: None,
        session_mib: None,
        peak_mib: timing::peak_mib(),
    }
}

/// Operations of a frame [1e9], two for each multiply-add.
fn gflop(model: &Model, (width, height): (usize, usize)) -> f64 {
    let step = model.graph().alignment();
    let padded = (width.next_multiple_of(step) * height.next_multiple_of(step)) as f64;
    2e-9 * model.graph().macs_per_pixel() * padded
}

fn text(rows: &[Row]) -> String {
    let header = "method|size|threads|median ms|min..max ms|scaling|first ms|ns/px|taps|GFLOP|GFLOP/s|session MiB|peak MiB";
    let header: Vec<_> = header.split('|').collect();
    let cells = |r: &Row| {
        vec![
            r.method.clone(),
            format!("{}x{}", r.width, r.height),
            r.threads.to_string(),
            number(r.median_ms, 1),
            format!("{:.1}..{:.1}", r.min_ms, r.max_ms),
            number(r.scaling, 2),
            number(r.first_ms, 1),
            number(1e6 * r.median_ms / (r.width * r.height) as f64, 1),
            number(r.taps.map(f64::from), 0),
            number(r.gflop, 1),
            number(r.gflop_per_s, 0),
            number(r.session_mib, 1),
            number(r.peak_mib, 0),
        ]
    };
    table(&header, &rows.iter().map(cells).collect::<Vec<_>>(), Style::Text)
}
