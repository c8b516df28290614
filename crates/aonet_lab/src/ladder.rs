//! What kinds of frames know, and how much of it searches find: exact rays beside the shares of light that a search reports.

use crate::dataset::{FrameEntry, Manifest};
use crate::eval;
use crate::marching;
use aonet::internals::shares::SHARES;
use aonet::search::{Classic, Options, Session, Share};
use aonet_scene::error::{Error, Result};
use aonet_scene::gbuffer;
use aonet_scene::knowledge::{Knowledge, knowledge};
use aonet_scene::reference::Sampling;
use aonet_scene::trace::Tracer;
use aonet_scene::view::Surround;
use serde::Serialize;
use std::path::Path;

/// What is measured on every frame.
#[derive(Debug, Clone)]
pub struct Ladder {
    /// Kinds of frames.
    pub kinds: Vec<Surround>,
    /// What finds shares of light, by name, each with the kind of frame that it gets.
    pub searches: Vec<(String, Finder, Surround)>,
    /// Frames, evenly spread over the dataset; all if absent.
    pub frames: Option<usize>,
    /// Every so many pixels of every so many rows are compared.
    pub every: usize,
    /// Rays a pixel.
    pub sampling: Sampling,
}

/// How shares of light are found.
#[derive(Debug, Clone, Copy)]
pub enum Finder {
    /// A method that reports shares.
    Search(Classic),
    /// So many rays a pixel, marched through the frame.
    Rays(u32),
}

/// Means over frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rungs {
    /// Number of frames.
    pub frames: usize,
    /// For each kind of frame, the mean PSNR (dB) of the visibility that takes everything unknown as open.
    pub psnr: Vec<f64>,
    /// For each search.
    pub searches: Vec<Finding>,
}

/// A search's share of light that is hit, beside the exact one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Finding {
    /// Mean over the frames of the correlation over pixels.
    pub correlation: f64,
    /// Mean that the search finds.
    pub hit: f64,
    /// Mean of the exact shares.
    pub exact: f64,
    /// Mean PSNR (dB) of what the shares explain of the dataset's AO: that of the linear combination that fits each frame best. The rays
    /// of the ladder would bring their noise into it.
    pub explained: f64,
    /// The same with the exact share of light that is hit in place of the search's, beside the AO of the very rays that found it: the noise
    /// that they share cancels, so that the number stands for many rays.
    pub explained_by_exact: f64,
    /// Mean share of the squared error of the first of the two that lies in the worst hundredth of a frame's pixels.
    pub worst: f64,
}

impl Ladder {
    /// Measures frames of a dataset whose scenes are under `scenes`; `progress` is called once a frame with the number of frames.
    ///
    /// # Errors
    /// When a scene or a view cannot be read, a search reports no shares, or the dataset has no frame of a scene.
    pub fn climb(&self, manifest: &Manifest, scenes: &Path, progress: &dyn Fn(usize)) -> Result<Rungs> {
        let mut rungs = Rungs {
            frames: 0,
            psnr: vec![0.0; self.kinds.len()],
            searches: vec![Finding::default(); self.searches.len()],
        };
        let all = manifest.frames.len();
        let count = self.frames.unwrap_or(all).min(all);
        let chosen: Vec<_> = (0..count).map(|i| &manifest.frames[i * all / count]).collect();
        for spec in &manifest.plan.located(scenes).scenes {
            let frames: Vec<_> = chosen.iter().filter(|entry| entry.scene == spec.name).collect();
            if frames.is_empty() {
                continue;
            }
            let (scene, _) = spec.load()?;
            let tracer = Tracer::new(scene);
            for entry in frames {
                self.frame(&tracer, (manifest, entry), &mut rungs)?;
                progress(count);
            }
        }
        if rungs.frames == 0 {
            return Err(Error::request("dataset", "frames of scenes that it lists", "none"));
        }
        let share = 1.0 / rungs.frames as f64;
        rungs.psnr.iter_mut().for_each(|sum| *sum *= share);
        for finding in &mut rungs.searches {
            *finding = Finding {
                correlation: finding.correlation * share,
                hit: finding.hit * share,
                exact: finding.exact * share,
                explained: finding.explained * share,
                explained_by_exact: finding.explained_by_exact * share,
                worst: finding.worst * share,
            };
        }
        Ok(rungs)
    }

