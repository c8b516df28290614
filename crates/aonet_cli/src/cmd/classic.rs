//! `aonet classic`: AO from a G-buffer by a method without a network.

use crate::frame_args::FrameArgs;
use crate::output::{self, Style, table};
use crate::setup;
use anyhow::{Context, Result};
use aonet::classic::Classic;
use clap::Parser;
use std::path::PathBuf;
use std::time::Instant;

/// Compute the AO of a G-buffer by a classic method: gtao, vbao, hbao, ssao, ...
///
/// G-buffers are those of `aonet infer`. --help-parameters lists what a method can be told.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet classic gtao frame.exr -o ao.png
  aonet classic gtao frame.exr -o ao.exr --set slices=9 --set falloff=0.1
  aonet classic vbao frame.exr -o ao.exr --preset tuned.json
  aonet classic gtao --help-parameters")]
pub(crate) struct Args {
    /// Method.
    method: String,
    #[command(flatten)]
    frame: Option<FrameArgs>,
    /// Parameters from a file, as `aonet tune` writes it; otherwise the defaults of the method's source.
    #[arg(long, value_name = "FILE.json")]
    preset: Option<PathBuf>,
    /// One parameter; may be repeated, and comes after --preset.
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, f32)>,
    /// List the method's parameters with their values and ranges instead.
    #[arg(long)]
    help_parameters: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let method = method(args)?;
    if args.help_parameters {
        return list(&method);
    }
    let Some(frame_args) = &args.frame else {
        anyhow::bail!("a G-buffer and --output are needed");
    };
    let (frame, params) = frame_args.load(None)?;
    let pool = setup::pool(frame_args.threads)?;
    let start = Instant::now();
    let image = pool.install(|| method.run(&frame.gbuffer, params))?;
    frame_args.finish(&image, start, (method.name(), params))
}

fn method(args: &Args) -> Result<Classic> {
    let mut method = Classic::named(&args.method)?;
    if let Some(path) = &args.preset {
        let found = setup::preset(path)?;
        anyhow::ensure!(
            found.name() == method.name(),
            "{}: expected parameters of {}, found those of {}",
            path.display(),
            method.name(),
            found.name()
        );
        method = found;
    }
    for (name, value) in &args.set {
        method.set(name, *value).with_context(|| format!("--set {name}={value}"))?;
    }
    Ok(method)
}

fn list(method: &Classic) -> Result<()> {
    let rows: Vec<_> = method
        .knobs()
        .into_iter()
        .map(|k| vec![k.name.into(), k.value.to_string(), format!("{} to {}", k.low, k.high), k.doc.into()])
        .collect();
    output::text(&table(&["parameter", "value", "range", "what it does"], &rows, Style::Text))
}

/// A parameter and its value, as `NAME=VALUE`.
pub(crate) fn assignment(text: &str) -> Result<(String, f32)> {
    let (name, value) = text.split_once('=').context("expected NAME=VALUE")?;
    Ok((name.trim().to_owned(), value.trim().parse().context("expected a number after =")?))
}
