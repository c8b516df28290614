//! How much each input channel changes a network's output: AO-Net §3.1, Eq. 1 and Fig. 2.
//!
//! A channel gets Gaussian noise of a tenth of its standard deviation; its sensitivity is the mean **absolute** change of
//! the output before clamping, over that tenth. (Eq. 1 has no absolute value: signed changes cancel to first order.)
//! Standard deviations are over the foreground of all test frames; the noise is added to the foreground of crops from the
//! middle of some of them, and the change is measured there.

use crate::dataset::{FrameEntry, Manifest, Split};
use crate::eval;
use crate::network_inputs::network_inputs;
use aonet::internals::naive::{self, Inputs, Planes};
use aonet::net::{Features, Model, SearchConfig};
use aonet::{AoParams, GBuffer};
use aonet_scene::error::{Error, Result};
use aonet_scene::random::Random;
use rayon::prelude::*;
use serde::Serialize;

/// Noise, in standard deviations of the channel. Eq. 1.
const NOISE: f64 = 0.1;

/// Side of a crop (px), rounded up to the network's alignment. guess: most of the receptive field of a U-Net of four levels.
const CROP: usize = 96;

/// Multiply-accumulates to spend on a network, and bounds of the resulting number of crops. The oracle computes about
/// 3e8 per second and core; five crops are 46 thousand pixels, which gives a mean to half a per cent.
const MAC_BUDGET: f64 = 2e9;
const CROPS: std::ops::RangeInclusive<usize> = 2..=8;

/// Seed of the noise.
const SEED: u64 = 1;

/// One input channel of a network.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelSensitivity {
    /// `normal x`, `normal y`, `normal z`, then the configuration's names of the other channels.
    pub name: String,
    /// Standard deviation over the foreground of the test frames, in the channel's unit.
    pub sigma: f64,
    /// S_i of Eq. 1: visibility per unit of the channel.
    pub absolute: f64,
    /// S_i over the sum of all channels: a share in [0, 1].
    pub relative: f64,
}

/// Sensitivities of one network.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sensitivity {
    /// The input channels in order.
    pub channels: Vec<ChannelSensitivity>,
    /// Crops that the change was measured on.
    pub crops: usize,
    /// Foreground pixels in them.
    pub pixels: usize,
}

/// Sensitivities of every model on the test frames of a dataset. `progress` is called with the frames and models
/// done, and their number. Equal inputs give equal results.
///
/// # Errors
/// When a frame is broken or there is no test frame with foreground in the middle.
pub fn sensitivity(
    models: &[&Model],
    manifest: &Manifest,
    progress: &dyn Fn(usize, usize),
) -> Result<Vec<Sensitivity>> {
    let entries: Vec<&FrameEntry> = manifest.frames(Split::Test).collect();
    let total = entries.len() + models.len();
    let mut kinds: Vec<(Kind, Moments)> = Vec::new();
    for model in models {
        let kind = kind(model);
        if !kinds.iter().any(|(k, _)| *k == kind) {
            kinds.push((kind, Moments::default()));
        }
    }
    let mut usable = Vec::new();
    for (done, entry) in entries.iter().enumerate() {
        let (gbuffer, params, _) = eval::read(manifest, entry)?;
        for (kind_of, moments) in &mut kinds {
            let model = models.iter().find(|model| kind(model) == *kind_of).expect("a model of each kind");
            moments.add(&network_inputs(model, &gbuffer, params)?.features, &gbuffer);
        }
        let middle = Crop::of(&gbuffer, 1, 1);
        if 2 * middle.counted(&gbuffer).iter().filter(|c| **c).count() > middle.width * middle.height {
            usable.push(*entry);
        }
        progress(done + 1, total);
    }
    if usable.is_empty() {
        return Err(Error::file(manifest.dir(), "test frames with foreground in the middle", "none"));
    }
    let mut results = Vec::new();
    for (done, model) in models.iter().enumerate() {
        let moments = kinds.iter().find(|(k, _)| *k == kind(model)).map(|(_, m)| m);
        let sigmas = moments.expect("moments of each kind").sigmas();
        results.push(of_model(model, &sigmas, &samples(model, manifest, &usable)?));
        progress(entries.len() + done + 1, total);
    }
    Ok(results)
}

/// What decides about the values of a network's features: the channels, and the search that one of them shows.
type Kind = (Features, Option<SearchConfig>);

fn kind(model: &Model) -> Kind {
    let config = model.config();
    (config.features.clone(), config.search.filter(|_| config.features.show_a_search()))
}

/// What the channels of `features` are called.
pub fn channel_names(features: &Features) -> Vec<&'static str> {
    features.channels().iter().map(|channel| channel.name()).collect()
}

/// Sums of the foreground's features, by channel: first and second power.
#[derive(Default)]
struct Moments {
    pixels: f64,
    sums: Vec<[f64; 2]>,
}

