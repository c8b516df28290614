//! `aonet ladder`: what kinds of frames know, and how much of it searches find.

use crate::output::{self, Style, number, table};
use crate::setup;
use anyhow::Result;
use aonet_lab::dataset::Manifest;
use aonet_lab::ladder::{Finder, Ladder, Rungs};
use aonet_scene::reference::Sampling;
use aonet_scene::view::Surround;
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use std::path::PathBuf;

/// Measure what kinds of frames can know: rays of the reference that may only meet what a frame shows.
///
/// The first table has the mean PSNR of such a visibility for each guard band and second layer. The second one compares the share of
/// light that a search says is hit with the exact one, on frames with one layer, and with a guard band and two. It also has the mean PSNR of the
/// visibility that the shares of light explain, if every frame had weights of its own: with the search's hits, and with the exact ones. The last
/// column is the share of the squared error, with the search's hits, that lies in the worst hundredth of a frame's pixels. `--marched`
/// adds rows of rays that march through the frame, one step for every pixel on their way.
#[derive(Debug, Parser)]
#[command(after_help = "Example:
  aonet ladder data/test_any --scenes-dir scenes --frames 16")]
pub(crate) struct Args {
    /// Dataset folder or manifest.
    #[arg(value_name = "MANIFEST")]
    dataset: PathBuf,
    /// Folder with the glTF files of its scenes.
    #[arg(long, default_value = ".")]
    scenes_dir: PathBuf,
    /// Frames to measure, evenly spread over the dataset [default: all].
    #[arg(long)]
    frames: Option<usize>,
    /// Connected arcs with the parameters of a preset: a name or a file of `aonet tune`; may be repeated [default: arcs:tuned, arcs:deep].
    #[arg(long, value_name = "METHOD")]
    classic: Vec<String>,
    /// Also march so many rays a pixel through the frame; may be repeated.
    #[arg(long, value_name = "RAYS", value_parser = clap::value_parser!(u32).range(1..=4096))]
    marched: Vec<u32>,
    /// Distance of the pixels that are compared (px).
    #[arg(long, default_value_t = 8)]
    every: usize,
    /// Rays per pixel.
    #[arg(long, default_value_t = 96)]
    spp: u32,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Guard bands on each side, as shares of the picture.
const GUARDS: [f32; 6] = [0.0, 0.05, 0.1, 0.15, 0.25, 0.5];
/// Separations of the second layer, as shares of the AO radius.
const SEPARATIONS: [f32; 5] = [0.0, 0.05, 0.1, 0.25, 0.5];
/// The frames that searches get.
const FRAMES: [(&str, Surround); 2] = [
    ("one layer", Surround { margin: 0.0, separation: None }),
    ("guard band 0.15, two layers", Surround { margin: 0.15, separation: Some(0.1) }),
];

/// Columns of the table of searches.
const HEADER: [&str; 7] =
    ["search", "correlation", "hit", "exact", "explained dB", "with exact hits dB", "error in worst 1 %"];

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let manifest = Manifest::load(&args.dataset)?;
    let defaults = ["arcs:tuned", "arcs:deep"].map(str::to_owned);
    let methods = setup::classic(if args.classic.is_empty() { &defaults } else { &args.classic })?;
    let methods = methods.iter().map(|(name, method)| (name.clone(), Finder::Search(*method)));
    let marched = args.marched.iter().map(|rays| (format!("{rays} marched rays"), Finder::Rays(*rays)));
    let finders: Vec<_> = methods.chain(marched).collect();
    let searches = FRAMES.iter().flat_map(|(frames, kind)| {
        finders.iter().map(move |(name, finder)| (format!("{name}, {frames}"), *finder, *kind))
    });
    let ladder = Ladder {
        kinds: separations()
            .flat_map(|separation| GUARDS.map(|margin| Surround { margin, separation }))
            .collect(),
        searches: searches.collect(),
        frames: args.frames,
        every: args.every,
        sampling: Sampling { spp: args.spp, seed: 1 },
    };
    let style = ProgressStyle::with_template("tracing {wide_bar} {pos} of {len} frames {eta} left")?;
    let bar = ProgressBar::new(0).with_style(style);
    let rungs = ladder.climb(&manifest, &args.scenes_dir, &|frames| {
        bar.set_length(frames as u64);
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    report(args, &ladder, &rungs)
}

/// No second layer, then each of them.
fn separations() -> impl Iterator<Item = Option<f32>> {
    std::iter::once(None).chain(SEPARATIONS.map(Some))
}

fn report(args: &Args, ladder: &Ladder, rungs: &Rungs) -> Result<()> {
    let names = ladder.searches.iter().map(|(name, ..)| name);
    if args.json {
        let kind = |(kind, psnr)| json!({ "kind": kind, "psnr": psnr });
        let search = |(name, finding)| json!({ "search": name, "finding": finding });
        return output::json(&json!({
            "frames": rungs.frames,
            "kinds": ladder.kinds.iter().zip(&rungs.psnr).map(kind).collect::<Vec<_>>(),
            "searches": names.zip(&rungs.searches).map(search).collect::<Vec<_>>(),
        }));
    }
    let guards = GUARDS.map(|guard| format!("guard {guard}"));
    let header: Vec<_> = ["layers"].into_iter().chain(guards.iter().map(String::as_str)).collect();
    let row = |(separation, psnr): (Option<f32>, &[f64])| {
        let name = separation.map_or("one".to_owned(), |share| format!("two, {share} of the radius apart"));
        [name].into_iter().chain(psnr.iter().map(|psnr| number(*psnr, 2))).collect::<Vec<_>>()
    };
    let rows: Vec<_> = separations().zip(rungs.psnr.chunks(GUARDS.len())).map(row).collect();
    output::text(&table(&header, &rows, Style::Text))?;
    output::text(&format!("\nmean PSNR (dB) of {} frames, everything unknown open\n\n", rungs.frames))?;
    let row = |(name, found): (&String, &aonet_lab::ladder::Finding)| {
        let hits = [number(found.correlation, 3), number(found.hit, 4), number(found.exact, 4)];
        let psnr = [number(found.explained, 2), number(found.explained_by_exact, 2)];
        let worst = number(found.worst, 2);
        [name.clone()].into_iter().chain(hits).chain(psnr).chain([worst]).collect::<Vec<_>>()
    };
    let rows: Vec<_> = names.zip(&rungs.searches).map(row).collect();
    output::text(&table(&HEADER, &rows, Style::Text))
}
