//! `aonet export`: a network as a file for other runtimes.

use crate::{output, setup};
use anyhow::{Context, Result};
use aonet::net::Model;
use aonet::{AoParams, Size};
use aonet_lab::frame::{Frame, FrameHints};
use aonet_lab::onnx::{self, Extent, Form, Side};
use aonet_scene::atomic_file;
use clap::Parser;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Write a network as an ONNX file, for other runtimes.
///
/// Input `features` 1xCxHxW, what the network sees, and for a network with a search `search` 1x1xHxW, the visibility that it
/// finds; output `visibility` 1x1xHxW in [0, 1], of which the background means nothing. Names of the channels, configuration,
/// parameters of the search and alignment are in the metadata. Without --size, height and width are free, but multiples of
/// the alignment: pad right and bottom by repeating the edge.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet export runs/a/best.safetensors --onnx a.onnx
  aonet export a.safetensors --onnx a_720p.onnx --size 1280x720 --tuned
  aonet export --config configs/models/speed.json --onnx speed.onnx")]
pub(crate) struct Args {
    /// Network: fast, balanced, high, paper, or a file.
    #[arg(required_unless_present = "config")]
    model: Option<PathBuf>,
    /// Configuration of a model or of a training run instead: a network with random weights.
    #[arg(long, value_name = "C.json", conflicts_with = "model")]
    config: Option<PathBuf>,
    /// File to write.
    #[arg(long, value_name = "OUT.onnx")]
    onnx: PathBuf,
    /// Size of the frames, any; the file pads and crops by itself [default: free].
    #[arg(long, value_name = "WxH", value_parser = super::bench::parse_size)]
    size: Option<Size>,
    /// Rewrite linear kernels to be fast in ONNX Runtime; equal results up to rounding.
    #[arg(long)]
    tuned: bool,
    /// Also write what the file takes for this frame, to try it in another runtime: OUT_FRAME.npy beside OUT.onnx, and
    /// OUT_FRAME_search.npy for a network with a search; may be repeated.
    #[arg(long, value_name = "FRAME.exr")]
    frame: Vec<PathBuf>,
    /// Print facts as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let model = match &args.config {
        Some(config) => setup::untrained(config)?,
        None => setup::model(args.model.as_deref())?,
    };
    let form = if args.tuned { Form::Tuned } else { Form::Plain };
    let extent = args
        .size
        .map_or(Extent::Dynamic, |size| Extent::Fixed { width: size.width(), height: size.height() });
    is_onnx(&args.onnx)?;
    let file = onnx::export(&model, form, extent)?;
    atomic_file::write(&args.onnx, &file.bytes)?;
    let write = |frame: &PathBuf| inputs(args, (&model, extent), frame);
    let frames = args.frame.iter().map(write).collect::<Result<Vec<_>>>()?;
    if args.json {
        return output::json(&json!({
            "path": args.onnx, "bytes": file.bytes.len(), "inputs": file.inputs, "outputs": file.outputs, "frames": frames,
        }));
    }
    for (what, ports) in [("input", &file.inputs), ("output", &file.outputs)] {
        for port in ports {
            let sides = port.shape.map(|side| match side {
                Side::Fixed(side) => side.to_string(),
                Side::Named(name) => name.to_owned(),
            });
            output::note(&format!("{what} {}: {}", port.name, sides.join(" x ")));
        }
    }
    output::text(&format!("{}\n", args.onnx.display()))
}

/// Writes what the file takes for a frame; returns where the features are.
fn inputs(args: &Args, (model, extent): (&Model, Extent), path: &Path) -> Result<PathBuf> {
    let frame = Frame::load(path, &FrameHints::default())?;
    // A network that does not see the radius has it built in.
    let radius = frame.radius.or_else(|| (!model.config().features.sees_radius()).then_some(1.0));
    let radius = radius.with_context(|| format!("{}: no AO radius in the file", path.display()))?;
    let inputs = onnx::inputs(model, extent, (&frame.gbuffer, AoParams::new(radius)?));
    let name = format!("{}_{}", setup::name_of(&args.onnx), setup::name_of(path));
    let file = |suffix: &str| args.onnx.with_file_name(format!("{name}{suffix}.npy"));
    for (input, planes) in inputs.with_context(|| path.display().to_string())? {
        let suffix = if input == onnx::INPUT { String::new() } else { format!("_{input}") };
        atomic_file::write(&file(&suffix), &onnx::npy(&planes))?;
    }
    Ok(file(""))
}

/// Refuses a name with another extension: a typing error could overwrite the model.
fn is_onnx(path: &Path) -> Result<()> {
    let extension = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("onnx"));
    anyhow::ensure!(extension, "--onnx {}: expected a name that ends in .onnx", path.display());
    Ok(())
}
