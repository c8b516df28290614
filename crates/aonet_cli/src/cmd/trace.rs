//! `aonet trace`: a G-buffer with ray-traced AO from a scene.

use crate::device::Device;
use crate::names;
use crate::output;
use crate::setup::{self, SceneArgs};
use anyhow::Result;
use aonet_lab::frame::Frame;
use aonet_lab::picture;
use aonet_scene::gbuffer;
use aonet_scene::reference::Sampling;
use clap::Parser;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Trace the reference AO of a view.
#[derive(Debug, Parser)]
#[command(
    after_help = "Examples:\n  aonet trace room.glb --view view.json --spp 512 -o frame.exr --png ao.png\n  aonet trace room.glb --view view.json -o frame.exr --bent-normals"
)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Frame to write (EXR): G-buffer and AO.
    #[arg(short, long, value_name = "FRAME.exr", value_parser = names::exr())]
    output: PathBuf,
    /// Rays per pixel.
    #[arg(long, default_value_t = 256)]
    spp: u32,
    /// Seed of the sampling.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Where rays are traced.
    #[arg(long, value_enum, default_value_t)]
    device: Device,
    /// Also write bent normals, the mean directions of open light, as channels bent_normal.X/Y/Z: on the CPU only.
    #[arg(long)]
    bent_normals: bool,
    /// Also draw the AO.
    #[arg(long, value_name = "FILE.png", value_parser = names::png())]
    png: Option<PathBuf>,
    /// Print facts as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    anyhow::ensure!(
        !args.bent_normals || args.device == Device::Cpu,
        "--bent-normals: expected --device cpu, which traces them; found {}",
        args.device.name()
    );
    let backend = args.device.backend()?;
    let (tracer, view) = args.scene.load()?;
    let surface = gbuffer::render(&tracer, &view)?;
    let start = Instant::now();
    let sampling = Sampling { spp: args.spp, seed: args.seed };
    let (ao, bent) = match args.bent_normals {
        true => {
            let (ao, bent) = setup::bent_reference(&tracer, &surface, view.params()?, sampling)?;
            (ao, Some(bent))
        }
        false => (setup::reference(&mut backend.rays(&tracer)?, &surface, view.params()?, sampling)?, None),
    };
    let seconds = start.elapsed().as_secs_f64();
    if let Some(png) = &args.png {
        picture::save_png(&picture::ao(&ao), png)?;
    }
    let pixels = surface.gbuffer.depth().iter().filter(|d| d.is_finite()).count() as u64;
    let rays = pixels * u64::from(args.spp);
    let mean = ao.visibility().iter().map(|v| f64::from(*v)).sum::<f64>() / ao.visibility().len() as f64;
    let (gbuffer, geo_normal) = (surface.gbuffer, Some(surface.geo_normal));
    let frame =
        Frame { gbuffer, geo_normal, ao: Some(ao), radius: Some(view.radius), view: Some(view.clone()) };
    match &bent {
        Some(bent) => frame.save_with_bent_normals(&args.output, bent)?,
        None => frame.save(&args.output)?,
    }
    if args.json {
        return output::json(&json!({
            "frame": args.output, "width": view.width, "height": view.height, "radius": view.radius,
            "spp": args.spp, "device": backend.name(), "rays": rays, "seconds": seconds, "mean_visibility": mean,
        }));
    }
    output::note(&format!("{:.1} Mray in {seconds:.1} s", rays as f64 / 1e6));
    output::text(&format!("{}\n", args.output.display()))
}
