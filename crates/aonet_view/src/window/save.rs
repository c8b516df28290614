//! Files that the window writes, and scores of its methods.

use super::viewer::{SCORE_SAMPLES, Viewer};
use crate::renderer::{CameraPath, FrameParams, Method, Renderer, readback};
use crate::{Error, Result};
use aonet::metrics;
use aonet_lab::frame;
use aonet_lab::picture::save_png;
use aonet_scene::{View, atomic_file};
use std::path::{Path, PathBuf};

/// `aonet_view_000.EXTENSION` in the current folder, or the first number that is not taken.
fn free_name(extension: &str) -> Result<PathBuf> {
    let name = |i: u32| PathBuf::from(format!("aonet_view_{i:03}.{extension}"));
    let found = (0..1000).map(name).find(|path| !path.exists());
    found.ok_or_else(|| Error::file(&name(999), "a number that is not taken", "a thousand files"))
}

/// Writes the last frame as a picture, without the controls.
///
/// # Errors
/// When the device is lost or the file cannot be written.
pub(super) fn screenshot(renderer: &Renderer) -> Result<String> {
    let path = free_name("png")?;
    save_png(&readback::image(renderer)?, &path)?;
    Ok(path.display().to_string())
}

/// Writes the last frame's G-buffer as a frame file, with the reference if it has converged.
///
/// # Errors
/// When the device is lost or the file cannot be written.
pub(super) fn export(renderer: &Renderer, viewer: &Viewer, of: &FrameParams) -> Result<String> {
    let path = free_name("exr")?;
    let drawn = readback::drawn(renderer, &of.camera)?;
    let converged = renderer.samples() >= SCORE_SAMPLES;
    let ao = converged.then(|| readback::visibility(renderer, Method::Reference)).transpose()?;
    let size = renderer.size();
    let (eye, target) = (viewer.orbit.eye().to_array(), viewer.orbit.target.to_array());
    let up = [0.0, 1.0, 0.0];
    let view = View {
        eye,
        target,
        up,
        ortho_height: None,
        width: size.width(),
        height: size.height(),
        radius: viewer.radius,
        ..viewer.view.clone()
    };
    let (geo_normal, radius) = (Some(drawn.geo_normal), Some(viewer.radius));
    frame::Frame { gbuffer: drawn.gbuffer, geo_normal, ao, radius, view: Some(view) }.save(&path)?;
    let what = if converged { "with the reference" } else { "without a reference: press C first" };
    Ok(format!("{}, {what}", path.display()))
}

/// Writes a recorded camera path.
///
/// # Errors
/// When the file cannot be written.
pub(super) fn way(way: &CameraPath) -> Result<String> {
    let path = free_name("json")?;
    atomic_file::write(Path::new(&path), way.to_json().as_bytes())?;
    Ok(format!("{}, keys: {}", path.display(), way.keys.len()))
}

/// SSIM and PSNR of the methods of the last frame against its reference; none until the reference has converged.
///
/// # Errors
/// When the device is lost, or the frame is too small for SSIM.
pub(super) fn scores(renderer: &Renderer, of: &FrameParams) -> Result<Option<String>> {
    if renderer.samples() < SCORE_SAMPLES {
        return Ok(None);
    }
    let reference = readback::visibility(renderer, Method::Reference)?;
    let drawn = readback::drawn(renderer, &of.camera)?;
    let foreground = drawn.gbuffer.foreground();
    let mut lines = vec![format!("against {} rays, foreground:", renderer.samples())];
    let sides = [of.methods[0], of.methods[1]].into_iter().zip([of.split > 0.0, of.split < 1.0]);
    for (method, _) in sides.filter(|(method, seen)| *seen && *method != Method::Reference) {
        let image = match method {
            Method::Off => aonet::AoImage::open(reference.size()),
            method => readback::visibility(renderer, method)?,
        };
        let compared = metrics::compare(&reference, &image, Some(&foreground))?;
        let of = compared.foreground.unwrap_or(compared.full);
        lines.push(format!("{}: SSIM {:.4}, PSNR {:.2} dB", method.title(), of.ssim, of.psnr));
    }
    Ok(Some(lines.join("\n")))
}
