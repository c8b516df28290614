//! Every step of a network beside its lower bounds.

use super::subject::{Case, Method, Subject};
use super::{Args, progress};
use crate::output::{self, Style, number, table};
use anyhow::Result;
use aonet::net::cpu::Options;
use aonet_lab::timing::{self, OpTime, Peaks};
use serde::Serialize;
use serde_json::json;

/// The steps of one network at one size.
#[derive(Debug, Serialize)]
struct Steps {
    network: String,
    width: usize,
    height: usize,
    threads: usize,
    precision: String,
    gflop_per_s: f64,
    copy_gb_per_s: f64,
    ops: Vec<Row>,
}

/// A step beside its floors: the time of its multiplications and of its memory traffic at the machine's peaks.
#[derive(Debug, Serialize)]
struct Row {
    #[serde(flatten)]
    op: OpTime,
    flop_floor_ms: f64,
    bytes_floor_ms: f64,
    /// The time over the higher floor.
    over_floor: f64,
    /// Share of the frame's time.
    share: f64,
}

/// Options, and the machine's peaks with them.
#[derive(Clone, Copy)]
struct Setting {
    options: Options,
    peaks: Peaks,
}

/// Measures and prints.
pub(super) fn run(args: &Args, subjects: &[Subject]) -> Result<()> {
    let setting = |options: Options| {
        output::note(&format!("peaks of {}, threads: {}", options.precision, options.threads));
        Ok(Setting { options, peaks: Peaks::measure(options)? })
    };
    let settings = args.options()?.into_iter().map(setting).collect::<Result<Vec<_>>>()?;
    let mut all = Vec::new();
    for subject in subjects {
        let (name, method) = (&subject.name, &subject.load(args)?);
        let Method::Network(model) = method else { continue };
        for size in args.sizes() {
            for setting in &settings {
                progress(name, size, setting.options);
                let ops = timing::time_ops(model, size, setting.options, args.runs())?;
                all.push(steps(Case { name, method, size }, *setting, ops));
            }
        }
    }
    if args.json {
        return output::json(&json!({ "machine": args.machine(), "runs": args.runs(), "networks": all }));
    }
    let tables: Vec<_> = all.iter().map(text).collect();
    let note = "A floor is the longer of two times: direct convolution at the peak rate of multiply-adds, and moving every input, \
                output and parameter once at the rate of a copy in main memory. Steps whose buffers stay in the caches, and \
                convolutions that save multiplications, can be below it.";
    output::text(&format!(
        "{}\n{note}\n{}; medians of {} runs\n",
        tables.join("\n"),
        args.machine(),
        args.runs()
    ))
}

fn steps(case: Case<'_>, Setting { options, peaks }: Setting, ops: Vec<OpTime>) -> Steps {
    let frame_ms: f64 = ops.iter().map(|op| op.median_ms).sum();
    let row = |op: OpTime| {
        let flop_floor_ms = op.cost.flop / peaks.gflop_per_s / 1e6;
        let bytes_floor_ms = op.cost.bytes / peaks.copy_gb_per_s / 1e6;
        let over_floor = op.median_ms / flop_floor_ms.max(bytes_floor_ms);
        let share = op.median_ms / frame_ms;
        Row { op, flop_floor_ms, bytes_floor_ms, over_floor, share }
    };
    Steps {
        network: case.name.to_owned(),
        width: case.size.width(),
        height: case.size.height(),
        threads: options.threads,
        precision: options.precision.to_string(),
        gflop_per_s: peaks.gflop_per_s,
        copy_gb_per_s: peaks.copy_gb_per_s,
        ops: ops.into_iter().map(row).collect(),
    }
}

fn text(steps: &Steps) -> String {
    let Steps { network, width, height, threads, precision, gflop_per_s, copy_gb_per_s, ops } = steps;
    let title = format!(
        "{network}, {width}x{height}, threads: {threads}, {precision}; peaks: {gflop_per_s:.0} GFLOP/s, copy {copy_gb_per_s:.1} GB/s"
    );
    let header = "step|kind|channels|output|ms|share %|GFLOP|GFLOP/s|MB|FLOP floor ms|byte floor ms|ms/floor";
    let header: Vec<_> = header.split('|').collect();
    let mut rows: Vec<_> = ops.iter().map(cells).collect();
    rows.push(total(ops));
    format!("{title}\n{}", table(&header, &rows, Style::Text))
}

fn cells(row: &Row) -> Vec<String> {
    let Row { op: OpTime { cost, median_ms }, .. } = row;
    let head = [
        cost.name.clone(),
        cost.kind.clone(),
        format!("{} -> {}", cost.inputs, cost.outputs),
        format!("{}x{}", cost.width, cost.height),
    ];
    let rate = (cost.flop > 0.0).then_some(cost.flop / median_ms / 1e6);
    let figures = [
        number(*median_ms, 2),
        number(100.0 * row.share, 1),
        number(1e-9 * cost.flop, 2),
        number(rate, 0),
        number(1e-6 * cost.bytes, 1),
        number(row.flop_floor_ms, 2),
        number(row.bytes_floor_ms, 2),
        number(row.over_floor, 2),
    ];
    head.into_iter().chain(figures).collect()
}

/// The frame: sums, and the time over the sum of the higher floors.
fn total(rows: &[Row]) -> Vec<String> {
    let sum = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).sum::<f64>();
    let (ms, flop) = (sum(&|r| r.op.median_ms), sum(&|r| r.op.cost.flop));
    let floor = sum(&|r| r.flop_floor_ms.max(r.bytes_floor_ms));
    let head = ["frame", "", "", ""].map(str::to_owned);
    let figures = [
        number(ms, 2),
        number(100.0, 1),
        number(1e-9 * flop, 2),
        number(flop / ms / 1e6, 0),
        number(sum(&|r| 1e-6 * r.op.cost.bytes), 1),
        number(sum(&|r| r.flop_floor_ms), 2),
        number(sum(&|r| r.bytes_floor_ms), 2),
        number(ms / floor, 2),
    ];
    head.into_iter().chain(figures).collect()
}
