//! Results on stdout, notes and progress bars on stderr.

pub(crate) use aonet_lab::table::{Style, number, table};

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::io::{ErrorKind, Write};

/// Writes `text` to stdout. A closed pipe is not an error.
pub(crate) fn text(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e).context("standard output"),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// Writes a line for people to stderr. A closed stderr is not an error.
pub(crate) fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// `text` in lines of at most `columns` letters, as far as its words allow.
pub(crate) fn wrapped(text: &str, columns: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) if line.len() + 1 + word.len() <= columns => *line += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Writes `value` as one JSON document.
pub(crate) fn json(value: &impl Serialize) -> Result<()> {
    text(&format!("{}\n", serde_json::to_string_pretty(value)?))
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
