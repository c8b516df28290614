//! `aonet export`: a network as a file for other runtimes.

use crate::{output, setup};
use anyhow::Result;
use aonet_offline::atomic_file;
use aonet_offline::onnx::{self, Extent, Form, Side};
use clap::Parser;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Write a network as an ONNX file, for other runtimes.
///
/// Input `features` 1xCxHxW, what the network sees; output `visibility` 1x1xHxW in [0, 1], of which the background means
/// nothing. Names of the channels, configuration and alignment are in the metadata. Without --size, height and width are
/// free, but multiples of the alignment: pad right and bottom by repeating the edge.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet export runs/a/best.safetensors --onnx a.onnx
  aonet export a.safetensors --onnx a_720p.onnx --size 1280x720 --tuned")]
pub(crate) struct Args {
    /// Network.
    model: PathBuf,
    /// File to write.
    #[arg(long, value_name = "OUT.onnx")]
    onnx: PathBuf,
    /// Size of the frames, any; the file pads and crops by itself [default: free].
    #[arg(long, value_name = "WxH", value_parser = super::bench::parse_size)]
    size: Option<(usize, usize)>,
    /// Rewrite linear kernels to be fast in ONNX Runtime; equal results up to rounding.
    #[arg(long)]
    tuned: bool,
    /// Print facts as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let model = setup::model(Some(&args.model))?;
    let form = if args.tuned { Form::Tuned } else { Form::Plain };
    let extent = args.size.map_or(Extent::Dynamic, |(width, height)| Extent::Fixed { width, height });
    is_onnx(&args.onnx)?;
    let file = onnx::export(&model, form, extent)?;
    atomic_file::write(&args.onnx, &file.bytes)?;
    if args.json {
        return output::json(&json!({
            "path": args.onnx, "bytes": file.bytes.len(), "inputs": file.inputs, "outputs": file.outputs,
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

/// Refuses a name such as the model's own, which a slip of the hand would overwrite.
fn is_onnx(path: &Path) -> Result<()> {
    let extension = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("onnx"));
    anyhow::ensure!(extension, "--onnx {}: expected a name that ends in .onnx", path.display());
    Ok(())
}