impl Moments {
    fn add(&mut self, features: &Planes, gbuffer: &GBuffer) {
        self.sums.resize(features.channels, [0.0; 2]);
        let width = gbuffer.width();
        for i in (0..gbuffer.depth().len()).filter(|&i| gbuffer.is_foreground(i)) {
            self.pixels += 1.0;
            let at = i / width * features.width + i % width;
            for (c, sum) in self.sums.iter_mut().enumerate() {
                let value = f64::from(features.values[c * features.height * features.width + at]);
                *sum = [sum[0] + value, sum[1] + value * value];
            }
        }
    }

    fn sigmas(&self) -> Vec<f64> {
        let n = self.pixels.max(1.0);
        self.sums.iter().map(|[first, second]| (second / n - (first / n).powi(2)).max(0.0).sqrt()).collect()
    }
}

/// A rectangle in the middle of a frame.
#[derive(Debug, Clone, Copy)]
struct Crop {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
}

impl Crop {
    /// The middle, with sides that are multiples of `alignment` and edges on multiples of `grid` (px); where the frame is smaller, the
    /// padded frame.
    fn of(gbuffer: &GBuffer, alignment: usize, grid: usize) -> Self {
        let side = |frame: usize| CROP.min(frame).next_multiple_of(alignment);
        let (width, height) = (side(gbuffer.width()), side(gbuffer.height()));
        let start = |frame: usize, side: usize| frame.saturating_sub(side) / 2 / grid * grid;
        Self { left: start(gbuffer.width(), width), top: start(gbuffer.height(), height), width, height }
    }

    /// Marks its pixels that are in the frame and show geometry.
    fn counted(&self, gbuffer: &GBuffer) -> Vec<bool> {
        let at = |i: usize| (self.left + i % self.width, self.top + i / self.width);
        let inside = |(x, y): (usize, usize)| {
            x < gbuffer.width() && y < gbuffer.height() && gbuffer.is_foreground(y * gbuffer.width() + x)
        };
        (0..self.width * self.height).map(|i| inside(at(i))).collect()
    }
}

/// What a network reads of a crop, and which of its pixels count.
struct Sample {
    inputs: Inputs,
    counted: Vec<bool>,
}

impl Sample {
    fn new(model: &Model, gbuffer: &GBuffer, params: AoParams) -> Result<Self> {
        let patch = model.config().patch;
        let grid = if model.config().survey.is_some() { patch } else { 1 };
        let crop = Crop::of(gbuffer, model.graph().alignment(), grid);
        let whole = network_inputs(model, gbuffer, params)?;
        let cropped = |whole: &Planes, scale: usize| {
            Planes::from_fn((whole.channels, crop.height / scale, crop.width / scale), |c, y, x| {
                whole.at(c, (crop.top / scale + y) as isize, (crop.left / scale + x) as isize)
            })
        };
        let inputs = Inputs {
            features: cropped(&whole.features, 1),
            search: whole.search.as_ref().map(|found| cropped(found, 1)),
            survey: whole.survey.as_ref().map(|found| cropped(found, patch)),
        };
        Ok(Self { inputs, counted: crop.counted(gbuffer) })
    }
}

/// Crops of frames spread over the dataset, as many as the budget allows.
fn samples(model: &Model, manifest: &Manifest, entries: &[&FrameEntry]) -> Result<Vec<Sample>> {
    let evaluations = (model.config().features.channels().len() + 1) * CROP * CROP;
    let affordable = (MAC_BUDGET / (model.graph().macs_per_pixel() * evaluations as f64)) as usize;
    let count = affordable.clamp(*CROPS.start(), *CROPS.end()).min(entries.len());
    let sample = |k: usize| {
        let (gbuffer, params, _) = eval::read(manifest, entries[k * entries.len() / count])?;
        Sample::new(model, &gbuffer, params)
    };
    (0..count).map(sample).collect()
}

fn of_model(model: &Model, sigmas: &[f64], samples: &[Sample]) -> Sensitivity {
    let still: Vec<Planes> = samples.par_iter().map(|s| naive::evaluate(model, &s.inputs)).collect();
    let jobs: Vec<(usize, usize)> =
        (0..sigmas.len()).flat_map(|c| (0..samples.len()).map(move |s| (c, s))).collect();
    let changes: Vec<f64> = {
        let noise = |&(channel, crop): &(usize, usize)| Noise { channel, sigma: sigmas[channel], crop };
        let change = |noise: Noise| change(model, &samples[noise.crop], &still[noise.crop], noise);
        jobs.par_iter().map(|job| change(noise(job))).collect()
    };
    let pixels = samples.iter().flat_map(|s| &s.counted).filter(|c| **c).count();
    let absolute = |c: usize| -> f64 {
        let sum: f64 = changes[c * samples.len()..][..samples.len()].iter().sum();
        let noise = NOISE * sigmas[c];
        if noise > 0.0 { sum / pixels as f64 / noise } else { 0.0 }
    };
    let all: Vec<f64> = (0..sigmas.len()).map(absolute).collect();
    let sum = all.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let channels = channel_names(&model.config().features).into_iter().zip(sigmas).zip(&all);
    let channels = channels
        .map(|((name, &sigma), &absolute)| ChannelSensitivity {
            name: name.to_owned(),
            sigma,
            absolute,
            relative: absolute / sum,
        })
        .collect();
    Sensitivity { channels, crops: samples.len(), pixels }
}

