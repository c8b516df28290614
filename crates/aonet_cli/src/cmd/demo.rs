//! `aonet demo`: one scene with the ray-traced reference and the network's AO, side by side.

use crate::output::{self, Style, number, table};
use crate::radius;
use crate::setup::{self, StageArgs};
use anyhow::{Context, Result};
use aonet::metrics::{self, Comparison};
use aonet::{AoImage, AoParams, GBuffer};
use aonet_lab::eval::{Method, Runner, run as run_method};
use aonet_lab::frame::Frame;
use aonet_lab::picture::{self, Caption};
use aonet_lab::timing;
use aonet_scene::backend::Rays;
use aonet_scene::gbuffer::{self, Surface};
use aonet_scene::reference::Sampling;
use clap::Parser;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Render a scene, trace its AO, compute it with the network, and show both.
///
/// Without --scene, the scene is procedural. Without --view, the program places a camera.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet demo
  aonet demo --scene robot.glb -o robot_ao
  aonet demo --scene room.glb --environment --radius 0.5")]
pub(crate) struct Args {
    #[command(flatten)]
    stage: StageArgs,
    /// Folder for the pictures.
    #[arg(short, long, default_value = "aonet_demo")]
    output: PathBuf,
    /// Network: fast, balanced, high (best), paper, or a file.
    #[arg(long, value_name = "MODEL", default_value = "balanced")]
    model: PathBuf,
    /// Rays per pixel of the reference.
    #[arg(long, default_value_t = 128)]
    spp: u32,
    /// AO radius (world units); otherwise the view's, or a tenth of the image at the view's middle distance.
    #[arg(long)]
    radius: Option<f32>,
    /// Threads of the network [default: all cores].
    #[arg(long)]
    threads: Option<usize>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Counted runs of the network.
const RUNS: usize = 5;

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    let model = setup::model(Some(&args.model))?;
    let (tracer, mut view) = args.stage.load()?;
    let surface = gbuffer::render(&tracer, &view)?;
    if args.stage.view.is_none() && args.stage.scene.is_some() {
        view.radius = setup::radius_on_screen(&surface);
    }
    view.radius = radius::given_or(args.radius, view.radius)?;
    let params = view.params()?;
    radius::check((&setup::name_of(&args.model), &model), (&surface.gbuffer, params), args.radius);
    let start = Instant::now();
    let sampling = Sampling { spp: args.spp, seed: 1 };
    let reference = setup::reference(&mut Rays::Cpu(&tracer), &surface, params, sampling)?;
    let trace_s = start.elapsed().as_secs_f64();
    let network = Method::network(&model, setup::threads(args.threads));
    let (ao, ms) = timed(network, &surface.gbuffer, params)?;
    let constant = Method::Constant(model.facts().mean_visibility.unwrap_or(0.8));
    let (flat, _) = run_method(&constant, &surface.gbuffer, params)?;
    let foreground: Vec<bool> = surface.gbuffer.depth().iter().map(|d| d.is_finite()).collect();
    let of = |image: &AoImage| metrics::compare(&reference, image, Some(&foreground));
    let (scores, flat) = (of(&ao)?, of(&flat)?);
    let captions = [
        format!("reference, {} rays per pixel, {trace_s:.1} s", args.spp),
        format!("network, {ms:.0} ms"),
        format!("error: SSIM {:.4}, PSNR {:.2} dB", scores.full.ssim, scores.full.psnr),
    ];
    draw(args, (&surface, &reference, &ao), captions)?;
    let (gbuffer, geo_normal) = (surface.gbuffer, Some(surface.geo_normal));
    Frame { gbuffer, geo_normal, ao: Some(reference), radius: Some(view.radius), view: Some(view.clone()) }
        .save(&args.output.join("frame.exr"))?;
    report(args, &Outcome { network: scores, constant: flat, trace_s, network_ms: ms }, params)
}

/// The network's AO, and its median time (ms) over [`RUNS`].
fn timed(network: Method<'_>, gbuffer: &GBuffer, params: AoParams) -> Result<(AoImage, f64)> {
    let mut runner = Runner::new(network);
    let (mut image, mut times) = (AoImage::open(gbuffer.window().size()), Vec::new());
    for _ in 0..RUNS {
        let (ao, ms) = runner.run(gbuffer, params)?;
        image = ao;
        times.extend(ms);
    }
    Ok((image, timing::median(&mut times)))
}

fn draw(
    args: &Args,
    (surface, reference, ao): (&Surface, &AoImage, &AoImage),
    captions: [String; 3],
) -> Result<()> {
    let dir = &args.output;
    std::fs::create_dir_all(dir).with_context(|| dir.display().to_string())?;
    let [traced, computed, difference] = captions;
    let panels = [
        ("normal.png", picture::normals(&surface.gbuffer), Caption::new("input: normals (and depth)")),
        ("ao_reference.png", picture::ao(reference), Caption::new(traced)),
        ("ao_network.png", picture::ao(ao), Caption::new(computed)),
        ("error.png", picture::error(reference, ao)?, Caption { text: difference, error_legend: true }),
    ];
    picture::save_png(&picture::depth(&surface.gbuffer), &dir.join("depth.png"))?;
    let mut sheet = Vec::new();
    for (name, picture, caption) in panels {
        picture::save_png(&picture, &dir.join(name))?;
        sheet.push((picture, caption));
    }
    Ok(picture::save_png(&picture::sheet(&sheet, 2)?, &dir.join("side_by_side.png"))?)
}

/// Scores against the reference, and times.
struct Outcome {
    network: Comparison,
    /// Of the image whose visibility is the same everywhere.
    constant: Comparison,
    trace_s: f64,
    network_ms: f64,
}

fn report(args: &Args, outcome: &Outcome, params: AoParams) -> Result<()> {
    let Outcome { network, constant, trace_s, network_ms } = outcome;
    if args.json {
        return output::json(&json!({
            "folder": args.output, "radius": params.radius(), "spp": args.spp, "trace_s": trace_s, "network_ms": network_ms,
            "network": { "full": network.full, "foreground": network.foreground },
            "constant": { "full": constant.full, "foreground": constant.foreground },
        }));
    }
    let row = |name: &str, c: &Comparison, time: String| {
        let inside = c.foreground.as_ref();
        let scores = [number(c.full.ssim, 4), number(c.full.psnr, 2)];
        let inside = [number(inside.map(|f| f.ssim), 4), number(inside.map(|f| f.psnr), 2)];
        [vec![name.to_owned()], scores.to_vec(), inside.to_vec(), vec![time]].concat()
    };
    let rows = [
        row("network", network, format!("{network_ms:.1} ms")),
        row("constant image", constant, "-".into()),
        [vec![format!("reference, {} rays", args.spp)], vec!["-".into(); 4], vec![format!("{trace_s:.1} s")]]
            .concat(),
    ];
    let header = ["", "SSIM", "PSNR dB", "SSIM fg", "PSNR fg", "time"];
    output::text(&table(&header, &rows, Style::Text))?;
    output::text(&format!("\n{}\n", args.output.join("side_by_side.png").display()))
}
