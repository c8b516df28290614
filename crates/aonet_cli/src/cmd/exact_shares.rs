//! `aonet exact-shares`: what a search would report that finds all that a frame shows.

use anyhow::Result;
use aonet_lab::dataset::Manifest;
use aonet_lab::exact;
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;

/// Trace the exact shares of light of a dataset's frames: hit, hidden and off, as connected arcs would report them if they missed nothing.
///
/// A training configuration whose `exact_survey` names the folder gives them to its network in place of its survey. Such networks measure what a
/// better search would be worth; they cannot run on other frames.
#[derive(Debug, Parser)]
#[command(after_help = "Example:
  aonet exact-shares data/deep --scenes-dir scenes -o data/deep_shares")]
pub(crate) struct Args {
    /// Dataset folder or manifest.
    #[arg(value_name = "MANIFEST")]
    dataset: PathBuf,
    /// Folder with the glTF files of its scenes.
    #[arg(long, default_value = ".")]
    scenes_dir: PathBuf,
    /// Folder of the shares; frames that it has already are kept.
    #[arg(short, long)]
    output: PathBuf,
    /// Distance of the pixels (px): the patch of the networks.
    #[arg(long, default_value_t = 4)]
    every: usize,
    /// Rays per pixel.
    #[arg(long, default_value_t = 48)]
    spp: u32,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let manifest = Manifest::load(&args.dataset)?;
    let style = ProgressStyle::with_template("tracing {wide_bar} {pos} of {len} frames {eta} left")?;
    let bar = ProgressBar::new(manifest.frames.len() as u64).with_style(style);
    let work = (args.output.as_path(), args.every, args.spp);
    exact::save_all(&manifest, &args.scenes_dir, work, &|| bar.inc(1))?;
    bar.finish_and_clear();
    Ok(())
}
