//! `aonet classic`: AO from a G-buffer by a method without a network.

use crate::device::Device;
use crate::frame_args::{FrameArgs, Run};
use crate::{names, output, setup};
use anyhow::{Context, Result};
use aonet::search::{Classic, Options, ParameterValue, Session};
use aonet::{AoImage, AoParams, BentNormals, GBuffer};
use aonet_lab::ao_file;
use clap::Parser;
use std::path::PathBuf;
use std::time::Instant;

/// Compute the AO of a G-buffer by a classic method: gtao, agtao, arcs, vbao, hbao, ssao, ssdo or nnao.
///
/// G-buffers are those of `aonet infer`. METHOD:tuned has parameters that were found on training frames; gtao:low to
/// gtao:ultra (also of vbao) have another number of slices and steps.
#[derive(Debug, Parser)]
#[command(after_help = EXAMPLES, after_long_help = long_help())]
pub(crate) struct Args {
    /// Method, or a preset of `aonet tune` (.json).
    method: String,
    #[command(flatten)]
    frame: FrameArgs,
    /// Parameters from a file, as `aonet tune` writes it; otherwise the defaults of the method's source.
    #[arg(long, value_name = "FILE.json")]
    preset: Option<PathBuf>,
    /// One parameter, which overrides --preset; may be repeated. --help lists all parameters.
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, f32)>,
    /// Also write the shares of light that arcs finds: open, hit, hidden and off as channels of an .exr, or as colours of a .png.
    #[arg(long, value_name = "FILE", value_parser = names::exr_or_png())]
    shares: Option<PathBuf>,
    /// Where to compute; a GPU has all methods but nnao.
    #[arg(long, value_enum, default_value_t)]
    device: Device,
}

const EXAMPLES: &str = "Examples:
  aonet classic gtao:tuned frame.exr -o ao.png
  aonet classic gtao frame.exr -o ao.exr --set slices=9 --set falloff=0.1
  aonet classic agtao:tuned frame.exr -o ao.exr --bent-normals=bent.png
  aonet classic arcs:deep frame.exr -o ao.exr --shares shares.png
  aonet classic tuned.json frame.exr -o ao.exr";

/// Width of the parameters' list.
const HELP_COLUMNS: usize = 100;

/// The examples and every method's parameters.
fn long_help() -> String {
    let lines = |k: ParameterValue| {
        let facts = format!("  {:<15}{:<8}{:<15}", k.name, k.value, format!("{} to {}", k.low, k.high));
        let indent = " ".repeat(facts.len());
        let text = output::wrapped(k.doc, HELP_COLUMNS - facts.len()).join(&format!("\n{indent}"));
        format!("{facts}{text}\n")
    };
    let of = |method: Classic| {
        let rows: String = method.parameters().into_iter().map(lines).collect();
        format!("{:<17}{:<8}{:<15}what it does\n{rows}", method.name(), "default", "range")
    };
    let tables: Vec<_> = Classic::all().into_iter().map(of).collect();
    format!("{EXAMPLES}\n\nParameters:\n\n{}", tables.join("\n"))
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let method = method(args)?;
    let (gbuffer, params) = args.frame.load(None)?;
    let mut bent = args.frame.bent_normals(gbuffer.window().size())?;
    let (image, start) = match args.device {
        Device::Cpu => {
            let options = Options { threads: setup::threads(args.frame.threads), ..Options::default() };
            let window = gbuffer.window();
            let mut session = match bent {
                Some(_) => Session::with_bent_normals(&method, window, options).context("--bent-normals")?,
                None => Session::new(&method, window, options)?,
            };
            let mut image = AoImage::open(window.size());
            if let Some(path) = &args.shares {
                ao_file::save_shares(path, &session.shares(&gbuffer, params).context("--shares")?)?;
            }
            let start = Instant::now();
            match &mut bent {
                Some(bent) => session.run_with_bent_normals(&gbuffer, params, &mut image, bent)?,
                None => session.run(&gbuffer, params, &mut image)?,
            }
            (image, start)
        }
        Device::Gpu if args.shares.is_some() => {
            anyhow::bail!("--shares: expected --device cpu, which computes them; found gpu")
        }
        Device::Gpu => on_gpu(&method, (&gbuffer, params), bent.as_mut())?,
    };
    args.frame
        .finish((&image, bent.as_ref()), &Run { method: method.name(), device: args.device, params, start })
}

/// Runs the method, and reports the device on stderr.
#[cfg(feature = "gpu")]
fn on_gpu(
    method: &Classic,
    (gbuffer, params): (&GBuffer, AoParams),
    bent: Option<&mut BentNormals>,
) -> Result<(AoImage, Instant)> {
    use aonet::gpu::Layers;
    let device = crate::device::gpu()?;
    let mut image = AoImage::open(gbuffer.window().size());
    let layers = if gbuffer.second().is_some() { Layers::Two } else { Layers::One };
    let window = gbuffer.window();
    let mut session = match bent {
        Some(_) => aonet::gpu::Offscreen::classic_with_bent_normals(&device, method, window, layers)
            .context("--bent-normals")?,
        None => aonet::gpu::Offscreen::classic_in_layers(&device, method, window, layers)?,
    };
    crate::device::announce(&device, session.precision());
    let start = Instant::now();
    match bent {
        Some(bent) => session.run_with_bent_normals(gbuffer, params, &mut image, bent)?,
        None => session.run(gbuffer, params, &mut image)?,
    }
    Ok((image, start))
}

/// # Errors
/// Always: this build has no runtime for graphics processors.
#[cfg(not(feature = "gpu"))]
fn on_gpu(_: &Classic, _: (&GBuffer, AoParams), _: Option<&mut BentNormals>) -> Result<(AoImage, Instant)> {
    crate::device::absent()
}

fn method(args: &Args) -> Result<Classic> {
    let mut method = setup::one_classic(&args.method)?;
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

/// A parameter and its value, as `NAME=VALUE`.
pub(crate) fn assignment(text: &str) -> Result<(String, f32)> {
    let (name, value) = text.split_once('=').context("expected NAME=VALUE")?;
    Ok((name.trim().to_owned(), value.trim().parse().context("expected a number after =")?))
}
