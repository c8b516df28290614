//! Methods against the reference on the frames of a dataset: one table.

use crate::dataset::{FrameEntry, Manifest, Split};
use crate::error::{Error, Result};
use crate::frame::{Frame, FrameHints};
use aonet::metrics::{self, Comparison};
use aonet::net::Model;
use aonet::net::cpu::Session;
use aonet::{AoImage, AoParams, GBuffer};
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;

/// Something that turns a G-buffer into AO.
pub enum Method<'a> {
    /// The same value everywhere (1 on the background): the row that gives the others their meaning.
    Constant(f32),
    /// A network on the CPU.
    Network {
        /// The network.
        model: &'a Model,
        /// Threads to run it with, > 0.
        threads: usize,
    },
}

/// A named method.
pub struct Contestant<'a> {
    /// What the table calls it.
    pub name: String,
    /// What is run.
    pub method: Method<'a>,
}

/// Means over frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// Frames.
    pub frames: usize,
    /// SSIM, Gaussian window, full frame.
    pub ssim: f64,
    /// SSIM, flat 8x8 window, full frame.
    pub ssim_8x8: f64,
    /// Mean of the frames' PSNR [dB], full frame.
    pub psnr: f64,
    /// PSNR of the mean squared error over all pixels [dB].
    pub psnr_pooled: f64,
    /// SSIM over windows centred on foreground; frames without any are left out.
    pub ssim_foreground: f64,
    /// Mean of the frames' PSNR over foreground pixels [dB].
    pub psnr_foreground: f64,
    /// Median time a frame [ms]; nothing for a constant.
    pub ms: Option<f64>,
}

/// Rows by method, over everything and by scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// Method and means, in the order given.
    pub overall: Vec<(String, Row)>,
    /// The same for each scene.
    pub by_scene: BTreeMap<String, Vec<(String, Row)>>,
}

struct Measured {
    scene: String,
    comparison: Comparison,
    ms: Option<f64>,
}

