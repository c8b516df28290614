//! `aonet render`: a G-buffer from a scene.

use crate::names;
use crate::output;
use crate::setup::SceneArgs;
use anyhow::Result;
use aonet_lab::frame::Frame;
use aonet_lab::picture;
use aonet_scene::gbuffer;
use clap::Parser;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Render the G-buffer of a view: depth and normals, no AO.
///
/// A guard band (--margin) and a second layer (--layers 2) show occluders that the picture alone does not.
#[derive(Debug, Parser)]
#[command(
    after_help = "Examples:\n  aonet render room.glb --view view.json -o frame.exr --png normal.png\n  \
                         aonet render room.glb --view view.json --margin 0.15 --layers 2 -o deep.exr"
)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Frame to write (EXR).
    #[arg(short, long, value_name = "FRAME.exr", value_parser = names::exr())]
    output: PathBuf,
    /// Also draw the normals: layers side by side, the guard band darker.
    #[arg(long, value_name = "FILE.png", value_parser = names::png())]
    png: Option<PathBuf>,
    /// Print facts as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let (tracer, view) = args.scene.load()?;
    let start = Instant::now();
    let surface = gbuffer::render(&tracer, &view)?;
    let render_ms = start.elapsed().as_secs_f64() * 1e3;
    if let Some(png) = &args.png {
        picture::save_png(&picture::layers(&surface.gbuffer), png)?;
    }
    let foreground = surface.gbuffer.depth().iter().filter(|d| d.is_finite()).count();
    let (gbuffer, geo_normal) = (surface.gbuffer, Some(surface.geo_normal));
    Frame { gbuffer, geo_normal, ao: None, radius: Some(view.radius), view: Some(view.clone()) }
        .save(&args.output)?;
    if args.json {
        return output::json(&json!({
            "frame": args.output, "width": view.width, "height": view.height, "radius": view.radius,
            "triangles": tracer.scene().triangle.len(), "foreground_pixels": foreground, "render_ms": render_ms,
        }));
    }
    output::text(&format!("{}\n", args.output.display()))
}
