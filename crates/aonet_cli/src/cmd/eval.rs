//! `aonet eval`: networks, classic methods and a constant image against the reference, over a dataset.

mod estimate;
mod report;

use crate::names;
use crate::{output, setup};
use anyhow::{Context, Result, bail};
use aonet::net::Model;
use aonet::net::cpu::{Options, Precision};
use aonet_lab::dataset::{Manifest, Split};
use aonet_lab::eval::seen::Seen;
use aonet_lab::eval::{Contestant, Method, evaluate, mean_visibility, radius_fits};
use aonet_scene::atomic_file;
use clap::{Parser, ValueEnum};
use indicatif::ProgressBar;
use std::path::PathBuf;

/// Score networks and classic methods on the frames of a dataset: SSIM, PSNR and time.
///
/// The first row is a constant image: the mean visibility of the frames that the first network was trained on. Times are
/// the median over the frames, from buffers in memory to AO in memory.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet eval data/any --split test
  aonet eval data/any --model runs/a/best.safetensors --model high --markdown -o table.md
  aonet eval data/any --model high --model high:6x16")]
pub(crate) struct Args {
    /// Dataset folder or manifest.
    dataset: PathBuf,
    /// Network: fast, balanced, high, paper, or a file; may be repeated [default: balanced].
    #[arg(long, value_name = "MODEL")]
    model: Vec<PathBuf>,
    /// Classic method: a name, a preset of `aonet tune` (.json), `all` or `all:tuned`; may be repeated.
    #[arg(long, value_name = "METHOD")]
    classic: Vec<String>,
    /// Split to score.
    #[arg(long, value_enum, default_value = "test")]
    split: SplitName,
    /// Do not show guard bands to the methods.
    #[arg(long)]
    no_margin: bool,
    /// Do not show second layers to the methods.
    #[arg(long)]
    no_second: bool,
    /// Show guard bands and second layers from every N-th pixel of every N-th row only, as a cheaper pass would render them.
    #[arg(long, value_name = "N", default_value_t = 1)]
    surround_scale: usize,
    /// The constant image's value; otherwise the mean visibility that the first network's file records, else the mean over the
    /// dataset's training frames.
    #[arg(long)]
    constant: Option<f32>,
    /// Also score networks that were trained for another choice of radius; their rows are marked.
    #[arg(long)]
    any_radius: bool,
    /// Precision of the networks: f32, bf16 or int8; may be repeated [default: f32].
    #[arg(long, value_name = "PRECISION")]
    precision: Vec<Precision>,
    /// Threads of the networks [default: all cores].
    #[arg(long)]
    threads: Option<usize>,
    /// Also report where each method errs: at depth edges, around thin things, at the border, on open surfaces, by radius; and the
    /// grain of smooth surfaces: how much means of 3x3 pixels vary within 9x9 pixels, beside the reference.
    #[arg(long)]
    breakdown: bool,
    /// Also print one table for each scene.
    #[arg(long)]
    by_scene: bool,
    /// Print Markdown.
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Also write what is printed to a file.
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Also draw PSNR and SSIM over time, with the front of what no method beats in both.
    #[arg(long, value_name = "OUT.svg", value_parser = names::ending("svg"))]
    plot: Option<PathBuf>,
    /// The same over the time that a common graphics processor is estimated to need for 1280x720 with one layer, in f32, as
    /// `aonet bench --device gpu` counts it; needs a program built with the feature `gpu`, and no graphics processor.
    #[arg(long, value_name = "OUT.svg", value_parser = names::ending("svg"))]
    plot_gpu: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum SplitName {
    Train,
    Val,
    ValSeen,
    Test,
}

impl From<SplitName> for Split {
    fn from(name: SplitName) -> Self {
        match name {
            SplitName::Train => Self::Train,
            SplitName::Val => Self::Val,
            SplitName::ValSeen => Self::ValSeen,
            SplitName::Test => Self::Test,
        }
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let manifest = Manifest::load(&args.dataset)?;
    let mut models = Vec::new();
    for path in &args.model {
        models.push((setup::name_of(path), setup::model(Some(path))?));
    }
    if models.is_empty() {
        models.push(("balanced (shipped)".into(), setup::model(None)?));
    }
    let threads = setup::threads(args.threads);
    let constant = constant(args, &models[0].1, &manifest)?;
    let mut contestants =
        vec![Contestant { name: format!("constant {constant:.3}"), method: Method::Constant(constant) }];
    for (name, model) in &models {
        contestants.extend(networks(args, &manifest, (name, model), threads)?);
    }
    let networks = contestants.len() - 1;
    let classic = setup::classic(&args.classic)?;
    contestants.extend(classic.iter().map(|(name, method)| Contestant {
        name: name.clone(),
        method: Method::Classic { method, threads },
    }));
    // Before the frames are scored, which takes long.
    let gpu_ms = args.plot_gpu.is_some().then(|| estimate::gpu_ms(&contestants)).transpose()?;
    let seen = Seen {
        margin: !args.no_margin,
        second: !args.no_second,
        scale: args.surround_scale,
        ..Seen::from(Split::from(args.split))
    };
    let bar = ProgressBar::new(0);
    let progress = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let table = evaluate(&manifest, seen, &contestants, &progress)?;
    bar.finish_and_clear();
    let conditions = report::conditions(args, &manifest, threads);
    let text = match args.json {
        true => report::as_json(args, &table, &conditions)?,
        false => report::as_text(args, &table, &conditions),
    };
    if let Some(path) = &args.output {
        atomic_file::write(path, text.as_bytes())?;
    }
    let measured: Vec<_> = table.overall.iter().map(|(_, row)| row.ms).collect();
    let plots = [(&args.plot, "ms a frame", Some(measured)), (&args.plot_gpu, estimate::AXIS, gpu_ms)];
    for (path, axis, times) in plots {
        if let (Some(path), Some(times)) = (path, times) {
            atomic_file::write(path, report::as_plot(&table, networks, (axis, &times))?.as_bytes())?;
        }
    }
    output::text(&text)
}

/// A network in each of the precisions.
fn networks<'a>(
    args: &Args,
    manifest: &Manifest,
    (name, model): (&str, &'a Model),
    threads: usize,
) -> Result<Vec<Contestant<'a>>> {
    let fits = radius_fits(model, manifest);
    if !fits && !args.any_radius {
        bail!(
            "{name} was trained with radius {:?} and the frames have {:?}: pass --any-radius to score it all the same",
            model.facts().radius,
            manifest.plan.recipe.radius
        );
    }
    let of = |precision| {
        let name = if precision == Precision::F32 { name.to_owned() } else { format!("{name} {precision}") };
        let name = if fits { name } else { format!("{name} *") };
        let options = Options { threads, precision, ..Options::default() };
        Contestant { name, method: Method::Network { model, options } }
    };
    Ok(precisions(args).into_iter().map(of).collect())
}

fn precisions(args: &Args) -> Vec<Precision> {
    if args.precision.is_empty() { vec![Precision::F32] } else { args.precision.clone() }
}

fn constant(args: &Args, model: &Model, manifest: &Manifest) -> Result<f32> {
    match args.constant.or(model.facts().mean_visibility) {
        Some(value) if (0.0..=1.0).contains(&value) => Ok(value),
        Some(value) => bail!("the constant image: expected a value in [0, 1], found {value}"),
        None => mean_visibility(manifest).context("the constant image (give --constant)"),
    }
}
