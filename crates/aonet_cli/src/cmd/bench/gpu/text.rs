//! The rows as tables.

use super::estimate::RTX_3060;
use super::{PassRow, Row};
use crate::output::{Style, number, table};
use aonet_lab::timing::gpu::Spread;

const MIB: f64 = (1u64 << 20) as f64;

/// A table of all rows, on request a table of each row's passes, and notes that explain them.
pub(super) fn page(rows: &[Row], passes: bool, [device, note]: [&str; 2]) -> String {
    let by_pass: Vec<_> = rows.iter().filter(|_| passes).map(passes_of).collect();
    format!(
        "{}\n{}{device}; {note}\nframe: while the device is never idle; whole: from the first pass's begin to the last one's end, \
         each waiting for the one before\n{}\n",
        frames(rows),
        by_pass.concat(),
        RTX_3060.sentence()
    )
}

fn frames(rows: &[Row]) -> String {
    let header = "method|precision|kernels|size|frame ms|min..max ms|whole ms|GFLOP|MB|floor ms|estimate ms|session MiB";
    let header: Vec<_> = header.split('|').collect();
    let cells = |r: &Row| {
        vec![
            r.method.clone(),
            r.precision.clone(),
            r.kernels.clone(),
            format!("{}x{}", r.width, r.height),
            median(r.frame),
            range(r.frame),
            median(r.whole),
            number(1e-9 * r.flop, 1),
            number(1e-6 * r.bytes, 0),
            number(r.floor_ms, 3),
            number(r.estimate_ms, 2),
            number(r.memory_bytes.map(|b| b as f64 / MIB), 1),
        ]
    };
    table(&header, &rows.iter().map(cells).collect::<Vec<_>>(), Style::Text)
}

fn passes_of(row: &Row) -> String {
    let header = "pass|ms|min..max ms|GFLOP|MB|floor ms|estimate ms";
    let header: Vec<_> = header.split('|').collect();
    let cells = |p: &PassRow| {
        vec![
            p.cost.pass.clone(),
            median(p.time),
            range(p.time),
            number(1e-9 * p.cost.flop, 2),
            number(1e-6 * p.cost.bytes, 1),
            number(p.floor_ms, 3),
            number(p.estimate_ms, 3),
        ]
    };
    let title = format!("{}, {}x{}, {}, {}", row.method, row.width, row.height, row.precision, row.kernels);
    let rows: Vec<_> = row.passes.iter().map(cells).collect();
    format!("{title}\n{}\n", table(&header, &rows, Style::Text))
}

fn median(times: Option<Spread>) -> String {
    times.map_or_else(|| "not measured".to_owned(), |t| number(t.median_ms, 3))
}

fn range(times: Option<Spread>) -> String {
    times.map_or_else(|| "-".to_owned(), |t| format!("{:.3}..{:.3}", t.min_ms, t.max_ms))
}