    fn frame(
        &self,
        tracer: &Tracer,
        (manifest, entry): (&Manifest, &FrameEntry),
        rungs: &mut Rungs,
    ) -> Result<()> {
        let all: Vec<_> =
            self.kinds.iter().copied().chain(self.searches.iter().map(|(.., kind)| *kind)).collect();
        let known = knowledge(tracer, &entry.view, &all, (self.sampling, self.every))?;
        for (kind, sum) in rungs.psnr.iter_mut().enumerate() {
            *sum += known.psnr(kind);
        }
        let (.., ao) = eval::read(manifest, entry)?;
        let truth: Vec<f32> = known.pixels.iter().map(|i| ao.visibility()[*i]).collect();
        for (i, (search, finding)) in self.searches.iter().zip(&mut rungs.searches).enumerate() {
            let mut found = found_by(search, tracer, entry, &known)?;
            let exact = &known.hit[self.kinds.len() + i];
            finding.correlation += correlation(&found[0], exact);
            finding.hit += mean(&found[0]);
            finding.exact += mean(exact);
            let errors = unexplained(&found, &truth);
            finding.explained += psnr(&errors);
            finding.worst += worst(errors);
            replace_hits(&mut found, exact);
            finding.explained_by_exact += psnr(&unexplained(&found, &known.visibility));
        }
        rungs.frames += 1;
        Ok(())
    }
}

/// The shares of light that a search or marched rays find, all but the open one, at the pixels that are known.
fn found_by(
    (_, finder, kind): &(String, Finder, Surround),
    tracer: &Tracer,
    entry: &FrameEntry,
    known: &Knowledge,
) -> Result<Found> {
    let view = entry.view.clone().surrounded(*kind);
    let gbuffer = gbuffer::render(tracer, &view)?.gbuffer;
    let method = match finder {
        Finder::Search(method) => method,
        Finder::Rays(rays) => return Ok(marching::shares(&gbuffer, view.radius, &known.pixels, *rays)),
    };
    let mut session = Session::new(method, gbuffer.window(), Options::default())?;
    let shares = session.shares(&gbuffer, view.params()?)?;
    let [_, found @ ..] = Share::ALL;
    Ok(found.map(|share| {
        let plane = shares.plane(share);
        known.pixels.iter().map(|i| plane[*i]).collect()
    }))
}

/// All shares of the light of pixels but the open one: hit first, then hidden by more and more, off last.
type Found = [Vec<f32>; SHARES];

/// Puts the exact share of light that is hit in place of the search's; the others shrink or grow in proportion, so that the open share stays.
fn replace_hits(found: &mut Found, exact: &[f32]) {
    let [hit, others @ ..] = found;
    for (i, exact) in exact.iter().enumerate() {
        let rest: f32 = others.iter().map(|plane| plane[i]).sum();
        let scale = (1.0 - (exact - hit[i]) / rest.max(1e-6)).max(0.0);
        others.iter_mut().for_each(|plane| plane[i] *= scale);
        hit[i] = *exact;
    }
}