/// Noise on one channel of one crop.
#[derive(Debug, Clone, Copy)]
struct Noise {
    channel: usize,
    /// Standard deviation of the channel.
    sigma: f64,
    /// Number of the crop.
    crop: usize,
}

/// Sum over the counted pixels of the absolute change of the output when a channel is noisy.
fn change(model: &Model, sample: &Sample, still: &Planes, noise: Noise) -> f64 {
    let Noise { channel: c, sigma, crop } = noise;
    let mut random = Random::of_frame(SEED, &format!("channel {c}"), crop as u32);
    let mut inputs = sample.inputs.clone();
    let area = sample.counted.len();
    let plane = &mut inputs.features.values[c * area..][..area];
    for (value, _) in plane.iter_mut().zip(&sample.counted).filter(|(_, counted)| **counted) {
        *value += (NOISE * sigma) as f32 * random.normal();
    }
    // The search that the network corrects is the one that it sees.
    let shown = model.config().features.channels()[c].search_plane();
    if let Some((shown, found)) = shown.zip(inputs.search.as_mut()) {
        let found = &mut found.values[shown * area..][..area];
        // The first plane is a visibility, the channel an occlusion.
        found
            .iter_mut()
            .zip(plane)
            .for_each(|(to, value)| *to = if shown == 0 { 1.0 - *value } else { *value });
    }
    let moved = naive::evaluate(model, &inputs);
    let pairs = moved.values.iter().zip(&still.values).zip(&sample.counted);
    pairs.filter(|(_, counted)| **counted).map(|((a, b), _)| f64::from((a - b).abs())).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::fixtures;
    use aonet::internals::graph::Graph;
    use aonet::internals::weights::Weights;
    use aonet::net::{KernelWeights, ModelConfig, Output, TrainingFacts};

    /// Σ w_i x_i: centre taps only, lifted far above the kink of the activation and lowered again.
    fn linear(weights: [f32; 4]) -> Model {
        let config = ModelConfig {
            features: Features::normal_projected_radius(),
            patch: 1,
            kernel: KernelWeights::Off,
            output: Output::Visibility,
            search: None,
            survey: None,
            encoder: vec![1],
            decoder: vec![],
            ..ModelConfig::correcting()
        };
        let graph = Graph::new(&config).unwrap();
        let mut tensors = Weights::init(&graph, 1).tensors().clone();
        tensors.values_mut().for_each(|t| t.values.fill(0.0));
        for (i, w) in weights.into_iter().enumerate() {
            tensors.get_mut("enc0.conv0.weight").unwrap().values[9 * i + 4] = w;
        }
        tensors.get_mut("enc0.conv0.bias").unwrap().values[0] = 16.0;
        tensors.get_mut("enc0.conv1.weight").unwrap().values[4] = 1.0;
        tensors.get_mut("head.weight").unwrap().values[0] = 1.0;
        tensors.get_mut("head.bias").unwrap().values[0] = -16.0;
        Model::new(config, Weights::new(&graph, tensors).unwrap(), TrainingFacts::default()).unwrap()
    }

    #[test]
    fn a_linear_network_has_the_closed_form() {
        let dir = tempfile::tempdir().unwrap();
        let manifest = fixtures::dataset(dir.path());
        let weights = [0.5, -1.0, 0.25, 0.75];
        let model = linear(weights);
        let other = linear([1.0, 0.0, 0.0, 0.0]);
        let found = sensitivity(&[&model, &other], &manifest, &|_, _| ()).unwrap();
        // E|w xi| / s = |w| sqrt(2 / pi) for xi ~ N(0, s); some thousand pixels give it to about a per cent.
        let mean = (2.0 / std::f64::consts::PI).sqrt();
        assert!(found[0].pixels > 2000, "{found:?}");
        for (channel, w) in found[0].channels.iter().zip(weights) {
            let expected = f64::from(w.abs());
            assert!((channel.absolute / (mean * expected) - 1.0).abs() < 0.04, "{channel:?}");
            assert!((channel.relative - expected / 2.5).abs() < 0.01, "{channel:?}");
            assert!(channel.sigma > 0.0);
        }
        assert!((found[1].channels[0].relative - 1.0).abs() < 1e-9, "{found:?}");
        assert_eq!(sensitivity(&[&model, &other], &manifest, &|_, _| ()).unwrap(), found);
    }

    #[test]
    fn channels_are_called_what_they_are() {
        let names = channel_names(&Features::normal_projected_radius());
        assert_eq!(names, ["normal x", "normal y", "normal z", "projected radius"]);
        assert_eq!(channel_names(&Features::normal_depth())[3], "depth");
        assert_eq!(channel_names(&Features::normal()).len(), 3);
    }

    #[test]
    fn moments_are_of_the_foreground() {
        let gbuffer = fixtures::two_pixels_and_sky();
        let planes = Planes { channels: 1, height: 1, width: 3, values: vec![1.0, 3.0, 100.0] };
        let mut moments = Moments::default();
        moments.add(&planes, &gbuffer);
        assert_eq!(moments.sigmas(), [1.0]);
    }
}
