//! Scores methods against the reference on the frames of a dataset.

pub mod grain;
pub mod phenomena;
pub mod seen;

use crate::dataset::{FrameEntry, Manifest, Split};
use crate::frame::{Frame, FrameHints};
use crate::timing;
use aonet::metrics::{self, Comparison, Scores};
use aonet::net::Model;
use aonet::net::cpu::{Options, Session};
use aonet::search::{self, Classic};
use aonet::{AoImage, AoParams, GBuffer, Window};
use aonet_scene::error::{Error, Result};
use aonet_scene::staging::RadiusRule;
use phenomena::{Breakdown, RadiusClass};
use rayon::prelude::*;
use seen::Seen;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;

/// Training frames that [`mean_visibility`] reads. guess: enough for two digits.
const MEAN_FRAMES: usize = 100;

/// A method that computes AO from a G-buffer.
#[derive(Debug, Clone, Copy)]
pub enum Method<'a> {
    /// One value everywhere (1 on the background): the baseline of a table.
    Constant(f32),
    /// A network on the CPU.
    Network {
        /// The network.
        model: &'a Model,
        /// Threads, instructions and precision.
        options: Options,
    },
    /// A method without a network, on the CPU.
    Classic {
        /// The method and its parameters.
        method: &'a Classic,
        /// Threads to run it with, > 0.
        threads: usize,
    },
}

impl<'a> Method<'a> {
    /// A network in f32 on `threads` threads, > 0.
    pub fn network(model: &'a Model, threads: usize) -> Self {
        Self::Network { model, options: Options { threads, ..Options::default() } }
    }
}

/// A named method.
pub struct Contestant<'a> {
    /// Its name in the table.
    pub name: String,
    /// The method.
    pub method: Method<'a>,
}

/// Means over frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// Number of frames.
    pub frames: usize,
    /// SSIM, Gaussian window, full frame.
    pub ssim: f64,
    /// SSIM, flat 8x8 window, full frame.
    pub ssim_8x8: f64,
    /// Mean of the frames' PSNR (dB), full frame.
    pub psnr: f64,
    /// PSNR of the mean squared error over all pixels (dB).
    pub psnr_pooled: f64,
    /// SSIM over Gaussian windows centred on foreground; frames without any are left out, here and below.
    pub ssim_foreground: Option<f64>,
    /// The same with the flat 8x8 window.
    pub ssim_8x8_foreground: Option<f64>,
    /// Mean of the frames' PSNR over foreground pixels (dB).
    pub psnr_foreground: Option<f64>,
    /// PSNR of the mean squared error over all foreground pixels (dB).
    pub psnr_pooled_foreground: Option<f64>,
    /// Median time per frame (ms); none for a constant.
    pub ms: Option<f64>,
}

/// Rows by method, over all frames and by scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// Method and means, in the order given.
    pub overall: Vec<(String, Row)>,
    /// Rows for each scene.
    pub by_scene: BTreeMap<String, Vec<(String, Row)>>,
    /// Where each method errs, in the order given.
    pub breakdown: Vec<(String, Breakdown)>,
}

struct Measured {
    scene: String,
    comparison: Comparison,
    ms: Option<f64>,
}