/// Squared errors of the visibility that shares of light explain: the best linear combination, which is fitted to this very frame. So it
/// is what they could be worth to an estimator that knows the frame, and not what they are worth to one that does not.
fn unexplained(found: &Found, visibility: &[f32]) -> Vec<f64> {
    // The normal equations of least squares; the last column is the right-hand side.
    let mut rows = [[0.0; SHARES + 1]; SHARES];
    let values = |i: usize| -> [f64; SHARES + 1] {
        std::array::from_fn(|c| f64::from(found.get(c).map_or(1.0 - visibility[i], |plane| plane[i])))
    };
    for i in 0..visibility.len() {
        let values = values(i);
        rows.iter_mut().zip(values).for_each(|(row, by)| {
            row.iter_mut().zip(values).for_each(|(sum, value)| *sum += by * value);
        });
    }
    // Shares that are zero everywhere have no weight.
    (0..SHARES).for_each(|c| rows[c][c] += 1e-9);
    // Gauss and Jordan. The matrix is positive definite, so that no row has to be exchanged.
    for pivot in 0..SHARES {
        let inverse = 1.0 / rows[pivot][pivot];
        let pivot_row = rows[pivot].map(|value| value * inverse);
        for (r, row) in rows.iter_mut().enumerate() {
            let by = row[pivot];
            row.iter_mut().zip(pivot_row).for_each(|(value, p)| *value -= by * p);
            if r == pivot {
                *row = pivot_row;
            }
        }
    }
    let error = |i: usize| {
        let values = values(i);
        let found: f64 = rows.iter().zip(values).map(|(row, share)| row[SHARES] * share).sum();
        (found - values[SHARES]).powi(2)
    };
    (0..visibility.len()).map(error).collect()
}

/// PSNR (dB) of squared errors.
fn psnr(errors: &[f64]) -> f64 {
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    -10.0 * mean.max(1e-12).log10()
}

/// Share of the sum in the largest hundredth of the values, rounded up.
fn worst(mut errors: Vec<f64>) -> f64 {
    errors.sort_unstable_by(|a, b| b.total_cmp(a));
    let sum = |errors: &[f64]| errors.iter().sum::<f64>();
    sum(&errors[..errors.len().div_ceil(100)]) / sum(&errors).max(1e-12)
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64
}

