//! `aonet eval`: networks, classic methods and a constant image against the reference, over a dataset.

use crate::output::{self, Style, number, table};
use crate::setup;
use anyhow::{Context, Result, bail};
use aonet::net::Model;
use aonet_offline::atomic_file;
use aonet_offline::dataset::{Manifest, Split};
use aonet_offline::eval::phenomena::{self, Breakdown, Phenomenon, RadiusClass};
use aonet_offline::eval::{Contestant, Method, Row, Table, evaluate, mean_visibility, radius_fits};
use clap::{Parser, ValueEnum};
use indicatif::ProgressBar;
use serde::Serialize;
use serde_json::json;
use std::path::PathBuf;

/// Score networks and classic methods on the frames of a dataset: SSIM, PSNR and time.
///
/// The first row is a constant image: the mean visibility of the frames that the first network was trained on. Times are
/// the median over the frames, from buffers in memory to AO in memory, in f32.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet eval data/any --split test
  aonet eval data/any --model runs/a/best.safetensors --model runs/b/best.safetensors --markdown -o table.md")]
pub(crate) struct Args {
    /// Dataset folder or manifest.
    dataset: PathBuf,
    /// Network; may be repeated. The shipped one that serves any radius if absent.
    #[arg(long, value_name = "M.safetensors")]
    model: Vec<PathBuf>,
    /// Classic method: a name, a preset of `aonet tune` (.json), or `all`; may be repeated.
    #[arg(long, value_name = "METHOD")]
    classic: Vec<String>,
    /// Which frames.
    #[arg(long, value_enum, default_value = "test")]
    split: SplitName,
    /// The constant image's value; otherwise what the first network says of its training frames, else the mean over the
    /// dataset's training frames.
    #[arg(long)]
    constant: Option<f32>,
    /// Also score networks that were trained for another choice of radius; their rows are marked.
    #[arg(long)]
    any_radius: bool,
    /// Threads of the networks [default: all cores].
    #[arg(long)]
    threads: Option<usize>,
    /// Also tell where each method errs: at depth edges, around thin things, at the border, on open surfaces, by radius.
    #[arg(long)]
    breakdown: bool,
    /// One table for each scene as well.
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
        models.push(("any_radius (shipped)".into(), setup::model(None)?));
    }
    let threads = setup::threads(args.threads);
    let constant = constant(args, &models[0].1, &manifest)?;
    let mut contestants =
        vec![Contestant { name: format!("constant {constant:.3}"), method: Method::Constant(constant) }];
    for (name, model) in &models {
        let fits = radius_fits(model, &manifest);
        if !fits && !args.any_radius {
            bail!(
                "{name} was trained with radius {:?} and the frames have {:?}: pass --any-radius to score it all the same",
                model.facts().radius,
                manifest.plan.recipe.radius
            );
        }
        let name = if fits { name.clone() } else { format!("{name} *") };
        contestants.push(Contestant { name, method: Method::Network { model, threads } });
    }
    let pool = setup::pool(args.threads)?;
    let classic = setup::classic(&args.classic)?;
    contestants.extend(classic.iter().map(|(name, method)| Contestant {
        name: name.clone(),
        method: Method::Classic { method, pool: &pool },
    }));
    let bar = ProgressBar::new(0);
    let progress = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let table = evaluate(&manifest, args.split.into(), &contestants, &progress)?;
    bar.finish_and_clear();
    let conditions = conditions(args, &manifest, threads);
    let text =
        if args.json { as_json(args, &table, &conditions)? } else { as_text(args, &table, &conditions) };
    if let Some(path) = &args.output {
        atomic_file::write(path, text.as_bytes())?;
    }
    output::text(&text)
}

fn constant(args: &Args, model: &Model, manifest: &Manifest) -> Result<f32> {
    match args.constant.or(model.facts().mean_visibility) {
        Some(value) if (0.0..=1.0).contains(&value) => Ok(value),
        Some(value) => bail!("the constant image: expected a value in [0, 1], found {value}"),
        None => mean_visibility(manifest).context("the constant image (give --constant)"),
    }
}