/// Scores `contestants` on every frame of a split, or on the part of it that is shown. `progress` is called once a frame.
///
/// # Errors
/// When a frame is broken or has no reference, or the split is empty.
pub fn evaluate(
    manifest: &Manifest,
    seen: impl Into<Seen>,
    contestants: &[Contestant<'_>],
    progress: &dyn Fn(usize, usize),
) -> Result<Table> {
    let seen = seen.into();
    let entries: Vec<&FrameEntry> = manifest.frames(seen.split).collect();
    if entries.is_empty() {
        let expected = format!("frames of the split `{}`", seen.split.name());
        return Err(Error::file(manifest.dir(), expected, "none"));
    }
    let mut runners: Vec<Runner> = contestants.iter().map(|c| Runner::new(c.method)).collect();
    let mut breakdown = vec![Breakdown::default(); contestants.len()];
    let mut measured: Vec<Vec<Measured>> = contestants.iter().map(|_| Vec::new()).collect();
    for (done, entry) in entries.iter().enumerate() {
        let (gbuffer, params, reference) = read(manifest, entry)?;
        let gbuffer = seen.part(gbuffer)?;
        let (foreground, picture) = (gbuffer.foreground(), gbuffer.without_margin());
        let masks = phenomena::masks(&picture, params, &reference);
        let smooth = grain::smooth(&picture, params);
        let radius = RadiusClass::of(&picture, params);
        let outputs: Vec<(AoImage, Option<f64>)> =
            runners.iter_mut().map(|r| r.run(&gbuffer, params)).collect::<Result<_>>()?;
        // A comparison has one thread: images are compared side by side, when no method is being timed.
        let compare = |(image, _): &(AoImage, _)| metrics::compare(&reference, image, Some(&foreground));
        let comparisons: Vec<_> = outputs.par_iter().map(compare).collect();
        for (i, ((image, ms), comparison)) in outputs.iter().zip(comparisons).enumerate() {
            for (error, mask) in breakdown[i].phenomena.iter_mut().zip(&masks) {
                error.add(&reference, image, mask);
            }
            breakdown[i].grain.add(&reference, image, &smooth);
            if let Some(class) = radius {
                breakdown[i].radii[class as usize].add(&reference, image, &foreground);
            }
            let comparison = comparison.map_err(Error::in_file(&manifest.path(entry)))?;
            measured[i].push(Measured { scene: entry.scene.clone(), comparison, ms: *ms });
        }
        progress(done + 1, entries.len());
    }
    let names = contestants.iter().map(|c| c.name.clone());
    Ok(Table { breakdown: names.zip(breakdown).collect(), ..table(contestants, &measured) })
}

/// AO of a frame by a method, and the time it took (ms); the background is 1.
///
/// # Errors
/// When the frame's size is out of range.
pub fn run(method: &Method<'_>, gbuffer: &GBuffer, params: AoParams) -> Result<(AoImage, Option<f64>)> {
    Runner::new(*method).run(gbuffer, params)
}

/// A method, and the session of its last frame: frames of one size share it.
pub struct Runner<'a> {
    method: Method<'a>,
    session: Option<(Window, AnySession)>,
}

/// A session of a network or of a classic method.
enum AnySession {
    Network(Box<Session>),
    Classic(Box<search::Session>),
}

impl AnySession {
    fn run(&mut self, gbuffer: &GBuffer, params: AoParams, image: &mut AoImage) -> Result<()> {
        match self {
            Self::Network(session) => session.run(gbuffer, params, image)?,
            Self::Classic(session) => session.run(gbuffer, params, image)?,
        }
        Ok(())
    }
}

impl<'a> Runner<'a> {
    /// A method without a session.
    pub fn new(method: Method<'a>) -> Self {
        Self { method, session: None }
    }

    /// As [`run`]; opens a session only where the frame's window is another one than that of the last frame.
    ///
    /// # Errors
    /// As [`run`].
    pub fn run(&mut self, gbuffer: &GBuffer, params: AoParams) -> Result<(AoImage, Option<f64>)> {
        let window = gbuffer.window();
        let mut image = AoImage::open(window.size());
        if let Method::Constant(value) = self.method {
            let pixels = image.visibility_mut().iter_mut().zip(gbuffer.foreground());
            pixels.filter(|(_, shown)| *shown).for_each(|(v, _)| *v = value);
            return Ok((image, None));
        }
        let session = match &mut self.session {
            Some((of, session)) if *of == window => session,
            stale => {
                let mut session = open_session(&self.method, window)?;
                // The first run touches the session's pages; only later ones are timed.
                session.run(gbuffer, params, &mut image)?;
                &mut stale.insert((window, session)).1
            }
        };
        let start = Instant::now();
        session.run(gbuffer, params, &mut image)?;
        Ok((image, Some(start.elapsed().as_secs_f64() * 1e3)))
    }
}

/// A session of a method that is no constant.
fn open_session(method: &Method<'_>, window: Window) -> Result<AnySession> {
    Ok(match *method {
        Method::Constant(_) => unreachable!("a constant has no session"),
        Method::Classic { method, threads } => {
            let options = search::Options { threads, ..search::Options::default() };
            AnySession::Classic(Box::new(search::Session::new(method, window, options)?))
        }
        Method::Network { model, options } => {
            let session = Session::with_options(model, window, options)?;
            AnySession::Network(Box::new(session))
        }
    })
}

