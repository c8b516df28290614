//! `aonet export`: a network as a file for other runtimes.

mod onnx;
mod program;

use crate::{output, setup};
use anyhow::Result;
use aonet::Size;
use clap::{ArgGroup, Parser};
use serde_json::json;
use std::path::PathBuf;

/// Write a network as an ONNX file, or all that a graphics processor does for it as data, for other runtimes.
///
/// An ONNX file has the input `features` 1xCxHxW, what the network sees, and for a network with a search `search` 1x1xHxW, the
/// visibility that it finds; its output is `visibility` 1x1xHxW in [0, 1], of which the background means nothing. Names of the
/// channels, configuration, parameters of the search and alignment are in the metadata. Without --size, height and width are
/// free, but multiples of the alignment: pad right and bottom by repeating the edge.
///
/// A program is complete: it takes a frame's normals, depth and camera. It consists of shaders in WGSL, buffers and dispatches,
/// for frames of any size or of --size, within WebGPU's default limits. docs/program_format.md of the sources describes it.
#[derive(Debug, Parser)]
#[command(
    group(ArgGroup::new("to").required(true).multiple(true).args(["onnx", "program"])),
    after_help = "Examples:
  aonet export runs/a/best.safetensors --onnx a.onnx
  aonet export a.safetensors --onnx a_720p.onnx --size 1280x720 --tuned
  aonet export --config configs/models/speed.json --onnx speed.onnx
  aonet export fast --program fast --depth standard
  aonet export agtao:tuned --program agtao"
)]
pub(crate) struct Args {
    /// Network: fast, balanced, high, paper, or a file. With --program also a classic method, such as agtao:tuned.
    #[arg(required_unless_present = "config")]
    model: Option<PathBuf>,
    /// Configuration of a model or of a training run instead: a network with random weights.
    #[arg(long, value_name = "C.json", conflicts_with = "model")]
    config: Option<PathBuf>,
    #[command(flatten)]
    onnx: onnx::OnnxArgs,
    #[command(flatten)]
    program: program::ProgramArgs,
    /// Size of the frames, any; an ONNX file pads and crops by itself [default: free].
    #[arg(long, value_name = "WxH", value_parser = setup::parse_size)]
    size: Option<Size>,
    /// Print facts as JSON.
    #[arg(long)]
    json: bool,
}

/// What was written.
struct Written {
    /// Facts for --json.
    facts: serde_json::Value,
    /// What people want to know of it.
    notes: Vec<String>,
    /// The files.
    paths: Vec<PathBuf>,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let mut facts = json!({});
    for written in [onnx::write(args)?, program::write(args)?].into_iter().flatten() {
        if args.json {
            let (all, new) = (facts.as_object_mut(), written.facts);
            all.expect("an object").extend(new.as_object().expect("an object").clone());
            continue;
        }
        written.notes.iter().for_each(|note| output::note(note));
        for path in written.paths {
            output::text(&format!("{}\n", path.display()))?;
        }
    }
    if args.json { output::json(&facts) } else { Ok(()) }
}
