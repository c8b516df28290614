//! `aonet tune`: parameters of a classic method from training frames.

use crate::names;
use crate::output::{self, Style, number, table};
use crate::setup;
use anyhow::{Context, Result};
use aonet::search::Classic;
use aonet_lab::dataset::{Manifest, Split};
use aonet_lab::eval::phenomena::RadiusClass;
use aonet_lab::eval::{Contestant, Method, Table, evaluate};
use aonet_lab::nnao::{self, Training};
use aonet_lab::preset::Preset;
use aonet_lab::tune::{Search, tune};
use aonet_scene::atomic_file;
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use std::path::PathBuf;

/// Search for a classic method's parameters on the training frames of a dataset, and store them as a preset.
///
/// The loss is that of the networks: 0.94 DSSIM + 0.5 L1. Parameters that determine the cost (slices, steps, samples, pyramid, between, denoise_keep)
/// do not change. For NNAO the command trains weights instead, on pixels of the frames. Afterwards the method is scored on
/// validation frames with and without its new parameters, by radius.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet tune gtao --on data/any -o gtao.json
  aonet tune vbao --on data/any --set cosine=1 --trials 200 -o vbao.json
  aonet tune nnao --on data/any --frames 400 -o nnao.safetensors")]
pub(crate) struct Args {
    /// Method.
    method: String,
    /// Dataset folder or manifest.
    #[arg(long, value_name = "MANIFEST")]
    on: PathBuf,
    /// Preset to write (.json); of nnao, weights (.safetensors).
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// A parameter to start from; may be repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = super::classic::assignment)]
    set: Vec<(String, f32)>,
    /// Training frames to use.
    #[arg(long, default_value_t = 24)]
    frames: usize,
    /// Parameter sets to try.
    #[arg(long, default_value_t = 150)]
    trials: usize,
    /// Steps of training, for nnao.
    #[arg(long, default_value_t = 6000)]
    steps: usize,
    /// Seed of the search; equal seeds try equal parameters.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads [default: all cores].
    #[arg(long)]
    threads: Option<usize>,
    /// Print facts as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let extension = if args.method == "nnao" { "safetensors" } else { "json" };
    names::checked(args.output.clone(), extension)
        .map_err(|expected| anyhow::anyhow!("--output {}: {expected}", args.output.display()))?;
    let manifest = Manifest::load(&args.on)?;
    if args.method == "nnao" {
        return train_nnao(args, &manifest);
    }
    let mut method = Classic::named(&args.method)?;
    for (name, value) in &args.set {
        method.set(name, *value).with_context(|| format!("--set {name}={value}"))?;
    }
    let pool = setup::pool(args.threads)?;
    let search = Search { frames: args.frames, trials: args.trials, seed: args.seed };
    let style = ProgressStyle::with_template("tuning {wide_bar} {pos} of {len} {prefix} {eta} left")?;
    let bar = ProgressBar::new(args.trials as u64).with_style(style);
    let progress = |trial: usize, loss: f64| {
        bar.set_position(trial as u64);
        bar.set_prefix(format!("loss {loss:.4}"));
    };
    let tuned = pool.install(|| tune(&manifest, method, search, &progress))?;
    bar.finish_and_clear();
    let words: Vec<String> = std::env::args().skip(1).collect();
    let recipe = &manifest.plan.recipe;
    let frames = format!(
        "{} training frames of {}x{}, radius {:?}",
        args.frames, recipe.width, recipe.height, recipe.radius
    );
    Preset { method: tuned.method, command: format!("aonet {}", words.join(" ")), frames }
        .save(&args.output)?;
    let validation = validate(&manifest, [&method, &tuned.method], setup::threads(args.threads))?;
    report(args, (&method, &tuned), validation.as_ref())
}

/// NNAO's parameters are weights.
fn train_nnao(args: &Args, manifest: &Manifest) -> Result<()> {
    anyhow::ensure!(args.set.is_empty(), "nnao has fixed parameters: expected no --set");
    let style = ProgressStyle::with_template("training {wide_bar} {pos} of {len} {prefix} {eta} left")?;
    let bar = ProgressBar::new(args.steps as u64).with_style(style);
    let progress = |step: usize, error: f64| {
        bar.set_position(step as u64);
        bar.set_prefix(format!("mean squared error {error:.4}"));
    };
    let training = Training { frames: args.frames, steps: args.steps, batch: 2048, seed: args.seed };
    let (weights, error) =
        setup::pool(args.threads)?.install(|| nnao::train(manifest, training, &progress))?;
    bar.finish_and_clear();
    atomic_file::write(&args.output, &weights.to_bytes()?)?;
    if args.json {
        return output::json(&json!({ "weights": args.output, "mse": error }));
    }
    output::note(&format!("mean squared error {error:.5} on training pixels"));
    output::text(&format!("{}\n", args.output.display()))
}

/// Scores on validation frames: of unseen scenes if the dataset has any, else of seen ones.
fn validate(manifest: &Manifest, [before, after]: [&Classic; 2], threads: usize) -> Result<Option<Table>> {
    let Some(split) = [Split::Val, Split::ValSeen].into_iter().find(|s| manifest.frames(*s).next().is_some())
    else {
        return Ok(None);
    };
    let contestant =
        |name: &str, method| Contestant { name: name.into(), method: Method::Classic { method, threads } };
    let contestants = [contestant("as given", before), contestant("tuned", after)];
    Ok(Some(evaluate(manifest, split, &contestants, &|_, _| ())?))
}

fn report(
    args: &Args,
    (before, tuned): (&Classic, &aonet_lab::tune::Tuned),
    validation: Option<&Table>,
) -> Result<()> {
    if args.json {
        return output::json(&json!({
            "preset": args.output, "method": tuned.method, "loss": tuned.loss, "loss_before": tuned.loss_before,
            "validation": validation,
        }));
    }
    let pairs = before.parameters().into_iter().zip(tuned.method.parameters());
    let rows: Vec<_> = pairs
        .map(|(a, b)| vec![a.name.to_owned(), a.value.to_string(), number(f64::from(b.value), 4)])
        .chain([vec!["loss".into(), number(tuned.loss_before, 4), number(tuned.loss, 4)]])
        .collect();
    output::text(&table(&["parameter", "as given", "tuned"], &rows, Style::Text))?;
    if let Some(validation) = validation {
        let mut header = vec!["validation", "SSIM", "PSNR dB"];
        header.extend(RadiusClass::ALL.iter().map(|class| class.name()));
        let rows =
            validation.overall.iter().zip(&validation.breakdown).map(|((name, row), (_, breakdown))| {
                let errors = breakdown.radii.iter().map(|e| number(e.rmse(), 4));
                [name.clone(), number(row.ssim, 4), number(row.psnr, 2)].into_iter().chain(errors).collect()
            });
        let rows: Vec<Vec<String>> = rows.collect();
        output::text(&format!("\n{}(the last columns: RMSE)\n", table(&header, &rows, Style::Text)))?;
    }
    output::text(&format!("{}\n", args.output.display()))
}
