//! `aonet info`: what a file is.

use crate::{output, setup};
use anyhow::{Result, bail};
use aonet::AoImage;
use aonet::internals::nnao::{self, NnaoWeights};
use aonet::net::shipped;
use aonet::search::Classic;
use aonet_lab::ao_file::load_ao;
use aonet_lab::dataset::{Manifest, Split};
use aonet_lab::eval::radius_range;
use aonet_lab::frame::{Frame, FrameHints};
use aonet_scene::scene::MissingNormals;
use aonet_scene::scene::source::SceneSource;
use aonet_scene::{Error, View};
use clap::Parser;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// Describe a shipped network, a classic method, the graphics processor or a file: a model, a frame, an AO image, a view, a dataset or a scene.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet info high
  aonet info nnao
  aonet info gpu
  aonet info runs/a/best.safetensors
  aonet info procedural:furnished_room:3 --json")]
pub(crate) struct Args {
    /// fast, balanced, high, paper, a classic method such as nnao or gtao:tuned, gpu, .safetensors, .exr, .png, .json, .glb, .gltf, a dataset's folder, or procedural:KIND:SEED.
    file: String,
    /// For a frame: second layer from another EXR of the same size, as `aonet infer` reads it.
    #[arg(long, value_name = "FILE.exr")]
    second: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let path = Path::new(&args.file);
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let facts = match extension.to_str().unwrap_or_default() {
        "exr" if args.second.is_some() => frame(path, args.second.as_deref())?,
        _ if args.second.is_some() => bail!("--second needs a frame (.exr), not {}", args.file),
        "safetensors" => model(path).or_else(|why| weights_of_nnao(path).ok_or(why))?,
        _ if !path.is_file() && is_shipped(&args.file) => model(path)?,
        _ if !path.exists()
            && let Ok(method) = Classic::named(&args.file) =>
        {
            classic(method)
        }
        _ if !path.exists() && args.file == "gpu" => gpu()?,
        "exr" => frame(path, None).or_else(|why| match ao(path) {
            Ok(mut facts) => {
                facts["not_a_frame"] = json!(format!("{why:#}"));
                Ok(facts)
            }
            Err(_) => Err(why),
        })?,
        "png" => ao(path)?,
        "json" if is_manifest(path)? => dataset(path)?,
        "json" => view(path)?,
        _ if path.is_dir() => dataset(path)?,
        _ => scene(&args.file)?,
    };
    if args.json {
        return output::json(&facts);
    }
    let mut text = String::new();
    list(&facts, 0, &mut text);
    output::text(&text)
}

/// `key: value` lines, nested ones indented.
fn list(facts: &Value, depth: usize, text: &mut String) {
    let Value::Object(entries) = facts else { return };
    for (key, value) in entries {
        let indent = "  ".repeat(depth);
        match value {
            Value::Object(_) => {
                *text += &format!("{indent}{key}\n");
                list(value, depth + 1, text);
            }
            Value::String(s) => *text += &format!("{indent}{key:<22} {s}\n"),
            other => *text += &format!("{indent}{key:<22} {other}\n"),
        }
    }
}

/// A classic method with its parameters.
fn classic(method: Classic) -> Value {
    let parameters = method.parameters().into_iter().map(|p| (p.name.to_owned(), json!(decimal(p.value))));
    let weights = matches!(method, Classic::Nnao(_)).then_some(nnao::COUNT);
    json!({
        "kind": "classic method", "method": method.name(), "trained_weights": weights,
        "settings": parameters.collect::<Map<_, _>>(),
    })
}

/// The device that `--device gpu` computes on.
#[cfg(feature = "gpu")]
fn gpu() -> Result<Value> {
    use aonet::gpu::wgpu::Features;
    let device = crate::device::gpu()?;
    let (adapter, has) = (&device.adapter, |feature| device.device.features().contains(feature));
    let limits = device.device.limits();
    Ok(json!({
        "kind": "graphics processor", "name": adapter.name, "backend": adapter.backend.to_string(),
        "driver": format!("{} {}", adapter.driver, adapter.driver_info).trim(), "type": format!("{:?}", adapter.device_type),
        "half_floats": has(Features::SHADER_F16), "subgroups": has(Features::SUBGROUP),
        "matrices": device.matrices.is_some(), "timestamps": has(Features::TIMESTAMP_QUERY),
        "largest_image_px": limits.max_texture_dimension_2d, "largest_buffer_bytes": limits.max_buffer_size,
    }))
}

#[cfg(not(feature = "gpu"))]
fn gpu() -> Result<Value> {
    crate::device::absent()
}

/// The weights of NNAO, a classic method, if a file holds them.
fn weights_of_nnao(path: &Path) -> Option<Value> {
    let bytes = std::fs::read(path).ok()?;
    let weights = NnaoWeights::from_bytes(&bytes).ok()?;
    Some(json!({
        "kind": "weights of nnao, a classic method", "parameters": weights.values().len(), "file_bytes": bytes.len(),
    }))
}

