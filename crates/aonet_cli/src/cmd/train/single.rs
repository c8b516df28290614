//! One run, and what every run shares.

use super::Args;
use crate::output;
use crate::setup;
use anyhow::{Context, Result, bail};
use aonet::net::TrainingFacts;
use aonet_lab::dataset::Manifest;
use aonet_lab::train::{TrainConfig, TrainDevice, TrainEvent, TrainRun, train};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::Path;
use std::time::Duration;

pub(super) fn run(args: &Args, config: &Path) -> Result<()> {
    let config = TrainConfig::load(config)?;
    let manifests = manifests(args)?;
    let run = train_run(args, &manifests)?;
    let bar = bar(config.steps);
    let steps = train(&config, &manifests, &run, &|event| show(&bar, event))?;
    bar.finish_and_clear();
    output::note(&format!("{steps} of {} steps", config.steps));
    output::text(&format!("{}\n", args.output.join("best.safetensors").display()))
}

pub(super) fn manifests(args: &Args) -> Result<Vec<Manifest>> {
    Ok(args.dataset.iter().map(|p| Manifest::load(p)).collect::<Result<_, _>>()?)
}

/// A run's options that are not in its configuration.
pub(super) fn train_run(args: &Args, manifests: &[Manifest]) -> Result<TrainRun> {
    let limit = args.stop_after.map(|minutes| Duration::try_from_secs_f64(60.0 * minutes));
    Ok(TrainRun {
        dir: args.output.clone(),
        start: args.from.as_deref().map(|from| setup::model(Some(from))).transpose()?,
        vgg: args.vgg.clone(),
        device: device(args)?,
        time_limit: limit.transpose().context("--stop-after")?,
        facts: facts(args, manifests),
    })
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

/// A bar over `steps`; hidden where stderr is no terminal.
pub(super) fn bar(steps: u64) -> ProgressBar {
    let style = "{msg:28} {wide_bar} {pos}/{len}, {eta} left";
    let style = ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(steps).with_style(style)
}

/// Reports a run's events on its bar and on stderr.
pub(super) fn show(bar: &ProgressBar, event: TrainEvent) {
    match event {
        TrainEvent::Loaded(done, total) => bar.set_message(format!("frame {done}/{total}")),
        TrainEvent::Step(step, loss) => {
            bar.set_position(step);
            bar.set_message(format!("loss {loss:.4}"));
        }
        TrainEvent::Validated(step, scores) => {
            let scores: Vec<_> = scores.iter().map(|(name, value)| format!("{name} {value:.4}")).collect();
            bar.suspend(|| output::note(&format!("step {step}: validation {}", scores.join(", "))));
        }
        TrainEvent::NoPerceptualTerm => {
            let text = "no VGG-19 weights given (--vgg): the perceptual term of the loss is off";
            bar.suspend(|| output::note(text));
        }
    }
}
