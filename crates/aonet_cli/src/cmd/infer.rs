//! `aonet infer`: AO from a G-buffer by a network.

use crate::{output, setup};
use anyhow::{Context, Result};
use aonet::net::cpu::Session;
use aonet::{AoImage, AoParams};
use aonet_offline::View;
use aonet_offline::ao_file::save_ao;
use aonet_offline::frame::{Frame, FrameHints};
use clap::Parser;
use serde_json::json;
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
    /// G-buffer (EXR).
    frame: PathBuf,
    /// AO to write: .exr (32-bit) or .png (16-bit grey), linear.
    #[arg(short, long)]
    output: PathBuf,
    /// Network; the shipped one that serves any radius if absent.
    #[arg(long, value_name = "M.safetensors")]
    model: Option<PathBuf>,
    /// AO radius [world units]; otherwise the frame's or the view's.
    #[arg(long)]
    radius: Option<f32>,
    /// Vertical field of view [degrees]; otherwise the frame's or the view's.
    #[arg(long = "fov-y", value_name = "DEG")]
    fov_y: Option<f32>,
    /// Camera and radius (JSON).
    #[arg(long, value_name = "VIEW.json")]
    view: Option<PathBuf>,
    /// Threads [default: all cores].
    #[arg(long)]
    threads: Option<usize>,
    /// Where to compute.
    #[arg(long, default_value = "cpu", value_parser = ["cpu"])]
    device: String,
    /// Print facts as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let view = args.view.as_deref().map(View::load).transpose()?;
    let given = args.radius.map(AoParams::new).transpose().context("--radius")?;
    let model = setup::model(args.model.as_deref())?;
    let hints = FrameHints { view, fov_y_deg: args.fov_y, radius: args.radius, ..FrameHints::default() };
    let frame = Frame::load(&args.frame, &hints)?;
    let params = match (given, frame.radius) {
        (Some(params), _) => params,
        (None, Some(radius)) => AoParams::new(radius).with_context(|| args.frame.display().to_string())?,
        (None, None) if model.config().features.sees_radius() => {
            anyhow::bail!("{}: no AO radius in the file; give --radius or --view", args.frame.display())
        }
        // A network that does not see the radius has it built in.
        (None, None) => AoParams { radius: 1.0 },
    };
    let (width, height) = (frame.gbuffer.width(), frame.gbuffer.height());
    let mut image = AoImage::open(width, height)?;
    let mut session = Session::new(&model, width, height, setup::threads(args.threads))?;
    let start = Instant::now();
    session.run(&frame.gbuffer, params, &mut image)?;
    let ms = start.elapsed().as_secs_f64() * 1e3;
    save_ao(&args.output, &image)?;
    if args.json {
        return output::json(&json!({
            "ao": args.output, "width": width, "height": height, "radius": params.radius, "ms": ms,
            "device": args.device,
        }));
    }
    output::note(&format!("{width}x{height}, radius {}, {ms:.1} ms", params.radius));
    output::text(&format!("{}\n", args.output.display()))
}