/// Mean visibility of the foreground of up to 100 training frames, spread over the dataset: the constant image for
/// networks whose files do not record it.
///
/// # Errors
/// When a frame is broken, or no training frame has foreground.
pub fn mean_visibility(manifest: &Manifest) -> Result<f32> {
    let train: Vec<&FrameEntry> = manifest.frames(Split::Train).collect();
    let count = train.len().min(MEAN_FRAMES);
    let (mut sum, mut pixels) = (0.0, 0u64);
    for k in 0..count {
        let (gbuffer, _, ao) = read(manifest, train[k * train.len() / count])?;
        for (v, _) in ao.visibility().iter().zip(gbuffer.foreground()).filter(|(_, shown)| *shown) {
            sum += f64::from(*v);
            pixels += 1;
        }
    }
    if pixels == 0 {
        return Err(Error::file(manifest.dir(), "training frames to take the mean visibility of", "none"));
    }
    Ok((sum / pixels as f64) as f32)
}

/// The projected radii that `model` was trained with, as shares of the image's height at the median depth; `None` if its radius is
/// fixed, or its file does not say.
pub fn radius_range(model: &Model) -> Option<std::ops::RangeInclusive<f32>> {
    let RadiusRule::ImageFraction { min, max } = RadiusRule::ANY else { return None };
    let any = format!("{:?}", RadiusRule::ANY);
    let sees = model.config().features.sees_radius();
    (sees && model.facts().radius.split("; ").any(|trained| trained == any)).then_some(min..=max)
}

/// Whether `model` can be scored on the frames: a network that does not see the radius needs frames whose radii were
/// chosen as in its training.
pub fn radius_fits(model: &Model, manifest: &Manifest) -> bool {
    let rule = format!("{:?}", manifest.plan.recipe.radius);
    model.config().features.sees_radius() || model.facts().radius.split("; ").any(|trained| trained == rule)
}

/// G-buffer, radius and reference AO of a frame.
///
/// # Errors
/// Names the file when it is broken or has no reference.
pub fn read(manifest: &Manifest, entry: &FrameEntry) -> Result<(GBuffer<'static>, AoParams, AoImage)> {
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
    Table { overall: rows(&|_| true), by_scene: by_scene.collect(), breakdown: Vec::new() }
}

fn row(results: &[&Measured]) -> Row {
    let full: Vec<Scores> = results.iter().map(|m| m.comparison.full).collect();
    let inside: Vec<Scores> = results.iter().filter_map(|m| m.comparison.foreground).collect();
    let some = |value: f64| (!inside.is_empty()).then_some(value);
    let mut times: Vec<f64> = results.iter().filter_map(|m| m.ms).collect();
    Row {
        frames: results.len(),
        ssim: mean(&full, |s| s.ssim),
        ssim_8x8: mean(&full, |s| s.ssim_8x8),
        psnr: mean(&full, |s| finite_psnr(s.psnr)),
        psnr_pooled: pooled(&full),
        ssim_foreground: some(mean(&inside, |s| s.ssim)),
        ssim_8x8_foreground: some(mean(&inside, |s| s.ssim_8x8)),
        psnr_foreground: some(mean(&inside, |s| finite_psnr(s.psnr))),
        psnr_pooled_foreground: some(pooled(&inside)),
        ms: (!times.is_empty()).then(|| timing::median(&mut times)),
    }
}

fn mean(scores: &[Scores], value: impl Fn(&Scores) -> f64) -> f64 {
    scores.iter().map(value).sum::<f64>() / scores.len() as f64
}

fn pooled(scores: &[Scores]) -> f64 {
    let pixels: f64 = scores.iter().map(|s| s.pixels as f64).sum();
    finite_psnr(metrics::psnr(scores.iter().map(|s| s.mse * s.pixels as f64).sum::<f64>() / pixels))
}

