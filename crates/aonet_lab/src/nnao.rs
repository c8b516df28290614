//! Training of NNAO's weights: pixels of training frames, mean squared error, Adam.
// Holden, Saito, Komura 2016, §3, without dropout: with this many pixels the network does not overfit.

use crate::adam::{Adam, cosine_decay};
use crate::dataset::{FrameEntry, Manifest, Split};
use crate::eval;
use aonet::internals::nnao::{INPUTS, NnaoTap, NnaoWeights, Spiral, taps};
use aonet::search::NnaoParams;
use aonet_scene::error::{Error, Result};
use aonet_scene::random::Random;
use rayon::prelude::*;

/// Length and data of a training.
#[derive(Debug, Clone, Copy)]
pub struct Training {
    /// Training frames, spread evenly over the split.
    pub frames: usize,
    /// Steps of Adam.
    pub steps: usize,
    /// Pixels a step.
    pub batch: usize,
    /// Equal seeds give equal weights.
    pub seed: u64,
}

/// Pixels kept of each frame. guess: enough to justify reading the frame.
const PIXELS_A_FRAME: usize = 2048;
/// Learning rate at the first step; it decays along a half cosine. guess
const RATE: f64 = 5e-3;

/// Share of a step in the running mean of the error: batches are noisy.
const SMOOTHING: f64 = 0.01;

/// The inputs of one pixel, and its occlusion.
struct Example {
    taps: Vec<NnaoTap>,
    occlusion: f32,
}

/// Trains on `manifest`. Returns the weights and the mean squared error of the last steps' pixels; `progress` is called
/// with the steps done and that error.
///
/// # Errors
/// When there are no training frames with geometry, or one is broken.
pub fn train(
    manifest: &Manifest,
    training: Training,
    progress: &(dyn Fn(usize, f64) + Sync),
) -> Result<(NnaoWeights, f64)> {
    let mut random = Random::new(training.seed);
    let examples = examples(manifest, training.frames, &mut random)?;
    let (mean, deviation) = standard(&examples);
    let mut values = NnaoWeights::start(&mut || random.unit_f64() as f32);
    let mut mean_error = 0.0;
    let mut moments = vec![[0.0; 2]; values.len()];
    for step in 0..training.steps {
        let weights = NnaoWeights::new(values.clone(), mean, deviation)?;
        let batch: Vec<&Example> =
            (0..training.batch.max(1)).map(|_| &examples[random.below(examples.len())]).collect();
        let (gradient, error) = gradient(&weights, &batch);
        let rate = cosine_decay(RATE, step as u64, training.steps as u64);
        let adam = Adam::at(step as u64 + 1);
        for ((value, [mean, square]), g) in values.iter_mut().zip(&mut moments).zip(gradient) {
            *value -= (rate * adam.change([mean, square], g.into())) as f32;
        }
        mean_error += (error - mean_error) * if step == 0 { 1.0 } else { SMOOTHING };
        progress(step + 1, mean_error);
    }
    Ok((NnaoWeights::new(values, mean, deviation)?, mean_error))
}

fn examples(manifest: &Manifest, count: usize, random: &mut Random) -> Result<Vec<Example>> {
    let train: Vec<&FrameEntry> = manifest.frames(Split::Train).collect();
    let count = count.min(train.len());
    let mut examples = Vec::new();
    for k in 0..count {
        let (gbuffer, params, reference) = eval::read(manifest, train[k * train.len() / count])?;
        let pixels: Vec<usize> = (0..gbuffer.depth().len()).filter(|i| gbuffer.is_foreground(*i)).collect();
        for _ in 0..PIXELS_A_FRAME.min(pixels.len()) {
            let i = pixels[random.below(pixels.len())];
            let spiral = Spiral { params: &NnaoParams::default(), rotation: random.unit_f64() as f32 };
            let taps = taps(&gbuffer, params, spiral, [i % gbuffer.width(), i / gbuffer.width()]);
            examples.push(Example { taps, occlusion: 1.0 - reference.visibility()[i] });
        }
    }
    match examples.is_empty() {
        true => Err(Error::file(manifest.dir(), "training frames with geometry", "none")),
        false => Ok(examples),
    }
}

