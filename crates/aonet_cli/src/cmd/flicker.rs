//! `aonet flicker`: how steady methods are along a camera path.

use crate::output::{self, Style, number, table};
use crate::radius;
use crate::setup::{self, StageArgs};
use anyhow::{Result, bail};
use aonet::net::Model;
use aonet_lab::eval::{Method, Runner};
use aonet_lab::flicker::{Flicker, flicker};
use aonet_scene::View;
use aonet_scene::backend::Rays;
use aonet_scene::gbuffer::{self, Surface};
use aonet_scene::reference::Sampling;
use aonet_scene::trace::Tracer;
use clap::Parser;
use glam::Vec3;
use serde_json::json;
use std::path::PathBuf;

/// Measure how much images change along a camera path beyond the changes of the ray-traced reference.
///
/// The camera moves sideways, by --step pixels a frame at the view's median depth. The comparison covers points that two
/// neighbouring frames both see. Without --scene, the scene is procedural.
#[derive(Debug, Parser)]
#[command(after_help = "Examples:
  aonet flicker --classic gtao:tuned --classic agtao:tuned
  aonet flicker --scene robot.glb --model a.safetensors --model b.safetensors --frames 16 --step 0.5")]
pub(crate) struct Args {
    #[command(flatten)]
    stage: StageArgs,
    /// Network: fast, balanced, high, paper, or a file; may be repeated [default: balanced].
    #[arg(long, value_name = "MODEL")]
    model: Vec<PathBuf>,
    /// Classic method: a name, a preset of `aonet tune` (.json), `all` or `all:tuned`; may be repeated.
    #[arg(long, value_name = "METHOD")]
    classic: Vec<String>,
    /// Frames of the path, at least 2.
    #[arg(long, default_value_t = 8)]
    frames: usize,
    /// Pixels that the middle of the scene moves from frame to frame.
    #[arg(long, default_value_t = 2.5)]
    step: f32,
    /// Rays per pixel of the reference.
    #[arg(long, default_value_t = 256)]
    spp: u32,
    /// AO radius (world units); otherwise the view's, or one that suits it.
    #[arg(long)]
    radius: Option<f32>,
    /// Threads of the networks [default: all cores].
    #[arg(long)]
    threads: Option<usize>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<()> {
    if args.frames < 2 || !args.step.is_finite() {
        bail!(
            "--frames and --step: expected at least 2 frames and a finite step, found {} and {}",
            args.frames,
            args.step
        );
    }
    let models: Vec<(String, Model)> = match &args.model[..] {
        [] => vec![("balanced".into(), setup::model(None)?)],
        paths => {
            paths.iter().map(|p| Ok((setup::name_of(p), setup::model(Some(p))?))).collect::<Result<_>>()?
        }
    };
    let classic = setup::classic(&args.classic)?;
    let (tracer, mut view) = args.stage.load()?;
    let middle = gbuffer::render(&tracer, &view)?;
    if args.stage.view.is_none() && args.stage.scene.is_some() {
        view.radius = setup::radius_on_screen(&middle);
    }
    view.radius = radius::given_or(args.radius, view.radius)?;
    let params = view.params()?;
    for (name, model) in &models {
        radius::check((name, model), (&middle.gbuffer, params), args.radius);
    }
    let path = render(args, &tracer, &view, &middle)?;
    let sampling = |seed| Sampling { spp: args.spp, seed };
    let reference = |(i, surface)| setup::reference(&mut Rays::Cpu(&tracer), surface, params, sampling(i));
    let references = (1..).zip(&path).map(reference).collect::<Result<Vec<_>>>()?;
    let pictures: Vec<_> = path.iter().map(|surface| surface.gbuffer.without_margin()).collect();
    let threads = setup::threads(args.threads);
    let networks = models.iter().map(|(name, model)| (name, Method::network(model, threads)));
    let by_hand = classic.iter().map(|(name, method)| (name, Method::Classic { method, threads }));
    let mut rows = Vec::new();
    for (name, method) in networks.chain(by_hand) {
        let mut runner = Runner::new(method);
        let run = |surface: &Surface| Ok(runner.run(&surface.gbuffer, params)?.0);
        let images = path.iter().map(run).collect::<Result<Vec<_>>>()?;
        rows.push((name.as_str(), flicker(&pictures, &references, &images)?));
    }
    // The reference's own noise: the same frames with other rays.
    let other = |(i, surface): (u64, &Surface)| {
        setup::reference(&mut Rays::Cpu(&tracer), surface, params, sampling(i + 1000))
    };
    let others = (1..).zip(&path).map(other).collect::<Result<Vec<_>>>()?;
    rows.push(("reference, other rays", flicker(&pictures, &references, &others)?));
    report(args, &rows)
}

/// The frames of the path; the view is in its middle.
fn render(args: &Args, tracer: &Tracer, view: &View, middle: &Surface) -> Result<Vec<Surface>> {
    let (eye, target) = (Vec3::from(view.eye), Vec3::from(view.target));
    let right = (target - eye).cross(Vec3::from(view.up)).normalize_or_zero();
    let camera = middle.gbuffer.camera();
    let step = args.step / camera.projected_px(1.0, setup::middle_depth(middle));
    let at = |i: usize| {
        let offset = right * step * (i as f32 - 0.5 * (args.frames - 1) as f32);
        let view = View { eye: (eye + offset).into(), target: (target + offset).into(), ..view.clone() };
        Ok(gbuffer::render(tracer, &view)?)
    };
    (0..args.frames).map(at).collect()
}

fn report(args: &Args, rows: &[(&str, Flicker)]) -> Result<()> {
    if args.json {
        let method = |(name, f): &(&str, Flicker)| json!({ "method": name, "excess": f.excess, "change": f.change, "reference_change": f.reference_change, "pairs": f.pairs });
        return output::json(&rows.iter().map(method).collect::<Vec<_>>());
    }
    let row = |(name, f): &(&str, Flicker)| {
        vec![(*name).to_owned(), number(f.excess, 5), number(f.change, 5), number(f.reference_change, 5)]
    };
    let rows: Vec<_> = rows.iter().map(row).collect();
    output::text(&table(&["method", "flicker", "change", "reference's change"], &rows, Style::Text))?;
    let (frames, step, spp) = (args.frames, args.step, args.spp);
    output::text(&format!(
        "\nmeans a point and frame; {frames} frames, {step} px a frame, {spp} rays per pixel\n"
    ))
}
