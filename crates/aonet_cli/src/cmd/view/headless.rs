//! Pictures without a window.

use super::Args;
use super::stage::Stage;
use crate::output;
use anyhow::{Context, Result};
use aonet::Camera;
use aonet::gpu::Device;
use aonet_lab::picture::save_png;
use aonet_scene::scene::colours;
use aonet_view::renderer::{Orbit, readback};
use aonet_view::{FrameParams, Renderer};
use std::f32::consts::TAU;
use std::path::Path;

/// Rays per pixel in one submission.
const RAYS_AT_ONCE: u32 = 16;

/// Draws all frames and prints their paths.
pub(super) fn run(args: &Args, stage: Stage, out: &Path) -> Result<()> {
    let device = Device::wait_for()?;
    let mut scene = stage.tracer.scene().clone();
    colours::add_plain(&mut scene);
    let mut renderer = Renderer::on(&device, &scene, stage.view.size()?)?;
    renderer.missing_images().iter().for_each(|missing| log::warn!("{missing}"));
    if frame(args, &stage, 0)?.traces() {
        renderer.set_tracer(&stage.tracer)?;
    }
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    for i in 0..args.frames {
        draw(&device, &mut renderer, &frame(args, &stage, i)?)?;
        let path = out.join(format!("frame_{i:04}.png"));
        save_png(&readback::image(&renderer)?, &path)?;
        output::text(&format!("{}\n", path.display()))?;
    }
    Ok(())
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

fn frame(args: &Args, stage: &Stage, i: usize) -> Result<FrameParams> {
    Ok(FrameParams {
        far: stage.view.far,
        methods: stage.methods,
        split: stage.split,
        show: stage.show,
        samples: args.spp,
        ..FrameParams::new(camera(stage, i, args.frames)?, stage.view.params()?)
    })
}

/// The camera of frame `i`: on the camera path, or on a circle around the view's target.
fn camera(stage: &Stage, i: usize, frames: usize) -> Result<Camera> {
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
    let Some(orbit) = orbit else { return Ok(view.camera()?) };
    Ok(orbit.camera(view.fov_y_deg.to_radians(), aonet::Size::new(view.width, view.height)?, view.near)?)
}
