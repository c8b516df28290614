//! How far bent normals of searches are from the traced ones.

use crate::dataset::Manifest;
use aonet::net::{Model, cpu};
use aonet::search::{Classic, Options, Session};
use aonet::{AoImage, AoParams, BentNormals, GBuffer};
use aonet_scene::error::{Error, Result};
use aonet_scene::gbuffer;
use aonet_scene::reference::{Sampling, reference_with_bent_normals};
use aonet_scene::trace::Tracer;
use serde::Serialize;
use std::path::Path;

/// What gives a frame's bent normals.
#[derive(Debug, Clone, Copy)]
pub enum Source<'a> {
    /// The surface's own normal: what programs without bent normals use.
    Normal,
    /// A classic method.
    Classic(&'a Classic),
    /// The search of a network.
    Network(&'a Model),
}

/// What is measured.
#[derive(Debug)]
pub struct Bending<'a> {
    /// Sources by name.
    pub sources: Vec<(String, Source<'a>)>,
    /// Frames, evenly spread over the dataset; all if absent.
    pub frames: Option<usize>,
    /// Rays a pixel.
    pub sampling: Sampling,
}

/// Mean angles from the traced directions (degrees): means over the frames of means over the pixels that show geometry.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Angles {
    /// All pixels count the same.
    pub mean: f64,
    /// Pixels count by their traced visibility: as the light that comes from there.
    pub by_visibility: f64,
}

impl Bending<'_> {
    /// Measures frames of a dataset whose scenes are under `scenes`, and returns their number and the angles of each source. `progress`
    /// is called once a frame with the number of frames.
    ///
    /// # Errors
    /// When a scene or a view cannot be read, a source has no bent normals, or the dataset has no frame of a scene.
    pub fn measure(
        &self,
        manifest: &Manifest,
        scenes: &Path,
        progress: &dyn Fn(usize),
    ) -> Result<(usize, Vec<Angles>)> {
        let all = manifest.frames.len();
        let count = self.frames.unwrap_or(all).min(all);
        let chosen: Vec<_> = (0..count).map(|i| &manifest.frames[i * all / count]).collect();
        let (mut frames, mut angles) = (0, vec![Angles::default(); self.sources.len()]);
        for spec in &manifest.plan.located(scenes).scenes {
            let mut of_scene = chosen.iter().filter(|entry| entry.scene == spec.name).peekable();
            if of_scene.peek().is_none() {
                continue;
            }
            let tracer = Tracer::new(spec.load()?.0);
            for entry in of_scene {
                let surface = gbuffer::render(&tracer, &entry.view)?;
                let params = entry.view.params()?;
                let truth = reference_with_bent_normals(&tracer, &surface, params, self.sampling, &|_| ())?;
                for ((_, source), sum) in self.sources.iter().zip(&mut angles) {
                    let found = source.bent_normals(&surface.gbuffer, params)?;
                    let of_frame = between(&found, &truth, &surface.gbuffer);
                    sum.mean += of_frame.mean;
                    sum.by_visibility += of_frame.by_visibility;
                }
                frames += 1;
                progress(count);
            }
        }
        if frames == 0 {
            return Err(Error::request("dataset", "frames of scenes that it lists", "none"));
        }
        for angle in &mut angles {
            angle.mean /= frames as f64;
            angle.by_visibility /= frames as f64;
        }
        Ok((frames, angles))
    }
}

impl Source<'_> {
    /// The bent normals of a frame's picture.
    ///
    /// # Errors
    /// When the method or the network has none.
    pub fn bent_normals(self, gbuffer: &GBuffer, params: AoParams) -> Result<BentNormals> {
        let window = gbuffer.window();
        let (mut image, mut bent) = (AoImage::open(window.size()), BentNormals::zeros(window.size()));
        match self {
            Self::Normal => window.crop(gbuffer.normal(), bent.directions_mut()),
            Self::Classic(method) => Session::with_bent_normals(method, window, Options::default())?
                .run_with_bent_normals(gbuffer, params, &mut image, &mut bent)?,
            Self::Network(model) => cpu::Session::with_bent_normals(model, window, cpu::Options::default())?
                .run_with_bent_normals(gbuffer, params, &mut image, &mut bent)?,
        }
        Ok(bent)
    }
}

/// Mean angles between found and traced directions on a frame.
fn between(found: &BentNormals, truth: &(AoImage, BentNormals), gbuffer: &GBuffer) -> Angles {
    let picture = gbuffer.without_margin();
    let (visibility, traced) = (truth.0.visibility(), truth.1.directions());
    let (mut sum, mut count, mut weighted, mut weights) = (0.0, 0.0, 0.0, 0.0);
    for i in (0..traced.len()).filter(|i| picture.is_foreground(*i)) {
        let dot: f32 = (0..3).map(|c| found.directions()[i][c] * traced[i][c]).sum();
        let angle = f64::from(dot.clamp(-1.0, 1.0)).acos().to_degrees();
        let weight = f64::from(visibility[i]);
        (sum, count) = (sum + angle, count + 1.0);
        (weighted, weights) = (weighted + angle * weight, weights + weight);
    }
    Angles { mean: sum / f64::max(count, 1.0), by_visibility: weighted / f64::max(weights, 1e-9) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::{Camera, Size};

    #[test]
    fn angles_count_pixels_of_the_foreground_alike_and_by_visibility() {
        let size = Size::px(3, 1);
        let camera = Camera::perspective(1.0, size).unwrap();
        let normal = vec![[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0; 3]];
        let gbuffer = GBuffer::new(camera, vec![1.0, 1.0, f32::INFINITY], normal).unwrap();
        let ao = AoImage::new(size, vec![0.25, 0.75, 1.0]).unwrap();
        let traced = vec![[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0; 3]];
        let truth = (ao, BentNormals::new(size, traced).unwrap());
        let params = AoParams::new(1.0).unwrap();
        let found = Source::Normal.bent_normals(&gbuffer, params).unwrap();
        let angles = between(&found, &truth, &gbuffer);
        assert!(
            (angles.mean - 45.0).abs() < 1e-6 && (angles.by_visibility - 67.5).abs() < 1e-6,
            "{angles:?}"
        );
        assert!(Source::Classic(&Classic::named("ssao").unwrap()).bent_normals(&gbuffer, params).is_err());
    }
}