/// What the numbers depend on besides the methods.
#[derive(Debug, Serialize)]
struct Conditions {
    command: String,
    version: &'static str,
    frames: usize,
    width: usize,
    height: usize,
    /// Nothing where imported frames do not say.
    reference_spp: Option<u32>,
    threads: usize,
    cores: usize,
}

fn conditions(args: &Args, manifest: &Manifest, threads: usize) -> Conditions {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let (split, recipe) = (args.split.into(), &manifest.plan.recipe);
    Conditions {
        command: format!("aonet {}", words.join(" ")),
        version: env!("CARGO_PKG_VERSION"),
        frames: manifest.frames(split).count(),
        width: recipe.width,
        height: recipe.height,
        reference_spp: Some(recipe.spp(split)).filter(|spp| *spp > 0),
        threads,
        cores: setup::threads(None),
    }
}

fn as_text(args: &Args, table: &Table, c: &Conditions) -> String {
    let style = if args.markdown { Style::Markdown } else { Style::Text };
    let mut text = draw(&table.overall, style);
    if table.overall.iter().any(|(name, _)| name.ends_with(" *")) {
        text += "\n* trained for another choice of radius\n";
    }
    if args.breakdown {
        text += &format!(
            "\nRMSE / mean error (above zero: too bright) by place and by radius\n\n{}",
            breakdown(table, style)
        );
    }
    if args.by_scene {
        for (scene, rows) in &table.by_scene {
            text += &format!("\n{}{scene}\n\n{}", if args.markdown { "### " } else { "" }, draw(rows, style));
        }
    }
    let quote = if args.markdown { "`" } else { "" };
    let reference = c.reference_spp.map_or_else(|| "imported".into(), |spp| format!("{spp} rays"));
    text + &format!(
        "\n{} frames of {}x{}, reference {}; {} threads on {} cores; aonet {}\n{quote}{}{quote}\n",
        c.frames, c.width, c.height, reference, c.threads, c.cores, c.version, c.command
    )
}

fn draw(rows: &[(String, Row)], style: Style) -> String {
    let cells = |(name, row): &(String, Row)| {
        vec![
            name.clone(),
            number(row.ssim, 4),
            number(row.ssim_8x8, 4),
            number(row.psnr, 2),
            number(row.psnr_pooled, 2),
            number(row.ssim_foreground, 4),
            number(row.psnr_foreground, 2),
            number(row.ms, 1),
        ]
    };
    let header = ["method", "SSIM", "SSIM 8x8", "PSNR dB", "pooled dB", "SSIM fg", "PSNR fg", "ms"];
    table(&header, &rows.iter().map(cells).collect::<Vec<_>>(), style)
}

fn breakdown(results: &Table, style: Style) -> String {
    let mut header = vec!["method"];
    header.extend(Phenomenon::ALL.iter().map(|p| p.name()));
    header.extend(RadiusClass::ALL.iter().map(|c| c.name()));
    let cells = |(name, b): &(String, Breakdown)| {
        let errors = b.phenomena.iter().chain(&b.radii);
        let cell = |e: &phenomena::Error| format!("{} / {}", number(e.rmse(), 3), number(e.bias(), 3));
        std::iter::once(name.clone()).chain(errors.map(cell)).collect()
    };
    table(&header, &results.breakdown.iter().map(cells).collect::<Vec<_>>(), style)
}

fn as_json(args: &Args, table: &Table, conditions: &Conditions) -> Result<String> {
    let rows = |rows: &[(String, Row)]| -> Vec<_> {
        rows.iter().map(|(name, row)| json!({ "method": name, "scores": row })).collect()
    };
    let scenes: serde_json::Map<_, _> =
        table.by_scene.iter().map(|(s, r)| (s.clone(), json!(rows(r)))).collect();
    let document = json!({
        "dataset": args.dataset, "conditions": conditions, "overall": rows(&table.overall), "by_scene": scenes,
        "breakdown": table.breakdown.iter().map(|(n, b)| json!({ "method": n, "errors": b })).collect::<Vec<_>>(),
    });
    Ok(format!("{}\n", serde_json::to_string_pretty(&document)?))
}