/// Pearson's correlation; 0 where one side does not vary.
fn correlation(a: &[f32], b: &[f32]) -> f64 {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (f64::from(*a) - mean_a, f64::from(*b) - mean_b);
        ab += a * b;
        aa += a * a;
        bb += b * b;
    }
    if aa * bb > 0.0 { ab / (aa * bb).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Counts, tiny};
    use aonet::Size;
    use aonet_scene::staging::SceneSplit;

    fn ladder(searches: Vec<(String, Finder, Surround)>) -> Ladder {
        let separations = [None, Some(0.1)];
        Ladder {
            kinds: separations.map(|separation| Surround { margin: 0.1, separation }).into(),
            searches,
            frames: None,
            every: 2,
            sampling: Sampling { spp: 64, seed: 1 },
        }
    }

    #[test]
    fn more_layers_know_more_and_arcs_find_some_of_it() {
        let dir = tempfile::tempdir().unwrap();
        let counts = Counts { train: 2, val: 0, val_seen: 0, test: 0 };
        let params = tiny::params(Size::px(48, 32), 256, counts);
        let manifest = tiny::make(dir.path(), params, &[SceneSplit::Train]);
        let of = |name: &str| {
            let one_layer = Surround { margin: 0.0, separation: None };
            vec![(name.to_owned(), Finder::Search(Classic::named(name).unwrap()), one_layer)]
        };
        let counted = std::cell::Cell::new(0);
        let count = |frames| counted.set(counted.get() + 10 + frames);
        let rungs = ladder(of("arcs")).climb(&manifest, Path::new(""), &count).unwrap();
        assert_eq!((rungs.frames, counted.get()), (2, 24));
        let [one, two] = rungs.psnr[..] else { panic!("{rungs:?}") };
        assert!(one > 15.0 && two > one + 1.0, "{rungs:?}");
        let found = rungs.searches[0];
        assert!(found.correlation > 0.7 && (found.hit / found.exact - 1.0).abs() < 0.5, "{found:?}");
        assert!(found.explained > 15.0 && (0.01..1.0).contains(&found.worst), "{found:?}");
        let rays = vec![("rays".to_owned(), Finder::Rays(64), Surround { margin: 0.0, separation: None })];
        let marched = ladder(rays).climb(&manifest, Path::new(""), &count).unwrap().searches[0];
        assert!(marched.correlation > 0.8 && (marched.hit / marched.exact - 1.0).abs() < 0.3, "{marched:?}");
        assert_eq!(marched.exact, found.exact, "the same rays are the measure");
        let error = ladder(of("gtao")).climb(&manifest, Path::new(""), &count).unwrap_err().to_string();
        assert!(error.contains("reports shares"), "{error}");
    }

    /// Five shares of 40 pixels that vary independently of each other.
    fn varied() -> Found {
        std::array::from_fn(|c| (0..40).map(|i| ((i * (2 * c + 3) + c) % 11) as f32 / 55.0).collect())
    }

    #[test]
    fn a_linear_combination_is_explained_and_anything_else_is_not() {
        let found = varied();
        let mixed = |i: usize| 1.0 - 0.9 * found[0][i] - 0.3 * found[2][i] - 0.6 * found[4][i];
        let visibility: Vec<f32> = (0..40).map(mixed).collect();
        let explained = |found: &Found, visibility: &[f32]| psnr(&unexplained(found, visibility));
        assert!(explained(&found, &visibility) > 90.0);
        // An error of 0.1 or -0.1 with a pattern that no share has; least squares may explain a part of it.
        let noisy: Vec<f32> =
            visibility.iter().enumerate().map(|(i, v)| v + if i % 2 == 0 { 0.1 } else { -0.1 }).collect();
        let psnr = explained(&found, &noisy);
        assert!((20.0..21.5).contains(&psnr), "{psnr}");
        let none: Found = std::array::from_fn(|_| vec![0.0; 40]);
        assert!(
            (explained(&none, &[0.9; 40]) - 20.0).abs() < 1e-3,
            "an occlusion of 0.1 that nothing explains"
        );
    }

    #[test]
    fn the_worst_hundredth_is_one_pixel_of_a_hundred() {
        let errors: Vec<_> = (0..100).map(|i| if i == 42 { 99.0 } else { 1.0 }).collect();
        assert_eq!(worst(errors), 0.5);
        assert_eq!(worst(vec![0.0; 5]), 0.0);
        assert_eq!(worst(vec![1.0, 3.0]), 0.75, "of a few pixels it is one");
    }

    #[test]
    fn exact_hits_leave_the_open_share_as_it_is() {
        let mut found = varied();
        let open = |found: &Found, i: usize| 1.0 - found.iter().map(|plane| plane[i]).sum::<f32>();
        let before: Vec<_> = (0..40).map(|i| open(&found, i)).collect();
        let exact: Vec<f32> = (0..40).map(|i| found[0][i] + 0.01 * (i % 3) as f32 - 0.01).collect();
        replace_hits(&mut found, &exact);
        assert_eq!(found[0], exact);
        for (i, before) in before.iter().enumerate() {
            let hidden: f32 = found[1..].iter().map(|plane| plane[i]).sum();
            if hidden > 0.0 {
                assert!((open(&found, i) - before).abs() < 1e-5, "{i}");
            }
        }
    }

    #[test]
    fn correlations_have_the_closed_form() {
        assert!((correlation(&[0.0, 1.0, 2.0], &[1.0, 3.0, 5.0]) - 1.0).abs() < 1e-12);
        assert!((correlation(&[0.0, 1.0, 2.0], &[5.0, 3.0, 1.0]) + 1.0).abs() < 1e-12);
        // Differences from the mean: (-1, 0, 1) and (-1, 1, 0).
        assert!((correlation(&[0.0, 1.0, 2.0], &[0.0, 2.0, 1.0]) - 0.5).abs() < 1e-12);
        assert_eq!(correlation(&[1.0, 1.0], &[0.0, 2.0]), 0.0);
    }
}
