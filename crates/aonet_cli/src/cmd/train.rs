//! `aonet train`: datasets and configurations in, models out.

#[cfg(feature = "train")]
mod queue;
#[cfg(feature = "train")]
mod single;

use anyhow::Result;
use clap::Parser;
use std::path::PathBuf;

/// Train a network, or one after another every network of a folder, on one or more datasets.
///
/// The run directory holds the configuration, log.jsonl, curves.svg, a checkpoint and the best and last models.
/// The same command continues a stopped run from its checkpoint; of a folder, it skips finished runs.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet train configs/balanced.json --dataset data/any --dataset data/val -o runs/balanced
  aonet train configs/paper.json --dataset data/paper -o runs/paper --vgg vgg19.safetensors
  aonet train --all configs/rows --dataset data/any -o runs --seeds 1,2")]
pub(crate) struct Args {
    /// Training configuration (JSON).
    #[arg(required_unless_present = "all")]
    pub(crate) config: Option<PathBuf>,
    /// Train every *.json of this folder instead, sorted by name.
    #[arg(long, value_name = "DIR", conflicts_with = "config")]
    pub(crate) all: Option<PathBuf>,
    /// With --all: all configurations with the first seed, then all with the next [default: each one's own].
    #[arg(long, value_delimiter = ',', requires = "all")]
    pub(crate) seeds: Vec<u64>,
    /// With --all: only these configurations (file names without .json).
    #[arg(long, value_name = "NAME", value_delimiter = ',', requires = "all")]
    pub(crate) only: Vec<String>,
    /// Dataset folder or manifest. May be repeated: together they need training and validation frames (aonet dataset --split val).
    #[arg(long, required = true, value_name = "MANIFEST")]
    pub(crate) dataset: Vec<PathBuf>,
    /// Run directory; made if missing, resumed if it holds a checkpoint. With --all: the folder of the run directories
    /// NAME, or NAME-SEED for a seed that is not the configuration's own.
    #[arg(short, long)]
    pub(crate) output: PathBuf,
    /// Start from the weights of this network rather than random ones: fast, balanced, high, paper, or a file. Where the
    /// new network has fewer channels, it keeps the strongest; channels that it has besides change nothing at first.
    #[arg(long, value_name = "MODEL", conflicts_with = "all")]
    pub(crate) from: Option<PathBuf>,
    /// VGG-19 weights for the perceptual term (safetensors, torchvision's names `features.0.weight` ...);
    /// without them the term is off. torchvision's vgg19 state dict can be saved so with the safetensors package.
    #[arg(long, value_name = "FILE")]
    pub(crate) vgg: Option<PathBuf>,
    /// Where to train.
    #[arg(long, default_value = "flex", value_parser = ["flex", "cuda"])]
    pub(crate) device: String,
    /// Crops computed side by side on the CPU [default: all cores].
    #[arg(long)]
    pub(crate) threads: Option<usize>,
    /// Stop with a checkpoint after this many minutes.
    #[arg(long, value_name = "MINUTES")]
    pub(crate) stop_after: Option<f64>,
    /// Version of the code to record in the model, such as a commit.
    #[arg(long, default_value = concat!("aonet ", env!("CARGO_PKG_VERSION")))]
    pub(crate) commit: String,
    /// With --all: print the table as JSON.
    #[arg(long, requires = "all")]
    pub(crate) json: bool,
}

/// Runs the command.
///
/// # Errors
/// When this build cannot train.
#[cfg(not(feature = "train"))]
pub(crate) fn run(args: Args) -> Result<()> {
    anyhow::bail!(
        "cannot train {}: this program was built without training; build it with `cargo build --release --features train`",
        args.config.or(args.all).unwrap_or_default().display()
    )
}

/// Runs the command.
///
/// # Errors
/// When a file is broken, the device is missing, or a run of a folder failed.
#[cfg(feature = "train")]
pub(crate) fn run(args: Args) -> Result<()> {
    match (&args.all, &args.config) {
        (Some(configs), _) => queue::run(&args, configs),
        (None, Some(config)) => single::run(&args, config),
        (None, None) => anyhow::bail!("a configuration or --all is needed"),
    }
}
