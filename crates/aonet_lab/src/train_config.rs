//! The configuration of a training run: a JSON file that, with a dataset and a seed, determines the weights.

use crate::exact::Extent;
use aonet::net::{Arch, Axis, Channel, KernelWeights, ModelConfig};
use aonet_scene::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Smallest side of crops for `ms_ssim` (px): it leaves one window of 11 px at the coarsest of five scales.
pub(crate) const LEAST_MS_SSIM_SIDE: usize = 11 << 4;

/// A training run, as in AO-Net §3.4 and §4.1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainConfig {
    /// The network.
    pub model: ModelConfig,
    /// Optimiser steps.
    pub steps: u64,
    /// Crops per step. The paper: 16.
    pub batch: usize,
    /// Side of the square crops (px); a multiple of the network's alignment.
    pub crop: usize,
    /// The optimiser.
    #[serde(default)]
    pub optimizer: Optimizer,
    /// Learning rate at the first step; decays to zero along a half cosine. The paper: 1e-3.
    pub learning_rate: f64,
    /// Steps over which the learning rate rises from zero, linearly, before it follows the cosine.
    #[serde(default)]
    pub warm_up: u64,
    /// Share of the past in a running mean of the weights, in [0, 1): the mean is what is scored and saved. 0: the
    /// weights themselves.
    #[serde(default)]
    pub average: f64,
    /// Weights of the loss terms.
    pub loss: LossConfig,
    /// Random symmetries of the crops.
    pub augment: Augment,
    /// Whether weights are tied so that a mirrored frame gives the mirrored image (Cohen and Welling 2016). For networks of the family `ao_net`
    /// without kernels, with even numbers of channels.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub symmetric: bool,
    /// Seed of the weights and of every crop.
    pub seed: u64,
    /// Steps between validations.
    pub validate_every: u64,
    /// Most validation frames, evenly spread over the split.
    pub validation_frames: usize,
    /// Steps between checkpoints.
    pub checkpoint_every: u64,
    /// Exact shares of light in place of what the network's survey finds, to learn what a better survey would be worth. Their extent
    /// must be what [`Augment`] leaves of every frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact_survey: Option<ExactSurvey>,
}

/// The optimiser.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Optimizer {
    /// Kingma and Ba 2015, with their constants. The paper's choice.
    #[default]
    Adam,
    /// Zeiler 2012 with decay 0.9, as Deep Shading was trained. It finds its own step sizes: the learning rate is a
    /// factor on them, 1 in the original.
    AdaDelta,
}

/// Eq. 5: `perceptual` is lambda_1, `dssim` is lambda_2. `l1` and `psnr` are ours: SSIM and VGG are weak on absolute brightness.
/// `ms_ssim` and `ssim_window` are for other authors' networks. By default every term is off.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LossConfig {
    /// Weight of 0.5 (1 - SSIM), Eq. 3. The paper: 0.94. Deep Shading: 2, without other terms.
    pub dssim: f64,
    /// Weight of the VGG-19 distance, Eq. 4; needs a weights file at run time. The paper: 0.06.
    pub perceptual: f64,
    /// VGG-19 activations compared, such as `relu2_2`.
    pub vgg_layers: Vec<String>,
    /// Weight of the mean absolute error. DeepAO: 0.24.
    pub l1: f64,
    /// Weight of 1 - MS-SSIM, Wang et al. 2003, with Gaussian windows; for crops of at least 176 px. DeepAO: 0.84.
    #[serde(default)]
    pub ms_ssim: f64,
    /// Weight of log10(1 + MSE / 1e-4) of a crop: PSNR as a loss, which asks for the mean where a pixel's visibility is
    /// uncertain; `l1` asks for the median. Beyond 40 dB it gains little.
    #[serde(default)]
    pub psnr: f64,
    /// The window of `dssim`.
    #[serde(default)]
    pub ssim_window: SsimWindow,
}

/// Window of SSIM.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SsimWindow {
    /// 11x11, Gaussian with a spread of 1.5; C1 is 1e-4, C2 is 9e-4. Wang et al. 2004.
    #[default]
    Gaussian11,
    /// 8x8, equal weights; C1 is 1e-4, C2 is 1e-3. Deep Shading.
    Flat8,
}

/// Random changes of frames and crops that leave the reference valid; normals are turned with the image.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Augment {
    /// Mirror every other crop left to right.
    pub mirror: bool,
    /// Share of the crops that are rotated by 90, 180 or 270 degrees, in [0, 1].
    pub roll: f64,
    /// Draw more crops at the borders of frames, so that the pixels there are in as many crops as others. Otherwise every place of a crop is
    /// equally likely.
    #[serde(default)]
    pub borders: bool,
    /// Share of the frames, validation frames included, that lose their guard band, in [0, 1].
    #[serde(default)]
    pub without_margin: f64,
    /// Share of the frames, validation frames included, that lose their second layer, in [0, 1].
    #[serde(default)]
    pub without_second: f64,
}

