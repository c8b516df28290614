//! A G-buffer, its camera and radius, and the AO made from it: what `infer` and `classic` share.

use crate::device::Device;
use crate::{names, output};
use anyhow::{Context, Result};
use aonet::{AoImage, AoParams, BentNormals, GBuffer, Size};
use aonet_lab::ao_file::save_ao;
use aonet_lab::bent_file::{save_ao_with_bent_normals, save_bent_normals};
use aonet_lab::frame::{Frame, FrameHints};
use aonet_lab::timing;
use aonet_scene::View;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A G-buffer file, and values that the file may lack.
#[derive(Debug, clap::Args)]
pub(crate) struct FrameArgs {
    /// G-buffer (EXR).
    frame: PathBuf,
    /// Second layer: the depth, and normals if there are some, of another EXR of the same camera and size, rendered without
    /// the objects in front [default: the frame's channels second.depth and second.normal.X/Y/Z].
    #[arg(long, value_name = "FILE.exr")]
    second: Option<PathBuf>,
    /// File to write: .exr (32-bit) or .png (16-bit grey), linear.
    #[arg(short, long, value_name = "AO", value_parser = names::exr_or_png())]
    output: PathBuf,
    /// Also write bent normals, the mean directions of open light: as channels bent_normal.X/Y/Z beside the AO of an .exr, or into a
    /// file of their own, .exr or .png (n/2 + 1/2). gtao, agtao and networks with a search have them.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, value_parser = names::exr_or_png())]
    bent_normals: Option<Option<PathBuf>>,
    /// AO radius (world units); otherwise the frame's or the view's.
    #[arg(long)]
    pub(crate) radius: Option<f32>,
    /// Vertical field of view (degrees); otherwise the frame's or the view's.
    #[arg(long = "fov-y", value_name = "DEG")]
    fov_y: Option<f32>,
    /// Camera and radius (JSON).
    #[arg(long, value_name = "VIEW.json")]
    view: Option<PathBuf>,
    /// Threads [default: all cores].
    #[arg(long)]
    pub(crate) threads: Option<usize>,
    /// Print facts as JSON.
    #[arg(long)]
    json: bool,
}

/// How an AO image was made.
pub(crate) struct Run<'a> {
    /// Name of the method.
    pub(crate) method: &'a str,
    pub(crate) device: Device,
    pub(crate) params: AoParams,
    /// When the method started.
    pub(crate) start: Instant,
}

impl FrameArgs {
    /// Reads the G-buffer and its radius. `fallback` is the radius for a method that ignores it.
    pub(crate) fn load(&self, fallback: Option<AoParams>) -> Result<(GBuffer<'static>, AoParams)> {
        let frame = |hints: &FrameHints| Frame::load_gbuffer(&self.frame, self.second.as_deref(), hints);
        let (frame, params) = self.read(&frame, fallback)?;
        Ok((frame.gbuffer, params))
    }

    /// Reads the frame with its reference AO, if it has one, and its radius.
    pub(crate) fn load_with_reference(&self) -> Result<(Frame, AoParams)> {
        let frame = |hints: &FrameHints| match &self.second {
            Some(second) => Frame::load_with_second(&self.frame, second, hints),
            None => Frame::load(&self.frame, hints),
        };
        self.read(&frame, None)
    }

    fn read(
        &self,
        frame: &dyn Fn(&FrameHints) -> aonet_scene::Result<Frame>,
        fallback: Option<AoParams>,
    ) -> Result<(Frame, AoParams)> {
        let view = self.view.as_deref().map(View::load).transpose()?;
        let given = self.radius.map(AoParams::new).transpose().context("--radius")?;
        let hints = FrameHints { view, fov_y_deg: self.fov_y, radius: self.radius, ..FrameHints::default() };
        let frame = frame(&hints)?;
        let params = match (given, frame.radius, fallback) {
            (Some(params), _, _) => params,
            (None, Some(radius), _) => {
                AoParams::new(radius).with_context(|| self.frame.display().to_string())?
            }
            (None, None, Some(params)) => params,
            (None, None, None) => {
                anyhow::bail!("{}: no AO radius in the file; give --radius or --view", self.frame.display())
            }
        };
        Ok((frame, params))
    }

    /// The file to write.
    pub(crate) fn output(&self) -> &Path {
        &self.output
    }

    /// Whether to print JSON.
    pub(crate) fn json(&self) -> bool {
        self.json
    }

    /// An image for the bent normals of a picture of this size, if they are wanted.
    ///
    /// # Errors
    /// When they are to stand beside the AO and that is a PNG.
    pub(crate) fn bent_normals(&self, size: Size) -> Result<Option<BentNormals>> {
        let is_png = self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
        anyhow::ensure!(
            !is_png || !matches!(self.bent_normals, Some(None)),
            "--bent-normals: a .png of AO has no room for them; expected --bent-normals=FILE, or an .exr as --output"
        );
        Ok(self.bent_normals.as_ref().map(|_| BentNormals::zeros(size)))
    }

    /// Writes the AO, and bent normals where there are some, and reports how it was made.
    pub(crate) fn finish(
        &self,
        (image, bent): (&AoImage, Option<&BentNormals>),
        run: &Run<'_>,
    ) -> Result<()> {
        let &Run { method, device, params, start } = run;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let own = self.bent_normals.iter().flatten().next();
        match (bent, own) {
            (Some(bent), None) => save_ao_with_bent_normals(&self.output, image, bent)?,
            (Some(bent), Some(path)) => {
                save_ao(&self.output, image)?;
                save_bent_normals(path, bent)?;
            }
            (None, _) => save_ao(&self.output, image)?,
        }
        let (width, height, radius) = (image.width(), image.height(), params.radius());
        if self.json {
            return output::json(&json!({
                "ao": self.output, "width": width, "height": height, "radius": radius, "ms": ms,
                "device": device.name(), "method": method, "peak_mib": timing::peak_mib(),
                "bent_normals": bent.map(|_| own.unwrap_or(&self.output)),
            }));
        }
        output::note(&format!("{width}x{height}, radius {radius:?}, {ms:.1} ms"));
        output::text(&format!("{}\n", self.output.display()))
    }
}