fn is_shipped(name: &str) -> bool {
    shipped::ALL.into_iter().any(|(shipped, _)| shipped == name)
}

fn model(path: &Path) -> Result<Value> {
    let model = setup::model(Some(path))?;
    let graph = model.graph();
    let shipped = shipped::ALL.into_iter().find(|(name, _)| path.as_os_str() == *name);
    let bytes =
        shipped.map_or_else(|| std::fs::metadata(path).map_or(0, |m| m.len()), |(_, b)| b.len() as u64);
    let radius = radius_range(&model).map(|range| [range.start(), range.end()].map(|end| decimal(*end)));
    Ok(json!({
        "kind": "model", "config": model.config(), "parameters": graph.params_count(), "file_bytes": bytes,
        "macs_per_pixel": graph.macs_per_pixel().round(), "alignment_px": graph.alignment(),
        "sees_radius": model.config().features.sees_radius(),
        "radius_in_image_heights": radius, "training": model.facts(),
    }))
}

/// A number with the digits that its 32 bits have, not those of its 64.
fn decimal(number: f32) -> f64 {
    number.to_string().parse().unwrap_or(f64::from(number))
}

fn frame(path: &Path, second: Option<&Path>) -> Result<Value> {
    let load = |hints: &FrameHints| match second {
        Some(second) => Frame::load_with_second(path, second, hints),
        None => Frame::load(path, hints),
    };
    // Only the camera depends on the field of view; 60 degrees stands in for one that is unknown.
    let known = load(&FrameHints::default());
    let camera_known = known.is_ok();
    let hints = FrameHints { fov_y_deg: Some(60.0), ..FrameHints::default() };
    let frame = known.or_else(|_| load(&hints))?;
    let (size, margin) = (frame.gbuffer.window().size(), frame.gbuffer.window().margin());
    let depth = frame.gbuffer.depth();
    let behind = frame.gbuffer.second().map(|second| {
        second.depth.iter().filter(|d| d.is_finite()).count() as f64 / second.depth.len() as f64
    });
    let finite = || depth.iter().copied().filter(|d| d.is_finite());
    Ok(json!({
        "kind": "frame", "width": size.width(), "height": size.height(),
        "margin": { "x": margin.x, "y": margin.y }, "second_layer": frame.gbuffer.second().is_some(),
        "second_share": behind,
        "camera_known": camera_known, "view": frame.view, "radius": frame.radius,
        "foreground_share": finite().count() as f64 / depth.len() as f64,
        "depth_min": finite().fold(f32::INFINITY, f32::min), "depth_max": finite().fold(0.0, f32::max),
        "geometric_normals": frame.geo_normal.is_some(),
        "mean_visibility": frame.ao.as_ref().map(mean),
    }))
}

fn ao(path: &Path) -> Result<Value> {
    let ao = load_ao(path)?;
    Ok(
        json!({ "kind": "AO image", "width": ao.width(), "height": ao.height(), "mean_visibility": mean(&ao) }),
    )
}

fn mean(ao: &AoImage) -> f64 {
    ao.visibility().iter().map(|v| f64::from(*v)).sum::<f64>() / ao.visibility().len() as f64
}

/// Whether a JSON file lists frames, as only manifests do.
fn is_manifest(path: &Path) -> Result<bool> {
    let bytes = std::fs::read(path).map_err(Error::io(path))?;
    Ok(serde_json::from_slice::<Value>(&bytes).is_ok_and(|json| json.get("frames").is_some()))
}

fn view(path: &Path) -> Result<Value> {
    Ok(json!({ "kind": "view", "view": View::load(path)? }))
}

fn dataset(path: &Path) -> Result<Value> {
    let manifest = Manifest::load(path)?;
    let count = |split: Split| manifest.frames(split).count();
    let recipe = &manifest.plan.recipe;
    Ok(json!({
        "kind": "dataset", "folder": manifest.dir(), "preset": format!("{:?}", recipe.preset), "seed": recipe.seed,
        "width": recipe.width, "height": recipe.height, "margin": recipe.surround.margin,
        "separation": recipe.surround.separation, "spp": recipe.spp, "eval_spp": recipe.eval_spp,
        "radius": format!("{:?}", recipe.radius), "scenes": manifest.plan.scenes.len(), "missing": manifest.missing(),
        "frames": { "train": count(Split::Train), "val": count(Split::Val),
                    "val_seen": count(Split::ValSeen), "test": count(Split::Test) },
    }))
}

fn scene(text: &str) -> Result<Value> {
    let source: SceneSource = text.parse()?;
    let scene = source.load(MissingNormals::Flat)?;
    let bounds = scene.bounds();
    let file: Option<PathBuf> = Path::new(text).is_file().then(|| text.into());
    Ok(json!({
        "kind": "scene", "name": scene.name, "file": file, "triangles": scene.triangle.len(),
        "vertices": scene.position.len(), "min": bounds.min.to_array(), "max": bounds.max.to_array(),
    }))
}
