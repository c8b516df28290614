//! `aonet train`: a dataset and a configuration in, a model out.

use anyhow::Result;
use clap::Parser;
use std::path::PathBuf;

/// Train a network on one or more datasets.
///
/// The run directory holds the configuration, log.jsonl, curves.svg, a checkpoint and the best and last models.
/// A run that was stopped goes on from its checkpoint when the same command is given again.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet train configs/any_radius.json --dataset data/any -o runs/any_radius
  aonet train configs/paper.json --dataset data/paper -o runs/paper --vgg vgg19.safetensors --device cuda")]
pub(crate) struct Args {
    /// Training configuration (JSON).
    pub(crate) config: PathBuf,
    /// Dataset folder or manifest. May be repeated.
    #[arg(long, required = true, value_name = "MANIFEST")]
    pub(crate) dataset: Vec<PathBuf>,
    /// Run directory; made if missing, resumed if it holds a checkpoint.
    #[arg(short, long)]
    pub(crate) output: PathBuf,
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
    /// What to write into the model about the code's version, such as a commit.
    #[arg(long, default_value = "")]
    pub(crate) commit: String,
}

/// Runs the command.
///
/// # Errors
/// When a file is broken or this build cannot train.
#[cfg(not(feature = "train"))]
pub(crate) fn run(args: Args) -> Result<()> {
    anyhow::bail!(
        "cannot train {}: this program was built without training; build it with `cargo build --release --features train`",
        args.config.display()
    )
}

/// Runs the command.
///
/// # Errors
/// When a file is broken or the device is missing.
#[cfg(feature = "train")]
pub(crate) fn run(args: Args) -> Result<()> {
    training::run(&args)
}

#[cfg(feature = "train")]
mod training {
    use super::Args;
    use crate::output;
    use anyhow::{Context, Result, bail};
    use aonet::net::TrainingFacts;
    use aonet_offline::dataset::Manifest;
    use aonet_offline::train::{TrainConfig, TrainDevice, TrainEvent, TrainRun, train};
    use indicatif::{ProgressBar, ProgressStyle};
    use std::time::Duration;

    pub(super) fn run(args: &Args) -> Result<()> {
        let config = TrainConfig::load(&args.config)?;
        let manifests = args.dataset.iter().map(|p| Manifest::load(p)).collect::<Result<Vec<_>, _>>()?;
        let run = TrainRun {
            dir: args.output.clone(),
            vgg: args.vgg.clone(),
            device: device(args)?,
            time_limit: args
                .stop_after
                .map(|m| Duration::try_from_secs_f64(60.0 * m))
                .transpose()
                .context("--stop-after")?,
            facts: facts(args, &manifests),
        };
        let bar = ProgressBar::new(config.steps);
        let style = "{msg:28} {wide_bar} {pos}/{len}, {eta} left";
        bar.set_style(ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar()));
        let steps = train(&config, &manifests, &run, &|event| show(&bar, event))?;
        bar.finish_and_clear();
        output::note(&format!("{steps} of {} steps", config.steps));
        output::text(&format!("{}\n", args.output.join("best.safetensors").display()))
    }

    fn device(args: &Args) -> Result<TrainDevice> {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        match args.device.as_str() {
            "flex" => Ok(TrainDevice::Flex { threads: args.threads.unwrap_or_else(cores).max(1) }),
            #[cfg(feature = "cuda")]
            "cuda" => Ok(TrainDevice::Cuda),
            other => {
                bail!("device {other}: this program was built without it; build with `--features {other}`")
            }
        }
    }

    fn facts(args: &Args, manifests: &[Manifest]) -> TrainingFacts {
        let command: Vec<String> = std::env::args().skip(1).collect();
        let described: Vec<_> = manifests.iter().map(describe).collect();
        let radius: Vec<_> = manifests.iter().map(|m| format!("{:?}", m.plan.recipe.radius)).collect();
        TrainingFacts {
            dataset: described.join("; "),
            radius: radius.join("; "),
            command: format!("aonet {}", command.join(" ")),
            commit: args.commit.clone(),
            ..TrainingFacts::default()
        }
    }

    fn describe(manifest: &Manifest) -> String {
        let recipe = &manifest.plan.recipe;
        format!(
            "{:?}, {} scenes, {}x{}, {} rays per pixel, seed {}",
            recipe.preset,
            manifest.plan.scenes.len(),
            recipe.width,
            recipe.height,
            recipe.spp,
            recipe.seed
        )
    }

    fn show(bar: &ProgressBar, event: TrainEvent) {
        match event {
            TrainEvent::Loaded(done, total) => bar.set_message(format!("frame {done}/{total}")),
            TrainEvent::Step(step, loss) => {
                bar.set_position(step);
                bar.set_message(format!("loss {loss:.4}"));
            }
            TrainEvent::Validated(step, scores) => {
                let scores: Vec<_> =
                    scores.iter().map(|(name, value)| format!("{name} {value:.4}")).collect();
                bar.suspend(|| output::note(&format!("step {step}: validation {}", scores.join(", "))));
            }
            TrainEvent::NoPerceptualTerm => {
                bar.suspend(|| {
                    output::note("no VGG-19 weights given (--vgg): the perceptual term of the loss is off")
                });
            }
        }
    }
}