/// Mean and standard deviation of every input, over the taps that count.
fn standard(examples: &[Example]) -> ([f32; INPUTS], [f32; INPUTS]) {
    let counted = || examples.iter().flat_map(|e| &e.taps).filter(|t| t.near > 0.0);
    let count = counted().count().max(1) as f64;
    let mean: [f64; INPUTS] =
        std::array::from_fn(|c| counted().map(|t| f64::from(t.inputs[c])).sum::<f64>() / count);
    let variance =
        |c: usize| counted().map(|t| (f64::from(t.inputs[c]) - mean[c]).powi(2)).sum::<f64>() / count;
    (mean.map(|m| m as f32), std::array::from_fn(|c| variance(c).sqrt().max(1e-6) as f32))
}

/// Mean gradient and error of a batch; parts of it run in parallel and are summed in order.
fn gradient(weights: &NnaoWeights, batch: &[&Example]) -> (Vec<f32>, f64) {
    const SHARE: usize = 256;
    let of_share = |share: &[&Example]| {
        let mut gradient = vec![0.0; weights.values().len()];
        let mut error = 0.0;
        for example in share {
            let slope = |y: f32| 2.0 * (y - example.occlusion) / batch.len() as f32;
            let y = weights.backward(&example.taps, slope, &mut gradient);
            error += f64::from((y - example.occlusion).powi(2));
        }
        (gradient, error)
    };
    let shares: Vec<_> = batch.par_chunks(SHARE).map(of_share).collect();
    let mut sum = vec![0.0; weights.values().len()];
    for (gradient, _) in &shares {
        sum.iter_mut().zip(gradient).for_each(|(s, g)| *s += g);
    }
    (sum, shares.iter().map(|(_, e)| e).sum::<f64>() / batch.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::internals::nnao::COUNT;

    fn example(random: &mut Random) -> Example {
        let mut unit = || 2.0 * random.unit_f64() as f32 - 1.0;
        let mut tap = || NnaoTap {
            place: [0.7 * unit(), 0.7 * unit()],
            near: unit().abs(),
            inputs: std::array::from_fn(|_| unit()),
        };
        let taps = (0..16).map(|_| tap()).collect();
        Example { taps, occlusion: random.unit_f64() as f32 }
    }

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        let mut random = Random::new(3);
        let examples: Vec<Example> = (0..4).map(|_| example(&mut random)).collect();
        let batch: Vec<&Example> = examples.iter().collect();
        let values = NnaoWeights::start(&mut || random.unit_f64() as f32);
        let at = |values: Vec<f32>| NnaoWeights::new(values, [0.1; INPUTS], [0.5; INPUTS]).unwrap();
        let (found, error) = gradient(&at(values.clone()), &batch);
        let plain = |w: &NnaoWeights| {
            batch.iter().map(|e| f64::from((w.occlusion(&e.taps) - e.occlusion).powi(2))).sum::<f64>() / 4.0
        };
        assert!((plain(&at(values.clone())) - error).abs() < 1e-6);
        let mut checked = 0;
        for k in (0..COUNT - 45).step_by(211).chain(COUNT - 45..COUNT) {
            let moved = |by: f32| {
                let mut values = values.clone();
                values[k] += by;
                plain(&at(values))
            };
            let expected = (moved(1e-3) - moved(-1e-3)) / 2e-3;
            assert!(
                (f64::from(found[k]) - expected).abs() < 2e-3 * (1.0 + expected.abs()),
                "{k}: {} {expected}",
                found[k]
            );
            checked += usize::from(expected.abs() > 1e-3);
        }
        assert!(checked > 20, "{checked}");
    }
}
