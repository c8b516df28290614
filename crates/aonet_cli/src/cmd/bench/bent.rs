//! What bent normals cost, in runs that take turns with runs without them.

use super::subject::{Method, Subject};
use super::{Args, progress};
use crate::output::{self, Style, number, table};
use anyhow::{Context, Result};
use aonet_lab::timing::{time_bent_normals, time_classic_bent_normals};
use serde_json::json;

/// Measures and prints.
pub(super) fn run(args: &Args, subjects: &[Subject]) -> Result<()> {
    let (mut rows, mut timings) = (Vec::new(), Vec::new());
    for subject in subjects {
        let (name, method) = (&subject.name, &subject.load(args)?);
        for size in args.sizes() {
            for options in args.options()? {
                progress(name, size, options);
                let times = match method {
                    Method::Network(model) => time_bent_normals(model, size, options, args.runs()),
                    Method::Classic(of) => time_classic_bent_normals(of, size, options, args.runs()),
                };
                let times = times.with_context(|| format!("--bent-normals, {name}"))?;
                let cells = [
                    name.clone(),
                    size.to_string(),
                    options.threads.to_string(),
                    number(times.without_ms, 2),
                    number(times.with_ms, 2),
                    number(times.ratio, 3),
                ];
                rows.push(cells.to_vec());
                timings.push(json!({
                    "method": name, "width": size.width(), "height": size.height(),
                    "threads": options.threads, "times": times,
                }));
            }
        }
    }
    if args.json {
        return output::json(&json!({ "machine": args.machine(), "bent_normals": timings }));
    }
    let header = ["method", "size", "threads", "ms", "ms, bent normals", "ratio"];
    let text = table(&header, &rows, Style::Text);
    output::text(&format!("{text}\n{}; medians of {} runs of each, in turns\n", args.machine(), args.runs()))
}