/// Scores `contestants` on every frame of `split`. `progress` is called once a frame.
///
/// # Errors
/// When a frame is broken or has no reference, or the split is empty.
pub fn evaluate(
    manifest: &Manifest,
    split: Split,
    contestants: &[Contestant<'_>],
    progress: &dyn Fn(usize, usize),
) -> Result<Table> {
    let entries: Vec<&FrameEntry> = manifest.frames(split).collect();
    if entries.is_empty() {
        return Err(Error::file(manifest.dir(), format!("frames of the split `{}`", split.name()), "none"));
    }
    let mut measured: Vec<Vec<Measured>> = contestants.iter().map(|_| Vec::new()).collect();
    for (done, entry) in entries.iter().enumerate() {
        let (gbuffer, params, reference) = read(manifest, entry)?;
        let foreground: Vec<bool> = (0..gbuffer.depth().len()).map(|i| gbuffer.is_foreground(i)).collect();
        for (contestant, results) in contestants.iter().zip(&mut measured) {
            let (image, ms) = run(&contestant.method, &gbuffer, params)?;
            let comparison = metrics::compare(&reference, &image, Some(&foreground))?;
            results.push(Measured { scene: entry.scene.clone(), comparison, ms });
        }
        progress(done + 1, entries.len());
    }
    Ok(table(contestants, &measured))
}

/// AO of a frame by a method, and the time it took [ms]; the background is 1.
///
/// # Errors
/// When the frame's size is out of range.
pub fn run(method: &Method<'_>, gbuffer: &GBuffer, params: AoParams) -> Result<(AoImage, Option<f64>)> {
    let mut image = AoImage::open(gbuffer.width(), gbuffer.height())?;
    match method {
        Method::Constant(value) => {
            let pixels = image.visibility_mut().iter_mut().enumerate();
            pixels.filter(|(i, _)| gbuffer.is_foreground(*i)).for_each(|(_, v)| *v = *value);
            Ok((image, None))
        }
        Method::Network { model, threads } => {
            let mut session = Session::new(model, gbuffer.width(), gbuffer.height(), *threads)?;
            // The first run touches the arena's pages; the second is timed.
            session.run(gbuffer, params, &mut image)?;
            let start = Instant::now();
            session.run(gbuffer, params, &mut image)?;
            Ok((image, Some(start.elapsed().as_secs_f64() * 1e3)))
        }
    }
}

fn read(manifest: &Manifest, entry: &FrameEntry) -> Result<(GBuffer, AoParams, AoImage)> {
    let path = manifest.path(entry);
    let hints =
        FrameHints { view: Some(entry.view.clone()), radius: Some(entry.radius), ..FrameHints::default() };
    let frame = Frame::load(&path, &hints)?;
    let ao = frame.ao.ok_or_else(|| Error::file(&path, "a channel `ao`", "none"))?;
    Ok((frame.gbuffer, AoParams::new(entry.radius).map_err(Error::in_file(&path))?, ao))
}

fn table(contestants: &[Contestant<'_>], measured: &[Vec<Measured>]) -> Table {
    let rows = |keep: &dyn Fn(&Measured) -> bool| {
        let row = |results: &Vec<Measured>| row(&results.iter().filter(|m| keep(m)).collect::<Vec<_>>());
        contestants.iter().zip(measured).map(|(c, results)| (c.name.clone(), row(results))).collect()
    };
    let scenes: std::collections::BTreeSet<_> = measured.iter().flatten().map(|m| m.scene.clone()).collect();
    let by_scene = scenes.into_iter().map(|scene| (scene.clone(), rows(&|m| m.scene == scene)));
    Table { overall: rows(&|_| true), by_scene: by_scene.collect() }
}

fn row(results: &[&Measured]) -> Row {
    let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
    let full = |value: &dyn Fn(&metrics::Scores) -> f64| {
        mean(results.iter().map(|m| value(&m.comparison.full)).collect())
    };
    let inside = |value: &dyn Fn(&metrics::Scores) -> f64| {
        mean(results.iter().filter_map(|m| m.comparison.foreground.as_ref().map(value)).collect())
    };
    let pixels: f64 = results.iter().map(|m| m.comparison.full.pixels as f64).sum();
    let error: f64 = results.iter().map(|m| m.comparison.full.mse * m.comparison.full.pixels as f64).sum();
    let mut times: Vec<f64> = results.iter().filter_map(|m| m.ms).collect();
    times.sort_by(f64::total_cmp);
    Row {
        frames: results.len(),
        ssim: full(&|s| s.ssim),
        ssim_8x8: full(&|s| s.ssim_8x8),
        psnr: full(&|s| finite_psnr(s.psnr)),
        psnr_pooled: metrics::psnr(error / pixels),
        ssim_foreground: inside(&|s| s.ssim),
        psnr_foreground: inside(&|s| finite_psnr(s.psnr)),
        ms: times.get(times.len() / 2).copied(),
    }
}

/// Identical images have infinite PSNR; one of them must not decide a mean. 100 dB is below what f32 can tell apart.
fn finite_psnr(psnr: f64) -> f64 {
    psnr.min(100.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::{Camera, Projection};
    use glam::Vec3;

    fn gbuffer() -> GBuffer {
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::look_at((Vec3::ZERO, -Vec3::Z, Vec3::Y), projection, (16, 16), 0.0).unwrap();
        let depth = (0..256).map(|i| if i < 64 { f32::INFINITY } else { 1.0 }).collect();
        GBuffer::new(camera, depth, vec![[0.0, 0.0, 1.0]; 256]).unwrap()
    }

    #[test]
    fn a_constant_leaves_the_background_open() {
        let (image, ms) = run(&Method::Constant(0.25), &gbuffer(), AoParams { radius: 1.0 }).unwrap();
        assert_eq!((image.visibility()[63], image.visibility()[64], ms), (1.0, 0.25, None));
    }

    #[test]
    fn rows_pool_and_average_as_defined() {
        let reference = AoImage::new(16, 16, vec![0.5; 256]).unwrap();
        let measured = |value: f32| {
            let image = AoImage::new(16, 16, vec![value; 256]).unwrap();
            let comparison = metrics::compare(&reference, &image, Some(&[true; 256])).unwrap();
            Measured { scene: "s".into(), comparison, ms: Some(f64::from(value)) }
        };
        // Errors 0.1 and 0.01: 20 and 40 dB; pooled mean square (0.01 + 0.0001) / 2.
        let (a, b) = (measured(0.6), measured(0.51));
        let row = row(&[&a, &b]);
        assert!((row.psnr - 30.0).abs() < 1e-3, "{row:?}");
        assert!((row.psnr_pooled + 10.0 * (0.0101f64 / 2.0).log10()).abs() < 1e-3, "{row:?}");
        assert_eq!(row.frames, 2);
    }
}
