//! `aonet bent`: how far bent normals are from the traced ones.

use crate::output::{self, Style, number, table};
use crate::setup;
use anyhow::{Context, Result};
use aonet::net::Model;
use aonet_lab::bending::{Angles, Bending, Source};
use aonet_lab::dataset::Manifest;
use aonet_scene::reference::Sampling;
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use std::path::PathBuf;

/// Measure bent normals against ray-traced ones, on views of a dataset whose scenes are there.
///
/// The table has the mean angle to the traced direction over the pixels that show geometry: all alike, and weighted by the traced
/// visibility. The first row is the surface's normal, which programs without bent normals light with.
#[derive(Debug, Parser)]
#[command(after_help = "Example:
  aonet bent data/test_any --scenes-dir scenes --frames 16")]
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
    /// Classic method with bent normals: a name or a file of `aonet tune`; may be repeated [default: gtao, gtao:tuned, agtao:tuned,
    /// arcs:tuned].
    #[arg(long, value_name = "METHOD")]
    classic: Vec<String>,
    /// Network with a search: a name or a file; may be repeated [default: fast, balanced, high].
    #[arg(long, value_name = "MODEL")]
    model: Vec<PathBuf>,
    /// Rays per pixel.
    #[arg(long, default_value_t = 256)]
    spp: u32,
    /// Print JSON.
    #[arg(long, conflicts_with = "markdown")]
    json: bool,
    /// Print a Markdown table.
    #[arg(long)]
    markdown: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let manifest = Manifest::load(&args.dataset)?;
    let given = |named: &[String], defaults: &[&str]| match named {
        [] => defaults.iter().map(|name| (*name).to_owned()).collect(),
        named => named.to_vec(),
    };
    let methods =
        setup::classic(&given(&args.classic, &["gtao", "gtao:tuned", "agtao:tuned", "arcs:tuned"]))?;
    let defaults = ["fast", "balanced", "high"].map(PathBuf::from);
    let paths = if args.model.is_empty() { &defaults[..] } else { &args.model };
    let models: Vec<(String, Model)> = paths
        .iter()
        .map(|path| Ok((path.display().to_string(), setup::model(Some(path))?)))
        .collect::<Result<_>>()?;
    let classic = methods.iter().map(|(name, method)| (name.clone(), Source::Classic(method)));
    let networks = models.iter().map(|(name, model)| (name.clone(), Source::Network(model)));
    let normal = ("surface normal".to_owned(), Source::Normal);
    let bending = Bending {
        sources: [normal].into_iter().chain(classic).chain(networks).collect(),
        frames: args.frames,
        sampling: Sampling { spp: args.spp, seed: 1 },
    };
    let style = ProgressStyle::with_template("tracing {wide_bar} {pos} of {len} frames {eta} left")?;
    let bar = ProgressBar::new(0).with_style(style);
    let found = bending.measure(&manifest, &args.scenes_dir, &|frames| {
        bar.set_length(frames as u64);
        bar.inc(1);
    });
    bar.finish_and_clear();
    let (frames, angles) = found.with_context(|| args.dataset.display().to_string())?;
    let rows: Vec<_> = bending.sources.iter().map(|(name, _)| name).zip(&angles).collect();
    report(args, frames, &rows)
}

fn report(args: &Args, frames: usize, rows: &[(&String, &Angles)]) -> Result<()> {
    if args.json {
        let row = |(name, angles): &(&String, &Angles)| json!({ "source": name, "degrees": angles });
        let rows: Vec<_> = rows.iter().map(row).collect();
        return output::json(&json!({ "frames": frames, "spp": args.spp, "rows": rows }));
    }
    let row = |(name, angles): &(&String, &Angles)| {
        vec![(*name).clone(), number(angles.mean, 2), number(angles.by_visibility, 2)]
    };
    let rows: Vec<_> = rows.iter().map(row).collect();
    let style = if args.markdown { Style::Markdown } else { Style::Text };
    output::text(&table(&["bent normal", "degrees", "degrees, by visibility"], &rows, style))?;
    output::text(&format!(
        "\nmean angles to the traced direction; {frames} frames, {} rays per pixel\n",
        args.spp
    ))
}