/// Exact shares of light of the frames of a dataset, validation frames included.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExactSurvey {
    /// Folder that [`save_all`](crate::exact::save_all) has written.
    pub folder: PathBuf,
    /// What the frames show.
    pub extent: Extent,
}

impl TrainConfig {
    /// The paper's settings for a network: Eq. 5, batch 16, crops of 256.
    pub fn paper(model: ModelConfig) -> Self {
        Self {
            model,
            steps: 40_000,
            batch: 16,
            crop: 256,
            optimizer: Optimizer::Adam,
            learning_rate: 1e-3,
            warm_up: 0,
            average: 0.0,
            loss: LossConfig {
                dssim: 0.94,
                perceptual: 0.06,
                vgg_layers: vec!["relu2_2".into()],
                ..LossConfig::default()
            },
            augment: Augment { mirror: true, roll: 0.25, ..Augment::default() },
            symmetric: false,
            seed: 1,
            validate_every: 500,
            validation_frames: 48,
            checkpoint_every: 250,
            exact_survey: None,
        }
    }

    /// Reads a configuration from a JSON file.
    ///
    /// # Errors
    /// When the file cannot be read or [`TrainConfig::from_bytes`] refuses it.
    pub fn load(path: &Path) -> Result<Self> {
        Self::from_bytes(&std::fs::read(path).map_err(Error::io(path))?, path)
    }

    /// Reads a configuration from the contents of a file; `path` is for messages.
    ///
    /// # Errors
    /// When a field is missing, unknown or out of range.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        let config: Self =
            serde_json::from_slice(bytes).map_err(|e| Error::file(path, "a training configuration", e))?;
        config.checked()
    }

    /// Returns the configuration after a check of every field.
    ///
    /// # Errors
    /// Names the field, its valid values and its value.
    pub fn checked(self) -> Result<Self> {
        let graph = aonet::internals::graph::Graph::new(&self.model)?;
        let at_least_one = |name: &str, value: u64| match value {
            0 => Err(Error::request(format!("training {name}"), "at least 1", 0)),
            _ => Ok(()),
        };
        at_least_one("steps", self.steps)?;
        at_least_one("batch", self.batch as u64)?;
        at_least_one("validate_every", self.validate_every)?;
        at_least_one("checkpoint_every", self.checkpoint_every)?;
        if self.crop < 32 || !self.crop.is_multiple_of(graph.alignment()) {
            let expected = format!("a multiple of {} that is at least 32", graph.alignment());
            return Err(Error::request("training crop", expected, self.crop));
        }
        if !(self.learning_rate > 0.0 && self.learning_rate.is_finite()) {
            return Err(Error::request("training learning_rate", "finite > 0", self.learning_rate));
        }
        if !(0.0..1.0).contains(&self.average) {
            return Err(Error::request("training average", "in [0, 1)", self.average));
        }
        let Augment { mirror: _, borders: _, roll, without_margin, without_second } = self.augment;
        let shares = [("roll", roll), ("without_margin", without_margin), ("without_second", without_second)];
        if let Some((name, share)) = shares.into_iter().find(|(_, share)| !(0.0..=1.0).contains(share)) {
            return Err(Error::request(format!("training {name}"), "in [0, 1]", share));
        }
        self.loss.check(self.crop)?;
        if self.symmetric {
            check_symmetric(&self.model)?;
        }
        if let Some(exact) = &self.exact_survey {
            let left = match exact.extent {
                Extent::OneLayer => 1.0,
                Extent::Whole => 0.0,
            };
            if self.model.survey.is_none() {
                return Err(Error::request("training exact_survey", "a network with a survey", "none"));
            }
            if [without_margin, without_second] != [left; 2] {
                let expected = format!("without_margin and without_second {left}");
                let found = format!("{without_margin} and {without_second}");
                return Err(Error::request("training exact_survey", expected, found));
            }
        }
        Ok(self)
    }
}

/// Checks that a network can be symmetric: halves of channels, and an image that the head writes.
fn check_symmetric(model: &ModelConfig) -> Result<()> {
    let refuse = |expected: &str, found: String| Err(Error::request("training symmetric", expected, found));
    if model.arch != Arch::AoNet || model.kernel != KernelWeights::Off {
        return refuse("an ao_net without kernels", format!("{:?}, {:?} kernels", model.arch, model.kernel));
    }
    if model.features.sees(Channel::NormalEncoded(Axis::X)) {
        return refuse("normals, whose sign can change", "encoded normals".to_owned());
    }
    let mut widths = model.embedding.iter().chain(&model.encoder).chain(&model.decoder);
    match widths.find(|channels| *channels % 2 == 1) {
        Some(odd) => refuse("even numbers of channels", odd.to_string()),
        None => Ok(()),
    }
}

