//! Pictures without a window.

use super::Args;
use super::stage::Stage;
use crate::{output, radius};
use anyhow::{Context, Result};
use aonet::Window;
use aonet::gpu::{Device, wgpu};
use aonet::net::{Model, shipped};
use aonet_lab::frame::Frame;
use aonet_lab::picture::save_png;
use aonet_scene::View;
use aonet_scene::gbuffer;
use aonet_scene::scene::colours;
use aonet_view::renderer::{Orbit, PassTime, readback};
use aonet_view::{FrameParams, Method, Renderer};
use std::f32::consts::TAU;
use std::path::Path;

/// Rays per pixel in one submission.
const RAYS_AT_ONCE: u32 = 16;

/// Draws all frames and prints their paths.
pub(super) fn run(args: &Args, stage: Stage, out: &Path) -> Result<()> {
    if args.radius.is_some() {
        check_radius(args, &stage)?;
    }
    let device = Device::wait_for()?;
    let mut scene = stage.tracer.scene().clone();
    colours::add_plain(&mut scene);
    let window = Window::new(stage.view.size()?, stage.view.margin_px()?)?;
    let mut renderer = Renderer::on(&device, &scene, window)?;
    renderer.missing_images().iter().for_each(|missing| log::warn!("{missing}"));
    if args.times && !renderer.has_clock() {
        output::note("no times: this device does not time passes");
    }
    if frame(args, &stage, &stage.view)?.traces() {
        renderer.set_tracer(&stage.tracer)?;
    }
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    for i in 0..args.frames {
        let view = view(&stage, i, args.frames);
        let frame = frame(args, &stage, &view)?;
        draw(&device, &mut renderer, &frame)?;
        let path = out.join(format!("frame_{i:04}.png"));
        save_png(&readback::image(&renderer)?, &path)?;
        output::text(&format!("{}\n", path.display()))?;
        if args.exr {
            let path = path.with_extension("exr");
            save_exr(&renderer, &frame, view, &path)?;
            output::text(&format!("{}\n", path.display()))?;
        }
        if args.times && renderer.has_clock() {
            output::note(&times(&device, &mut renderer, &frame)?);
        }
    }
    Ok(())
}

/// Says on stderr when a network was not trained with the given radius, in the stage's view.
fn check_radius(args: &Args, stage: &Stage) -> Result<()> {
    let names = stage.methods.map(Method::name);
    let networks = shipped::ALL.into_iter().filter(|(name, _)| names.contains(name));
    let surface = gbuffer::render(&stage.tracer, &stage.view)?;
    for (name, bytes) in networks {
        let model = Model::from_bytes(bytes)?;
        radius::check((name, &model), (&surface.gbuffer, stage.view.params()?), args.radius);
    }
    Ok(())
}

/// Writes the G-buffer of the last frame.
fn save_exr(renderer: &Renderer, frame: &FrameParams, view: View, path: &Path) -> Result<()> {
    let drawn = readback::drawn(renderer, &frame.camera)?;
    let (radius, geo_normal) = (Some(view.radius), Some(drawn.geo_normal));
    Ok(Frame { gbuffer: drawn.gbuffer, geo_normal, ao: None, radius, view: Some(view) }.save(path)?)
}

/// Draws a frame; the reference in parts that are short enough for a driver's watchdog.
fn draw(device: &Device, renderer: &mut Renderer, frame: &FrameParams) -> Result<()> {
    let mut left = frame.samples;
    loop {
        let frame = FrameParams { samples: left.min(RAYS_AT_ONCE), ..*frame };
        left -= frame.samples;
        let mut encoder = device.device.create_command_encoder(&Default::default());
        renderer.encode(&mut encoder, &frame)?;
        device.queue.submit([encoder.finish()]);
        if left == 0 || !frame.traces() {
            return Ok(());
        }
    }
}

/// The times of a frame's passes on one line. The frame is drawn again: now its shaders are compiled.
fn times(device: &Device, renderer: &mut Renderer, frame: &FrameParams) -> Result<String> {
    // The second of two frames reads the times of the first.
    for _ in 0..2 {
        draw(device, renderer, frame)?;
        device.device.poll(wgpu::PollType::wait_indefinitely()).context("the graphics device")?;
    }
    let passes = renderer.times();
    let line = |label: &str, ms: f32| format!("{label} {ms:.2} ms");
    let together = line("together", passes.iter().map(|pass| pass.ms).sum());
    let each = passes.iter().map(|PassTime { label, ms }| line(label, *ms));
    Ok(each.chain([together]).collect::<Vec<_>>().join(", "))
}

fn frame(args: &Args, stage: &Stage, view: &View) -> Result<FrameParams> {
    Ok(FrameParams {
        far: view.far,
        methods: stage.methods,
        split: stage.split,
        show: stage.show,
        bent_normals: stage.bent_normals,
        separation: view.separation,
        samples: args.spp,
        ..FrameParams::new(view.camera()?, view.params()?)
    })
}

/// The view of frame `i`: on the camera path, or on a circle around the target of the stage's view.
fn view(stage: &Stage, i: usize, frames: usize) -> View {
    let (view, i) = (&stage.view, i as f32);
    let orbit = match &stage.way {
        Some(way) => {
            let (first, last) = way.span();
            way.at(first + (last - first) * i / frames.saturating_sub(1).max(1) as f32)
        }
        None if frames > 1 && view.ortho_height.is_none() => {
            let mut orbit = Orbit::of_view(view);
            orbit.turn(TAU * i / frames as f32, 0.0);
            Some(orbit)
        }
        None => None,
    };
    let Some(orbit) = orbit else { return view.clone() };
    let (eye, target) = (orbit.eye().to_array(), orbit.target.to_array());
    View { eye, target, up: [0.0, 1.0, 0.0], ortho_height: None, ..view.clone() }
}
