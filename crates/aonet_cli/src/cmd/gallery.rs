//! `aonet gallery`: every method on one frame, with its error, in one picture.

use crate::frame_args::FrameArgs;
use crate::names;
use crate::output::{self, Style, number, table};
use crate::{radius, setup};
use anyhow::{Context, Result};
use aonet::metrics::{self, Comparison};
use aonet::net::Model;
use aonet::search::{Classic, Options, Session, Shares};
use aonet::{AoImage, AoParams, GBuffer};
use aonet_lab::eval::{Method, run as run_method};
use aonet_lab::picture::{self, Caption};
use clap::Parser;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Draw a frame's normals, reference, depth and shares of light, and the AO of every method above its error.
///
/// The frame needs the channel `ao`. Classic methods use their tuned parameters if there are any.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet demo && aonet gallery aonet_demo/frame.exr -o gallery.png
  aonet gallery frame.exr -o gallery.png --method gtao --method gtao:tuned --model mine.safetensors")]
#[command(mut_arg("output", |arg| arg.help("Picture to write").value_name("FILE.png").value_parser(names::png())))]
pub(crate) struct Args {
    #[command(flatten)]
    frame: FrameArgs,
    /// Classic method: a name, a preset of `aonet tune` (.json), `all` or `all:tuned`; may be repeated [default: all:tuned].
    #[arg(long)]
    method: Vec<String>,
    /// Network: fast, balanced, high, paper, or a file; may be repeated [default: balanced and high].
    #[arg(long, value_name = "MODEL")]
    model: Vec<PathBuf>,
    /// Columns of the picture.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u8).range(2..=16))]
    columns: u8,
}

struct Shot {
    name: String,
    ao: AoImage,
    ms: Option<f64>,
    comparison: Comparison,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let (frame, params) = args.frame.load_with_reference()?;
    let reference = frame.ao.as_ref().context("the frame has no channel `ao` to compare with")?;
    let threads = setup::threads(args.frame.threads);
    let (classic, models) = methods(args)?;
    for (name, model) in &models {
        radius::check((name, model), (&frame.gbuffer, params), args.frame.radius);
    }
    let networks =
        models.iter().map(|(name, model)| (name, Method::network(model, setup::threads(args.frame.threads))));
    let methods = classic.iter().map(|(name, method)| (name, Method::Classic { method, threads }));
    let mut shots = Vec::new();
    for (name, method) in methods.chain(networks) {
        shots.push(shoot(name, &method, (&frame.gbuffer, params), reference)?);
    }
    let columns = args.columns.into();
    let panels = panels((&frame.gbuffer, params), reference, &shots, columns)?;
    picture::save_png(&picture::sheet(&panels, columns)?, args.frame.output())?;
    report(args, &shots)
}

type Named<T> = Vec<(String, T)>;

fn methods(args: &Args) -> Result<(Named<Classic>, Named<Model>)> {
    let all = ["all:tuned".to_owned()];
    let classic = setup::classic(if args.method.is_empty() { &all } else { &args.method })?;
    let mut models = Vec::new();
    for path in &args.model {
        models.push((setup::name_of(path), setup::model(Some(path))?));
    }
    if models.is_empty() {
        for name in ["balanced", "high"] {
            models.push((name.into(), setup::model(Some(Path::new(name)))?));
        }
    }
    Ok((classic, models))
}

fn shoot(
    name: &str,
    method: &Method<'_>,
    (gbuffer, params): (&GBuffer, AoParams),
    reference: &AoImage,
) -> Result<Shot> {
    let (ao, ms) = run_method(method, gbuffer, params)?;
    let comparison = metrics::compare(reference, &ao, Some(&gbuffer.foreground()))?;
    Ok(Shot { name: name.to_owned(), ao, ms, comparison })
}

/// Rows of AO, each above the row of its errors; what the frame shows comes first, as far as there are columns.
fn panels(
    (gbuffer, params): (&GBuffer, AoParams),
    reference: &AoImage,
    shots: &[Shot],
    columns: usize,
) -> Result<Vec<(image::RgbImage, Caption)>> {
    let mut panels = vec![
        (picture::normals(gbuffer), Caption::new("normals")),
        (picture::ao(reference), Caption::new("ray-traced reference")),
        (picture::depth(gbuffer), Caption::new("depth")),
        (picture::shares(&shares(gbuffer, params)?), Caption::new("light: open, hit, hidden, off")),
    ];
    let blank = || (picture::blank(reference.size()), Caption::new(""));
    panels.resize_with(columns, blank);
    for row in shots.chunks(columns) {
        panels.extend(row.iter().map(|shot| {
            let time = shot.ms.map_or_else(String::new, |ms| format!(", {ms:.0} ms"));
            (picture::ao(&shot.ao), Caption::new(format!("{}{time}", shot.name)))
        }));
        panels.resize_with(panels.len().next_multiple_of(columns), blank);
        for shot in row {
            // As much as fits beside the colour scale.
            let ssim = format!("{:.3}", shot.comparison.full.ssim);
            let text = format!("{:.1} dB {}", shot.comparison.full.psnr, ssim.trim_start_matches('0'));
            panels.push((picture::error(reference, &shot.ao)?, Caption { text, error_legend: true }));
        }
        panels.resize_with(panels.len().next_multiple_of(columns), blank);
    }
    Ok(panels)
}

/// What connected arcs know of the light of a frame.
fn shares(gbuffer: &GBuffer, params: AoParams) -> Result<Shares> {
    let mut session = Session::new(&Classic::named("arcs")?, gbuffer.window(), Options::default())?;
    Ok(session.shares(gbuffer, params)?)
}

fn report(args: &Args, shots: &[Shot]) -> Result<()> {
    if args.frame.json() {
        let rows = shots.iter().map(|s| {
            json!({ "method": s.name, "ms": s.ms, "full": s.comparison.full, "foreground": s.comparison.foreground })
        });
        return output::json(&json!({ "picture": args.frame.output(), "methods": rows.collect::<Vec<_>>() }));
    }
    let row = |s: &Shot| {
        let inside = s.comparison.foreground;
        vec![
            s.name.clone(),
            number(s.comparison.full.ssim, 4),
            number(s.comparison.full.psnr, 2),
            number(inside.map(|f| f.ssim), 4),
            number(inside.map(|f| f.psnr), 2),
            number(s.ms, 1),
        ]
    };
    let header = ["method", "SSIM", "PSNR dB", "SSIM fg", "PSNR fg", "ms"];
    output::text(&table(&header, &shots.iter().map(row).collect::<Vec<_>>(), Style::Text))?;
    output::text(&format!("\n{}\n", args.frame.output().display()))
}
