//! Progress of a dataset: a bar on a terminal, and a last line about the run.

use crate::output;
use aonet_lab::dataset::{Event, Summary};
use indicatif::{ProgressBar, ProgressStyle};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// A bar over frames, shown on a terminal only, and the number of rays.
pub(super) struct Progress {
    bar: ProgressBar,
    rays: AtomicU64,
    start: Instant,
}

impl Progress {
    pub(super) fn new() -> Self {
        let style = "{msg:24} {wide_bar} {pos}/{len} frames, {prefix}, {eta} left";
        let style = ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar());
        Self { bar: ProgressBar::new(0).with_style(style), rays: AtomicU64::new(0), start: Instant::now() }
    }

    pub(super) fn on_event(&self, event: Event) {
        match event {
            Event::Resume { done, total } => {
                self.bar.set_length(total as u64);
                self.bar.set_position(done as u64);
                self.bar.reset_eta();
            }
            Event::Scene(name) => self.bar.set_message(name.to_owned()),
            Event::Rays(n) => {
                self.rays.fetch_add(n, Ordering::Relaxed);
                let (seconds, rays) = self.cost();
                self.bar.set_prefix(format!("{:.1} Mray/s", rays as f64 / 1e6 / seconds));
            }
            Event::Frame(_) => self.bar.inc(1),
        }
    }

    /// Seconds since the start, and rays traced.
    pub(super) fn cost(&self) -> (f64, u64) {
        (self.start.elapsed().as_secs_f64().max(1e-9), self.rays.load(Ordering::Relaxed))
    }

    /// Reports on stderr what was made, how fast, and why views were dropped.
    pub(super) fn finish(&self, summary: &Summary) {
        self.bar.finish_and_clear();
        let (seconds, rays) = self.cost();
        output::note(&format!(
            "{} frames made, {} kept, {:.1} s, {:.1} Mray/s, {:.0} % of the views accepted",
            summary.made,
            summary.kept,
            seconds,
            rays as f64 / 1e6 / seconds,
            100.0 * summary.acceptance()
        ));
        for (flaw, count) in &summary.flaws {
            output::note(&format!("  {count} views dropped: {}", flaw.name()));
        }
    }
}
