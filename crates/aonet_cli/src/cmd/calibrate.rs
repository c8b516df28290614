//! `aonet calibrate`: adds the ranges that int8 needs to a network.

use crate::names;
use crate::{output, setup};
use anyhow::Result;
use aonet::net::WeightFormat;
use aonet_lab::calibrate;
use aonet_lab::dataset::Manifest;
use aonet_scene::atomic_file;
use clap::Parser;
use indicatif::ProgressBar;
use std::path::PathBuf;

/// Measure the ranges of values inside a network on training frames, and write the network with them: `--precision int8` needs
/// them.
///
/// The weights do not change.
#[derive(Debug, Parser)]
#[command(after_help = "Example:
  aonet calibrate data/any --model runs/a/best.safetensors -o a_int8.safetensors
  aonet infer frame.exr --model a_int8.safetensors --precision int8 -o ao.png")]
pub(crate) struct Args {
    /// Dataset folder or manifest.
    dataset: PathBuf,
    /// Network: fast, balanced, high, paper, or a file.
    #[arg(long, value_name = "MODEL", default_value = "balanced")]
    model: PathBuf,
    /// Training frames to look at, evenly spread.
    #[arg(long, default_value_t = 64)]
    frames: usize,
    /// Threads [default: all cores].
    #[arg(long)]
    threads: Option<usize>,
    /// File to write, with weights in half precision.
    #[arg(short, long, value_name = "OUT.safetensors", value_parser = names::ending("safetensors"))]
    output: PathBuf,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let model = setup::model(Some(&args.model))?;
    let manifest = Manifest::load(&args.dataset)?;
    let bar = ProgressBar::new(0);
    let progress = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let ranges =
        calibrate::ranges(&model, &manifest, (args.frames, setup::threads(args.threads)), &progress)?;
    bar.finish_and_clear();
    let bytes = model.with_ranges(ranges)?.to_bytes(WeightFormat::F16)?;
    atomic_file::write(&args.output, &bytes)?;
    output::text(&format!("{}\n", args.output.display()))
}