/// Limit of a PSNR in a mean, because identical images have infinite PSNR. 100 dB is below the rounding of f32.
fn finite_psnr(psnr: f64) -> f64 {
    psnr.min(100.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Counts, tiny};
    use aonet::internals::naive;
    use aonet::{Camera, Projection, Size};
    use aonet_scene::staging::SceneSplit;
    use std::path::Path;

    fn gbuffer() -> GBuffer<'static> {
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::new(projection, Size::px(16, 16)).unwrap();
        let depth = (0..256).map(|i| if i < 64 { f32::INFINITY } else { 1.0 }).collect::<Vec<_>>();
        GBuffer::new(camera, depth, vec![[0.0, 0.0, 1.0]; 256]).unwrap()
    }

    #[test]
    fn a_constant_leaves_the_background_open() {
        let (image, ms) = run(&Method::Constant(0.25), &gbuffer(), AoParams::new(1.0).unwrap()).unwrap();
        assert_eq!((image.visibility()[63], image.visibility()[64], ms), (1.0, 0.25, None));
    }

    #[test]
    fn rows_pool_and_average_as_defined() {
        let reference = AoImage::new(Size::px(16, 16), vec![0.5; 256]).unwrap();
        let measured = |value: f32| {
            let image = AoImage::new(Size::px(16, 16), vec![value; 256]).unwrap();
            let comparison = metrics::compare(&reference, &image, Some(&[true; 256])).unwrap();
            Measured { scene: "s".into(), comparison, ms: Some(f64::from(value)) }
        };
        // Errors 0.1 and 0.01: 20 and 40 dB; pooled mean square (0.01 + 0.0001) / 2.
        let (a, b) = (measured(0.6), measured(0.51));
        let row = row(&[&a, &b]);
        assert!((row.psnr - 30.0).abs() < 1e-3, "{row:?}");
        assert!((row.psnr_pooled + 10.0 * (0.0101f64 / 2.0).log10()).abs() < 1e-3, "{row:?}");
        assert_eq!((row.frames, row.ms.map(|t| t as f32)), (2, Some(0.555)));
        assert!(row.psnr_foreground.is_some_and(|p| (p - row.psnr).abs() < 1e-9), "{row:?}");
        assert!(row.psnr_pooled_foreground.is_some_and(|p| (p - row.psnr_pooled).abs() < 1e-9), "{row:?}");
        let mut sky = measured(0.5);
        sky.comparison.foreground = None;
        let row = super::row(&[&sky]);
        assert_eq!(
            (row.psnr, row.psnr_pooled, row.ssim_foreground, row.psnr_pooled_foreground),
            (100.0, 100.0, None, None)
        );
    }

    fn dataset(dir: &Path) -> Manifest {
        let frames = Counts { train: 1, val: 0, val_seen: 0, test: 2 };
        let splits = [SceneSplit::Train, SceneSplit::Test];
        tiny::make(dir, tiny::params(Size::px(48, 27), 16, frames), &splits)
    }

    #[test]
    fn a_dataset_is_scored_as_its_frames_are() {
        let dir = tempfile::tempdir().unwrap();
        let manifest = dataset(dir.path());
        let model = Model::from_bytes(aonet::net::shipped::BALANCED).unwrap();
        let constant = mean_visibility(&manifest).unwrap();
        assert!((0.05..1.0).contains(&constant), "{constant}");
        let contestant = |method| Contestant { name: "c".into(), method };
        let network = Method::network(&model, 2);
        let contestants = [contestant(Method::Constant(constant)), contestant(network)];
        let table = evaluate(&manifest, Split::Test, &contestants, &|_, _| ()).unwrap();
        assert_eq!(table.by_scene["clutter_pile_2"], table.overall);

        let of_frame = |entry: &FrameEntry| {
            let (gbuffer, params, reference) = read(&manifest, entry).unwrap();
            let ao = naive::run(&model, &gbuffer, params).unwrap();
            metrics::compare(&reference, &ao, None).unwrap().full.ssim
        };
        let expected = manifest.frames(Split::Test).map(of_frame).sum::<f64>() / 2.0;
        let (flat, found) = (&table.overall[0].1, &table.overall[1].1);
        // The oracle and the runtime agree to 1e-4 in visibility.
        assert!((found.ssim - expected).abs() < 1e-3, "{found:?} {expected}");
        assert!((flat.ssim - expected).abs() > 1e-2 && flat.ms.is_none() && found.ms.is_some(), "{flat:?}");
        assert!(evaluate(&manifest, Split::Val, &contestants, &|_, _| ()).is_err());
    }
}
