//! A network as an ONNX file.

use super::{Args, Written};
use crate::setup;
use anyhow::{Context, Result};
use aonet::AoParams;
use aonet::net::Model;
use aonet_lab::frame::{Frame, FrameHints};
use aonet_lab::onnx::{self, Extent, Form, Side};
use aonet_scene::atomic_file;
use serde_json::json;
use std::path::{Path, PathBuf};

/// How an ONNX file is written.
#[derive(Debug, clap::Args)]
pub(super) struct OnnxArgs {
    /// File to write.
    #[arg(long = "onnx", id = "onnx", value_name = "OUT.onnx")]
    pub(super) path: Option<PathBuf>,
    /// Rewrite linear kernels to be fast in ONNX Runtime; equal results up to rounding.
    #[arg(long, requires = "onnx")]
    tuned: bool,
    /// Also write what the file takes for this frame, to try it in another runtime: OUT_FRAME.npy beside OUT.onnx, and
    /// OUT_FRAME_search.npy and OUT_FRAME_survey.npy for networks that have them; may be repeated.
    #[arg(long, value_name = "FRAME.exr", requires = "onnx")]
    frame: Vec<PathBuf>,
}

/// Writes the file, if it is wanted.
pub(super) fn write(args: &Args) -> Result<Option<Written>> {
    let Some(path) = &args.onnx.path else { return Ok(None) };
    let model = args.model()?;
    let form = if args.onnx.tuned { Form::Tuned } else { Form::Plain };
    let extent = (args.size)
        .map_or(Extent::Dynamic, |size| Extent::Fixed { width: size.width(), height: size.height() });
    is_onnx(path)?;
    let file = onnx::export(&model, form, extent)?;
    atomic_file::write(path, &file.bytes)?;
    let write = |frame: &PathBuf| inputs(path, (&model, extent), frame);
    let frames = args.onnx.frame.iter().map(write).collect::<Result<Vec<_>>>()?;
    let facts = json!({
        "path": path, "bytes": file.bytes.len(), "inputs": file.inputs, "outputs": file.outputs, "frames": frames,
    });
    let mut notes = Vec::new();
    for (what, ports) in [("input", &file.inputs), ("output", &file.outputs)] {
        for port in ports {
            let sides = port.shape.map(|side| match side {
                Side::Fixed(side) => side.to_string(),
                Side::Named(name) => name.to_owned(),
            });
            notes.push(format!("{what} {}: {}", port.name, sides.join(" x ")));
        }
    }
    Ok(Some(Written { facts, notes, paths: vec![path.clone()] }))
}

/// Writes what the file takes for a frame; returns where the features are.
fn inputs(onnx: &Path, (model, extent): (&Model, Extent), path: &Path) -> Result<PathBuf> {
    let frame = Frame::load(path, &FrameHints::default())?;
    // A network that does not see the radius has it built in.
    let radius = frame.radius.or_else(|| (!model.config().features.sees_radius()).then_some(1.0));
    let radius = radius.with_context(|| format!("{}: no AO radius in the file", path.display()))?;
    let inputs = onnx::inputs(model, extent, (&frame.gbuffer, AoParams::new(radius)?));
    let name = format!("{}_{}", setup::name_of(onnx), setup::name_of(path));
    let file = |suffix: &str| onnx.with_file_name(format!("{name}{suffix}.npy"));
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
