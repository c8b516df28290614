//! `aonet infer`: AO from a G-buffer by a network.

use crate::frame_args::FrameArgs;
use crate::setup;
use anyhow::Result;
use aonet::net::cpu::{Options, Precision, Session};
use aonet::{AoImage, AoParams};
use aonet_offline::frame::Frame;
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
  aonet infer blender.exr -o ao.exr --view camera.json")]
pub(crate) struct Args {
    #[command(flatten)]
    frame: FrameArgs,
    /// Network; the shipped one that serves any radius if absent.
    #[arg(long, value_name = "M.safetensors")]
    model: Option<PathBuf>,
    /// Numbers to multiply: f32, bf16 (AVX-512 BF16) or int8 (AVX-512 VNNI, and a network from `aonet calibrate` or a
    /// shipped one) [default: bf16 where the machine has it, else f32].
    #[arg(long)]
    precision: Option<Precision>,
    /// Where to compute.
    #[arg(long, default_value = "cpu", value_parser = ["cpu"])]
    device: String,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let model = setup::model(args.model.as_deref())?;
    // A network that does not see the radius has it built in.
    let fallback = (!model.config().features.sees_radius()).then_some(AoParams { radius: 1.0 });
    // Methods take memory of their own: what they do not look at is dropped here.
    let (Frame { gbuffer, .. }, params) = args.frame.load(fallback)?;
    let (width, height) = (gbuffer.width(), gbuffer.height());
    let mut image = AoImage::open(width, height)?;
    let threads = setup::threads(args.frame.threads);
    let options = Options {
        threads,
        precision: args.precision.unwrap_or_else(Precision::fastest),
        ..Options::default()
    };
    let mut session = Session::with_options(&model, (width, height), options)?;
    let start = Instant::now();
    session.run(&gbuffer, params, &mut image)?;
    args.frame.finish(&image, start, ("network", params))
}
