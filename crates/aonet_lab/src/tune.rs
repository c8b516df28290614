//! A search over a classic method's own parameters on training frames, with the loss that the networks are trained with.

use crate::dataset::{FrameEntry, Manifest, Split};
use crate::eval;
use aonet::metrics::{self, Window};
use aonet::search::Classic;
use aonet::{AoImage, AoParams, GBuffer};
use aonet_scene::error::{Error, Result};
use aonet_scene::random::Random;
use rayon::prelude::*;

/// Parameters that determine the cost; they keep the given values.
const COST: [&str; 7] =
    ["slices", "steps", "samples", "depth_levels", "depth_offset", "between", "denoise_keep"];

/// Weights of DSSIM and L1, as in the networks' training configurations.
const LOSS: (f64, f64) = (0.94, 0.5);

/// Budget of a search.
#[derive(Debug, Clone, Copy)]
pub struct Search {
    /// Training frames, spread evenly over the split.
    pub frames: usize,
    /// Parameter sets to try: the given one first, a third at random, the rest around the best so far.
    pub trials: usize,
    /// Seed of the search; equal seeds try equal parameters.
    pub seed: u64,
}

/// Result of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuned {
    /// The method with the best parameters.
    pub method: Classic,
    /// Its mean loss over the frames.
    pub loss: f64,
    /// Mean loss of the given method.
    pub loss_before: f64,
}

/// Searches for parameters of `method`. `progress` is called with the trials done and the least loss.
///
/// # Errors
/// When there are no training frames, one is broken, or `search` has an empty budget.
pub fn tune(
    manifest: &Manifest,
    method: Classic,
    search: Search,
    progress: &(dyn Fn(usize, f64) + Sync),
) -> Result<Tuned> {
    let frames = load(manifest, search.frames)?;
    let mut random = Random::new(search.seed);
    let loss_before = loss(&method, &frames)?;
    let mut best = Tuned { method, loss: loss_before, loss_before };
    for trial in 1..search.trials {
        progress(trial, best.loss);
        let anew = search.trials.div_ceil(3);
        let candidate = match trial.checked_sub(anew) {
            None => drawn(method, &mut random)?,
            Some(after) => {
                let left = 1.0 - after as f64 / (search.trials - anew) as f64;
                nearby(best.method, &mut random, 0.02 + 0.3 * left)?
            }
        };
        let loss = loss(&candidate, &frames)?;
        if loss < best.loss {
            best = Tuned { method: candidate, loss, ..best }
        }
    }
    Ok(best)
}

