//! What goes to stdout, and notes and progress bars on stderr.

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::io::{ErrorKind, Write};

/// Writes `text` to stdout; a reader that has gone away is no error.
pub(crate) fn text(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e).context("standard output"),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// Writes a line for people to stderr. Where nobody listens there is nobody to tell.
pub(crate) fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Writes `value` as one JSON document.
pub(crate) fn json(value: &impl Serialize) -> Result<()> {
    text(&format!("{}\n", serde_json::to_string_pretty(value)?))
}

/// A table: how it is set apart is up to `style`. The first column is left-aligned, the others right.
pub(crate) fn table(header: &[&str], rows: &[Vec<String>], style: Style) -> String {
    let columns = header.len();
    let width = |c: usize| {
        let cells = rows.iter().map(|r| r[c].chars().count());
        cells.chain([header[c].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |cells: Vec<&str>| {
        let padded = cells.iter().enumerate().map(|(c, cell)| match c {
            0 => format!("{cell:<0$}", widths[c]),
            _ => format!("{cell:>0$}", widths[c]),
        });
        let padded: Vec<String> = padded.collect();
        match style {
            Style::Text => format!("{}\n", padded.join("  ").trim_end()),
            Style::Markdown => format!("| {} |\n", padded.join(" | ")),
        }
    };
    let mut text = line(header.to_vec());
    if style == Style::Markdown {
        let dashes: Vec<String> =
            (0..columns).map(|c| if c == 0 { "---".into() } else { "---:".into() }).collect();
        text += &format!("|{}|\n", dashes.join("|"));
    }
    rows.iter().for_each(|row| text += &line(row.iter().map(String::as_str).collect()));
    text
}

/// How a table looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Style {
    /// Columns of spaces.
    Text,
    /// A Markdown table.
    Markdown,
}

/// A number with `digits` decimals; a dash for nothing, `inf` for infinity.
pub(crate) fn number(value: impl Into<Option<f64>>, digits: usize) -> String {
    value.into().map_or_else(|| "-".into(), |v| format!("{v:.digits$}"))
}

/// A bar over rays with their rate and the time left; hidden where stderr is no terminal.
pub(crate) fn ray_bar(rays: u64) -> ProgressBar {
    let style = "tracing {wide_bar} {percent} % {prefix} {eta} left";
    let style = ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(rays).with_style(style)
}

/// Advances a [`ray_bar`].
pub(crate) fn traced(bar: &ProgressBar, rays: u64) {
    bar.inc(rays);
    bar.set_prefix(format!(
        "{:.1} Mray/s",
        bar.position() as f64 / 1e6 / bar.elapsed().as_secs_f64().max(1e-9)
    ));
}
