//! `aonet infer`: AO from a G-buffer by a network.

use crate::device::{Device, PrecisionArg};
use crate::frame_args::{FrameArgs, Run};
use crate::{radius, setup};
use anyhow::{Context, Result};
use aonet::net::{Model, cpu};
use aonet::{AoImage, AoParams, BentNormals, GBuffer};
use clap::Parser;
use std::path::PathBuf;
use std::time::Instant;

/// Compute the AO of a G-buffer: one made by `aonet render`, by an engine, or Blender's multi-layer EXR.
///
/// Channels: normal.X/Y/Z in view space and depth along the viewing axis; or Blender's Normal and Depth passes, whose
/// normals are in world space and need --view.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet infer frame.exr -o ao.png
  aonet infer engine.exr -o ao.exr --fov-y 60 --radius 0.5
  aonet infer blender.exr -o ao.exr --view camera.json
  aonet infer frame.exr -o ao.exr --bent-normals
  aonet infer frame.exr -o ao.exr --device gpu --precision f32")]
pub(crate) struct Args {
    #[command(flatten)]
    frame: FrameArgs,
    /// Network: fast, balanced, high (best), paper, or a file. balanced:4x8 asks for 4 slices of 8 taps a side in its search,
    /// balanced:survey=2x24 for others in its survey.
    #[arg(long, value_name = "MODEL", default_value = "balanced")]
    model: PathBuf,
    /// Precision [default: on the CPU bf16 where the machine has it, on a GPU f16, else f32].
    #[arg(long, value_enum)]
    precision: Option<PrecisionArg>,
    /// Where to compute.
    #[arg(long, value_enum, default_value_t)]
    device: Device,
}

/// An image and the time when the device started it.
type Timed = (AoImage, Instant);

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let model = setup::model(Some(&args.model))?;
    // A network that does not see the radius has it built in.
    let fallback = if model.config().features.sees_radius() { None } else { Some(AoParams::new(1.0)?) };
    let (gbuffer, params) = args.frame.load(fallback)?;
    let network = (&*setup::name_of(&args.model), &model);
    radius::check(network, (&gbuffer, params), args.frame.radius);
    let mut bent = args.frame.bent_normals(gbuffer.window().size())?;
    let (image, start) = match args.device {
        Device::Cpu => on_cpu(args, &model, (&gbuffer, params), bent.as_mut())?,
        Device::Gpu => on_gpu(args.precision, &model, (&gbuffer, params), bent.as_mut())?,
    };
    args.frame.finish((&image, bent.as_ref()), &Run { method: "network", device: args.device, params, start })
}

fn on_cpu(
    args: &Args,
    model: &Model,
    (gbuffer, params): (&GBuffer, AoParams),
    bent: Option<&mut BentNormals>,
) -> Result<Timed> {
    let precision = args.precision.map_or_else(|| Ok(cpu::Precision::fastest()), PrecisionArg::cpu)?;
    let mut image = AoImage::open(gbuffer.window().size());
    let options =
        cpu::Options { threads: setup::threads(args.frame.threads), precision, ..cpu::Options::default() };
    let window = gbuffer.window();
    let mut session = match bent {
        Some(_) => cpu::Session::with_bent_normals(model, window, options).context("--bent-normals")?,
        None => cpu::Session::with_options(model, window, options)?,
    };
    let start = Instant::now();
    match bent {
        Some(bent) => session.run_with_bent_normals(gbuffer, params, &mut image, bent)?,
        None => session.run(gbuffer, params, &mut image)?,
    }
    Ok((image, start))
}

/// Runs the network, and reports device and precision on stderr.
#[cfg(feature = "gpu")]
fn on_gpu(
    precision: Option<PrecisionArg>,
    model: &Model,
    (gbuffer, params): (&GBuffer, AoParams),
    bent: Option<&mut BentNormals>,
) -> Result<Timed> {
    use aonet::gpu;
    let precision = precision.map_or(Ok(gpu::Precision::F16), PrecisionArg::gpu)?;
    let device = crate::device::gpu()?;
    let mut image = AoImage::open(gbuffer.window().size());
    let layers = if gbuffer.second().is_some() { gpu::Layers::Two } else { gpu::Layers::One };
    let frames = (gbuffer.window(), layers);
    let mut session = match bent {
        Some(_) => {
            gpu::Offscreen::with_bent_normals(&device, model, frames, precision).context("--bent-normals")?
        }
        None => gpu::Offscreen::in_layers(&device, model, frames, precision)?,
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
fn on_gpu(
    _: Option<PrecisionArg>,
    _: &Model,
    _: (&GBuffer, AoParams),
    _: Option<&mut BentNormals>,
) -> Result<Timed> {
    crate::device::absent()
}