type TrainingFrame = (GBuffer<'static>, AoParams, AoImage);

fn load(manifest: &Manifest, count: usize) -> Result<Vec<TrainingFrame>> {
    let train: Vec<&FrameEntry> = manifest.frames(Split::Train).collect();
    if train.is_empty() || count == 0 {
        let found = format!("{count} of {}", train.len());
        return Err(Error::file(manifest.dir(), "training frames to tune on", found));
    }
    let count = count.min(train.len());
    (0..count).map(|k| eval::read(manifest, train[k * train.len() / count])).collect()
}

/// Mean of the frames' losses. Frames run in parallel; the sum runs in their order.
fn loss(method: &Classic, frames: &[TrainingFrame]) -> Result<f64> {
    let one = |(gbuffer, params, reference): &TrainingFrame| -> Result<f64> {
        let image = method.run(gbuffer, *params)?;
        let ssim = metrics::ssim(reference, &image, Window::Gaussian11)?;
        let pairs = image.visibility().iter().zip(reference.visibility());
        let l1 = pairs.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / image.visibility().len() as f64;
        Ok(LOSS.0 * 0.5 * (1.0 - ssim) + LOSS.1 * l1)
    };
    let losses: Vec<f64> = frames.par_iter().map(one).collect::<Result<_>>()?;
    Ok(losses.iter().sum::<f64>() / losses.len() as f64)
}

/// Every parameter that is searched, drawn from its range.
fn drawn(mut method: Classic, random: &mut Random) -> Result<Classic> {
    for parameter in searched(&method) {
        method.set(parameter.name, parameter.at(random.unit_f64()))?;
    }
    Ok(method)
}

/// Some parameters moved by about `reach` of their range.
fn nearby(mut method: Classic, random: &mut Random, reach: f64) -> Result<Classic> {
    let parameters = searched(&method);
    let share = (2.0 / parameters.len() as f64).max(0.25);
    let sure = (random.unit_f64() * parameters.len() as f64) as usize;
    for (i, parameter) in parameters.iter().enumerate() {
        // Two draws make a triangle about zero.
        let moves = random.unit_f64() < share || i == sure;
        let by = reach * (random.unit_f64() - random.unit_f64());
        if moves {
            let by = if parameter.whole { by.signum() * by.abs().max(1.01 / parameter.span()) } else { by };
            method.set(parameter.name, parameter.at((parameter.place() + by).clamp(0.0, 1.0)))?;
        }
    }
    Ok(method)
}

/// A parameter on a scale from 0 to 1: logarithmic where the range spans more than a factor of ten.
struct Scale {
    name: &'static str,
    low: f64,
    high: f64,
    value: f64,
    whole: bool,
}

fn searched(method: &Classic) -> Vec<Scale> {
    let parameters = method.parameters().into_iter().filter(|k| !COST.contains(&k.name));
    let scale = |k: aonet::search::ParameterValue| Scale {
        name: k.name,
        low: k.low.into(),
        high: k.high.into(),
        value: k.value.into(),
        whole: k.whole,
    };
    parameters.map(scale).collect()
}

impl Scale {
    fn is_log(&self) -> bool {
        !self.whole && self.low > 0.0 && self.high / self.low > 10.0
    }

    fn span(&self) -> f64 {
        self.high - self.low
    }

    /// The value at a position in [0, 1].
    fn at(&self, place: f64) -> f32 {
        let value = match (self.whole, self.is_log()) {
            (true, _) => (self.low + place * self.span()).round(),
            (false, true) => self.low * (self.high / self.low).powf(place),
            (false, false) => self.low + place * self.span(),
        };
        (value as f32).clamp(self.low as f32, self.high as f32)
    }

    /// The position of the current value.
    fn place(&self) -> f64 {
        match self.is_log() {
            true => (self.value / self.low).ln() / (self.high / self.low).ln(),
            false => (self.value - self.low) / self.span(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Counts, tiny};
    use aonet::Size;
    use aonet_scene::staging::SceneSplit;

    #[test]
    fn scales_go_there_and_back() {
        let method = Classic::named("vbao").unwrap();
        for parameter in searched(&method) {
            assert!(
                (f64::from(parameter.at(parameter.place())) - parameter.value).abs() < 1e-4 * parameter.high,
                "{}",
                parameter.name
            );
            assert_eq!((parameter.at(0.0), parameter.at(1.0)), (parameter.low as f32, parameter.high as f32));
        }
        assert!(searched(&method).iter().all(|k| k.name != "slices"));
    }

    #[test]
    fn a_search_betters_the_loss_on_training_frames_and_repeats() {
        let dir = tempfile::tempdir().unwrap();
        let frames = Counts { train: 2, val: 0, val_seen: 0, test: 1 };
        let splits = [SceneSplit::Train, SceneSplit::Test];
        let manifest = tiny::make(dir.path(), tiny::params(Size::px(64, 36), 32, frames), &splits);
        let method = Classic::named("gtao").unwrap();
        let search = Search { frames: 2, trials: 24, seed: 5 };
        let tuned = tune(&manifest, method, search, &|_, _| ()).unwrap();
        assert!(tuned.loss < 0.98 * tuned.loss_before, "{tuned:?}");
        assert_eq!(tune(&manifest, method, search, &|_, _| ()).unwrap(), tuned);
        assert_ne!(tune(&manifest, method, Search { seed: 6, ..search }, &|_, _| ()).unwrap(), tuned);
        let only_cost = |m: &Classic| -> Vec<f32> {
            m.parameters().iter().filter(|k| COST.contains(&k.name)).map(|k| k.value).collect()
        };
        assert_eq!(only_cost(&tuned.method), only_cost(&method));
        assert!(tune(&manifest, method, Search { frames: 0, ..search }, &|_, _| ()).is_err());
    }
}