impl LossConfig {
    /// Weights of the terms that need no file.
    pub(crate) fn plain_weights(&self) -> f64 {
        self.dssim + self.l1 + self.ms_ssim + self.psnr
    }

    fn check(&self, crop: usize) -> Result<()> {
        let weights = [self.dssim, self.perceptual, self.l1, self.ms_ssim, self.psnr];
        if weights.iter().any(|w| !(w.is_finite() && *w >= 0.0)) {
            return Err(Error::request("training loss", "finite weights >= 0", format!("{weights:?}")));
        }
        if self.plain_weights() + self.perceptual == 0.0 {
            return Err(Error::request("training loss", "at least one weight above zero", "none"));
        }
        if self.ms_ssim > 0.0 && crop < LEAST_MS_SSIM_SIDE {
            let expected = format!("at least {LEAST_MS_SSIM_SIDE}: MS-SSIM looks at five scales");
            return Err(Error::request("training crop", expected, crop));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms_ssim(weight: f64, crop: usize) -> TrainConfig {
        let paper = TrainConfig::paper(ModelConfig::paper());
        TrainConfig { crop, loss: LossConfig { ms_ssim: weight, ..paper.loss.clone() }, ..paper }
    }

    fn json_files(dir: &Path) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path());
        let files = |path: PathBuf| if path.is_dir() { json_files(&path) } else { vec![path] };
        entries.flat_map(files).filter(|file| file.extension().is_some_and(|e| e == "json")).collect()
    }

    #[test]
    fn the_untrained_networks_of_the_project_are_good() {
        for file in json_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/models")) {
            let config: ModelConfig = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
            config.checked().unwrap();
        }
    }

    #[test]
    fn the_configurations_of_the_project_are_good() {
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs");
        let rows = dir.join("rows");
        let models = dir.join("models");
        let files: Vec<PathBuf> = json_files(&dir).into_iter().filter(|f| !f.starts_with(&models)).collect();
        assert!(files.iter().any(|f| f.parent() == Some(&rows)), "subfolders are looked into");
        let mut budgets = Vec::new();
        for file in &files {
            let config = TrainConfig::load(file).unwrap();
            if file.parent() == Some(&rows) {
                let budget = (config.steps, config.batch, config.crop, config.seed, config.validation_frames);
                budgets.push((budget, config.augment, file));
            }
        }
        for (budget, augment, file) in &budgets {
            assert!(
                (budget, augment) == (&budgets[0].0, &budgets[0].1),
                "{}: another budget",
                file.display()
            );
        }
    }

    #[test]
    fn fields_out_of_range_are_refused_by_name() {
        let loss = |loss| TrainConfig { loss, ..ms_ssim(0.0, 256) };
        let augment = |augment| TrainConfig { augment, ..ms_ssim(0.0, 256) };
        let odd_embedding = ModelConfig { embedding: Some(9), ..ModelConfig::correcting() };
        let cases = [
            (TrainConfig { learning_rate: 0.0, ..ms_ssim(0.0, 256) }, "learning_rate"),
            (TrainConfig { learning_rate: f64::NAN, ..ms_ssim(0.0, 256) }, "learning_rate"),
            (TrainConfig { average: 1.0, ..ms_ssim(0.0, 256) }, "average"),
            (augment(Augment { roll: 1.5, ..Augment::default() }), "roll"),
            (augment(Augment { without_margin: -0.5, ..Augment::default() }), "without_margin"),
            (augment(Augment { without_second: f64::NAN, ..Augment::default() }), "without_second"),
            (TrainConfig { batch: 0, ..ms_ssim(0.0, 256) }, "batch"),
            (TrainConfig { symmetric: true, ..ms_ssim(0.0, 256) }, "training symmetric"),
            (TrainConfig { symmetric: true, model: odd_embedding, ..ms_ssim(0.0, 256) }, "even numbers"),
            (ms_ssim(0.0, 100), "crop"),
            (ms_ssim(0.84, 160), "at least 176"),
            (ms_ssim(-0.84, 256), "weights >= 0"),
            (loss(LossConfig::default()), "above zero"),
        ];
        for (config, named) in cases {
            let error = config.checked().unwrap_err().to_string();
            assert!(error.contains(named), "{error} should name {named}");
        }
        ms_ssim(0.84, 192).checked().unwrap();
        ms_ssim(0.0, 160).checked().unwrap();
        loss(LossConfig { ms_ssim: 1.0, ..LossConfig::default() }).checked().unwrap();
    }
}
