//! `aonet paper`: the paper's tables and figures, from trained networks.

use crate::{output, setup};
use anyhow::{Context, Result};
use aonet_lab::dataset::Manifest;
use aonet_lab::paper::{self, Content, Item, Models, Section, Subject};
use aonet_scene::atomic_file;
use clap::Parser;
use clap::builder::PossibleValuesParser;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Default folder of rows.
const WEIGHTS: &str = "assets/models/rows";

/// Make the paper's tables and figures from trained networks and test frames.
///
/// A row ROW is the network WEIGHTS/ROW.safetensors, or the best of the training run WEIGHTS/ROW; the same with -SEED are
/// further seeds of it. Rows: deep_ao, deep_shading, ao_net, ours; normal_depth, normal_depth_normalized,
/// normal_projected_radius; base, base_patch, base_kernel; normal_encoded, softmax, no_skips, dssim_only, l1_only,
/// vgg_off, vgg_relu1_2, vgg_relu2_2. Others go to the ablations. A row without a network is printed as `not trained`.
/// table2 and fig3 need no dataset.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet paper table1 --test data/test --weights runs
  aonet paper all --test data/test -o results/paper        (and report.html)")]
pub(crate) struct Args {
    /// Which table or figure.
    #[arg(value_parser = names())]
    what: String,
    /// Dataset folder or manifest whose frames of the split `test` are used.
    #[arg(long, value_name = "DATASET")]
    test: Option<PathBuf>,
    /// Folder of networks [default: assets/models/rows, if it exists].
    #[arg(long, value_name = "DIR")]
    weights: Option<PathBuf>,
    /// Folder for the results.
    #[arg(short, long, default_value = "results")]
    output: PathBuf,
    /// Threads of the networks [default: all cores].
    #[arg(long)]
    threads: Option<usize>,
    /// Runs of which a run-time is the median.
    #[arg(long, default_value_t = 7)]
    runs: usize,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Makes every item that can be made.
const ALL: &str = "all";

fn names() -> PossibleValuesParser {
    Item::ALL.map(Item::name).into_iter().chain([ALL]).into()
}

/// The items of a name; for `all`, every item that can be made.
fn items(what: &str, has_frames: bool) -> Vec<Item> {
    let possible = |item: &Item| has_frames || !item.needs_frames();
    Item::ALL.into_iter().filter(|item| item.name() == what || (what == ALL && possible(item))).collect()
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let manifest = args.test.as_deref().map(Manifest::load).transpose()?;
    let models = match &args.weights {
        Some(dir) => Models::load(dir)?,
        None if Path::new(WEIGHTS).is_dir() => Models::load(Path::new(WEIGHTS))?,
        None => Models::default(),
    };
    let items = items(&args.what, manifest.is_some());
    if args.what == ALL && manifest.is_none() {
        output::note("without --test only table2 and fig3 can be made");
    }
    let words: Vec<String> = std::env::args().skip(1).collect();
    let command = format!("aonet {}", words.join(" "));
    let threads = setup::threads(args.threads);
    let (manifest, models, runs) = (manifest.as_ref(), &models, args.runs.max(1));
    let subject = Subject { manifest, models, threads, runs, command: &command };
    let bar = bar();
    let progress = |what: &str, done: usize, total: usize| {
        bar.set_message(what.to_owned());
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let sections = paper::make(&items, &subject, &progress)?;
    bar.finish_and_clear();
    write(args, &sections)
}

/// Hidden where stderr is no terminal.
fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta} left");
    ProgressBar::new(0).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn write(args: &Args, sections: &[Section]) -> Result<()> {
    let dir = &args.output;
    std::fs::create_dir_all(dir).with_context(|| dir.display().to_string())?;
    let mut text = String::new();
    for section in sections {
        let path = paper::save(section, dir)?;
        text += &match section.content {
            Content::Table { .. } => format!("{}\n", section.markdown()),
            Content::Chart(_) | Content::Pictures { .. } => {
                let claims: String = section.claims.iter().map(|c| format!("* {}\n", c.line())).collect();
                format!("{}\n{claims}\n", path.display())
            }
        };
    }
    if args.what == ALL {
        let path = dir.join("report.html");
        atomic_file::write(&path, paper::report(sections)?.as_bytes())?;
        text += &format!("{}\n", path.display());
    }
    if args.json {
        let all: serde_json::Map<_, _> =
            sections.iter().map(|s| (s.item.name().to_owned(), json!(s.json))).collect();
        return output::json(&all);
    }
    output::text(&text)
}
